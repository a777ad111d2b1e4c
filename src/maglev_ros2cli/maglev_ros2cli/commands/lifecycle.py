"""``ros2 lifecycle``: the states of managed nodes."""

from __future__ import annotations

import sys
from typing import Any

from lifecycle_msgs.msg import TransitionDescription
from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState

from maglev_node.polling import PollingNode
from maglev_ros2cli.graph import (
    add_arguments,
    add_node_verb,
    answer,
    ask,
    client,
    graph,
    graph_with,
    nodes,
    print_all,
    services,
)
from maglev_ros2cli.parser import CommandError, Parser, Verbs, complete

_GET_STATE = 'lifecycle_msgs/srv/GetState'


def add(parser: Parser) -> None:
    verbs = Verbs(parser)
    add_node_verb(verbs, 'get', get, 'Get lifecycle state for one or more nodes', nargs='?')
    add_node_verb(verbs, 'list', list_, 'Output a list of available transitions')
    verb = verbs.add('nodes', nodes_, 'Output a list of nodes with lifecycle')
    add_arguments(verb)
    verb.flag('-a', '--all', help='Display all nodes, also hidden')
    verb.flag('-c', '--count-nodes', help='Only display the number of nodes')
    verb = add_node_verb(verbs, 'set', set_, 'Trigger lifecycle state transition')
    transition = verb.add_argument('transition', help='The lifecycle transition')

    def known(given: Any) -> list[str]:
        with graph_with(given) as (own, full):
            return [each.transition.label for each in _transitions(own, full)]

    complete(transition, known)


def nodes_(arguments: Any) -> None:
    with graph(arguments) as own:
        names = _managed(own, hidden=arguments.all)
    print_all(names, count=arguments.count_nodes)


def get(arguments: Any) -> None:
    if arguments.node_name:
        with graph_with(arguments) as (own, full):
            print(_state(own, full))
        return
    with graph(arguments) as own:
        for full in _managed(own, hidden=arguments.include_hidden_nodes):
            print(f'{full}: {_state(own, full)}')


def _state(own: PollingNode, full: str) -> str:
    state = ask(own, GetState, f'{full}/get_state', GetState.Request()).current_state
    return f'{state.label} [{state.id}]'


def list_(arguments: Any) -> None:
    """The transitions a node has from its state."""
    with graph_with(arguments) as (own, full):
        for each in _transitions(own, full):
            print(f'- {each.transition.label} [{each.transition.id}]')
            print(f'\tStart: {each.start_state.label}')
            print(f'\tGoal: {each.goal_state.label}')


def set_(arguments: Any) -> None:
    """A transition by its label or number; one that fails is said on stderr, with exit code 0."""
    with graph_with(arguments) as (own, full):
        known = [each.transition for each in _transitions(own, full)]
        wanted = [each for each in known if arguments.transition in (each.label, str(each.id))]
        if not wanted:
            listed = [f'\n- {each.label} [{each.id}]' for each in known]
            text = 'Unknown transition requested, available ones are:'
            raise CommandError(text + ''.join(listed))
        request = ChangeState.Request(transition=wanted[0])
        done = answer(own, client(own, ChangeState, f'{full}/change_state'), request).success
    if done:
        print('Transitioning successful')
    else:
        print('Transitioning failed', file=sys.stderr)


def _managed(own: PollingNode, *, hidden: bool) -> list[str]:
    there = services(own)
    found = dict.fromkeys(each.full for each in nodes(own, hidden=hidden))
    return [full for full in found if _GET_STATE in there.get(f'{full}/get_state', ())]


def _transitions(own: PollingNode, full: str) -> list[TransitionDescription]:
    service = f'{full}/get_available_transitions'
    request = GetAvailableTransitions.Request()
    return list(ask(own, GetAvailableTransitions, service, request).available_transitions)
