"""Run a node without what was compiled ahead, and write what compiled functions it called, and how.

recorded_node.py OUT PACKAGE.MODULE:FUNCTION ARGUMENT...
"""

from __future__ import annotations

import json
import os
import pkgutil
import sys
from pathlib import Path

from maglev_model.compiled import ahead, build_ahead

leave = os._exit


def tell(code: int) -> None:
    """Write it, then leave."""
    calls = build_ahead.called().items()
    told = {ahead.symbol(function): build_ahead.digests(kinds) for function, kinds in calls}
    out.write_text(json.dumps(told), encoding='utf-8')
    leave(code)


out = Path(sys.argv[1])
run = pkgutil.resolve_name(sys.argv[2])
sys.argv[1:] = sys.argv[3:]
ahead.use = build_ahead.record  # type: ignore[assignment]
os._exit = tell  # type: ignore[assignment]
run()
