"""``ros2 topic``: the topics on the graph; what goes over them is in modules of its own."""

from __future__ import annotations

from typing import Any

from maglev_ros2cli.commands import topic_echo, topic_hz, topic_pub
from maglev_ros2cli.graph import absolute, add_arguments, add_topic_name, graph, print_type, topics
from maglev_ros2cli.parser import CommandError, Parser, Verbs


def add(parser: Parser) -> None:
    verbs = Verbs(parser)
    topic_echo.add(verbs)
    topic_hz.add(verbs)
    verb = verbs.add('info', info, 'Print information about a topic')
    add_arguments(verb)
    add_topic_name(verb, "Name of the ROS topic to get info (e.g. '/chatter')")
    verb.flag('-v', '--verbose', help='Also node names, QoS and types of endpoints')
    verb = verbs.add('list', list_, 'Output a list of available topics')
    add_arguments(verb)
    verb.flag('-t', '--show-types', help='Also show the topic type')
    verb.flag('-c', '--count-topics', help='Only display the number of topics')
    verb.flag('-a', '--include-hidden-topics', help='Also hidden topics')
    verb.flag('-v', '--verbose', help='List details of each topic')
    topic_pub.add(verbs)
    verb = verbs.add('type', type_, "Print a topic's type")
    add_arguments(verb)
    add_topic_name(verb, "Name of the ROS topic to get type (e.g. '/chatter')")


def list_(arguments: Any) -> None:
    with graph(arguments) as own:
        found = topics(own, hidden=arguments.include_hidden_topics)
        if arguments.count_topics:
            print(len(found))
        elif arguments.verbose:
            published = {name: own.count_publishers(name) for name in found}
            subscribed = {name: own.count_subscribers(name) for name in found}
            _print_counts('Published', 'publisher', found, published)
            _print_counts('Subscribed', 'subscriber', found, subscribed)
        else:
            for name, types in found.items():
                print(f'{name} [{", ".join(types)}]' if arguments.show_types else name)


def _print_counts(
    title: str, who: str, found: dict[str, list[str]], counts: dict[str, int]
) -> None:
    print(f'{title} topics:')
    for name, types in found.items():
        if counts[name]:
            plural = 's' if counts[name] > 1 else ''
            print(f' * {name} [{", ".join(types)}] {counts[name]} {who}{plural}')
    print()


def info(arguments: Any) -> None:
    name = absolute(arguments.topic_name)
    with graph(arguments) as own:
        types = topics(own).get(name)
        if types is None:
            raise CommandError(f"Unknown topic '{arguments.topic_name}'")
        end = '\n\n' if arguments.verbose else '\n'
        print('Type:', types[0] if len(types) == 1 else types, end=end)
        print('Publisher count:', own.count_publishers(name), end=end)
        if arguments.verbose:
            for each in own.get_publishers_info_by_topic(name):
                print(each, end=end)
        print('Subscription count:', own.count_subscribers(name), end=end)
        if arguments.verbose:
            for each in own.get_subscriptions_info_by_topic(name):
                print(each, end=end)


def type_(arguments: Any) -> int:
    return print_type(arguments, arguments.topic_name, topics)
