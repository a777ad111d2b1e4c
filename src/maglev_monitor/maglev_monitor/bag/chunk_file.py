"""The file under a bag that is being written: it can go back to where it was whole. No ROS here."""

from __future__ import annotations

import errno
import os
from pathlib import Path

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class ChunkFile:
    """A new file without a buffer, which would write what failed once more, later.

    All methods raise OSError. ``position`` is how much has been written, ``whole`` how much of it
    can be read, as :meth:`keep` says [bytes].
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.position = 0
        self.whole = 0
        self._file = path.open('xb', buffering=0)

    def write(self, data: bytes) -> int:
        """Write all of it."""
        rest = memoryview(data)
        while rest:
            written = self._file.write(rest)
            self.position += written
            rest = rest[written:]
        return len(data)

    def tell(self) -> int:
        """How much has been written [bytes]."""
        return self.position

    def flush(self) -> None:
        """Nothing: what was written is with the system already."""

    def keep(self) -> None:
        """What was written so far is whole."""
        self.whole = self.position

    def go_back(self) -> None:
        """Drop what was written since then."""
        self._file.truncate(self.whole)
        self._file.seek(self.whole)
        self.position = self.whole

    def claim(self, room: int) -> None:
        """Find out that the file may still grow by as much [bytes]; otherwise raise OSError."""
        try:
            os.posix_fallocate(self._file.fileno(), self.position, room)
        except OSError as error:
            if error.errno in _FULL:  # otherwise this file system cannot tell
                raise
        finally:
            self._file.truncate(self.position)

    def close(self) -> None:
        """May be called twice."""
        self._file.close()
