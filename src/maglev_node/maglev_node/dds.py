"""What the middleware needs before the first node of a process comes up."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from maglev_node.port_locks import FIRST_PORT, PORTS, free_ports

_VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
_PROFILE = Path(__file__).with_name('fastdds.xml')


def prepare_middleware() -> None:
    """Choose the middleware's profile and free what killed processes hold on to.

    For Fast DDS, before the process makes its first node; other middleware does not heed it.
    """
    os.environ.setdefault(_VARIABLE, str(_PROFILE))
    with contextlib.suppress(ValueError, OSError):  # a wrong domain is for ROS to refuse
        free_ports(int(os.environ.get('ROS_DOMAIN_ID') or 0))


def share_no_memory() -> None:
    """Let a process that only watches be heard and told over the network alone.

    Fast DDS waits up to two seconds for one that is killed while it holds what they share in
    memory, and that wait would be the loop's.
    """
    os.environ.setdefault('FASTDDS_BUILTIN_TRANSPORTS', 'UDPv4')


def local_participants(domain: int) -> int:
    """How many participants of a domain this machine has, by the ports they hear discovery on.

    Raises OSError where the system does not tell.
    """
    first = FIRST_PORT + PORTS * domain
    unicast = range(first + 10, first + PORTS, 2)
    lines = Path('/proc/net/udp').read_text(encoding='ascii').splitlines()[1:]
    return len({int(line.split()[1].partition(':')[2], 16) for line in lines} & set(unicast))
