"""``metrics.json``, the figures of a run. No ROS here."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def write_metrics(path: Path, result: Mapping[str, Any]) -> None:
    """Write ``metrics.json`` in one go: the file is either whole or not there. Raises OSError.

    JSON has no word for what is no finite number: that is ``null``, as what is not known.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + '.tmp')
    text = json.dumps(_finite(result), indent=2, allow_nan=False)
    temporary.write_text(text + '\n', encoding='utf-8')
    os.replace(temporary, path)


def _finite(content: Any) -> Any:
    """The same, with None for each number that is not finite."""
    if isinstance(content, Mapping):
        return {name: _finite(value) for name, value in content.items()}
    if isinstance(content, list | tuple):
        return [_finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content
