"""Packages and executables of the ament index."""

from __future__ import annotations

import os
from pathlib import Path

from ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_packages_with_prefixes,
)

from maglev_ros2cli.parser import CommandError


def names() -> list[str]:
    return sorted(get_packages_with_prefixes())


def executables(package: str) -> list[Path]:
    """A package's executables, sorted. Raises :class:`CommandError` for an unknown package."""
    try:
        folder = Path(get_package_prefix(package)) / 'lib' / package
    except (PackageNotFoundError, ValueError):
        raise CommandError(f"Package '{package}' not found") from None
    found = []
    for path, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith('.'))
        found += [Path(path) / name for name in sorted(files)]
    return [path for path in found if os.access(path, os.X_OK)]
