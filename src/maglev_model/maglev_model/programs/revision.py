"""Which software this is: its version, and of a checkout the commit. No ROS here."""

from __future__ import annotations

import subprocess
from importlib import metadata
from pathlib import Path

_PATIENCE = 5.0  # with git [s]


def revision(where: Path = Path(__file__)) -> str:
    """``0.1.0, v0.1.0-7-g4876d80-dirty``: the version, and how git names a checkout.

    :param where: a file of the software.
    """
    try:
        version = metadata.version('maglev_model')
    except metadata.PackageNotFoundError:
        version = ''
    return ', '.join(word for word in (version, _commit(where.resolve())) if word)


def _commit(file: Path) -> str:
    """What git calls the checkout in which a file is; empty where there is none, or no git."""
    root = next((folder for folder in file.parents if (folder / '.git').exists()), None)
    if root is None:
        return ''
    command = ['git', '-C', str(root), 'describe', '--always', '--dirty', '--tags']
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_PATIENCE)
    except (OSError, subprocess.TimeoutExpired):
        return ''
    return done.stdout.strip()
