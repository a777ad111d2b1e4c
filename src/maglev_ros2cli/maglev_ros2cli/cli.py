"""``ros2``: from the command line to the exit code."""

from __future__ import annotations

import contextlib
import importlib
import os
import shlex
import signal
import sys
from collections.abc import Sequence
from typing import NoReturn

import argcomplete

from maglev_model.programs.command import open_streams, unwritten
from maglev_ros2cli.parser import SUBSET, CommandError, Parser

COMMANDS = {
    'bag': 'Various rosbag related sub-commands',
    'interface': 'Show information about ROS interfaces',
    'lifecycle': 'Various lifecycle related sub-commands',
    'node': 'Various node related sub-commands',
    'param': 'Various param related sub-commands',
    'pkg': 'Various package related sub-commands',
    'run': 'Run a package specific executable',
    'service': 'Various service related sub-commands',
    'topic': 'Various topic related sub-commands',
}
"""The commands, each a module of :mod:`maglev_ros2cli.commands`."""

INTERRUPTED = int(signal.SIGINT)
"""Exit code after a Ctrl-C, which is ros2cli's."""

_BROKEN_PIPE = 128 + signal.SIGPIPE
_TERMINATED = 128 + signal.SIGTERM


def parser(words: Sequence[str]) -> Parser:
    """The parser for a command line; of commands that are not in it, no module is imported."""
    top = Parser(prog='ros2', description=f'ros2 is a command-line tool for ROS 2. {SUBSET}')
    top.set_defaults(run=lambda _: top.print_help())
    commands = top.add_subparsers(
        title='Commands',
        metavar='Call `ros2 <command> -h` for more detailed usage.',
        dest='command',
        parser_class=Parser,
    )
    for name, text in COMMANDS.items():
        command: Parser = commands.add_parser(
            name, help=text, description=text, prog=f'ros2 {name}'
        )
        if name in words:
            importlib.import_module(f'maglev_ros2cli.commands.{name}').add(command)
    return top


def run(words: Sequence[str]) -> int:
    """Carry out a command line and return the exit code; wrong use raises SystemExit."""
    try:
        arguments = parser(words).parse_args(words)
        code = arguments.run(arguments)
        sys.stdout.flush()
    except CommandError as error:
        print(error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        return _BROKEN_PIPE
    except OSError as error:
        if not (said := unwritten(error)):
            raise
        print(said, file=sys.stderr)
        return 1
    return code or 0


def main() -> NoReturn:
    """Entry point of the executable.

    Leaves without the interpreter's own teardown, which may block in the middleware.
    """
    if '_ARGCOMPLETE' in os.environ:
        argcomplete.autocomplete(parser(_words_to_complete()), exclude=['-h', '--help'])
    told_to_end: list[int] = []

    def terminate(*_: object) -> NoReturn:
        told_to_end.append(_TERMINATED)
        sys.exit(_TERMINATED)

    signal.signal(signal.SIGTERM, terminate)
    open_streams()
    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]
    try:
        code: object = run(sys.argv[1:])
    except SystemExit as error:
        code = error.code
    except Exception:
        code = _TERMINATED  # what the middleware makes of an exit in the midst of it
        if not told_to_end:
            sys.excepthook(*sys.exc_info())
            code = 70
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError):
            stream.flush()
    os._exit(code if isinstance(code, int) else 0)


def _words_to_complete() -> list[str]:
    line = os.environ.get('COMP_LINE', '')
    try:
        return shlex.split(line)[1:]
    except ValueError:  # in the middle of a quoted word
        return line.split()[1:]
