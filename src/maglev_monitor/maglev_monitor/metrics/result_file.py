"""``metrics.json``, the figures of a run. No ROS here."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def write_metrics(path: Path, result: Mapping[str, Any]) -> None:
    """Write ``metrics.json`` in one go: the file is either whole or not there. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + '.tmp')
    temporary.write_text(json.dumps(result, indent=2) + '\n', encoding='utf-8')
    os.replace(temporary, path)
