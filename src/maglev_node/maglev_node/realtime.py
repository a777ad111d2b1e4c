"""What the operating system gives a process that must be on time, where it is permitted."""

from __future__ import annotations

import ctypes
import os
import resource

_CURRENT, _FUTURE, _ON_FAULT = 1, 2, 4  # mlockall(2)


def take_priority(priority: int) -> bool:
    """Put all threads of this process under SCHED_FIFO; whether that is permitted (ulimit -r)."""
    try:
        for thread in os.listdir('/proc/self/task'):
            os.sched_setscheduler(int(thread), os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        return False
    return True


def lock_memory() -> bool:
    """Keep in memory all that is touched, now and later; whether that is permitted (ulimit -l).

    With a limit it is not: memory beyond it could not be had any more.
    """
    limit, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    if os.geteuid() != 0 and limit != resource.RLIM_INFINITY:
        return False
    locked: int = ctypes.CDLL(None).mlockall(_CURRENT | _FUTURE | _ON_FAULT)
    return locked == 0
