"""What the middleware needs before the first node of a process comes up."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from maglev_node.port_locks import free_ports

_VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
_PROFILE = Path(__file__).with_name('fastdds.xml')


def prepare_middleware() -> None:
    """Choose the middleware's profile and free what killed processes hold on to.

    For Fast DDS, before the process makes its first node; other middleware does not heed it.
    """
    os.environ.setdefault(_VARIABLE, str(_PROFILE))
    with contextlib.suppress(ValueError, OSError):  # a wrong domain is for ROS to refuse
        free_ports(int(os.environ.get('ROS_DOMAIN_ID') or 0))
