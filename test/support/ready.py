"""Calls what nodes call, as set-up does; so has the server from which they are forked."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / 'setup'))
from compile_ahead import HALVES

for call in HALVES.values():
    call()
