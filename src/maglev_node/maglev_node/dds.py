"""What the middleware needs before the first node of a process comes up."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from maglev_node.port_locks import FIRST_PORT, PORTS, free_ports

_VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
_RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
_PROFILE = Path(__file__).with_name('fastdds.xml')
_WATCHER = Path(__file__).with_name('fastdds_watcher.xml')


def prepare_middleware() -> None:
    """Choose the middleware's profile and free what killed processes hold on to.

    For Fast DDS, before the process makes its first node; other middleware does not heed it.
    """
    os.environ.setdefault(_VARIABLE, str(_PROFILE))
    with contextlib.suppress(ValueError, OSError):  # a wrong domain is for ROS to refuse
        free_ports(int(os.environ.get('ROS_DOMAIN_ID') or 0))


def share_no_memory() -> None:
    """Let a process that only watches be heard and told over the network alone.

    A loop that shares memory with one that is killed now and then waits for it, up to two seconds:
    so long does Fast DDS take to find out. Of no effect where a profile is given.
    """
    given = os.environ.get(_VARIABLE, str(_PROFILE)) != str(_PROFILE)
    if given or os.environ.get(_RANGE) != 'LOCALHOST':
        os.environ.setdefault('FASTDDS_BUILTIN_TRANSPORTS', 'UDPv4')
        return
    # There rmw_fastrtps adds shared memory whatever is asked for; the profile keeps to this machine
    # in its place.
    os.environ[_RANGE] = 'SYSTEM_DEFAULT'
    os.environ[_VARIABLE] = str(_WATCHER)


def local_participants(domain: int) -> int:
    """How many participants of a domain this machine has, by the ports they hear discovery on.

    Raises OSError where the system does not tell.
    """
    first = FIRST_PORT + PORTS * domain
    unicast = range(first + 10, first + PORTS, 2)
    lines = Path('/proc/net/udp').read_text(encoding='ascii').splitlines()[1:]
    return len({int(line.split()[1].partition(':')[2], 16) for line in lines} & set(unicast))
