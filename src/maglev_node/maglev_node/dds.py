"""What the middleware needs before the first node of a process comes up."""

from __future__ import annotations

import os
from pathlib import Path

_PROFILES = 'FASTRTPS_DEFAULT_PROFILES_FILE'
_TRANSPORTS = 'FASTDDS_BUILTIN_TRANSPORTS'
_RANGE, _PEERS = 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_STATIC_PEERS'
_BY_PROFILE = 'SYSTEM_DEFAULT'  # what rmw_fastrtps leaves to the profile
_ANYWHERE = Path(__file__).with_name('fastdds.xml')
_HERE = Path(__file__).with_name('fastdds_here.xml')

_FIRST_PORT, _PORTS = 7400, 250  # of domain 0, and of each domain (DDSI-RTPS 9.6.1.1)


def prepare_middleware() -> None:
    """Let Fast DDS carry messages over the network, on one machine too, with our timing.

    Its shared memory has locks that all processes of a domain take. Whoever is interrupted while it
    holds one, as what has no real-time priority is on a busy machine, keeps the loop waiting for as
    long, and whoever is killed then for seconds.
    Before the process makes its first node; other middleware does not heed it, and a profile that
    is given stays.
    """
    os.environ.setdefault(_TRANSPORTS, 'UDPv4')
    if os.environ.get(_PROFILES, '') not in ('', str(_ANYWHERE), str(_HERE)):
        return
    here = only_here()
    os.environ[_PROFILES] = str(_HERE if here else _ANYWHERE)
    if here:
        # With LOCALHOST rmw_fastrtps adds shared memory whatever is asked for; the profile keeps to
        # this machine in its place.
        os.environ[_RANGE] = _BY_PROFILE


def only_here() -> bool:
    """Whether nodes of this process, or of one that it starts, see those of this machine alone."""
    where = os.environ.get(_RANGE)
    by_profile = where == _BY_PROFILE and os.environ.get(_PROFILES) == str(_HERE)
    return by_profile or (where == 'LOCALHOST' and not os.environ.get(_PEERS))


def local_participants(domain: int) -> int:
    """How many participants of a domain this machine has, by the ports they hear discovery on.

    Raises OSError where the system does not tell.
    """
    first = _FIRST_PORT + _PORTS * domain
    unicast = range(first + 10, first + _PORTS, 2)
    lines = Path('/proc/net/udp').read_text(encoding='ascii').splitlines()[1:]
    return len({int(line.split()[1].partition(':')[2], 16) for line in lines} & set(unicast))
