"""``ros2 interface``: definitions of messages and services."""

from __future__ import annotations

import sys
from typing import Any

from maglev_ros2cli.interfaces import KINDS, names, shown
from maglev_ros2cli.parser import CommandError, Parser, Verbs, complete


def add(parser: Parser) -> None:
    verbs = Verbs(parser)
    verb = verbs.add('list', list_, 'List all interface types available')
    for kind, title in KINDS.items():
        verb.add_argument(
            f'-{kind[0]}',
            f'--only-{"actions" if kind == "action" else kind + "s"}',
            dest='kinds',
            action='append_const',
            const=kind,
            help=f'Print out only the {title.lower()}',
        )
    verb = verbs.add('show', show, 'Output the interface definition')
    comments = verb.add_mutually_exclusive_group()
    comments.add_argument(
        '--all-comments', action='store_true', help='Show all comments, also of nested types'
    )
    comments.add_argument(
        '--no-comments', action='store_true', help='Show no comments or whitespace'
    )
    name = verb.add_argument('type', help="The interface, std_msgs/msg/String; '-' reads its name")
    complete(name, lambda _: [each for kind in KINDS for each in names(kind)])


def list_(arguments: Any) -> None:
    for kind, title in KINDS.items():
        if not arguments.kinds or kind in arguments.kinds:
            print(f'{title}:')
            for name in names(kind):
                print(f'    {name}')


def show(arguments: Any) -> None:
    name = sys.stdin.readline().strip() if arguments.type == '-' else arguments.type
    if not name:
        raise CommandError('the passed value is empty')
    lines = shown(name, comments=not arguments.no_comments, nested_comments=arguments.all_comments)
    for line in list(lines):
        print(line)
