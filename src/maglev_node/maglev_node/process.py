"""A process that runs a node, or several: from its signals to its exit code."""

from __future__ import annotations

import faulthandler
import gc
import os
import pkgutil
import signal
import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, NoReturn

import rclpy
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from maglev_model.compiled import ahead
from maglev_model.parameters import ParameterError
from maglev_model.programs.command import leave_with
from maglev_node.dds import prepare_middleware
from maglev_node.discovery import discovering
from maglev_node.leaving import deliver, stop_receiving
from maglev_node.node import MaglevNode, NodeError, spin
from maglev_node.usage import usage

_LEAVING_TIME = 5.0
"""Longest for a node that has closed to leave the graph [s]."""

_BACKGROUND_NICENESS = 5


def run(name: str, caught: Sequence[int], *make_nodes: Callable[[], MaglevNode[Any]]) -> int:
    """Run the nodes of a process to their end and return its exit code.

    SIGINT, SIGTERM and SIGHUP, once they are in ``caught``, end it in order, which is exit code 0
    unless the node says otherwise: :meth:`MaglevNode.close` runs and can still publish. After a
    second signal :meth:`MaglevNode.may_stop` is not asked again until it agrees; what it does
    before it answers, such as a landing, no signal cuts short. SIGXCPU, from the kernel to what
    never waits at real-time priority, ends it so too, with exit code 1.
    What the user did wrong is one line on stderr; a defect shows its traceback.
    """
    nodes: list[MaglevNode[Any]] = []
    prepare_middleware()
    try:
        rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
        _refuse_misplaced()
        with discovering(name):
            for make in make_nodes:
                nodes.append(make())
        gc.collect()
        gc.freeze()
        _spin(nodes, caught)
    except (NodeError, ParameterError) as error:
        return _complain(name, str(error))
    except Exception as error:
        if not _is_user_error(error):
            raise
        return _complain(name, str(error).split(', at /')[0].splitlines()[0])
    finally:
        _close(nodes)
    if signal.SIGXCPU in caught:
        text = 'no wait for seconds on end: this machine is too slow or too busy for real time'
        return _complain(name, text)
    return max(node.exit_code or 0 for node in nodes)


def _complain(name: str, text: str) -> int:
    """Say why a process ends, where that can be written; its exit code."""
    with suppress(OSError):
        print(f'{name}: error: {text}', file=sys.stderr, flush=True)
    return 1


def _spin(nodes: Sequence[MaglevNode[Any]], caught: Sequence[int]) -> None:
    def stop() -> bool:
        return bool(caught) and (all(node.may_stop() for node in nodes) or len(caught) > 1)

    for node in nodes:
        node.ending = lambda: bool(caught)
        node.in_process = {each.get_name() for each in nodes}
    if len(nodes) == 1:
        nodes[0].spin(stop)
    else:
        spin(nodes, stop)


def main(
    name: str,
    caught: Sequence[int],
    *nodes: str | type[MaglevNode[Any]],
    background: bool = False,
) -> NoReturn:
    """Run the nodes of an executable and leave; see :func:`maglev_node.executable.run_nodes`.

    What is compiled it has ready, where set-up made it. Leaves without the interpreter's own
    teardown, which may block in the middleware.
    """
    if background:
        os.nice(_BACKGROUND_NICENESS)
    ahead.use()
    try:
        code = run(name, caught, *(partial(_make, node) for node in nodes))
    except Exception:
        sys.excepthook(*sys.exc_info())
        code = 70
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):  # a full disk
            stream.flush()
    os._exit(code)


def _refuse_misplaced() -> None:
    """Raise NodeError for arguments that no node would see, such as parameters not ROS's."""
    for argument in remove_ros_args(sys.argv)[1:]:
        raise NodeError(
            f"'{argument}' is no argument: -p, -r and --params-file come after --ros-args"
        )


def say_help(name: str, *nodes: str | type[MaglevNode[Any]]) -> NoReturn:
    """Say what the nodes of an executable are and leave."""
    leave_with(lambda: _help(name, [_load(node) for node in nodes]))


def _load(node: str | type[MaglevNode[Any]]) -> Any:
    return pkgutil.resolve_name(node) if isinstance(node, str) else node


def _make(node: str | type[MaglevNode[Any]]) -> MaglevNode[Any]:
    made: MaglevNode[Any] = _load(node)()
    return made


def _help(name: str, nodes: Iterable[type[MaglevNode[Any]]]) -> int:
    texts = [usage(node, name) for node in nodes]
    if len(texts) > 1:
        texts.insert(0, 'several nodes in one process; -p NODE:NAME:=VALUE is for one of them')
    print('\n\n'.join(texts))
    return 0


def _is_user_error(error: Exception) -> bool:
    """Errors ROS raises for what was typed: unknown arguments, unreadable parameter files."""
    return type(error).__module__.startswith(('rclpy', '_rclpy'))


def _close(nodes: Sequence[MaglevNode[Any]]) -> None:
    """The nodes' last work, then out of the graph: a middleware that blocks is left after a bound.

    Which is exit code 1, with the threads' tracebacks on stderr.
    """
    for node in nodes:
        node.close()
    faulthandler.dump_traceback_later(_LEAVING_TIME, exit=True)
    deliver(publisher for node in nodes for publisher in node.publishers)
    stop_receiving()
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown()
    faulthandler.cancel_dump_traceback_later()
