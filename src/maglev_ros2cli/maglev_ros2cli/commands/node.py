"""``ros2 node``: the nodes on the graph."""

from __future__ import annotations

import sys
from typing import Any

from rclpy.action import (
    get_action_client_names_and_types_by_node,
    get_action_server_names_and_types_by_node,
)
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden

from maglev_node.polling import PollingNode
from maglev_ros2cli.graph import absolute, add_arguments, add_node_name, graph, nodes, print_all
from maglev_ros2cli.parser import CommandError, Parser, Verbs


def add(parser: Parser) -> None:
    verbs = Verbs(parser)
    verb = verbs.add('info', info, 'Output information about a node')
    add_arguments(verb)
    add_node_name(verb)
    verb.flag('--include-hidden', help='Display hidden topics and services as well')
    verb = verbs.add('list', list_, 'Output a list of available nodes')
    add_arguments(verb)
    verb.flag('-a', '--all', help='Display all nodes, also hidden')
    verb.flag('-c', '--count-nodes', help='Only display the number of nodes')


def list_(arguments: Any) -> None:
    with graph(arguments) as own:
        names = [each.full for each in nodes(own, hidden=arguments.all)]
    if not arguments.count_nodes and len(names) > len(set(names)):
        print(
            'WARNING: Be aware that there are nodes in the graph that share an exact name, which'
            ' can have unintended side effects.',
            file=sys.stderr,
        )
    print_all(names, count=arguments.count_nodes)


def info(arguments: Any) -> None:
    full = absolute(arguments.node_name)
    with graph(arguments) as own:
        same = [each for each in nodes(own, hidden=True) if each.full == full]
        if not same:
            raise CommandError(f"Unable to find node '{arguments.node_name}'")
        if len(same) > 1:
            print(
                f"There are {len(same)} nodes in the graph with the exact name '{full}'."
                ' You are seeing information about only one of them.',
                file=sys.stderr,
            )
        print(full)
        for title, found in _parts(own, *same[0]).items():
            print(f'  {title}:')
            lines = [
                f'    {name}: {", ".join(types)}'
                for name, types in sorted(found)
                if arguments.include_hidden or not topic_or_service_is_hidden(name)
            ]
            print('\n'.join(lines))


def _parts(own: PollingNode, name: str, namespace: str) -> dict[str, list[tuple[str, list[str]]]]:
    return {
        'Subscribers': own.get_subscriber_names_and_types_by_node(name, namespace),
        'Publishers': own.get_publisher_names_and_types_by_node(name, namespace),
        'Service Servers': own.get_service_names_and_types_by_node(name, namespace),
        'Service Clients': own.get_client_names_and_types_by_node(name, namespace),
        'Action Servers': get_action_server_names_and_types_by_node(own, name, namespace),
        'Action Clients': get_action_client_names_and_types_by_node(own, name, namespace),
    }
