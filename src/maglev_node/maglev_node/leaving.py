"""How a process leaves the graph: what it said is heard, and its middleware does not block."""

from __future__ import annotations

import ctypes
import os
import socket
import stat
import struct
import time
from array import array
from collections.abc import Iterable, Iterator
from contextlib import suppress
from fcntl import ioctl
from termios import FIONREAD

from rclpy.duration import Duration
from rclpy.publisher import Publisher

_DROP_ALL = ctypes.create_string_buffer(struct.pack('HBBI', 0x06, 0, 0, 0))
"""A classic BPF program of one instruction: return, and keep no byte."""

_ATTACH_FILTER = 26  # SO_ATTACH_FILTER of asm-generic/socket.h

_CALLBACK_TIME = 0.02
"""Enough for the callbacks of what was read last [s]."""

_READING_TIME = 0.5
"""Longest wait for the middleware to have read what came before [s]."""


def deliver(publishers: Iterable[Publisher], at_most: float = 2.0) -> None:
    """Give what was published last the time to arrive: ``at_most`` [s] for all of them."""
    deadline = time.monotonic() + at_most
    for publisher in publishers:
        left = max(deadline - time.monotonic(), 0.0)
        publisher.wait_for_all_acked(Duration(seconds=left))


def stop_receiving() -> None:
    """Receive nothing more by UDP, on any socket this process has open; it can still send.

    Call it before the last node of a process is destroyed. Where Fast DDS is built with an old
    libstdc++, as in the wheels, it waits for ever, at full speed, when its participant is deleted
    while a callback tells of another one's writer or reader (eProsima/Fast-DDS issue 6513): now and
    then, where several nodes leave together. Who receives nothing has none of those callbacks.
    """
    sockets = list(_datagram_sockets())
    program = struct.pack('HP', 1, ctypes.addressof(_DROP_ALL))
    for each in sockets:
        with suppress(OSError):  # a kernel without filters
            each.setsockopt(socket.SOL_SOCKET, _ATTACH_FILTER, program)
    deadline = time.monotonic() + _READING_TIME
    while any(map(_waiting, sockets)) and time.monotonic() < deadline:
        time.sleep(1e-3)
    time.sleep(_CALLBACK_TIME)
    for each in sockets:
        each.close()


def _datagram_sockets() -> Iterator[socket.socket]:
    """Duplicates of the process's own sockets of UDP; none where the system does not list them."""
    names: list[str] = []
    with suppress(OSError):
        names = os.listdir('/proc/self/fd')
    for name in names:
        with suppress(OSError):
            if not stat.S_ISSOCK(os.stat(int(name)).st_mode):
                continue
            each = socket.socket(fileno=os.dup(int(name)))
            if each.type == socket.SOCK_DGRAM and each.family in (socket.AF_INET, socket.AF_INET6):
                yield each
            else:
                each.close()


def _waiting(of: socket.socket) -> bool:
    """Whether something was received that nobody has read."""
    unread = array('i', [0])
    with suppress(OSError):
        ioctl(of, FIONREAD, unread)
    return unread[0] > 0
