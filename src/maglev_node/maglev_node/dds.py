"""What the middleware is told before the first node of a process comes up."""

from __future__ import annotations

import os
from pathlib import Path

_VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
_PROFILE = Path(__file__).with_name('fastdds.xml')


def choose_profile() -> None:
    """Have Fast DDS take the profile of this package, unless the environment names another.

    Read when the process makes its first node; other middleware does not heed it.
    """
    os.environ.setdefault(_VARIABLE, str(_PROFILE))
