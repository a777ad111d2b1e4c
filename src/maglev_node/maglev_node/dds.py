"""What the middleware needs before the first node of a process comes up."""

from __future__ import annotations

import contextlib
import os
import re
import sys
import time
from pathlib import Path

_VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
_PROFILE = Path(__file__).with_name('fastdds.xml')
_SHARED_MEMORY = Path('/dev/shm')
_LOCK = re.compile(r'sem\.(fastrtps_port(\d+))_mutex')
_FIRST_PORT, _PORTS = 7400, 250  # of domain 0, and of each domain (DDSI-RTPS 9.6.1.1)
_HELD = 1.0  # a port is opened in far less; a lock held for this long has nobody to undo it [s]


def prepare_middleware() -> None:
    """Choose the middleware's profile and free what killed processes hold on to.

    For Fast DDS, before the process makes its first node; other middleware does not heed it.
    """
    os.environ.setdefault(_VARIABLE, str(_PROFILE))
    with contextlib.suppress(ValueError, OSError):  # a wrong domain is for ROS to refuse
        free_ports(int(os.environ.get('ROS_DOMAIN_ID') or 0))


def free_ports(domain: int) -> None:
    """Remove the locks of shared-memory ports that were left by processes killed in coming up.

    Fast DDS waits for such a lock without a bound: no node of the domain that is given this port
    would ever come up. Raises OSError when a lock cannot be removed.
    """
    locked = _locked(domain)
    end = time.monotonic() + _HELD
    while locked and time.monotonic() < end:
        time.sleep(0.05)
        locked &= _locked(domain)
    for name in locked:
        (_SHARED_MEMORY / f'sem.{name}_mutex').unlink(missing_ok=True)
        port = _SHARED_MEMORY / name
        if port.exists() and port.stat().st_size == 0:  # was being made
            port.unlink(missing_ok=True)


def local_participants(domain: int) -> int:
    """How many participants of a domain this machine has, by the ports they hear discovery on.

    Raises OSError where the system does not tell.
    """
    first = _FIRST_PORT + _PORTS * domain
    unicast = range(first + 10, first + _PORTS, 2)
    lines = Path('/proc/net/udp').read_text(encoding='ascii').splitlines()[1:]
    return len({int(line.split()[1].partition(':')[2], 16) for line in lines} & set(unicast))


def _locked(domain: int) -> set[str]:
    """Names of the domain's ports whose lock, a POSIX semaphore, is at 0."""
    first = _FIRST_PORT + _PORTS * domain
    names = set()
    for entry in os.scandir(_SHARED_MEMORY):
        match = _LOCK.fullmatch(entry.name)
        if match and first <= int(match[2]) < first + _PORTS:
            with contextlib.suppress(OSError):
                content = Path(entry.path).read_bytes()
                if len(content) >= 4 and int.from_bytes(content[:4], sys.byteorder) == 0:
                    names.add(match[1])
    return names
