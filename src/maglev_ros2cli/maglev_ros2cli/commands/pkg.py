"""``ros2 pkg``: packages and their executables."""

from __future__ import annotations

from typing import Any

from ament_index_python.packages import PackageNotFoundError, get_package_prefix

from maglev_ros2cli import packages
from maglev_ros2cli.parser import CommandError, Parser, Verbs, complete


def add(parser: Parser) -> None:
    verbs = Verbs(parser)
    verb = verbs.add('executables', executables, 'Output a list of package specific executables')
    name = verb.add_argument('package_name', nargs='?', help='The package name')
    complete(name, lambda _: packages.names())
    verb.flag('--full-path', help='Show the full path of each executable')
    verbs.add('list', list_, 'Output a list of available packages')
    verb = verbs.add('prefix', prefix, 'Output the prefix path of a package')
    complete(verb.add_argument('package_name', help='The package name'), lambda _: packages.names())
    verb.flag('--share', help='Show share directory for the package instead')


def executables(arguments: Any) -> None:
    for package in [arguments.package_name] if arguments.package_name else packages.names():
        for path in packages.executables(package):
            print(path if arguments.full_path else f'{package} {path.name}')


def list_(_arguments: Any) -> None:
    for name in packages.names():
        print(name)


def prefix(arguments: Any) -> None:
    try:
        path = get_package_prefix(arguments.package_name)
    except (PackageNotFoundError, ValueError):
        raise CommandError('Package not found') from None
    print(f'{path}/share/{arguments.package_name}' if arguments.share else path)
