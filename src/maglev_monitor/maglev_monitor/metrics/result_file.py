"""Files that are there as a whole or not at all, ``metrics.json`` among them. No ROS here."""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any


def write_metrics(path: Path, result: Mapping[str, Any]) -> None:
    """Write ``metrics.json``, as :func:`write_whole`.

    JSON has no word for what is no finite number: that is ``null``, as what is not known.
    """
    write_whole(path, json.dumps(_finite(result), indent=2, allow_nan=False) + '\n')


def write_whole(path: Path, text: str) -> None:
    """Write a file, in a folder that may be new, in one go: all of it or none. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole(path) as partial:
        partial.write_text(text, encoding='utf-8')


@contextlib.contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Where to write a file that takes its place when all of it is there."""
    partial = path.with_name(path.name + '.tmp')
    try:
        yield partial
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def _finite(content: Any) -> Any:
    """The same, with None for each number that is not finite."""
    if isinstance(content, Mapping):
        return {name: _finite(value) for name, value in content.items()}
    if isinstance(content, list | tuple):
        return [_finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content
