"""Locks of shared-memory ports that Fast DDS' processes left when they were killed in coming up.

A port is opened under a lock, a POSIX semaphore named after it, and whoever comes up waits for it
without a bound. A semaphore does not tell who holds it, but who holds or awaits one has it mapped:
one that is at 0 and is mapped by nobody has been left. It is then given back as its holder would
have done; nothing is removed by name that somebody else may be using.
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import mmap
import os
import re
import stat
import sys
import time
from pathlib import Path
from typing import NamedTuple

_SHARED_MEMORY = Path('/dev/shm')
_LOCK = re.compile(r'sem\.(fastrtps_port(\d+))_mutex')
FIRST_PORT, PORTS = 7400, 250  # of domain 0, and of each domain (DDSI-RTPS 9.6.1.1)
_SIZE = 32  # of a semaphore [bytes]

_MOMENT = 0.1  # a port is opened in far less [s]
_LONGEST = 3.0  # and always in less than this, a health check of 1 s included [s]

_ALL_PROCESSES = 0xEFFFFFFC  # inode of the process namespace that sees them all
_KERNEL_THREAD = 0x00200000  # in a process's flags


class Lock(NamedTuple):
    """A lock that is held or was left: its file, as it was when it was looked at."""

    path: Path
    device: int
    inode: int

    @property
    def port(self) -> Path:
        """The port's own file."""
        return self.path.with_name(self.path.name.removeprefix('sem.').removesuffix('_mutex'))


def free_ports(domain: int, patience: float = _LONGEST) -> None:
    """Give back the locks of the domain's ports that nobody holds any more.

    Where some processes' mappings are hidden from this one, a lock must have been held for
    ``patience`` [s] as well. Raises OSError.
    """
    begun = time.monotonic()
    locks = held_locks(domain)
    if locks:
        time.sleep(_MOMENT)
        locks &= held_locks(domain)
    while locks:
        using, all_seen = users(locks)
        for lock in locks - using:
            if all_seen or time.monotonic() - begun > patience:
                _give_back(lock)
        if all_seen or time.monotonic() - begun > patience:
            return
        time.sleep(_MOMENT)
        locks = (locks - using) & held_locks(domain)


def held_locks(domain: int) -> set[Lock]:
    """The locks of a domain's ports that are at 0."""
    first = FIRST_PORT + PORTS * domain
    locks = set()
    for entry in os.scandir(_SHARED_MEMORY):
        match = _LOCK.fullmatch(entry.name)
        if match and first <= int(match[2]) < first + PORTS:
            with contextlib.suppress(OSError), open(entry.path, 'rb') as file:
                found = os.fstat(file.fileno())
                if _is_zero(file.read(4)):
                    locks.add(Lock(Path(entry.path), found.st_dev, found.st_ino))
    return locks


def users(locks: set[Lock]) -> tuple[set[Lock], bool]:
    """Those of the locks that another process has mapped, and whether all processes were seen.

    Processes that may not write to any of the locks do not count.
    """
    wanted = {
        f'{os.major(lock.device):02x}:{os.minor(lock.device):02x} {lock.inode} ': lock
        for lock in locks
    }
    using: set[Lock] = set()
    all_seen = os.stat('/proc/self/ns/pid').st_ino == _ALL_PROCESSES
    for process in Path('/proc').iterdir():
        if not process.name.isdigit() or int(process.name) == os.getpid():
            continue
        try:
            maps = (process / 'maps').read_text(errors='replace')
        except (FileNotFoundError, ProcessLookupError):  # it has ended
            continue
        except OSError:
            all_seen = all_seen and not _may_use(process, locks)
            continue
        using |= {lock for key, lock in wanted.items() if key in maps}
    return using, all_seen


def _may_use(process: Path, locks: set[Lock]) -> bool:
    """Whether a process whose mappings are hidden could have one of the locks open."""
    with contextlib.suppress(OSError):
        if int((process / 'stat').read_text().rpartition(')')[2].split()[6]) & _KERNEL_THREAD:
            return False
        user = process.stat().st_uid
        return any(_may_write(user, lock.path.stat()) for lock in locks)
    return True


def _may_write(user: int, found: os.stat_result) -> bool:
    """Whether a user may write to a file that is found so; a group may, whoever is in it."""
    return user in (0, found.st_uid) or bool(found.st_mode & (stat.S_IWGRP | stat.S_IWOTH))


def _give_back(lock: Lock) -> None:
    """Release a lock nobody holds: that very one, once, whatever has its name by now."""
    with contextlib.suppress(PermissionError), open(lock.path, 'r+b') as file:
        found = os.fstat(file.fileno())
        if (found.st_dev, found.st_ino) != (lock.device, lock.inode) or found.st_size < _SIZE:
            return
        fcntl.flock(file, fcntl.LOCK_EX)  # of two nodes that come up, one gives it back
        with mmap.mmap(file.fileno(), _SIZE) as memory:
            if not _is_zero(memory[:4]) or lock in users({lock})[0]:
                return
            with contextlib.suppress(OSError):
                if lock.port.stat().st_size == 0:  # was being made
                    lock.port.unlink()
            _post(memory)


def _post(memory: mmap.mmap) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    semaphore = (ctypes.c_char * _SIZE).from_buffer(memory)
    try:
        if libc.sem_post(ctypes.byref(semaphore)) != 0:
            raise OSError(ctypes.get_errno(), 'sem_post')
    finally:
        del semaphore  # or the mapping cannot be closed


def _is_zero(content: bytes) -> bool:
    """Whether a semaphore, which begins with these bytes, is at 0."""
    return len(content) >= 4 and int.from_bytes(content[:4], sys.byteorder) == 0
