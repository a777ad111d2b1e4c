"""A place that one process on this machine holds: known at once, where discovery takes its time."""

from __future__ import annotations

import errno
import hashlib
import socket


class Place:
    """A name in the kernel's abstract namespace of sockets, which is that of the network's.

    Whoever holds it loses it when it ends, however that is; it leaves no file behind.
    """

    def __init__(self) -> None:
        self._socket: socket.socket | None = None

    def take(self, name: str) -> bool:
        """Whether the place is this one's now; also where the system has no such names."""
        if self._socket is not None:
            return True
        held = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            held.bind(f'\0maglev-{hashlib.sha256(name.encode()).hexdigest()}')
        except OSError as error:
            held.close()
            return error.errno != errno.EADDRINUSE
        self._socket = held
        return True

    def leave(self) -> None:
        """Let others have it."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None
