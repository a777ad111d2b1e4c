"""What the operating system gives a process that must be on time, where it is permitted."""

from __future__ import annotations

import ctypes
import os
import resource
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from maglev_model.parameters import ParameterError

_SPINNING = 'dds.asyn'
"""Threads of Fast DDS that ask for a writer's lock again and again, without a pause."""

_NAMING = 0.2  # in which a thread that has begun has given itself its name [s]
_LONGEST_BURST = 5_000_000, 10_000_000
"""Longest time that a thread of real-time priority may run without a wait: to SIGXCPU, to SIGKILL
[us]."""

_CURRENT, _FUTURE, _ON_FAULT = 1, 2, 4  # mlockall(2)
_TRIM_THRESHOLD, _MMAP_MAX = -1, -4  # mallopt(3)


def take(priority: int) -> list[str]:
    """Keep the heap, take ``priority`` and lock memory unless it is 0; what is not permitted."""
    keep_heap()
    refused: list[str] = []
    if priority == 0:
        return refused
    if not take_priority(priority):
        refused.append('real-time priority (see ulimit -r)')
    if not lock_memory():
        refused.append('locking memory (see ulimit -l)')
    return refused


def take_priority(priority: int) -> bool:
    """Put all threads of this process under SCHED_FIFO; whether that is permitted (ulimit -r).

    Fast DDS sends again, and to late comers, in a thread that spins while another has the writer:
    with the same priority it would keep that one from the processor, and the machine hung. What
    runs for 5 s without a wait is told to end (SIGXCPU), and killed after 10 s.
    """
    _limit_bursts()
    until = time.monotonic() + _NAMING
    while not any(_spins(thread) for thread in _threads()) and time.monotonic() < until:
        time.sleep(0.01)
    try:
        for thread in _threads():
            spins = _spins(thread)
            policy = os.SCHED_OTHER if spins and priority == 1 else os.SCHED_FIFO
            rank = priority - spins
            os.sched_setscheduler(int(thread.name), policy, os.sched_param(rank))
    except OSError:
        return False
    return True


def take_processors(processors: Sequence[int]) -> None:
    """Let all threads of this process run on these only, and those they begin; empty: as before.

    Raises ParameterError where the process may not run on one of them.
    """
    if not processors:
        return
    may = os.sched_getaffinity(0)
    if not may.issuperset(processors):
        raise ParameterError(
            f"parameter 'processors' is {list(processors)}, it must be of those this process may"
            f' run on: {sorted(may)}'
        )
    for thread in _threads():
        with suppress(OSError):  # it has ended
            os.sched_setaffinity(int(thread.name), processors)


def give_priority_back() -> None:
    """Put the threads of this process that are under SCHED_FIFO back under SCHED_OTHER."""
    for thread in _threads():
        with suppress(OSError):  # it has ended
            if os.sched_getscheduler(int(thread.name)) == os.SCHED_FIFO:
                os.sched_setscheduler(int(thread.name), os.SCHED_OTHER, os.sched_param(0))


def take_niceness(niceness: int) -> None:
    """Let all threads of this process yield to others; none is made less nice than it is."""
    for thread in _threads():
        with suppress(OSError):
            own = os.getpriority(os.PRIO_PROCESS, int(thread.name))
            os.setpriority(os.PRIO_PROCESS, int(thread.name), max(own, niceness))


def _limit_bursts() -> None:
    _, most = resource.getrlimit(resource.RLIMIT_RTTIME)
    soft, hard = (
        longest if most == resource.RLIM_INFINITY else min(longest, most)
        for longest in _LONGEST_BURST
    )
    resource.setrlimit(resource.RLIMIT_RTTIME, (soft, hard))


def _threads() -> list[Path]:
    return list(Path('/proc/self/task').iterdir())


def _spins(thread: Path) -> bool:
    try:
        return (thread / 'comm').read_text(encoding='utf-8').startswith(_SPINNING)
    except OSError:  # it has ended
        return False


def keep_heap() -> None:
    """Let large blocks come from the heap and stay in it: no page is asked for again and again.

    By itself glibc maps a block of 128 kB and more anew each time, page fault after page fault.
    Fast DDS asks for one with every sample where a reader acknowledges none of them.
    """
    libc = ctypes.CDLL(None)
    if hasattr(libc, 'mallopt'):  # of glibc, not of every C library
        libc.mallopt(_MMAP_MAX, 0)
        libc.mallopt(_TRIM_THRESHOLD, -1)


def lock_memory() -> bool:
    """Keep in memory all that is touched, now and later; whether that is permitted (ulimit -l).

    With a limit it is not: memory beyond it could not be had any more.
    """
    limit, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    if os.geteuid() != 0 and limit != resource.RLIM_INFINITY:
        return False
    locked: int = ctypes.CDLL(None).mlockall(_CURRENT | _FUTURE | _ON_FAULT)
    return locked == 0
