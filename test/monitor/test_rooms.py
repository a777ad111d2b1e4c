"""The monitor's folders stand on each other in one order only."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2] / 'src' / 'maglev_monitor' / 'maglev_monitor'
STANDS_ON = {
    'metrics': {'metrics'},
    'bag': {'metrics', 'bag'},
    'report': {'metrics', 'bag', 'report'},
    'live': {'metrics', 'report', 'live'},
}


@pytest.mark.parametrize('folder', STANDS_ON)
def test_a_folder_imports_only_what_it_stands_on(folder: str) -> None:
    files = list((ROOT / folder).glob('*.py'))
    assert files
    imported = {
        match
        for file in files
        for match in re.findall(r'(?:from|import) maglev_monitor\.(\w+)', file.read_text())
    }
    assert imported <= STANDS_ON[folder]


def test_every_folder_has_its_place() -> None:
    assert {path.parent.name for path in ROOT.glob('*/__init__.py')} == set(STANDS_ON)
