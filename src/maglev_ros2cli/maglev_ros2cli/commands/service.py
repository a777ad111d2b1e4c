"""``ros2 service``: the services on the graph, and calls of them."""

from __future__ import annotations

import sys
import time
from typing import Any

from maglev_model.programs.arguments import positive
from maglev_ros2cli.graph import (
    absolute,
    add_arguments,
    add_service_name,
    answer,
    graph,
    node,
    print_all,
    print_type,
    services,
    wait_until,
)
from maglev_ros2cli.interfaces import names
from maglev_ros2cli.messages import fill, find_type, values_of
from maglev_ros2cli.parser import Parser, Verbs, complete

_FIRST_LOOK = 0.1
"""How long a service may take to be seen without a word about it [s]."""


def add(parser: Parser) -> None:
    verbs = Verbs(parser)
    verb = verbs.add('call', call, 'Call a service')
    add_service_name(verb, "Name of the ROS service to call to (e.g. '/add_two_ints')")
    kind = verb.add_argument('service_type', help="Type of the service ('std_srvs/srv/Empty')")
    complete(kind, lambda _: names('srv'))
    verb.add_argument(
        'values', nargs='?', default='{}', help="The request's values in YAML: '{a: 1, b: 2}'"
    )
    verb.flag('--stdin', help='Read values from standard input')
    verb.add_argument('-r', '--rate', type=positive, metavar='N', help='Repeat the call at N Hz')
    verb = verbs.add('list', list_, 'Output a list of available services')
    add_arguments(verb)
    verb.flag('-t', '--show-types', help='Also show the types')
    verb.flag('-c', '--count-services', help='Only display the number of services')
    verb.flag('-a', '--include-hidden-services', help='Also hidden services')
    verb = verbs.add('type', type_, "Output a service's type")
    add_arguments(verb)
    add_service_name(verb, 'Name of the ROS service to get type (e.g. "/talker/list_parameters")')


def list_(arguments: Any) -> None:
    with graph(arguments) as own:
        found = services(own, hidden=arguments.include_hidden_services)
    shown = [
        f'{name} [{", ".join(types)}]' if arguments.show_types else name
        for name, types in found.items()
    ]
    print_all(shown, count=arguments.count_services)


def type_(arguments: Any) -> int:
    return print_type(arguments, arguments.service_name, services)


def call(arguments: Any) -> None:
    """Wait for a service, call it once or at a rate, and print each response."""
    name, kind = absolute(arguments.service_name), find_type(arguments.service_type, 'srv')
    request = kind.Request()
    stampers = fill(request, values_of(sys.stdin.read() if arguments.stdin else arguments.values))
    with node() as own:
        client = own.create_client(kind, name)
        if not wait_until(client.service_is_ready, _FIRST_LOOK):
            print('waiting for service to become available...')
            wait_until(client.service_is_ready)
        while True:
            start = time.monotonic()
            for stamp in stampers:
                stamp(own.get_clock().now().to_msg())
            print(f'requester: making request: {request!r}\n')
            print(f'response:\n{answer(own, client, request)!r}\n')
            if arguments.rate is None:
                return
            time.sleep(max(0.0, start + 1.0 / arguments.rate - time.monotonic()))
