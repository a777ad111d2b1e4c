"""``ros2 run``: become an executable of a package."""

from __future__ import annotations

import argparse
import os
import shlex
from typing import Any, NoReturn

from maglev_ros2cli import packages
from maglev_ros2cli.parser import CommandError, Parser, complete


def add(parser: Parser) -> None:
    parser.add_argument(
        '--prefix', help="Prefix command, in quotes if it has spaces (--prefix 'gdb -ex run')"
    )
    package = parser.add_argument('package_name', help='Name of the ROS package')
    complete(package, lambda _: packages.names())
    executable = parser.add_argument('executable_name', help='Name of the executable')
    complete(executable, lambda given: [p.name for p in packages.executables(given.package_name)])
    parser.add_argument(
        'argv', nargs=argparse.REMAINDER, help='Pass arbitrary arguments to the executable'
    )
    parser.set_defaults(run=run)


def run(arguments: Any) -> NoReturn:
    """Be replaced by the executable, whose signals and exit code are its own."""
    paths = [
        path
        for path in packages.executables(arguments.package_name)
        if path.name == arguments.executable_name
    ]
    if not paths:
        raise CommandError('No executable found')
    if len(paths) > 1:
        raise CommandError('\n- '.join(['Multiple executables found:', *map(str, paths)]))
    command = [*shlex.split(arguments.prefix or ''), str(paths[0]), *arguments.argv]
    try:
        os.execvp(command[0], command)
    except OSError as error:
        raise CommandError(f"cannot run '{command[0]}': {error.strerror}") from error
