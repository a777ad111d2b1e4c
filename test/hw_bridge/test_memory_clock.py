"""By which clock the amplifiers cool while no bridge runs."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import pytest

from maglev_hw_bridge import memory as module
from maglev_hw_bridge.memory import Memory
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import build

COOLED = 0.5 * np.exp(-1.0)  # in 2 s


def memory_in(folder: Path) -> Memory:
    return Memory(build(BridgeParameters, {'boards.memory': str(folder / 'boards.json')}))


@pytest.mark.parametrize(
    ('now', 'before', 'since', 'left'),
    [
        (1002.0, 'one', 'one', COOLED),
        (1000.0, 'one', 'one', 0.5),
        (10.0, 'one', 'one', 0.5),
        (2.0, 'one', 'another', COOLED),
        (0.0, 'one', 'another', 0.5),
        (1002.0, '', '', 0.5),
        (1002.0, '', 'one', 0.5),
        (1002.0, 'one', '', 0.5),
    ],
)
def test_what_has_passed_for_sure_cools(
    tmp_path: Path, now: float, before: str, since: str, left: float
) -> None:
    """In this start of the computer, or since it; where nobody knows which one, nothing has."""
    parameters = build(BridgeParameters, {'boards.memory': str(tmp_path / 'boards.json')})
    Memory(parameters, lambda: 1000.0, lambda: before).keep(np.full(12, 0.5), None, active=False)
    memory = Memory(parameters, lambda: now, lambda: since)
    assert memory.recall().load == pytest.approx(np.full(12, left))


def test_a_clock_on_the_wall_that_is_set_cools_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    memory_in(tmp_path).keep(np.full(12, 0.5), None, active=False)
    now = time.time()
    monkeypatch.setattr(time, 'time', lambda: now + 3600.0)
    assert memory_in(tmp_path).recall().load == pytest.approx(np.full(12, 0.5), rel=0.2)


def test_what_was_kept_by_the_clock_on_the_wall_is_as_hot_as_it_was(tmp_path: Path) -> None:
    memory = memory_in(tmp_path)
    memory.keep(np.full(12, 0.5), None, active=False)
    content = json.loads((tmp_path / 'boards.json').read_text())
    del content['boot']
    (tmp_path / 'boards.json').write_text(json.dumps(content))
    assert memory.recall().load == pytest.approx(np.full(12, 0.5))


def test_where_the_computer_does_not_say_when_it_started_nothing_cools(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert len(module._this_boot()) > 8
    monkeypatch.setattr(module, '_BOOT', tmp_path / 'nowhere')
    assert module._this_boot() == ''
