"""The process in which a regulator is designed: what it writes is its own, and may be missing."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from maglev_controller.design_process import DesignProcess
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.parameters import ParameterError, build

TALKATIVE = """
import numpy as np
print('imported', flush=True)

class Law:
    def reset(self): pass
    def step(self, measurement, reference): return np.zeros(5)

def make(parameters):
    print('made', flush=True)
    return Law()
"""


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine that is busy with other tests may take as long as it likes."""
    monkeypatch.setattr('maglev_controller.design_process._LONGEST', 600.0)


def begun(**overrides: object) -> DesignProcess:
    """A design that is done, with these parameters."""
    process = DesignProcess(
        Regulator(ControllerParameters()), build(ControllerParameters, overrides)
    )
    while not process.done:
        time.sleep(0.01)
    return process


def test_what_a_law_prints_is_no_part_of_the_design(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / 'talkative').mkdir()
    (tmp_path / 'talkative' / 'law.py').write_text(TALKATIVE)
    monkeypatch.setenv('PYTHONPATH', f'{tmp_path}:{os.environ["PYTHONPATH"]}')
    regulator, maps = begun(law='talkative.law').result()
    assert regulator.parameters.law == 'talkative.law'
    assert len(maps) == 5
    assert capfd.readouterr().err == 'imported\nmade\n'


def test_it_has_no_real_time_priority_when_it_imports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    policy = tmp_path / 'policy'
    look = f"import os; open('{policy}', 'w').write(str(os.sched_getscheduler(0)))"
    (tmp_path / 'sitecustomize.py').write_text(look)  # the first that an environment may bring in
    monkeypatch.setenv('PYTHONPATH', f'{tmp_path}:{os.environ["PYTHONPATH"]}')
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except PermissionError:
        pytest.skip('real-time priority is not permitted here (ulimit -r)')
    try:
        begun().result()
    finally:
        os.sched_setscheduler(0, *before)
    assert policy.read_text() == str(os.SCHED_OTHER)


@pytest.mark.parametrize('left', [0, 100])
def test_a_design_that_is_not_whole_is_none(left: int) -> None:
    process = begun()
    process._output.truncate(left)
    with pytest.raises(ParameterError, match=r'cannot be read: .*; the old gains stay'):
        process.result()


def test_where_no_process_can_begin_there_is_no_design(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('sys.executable', '/nowhere/python')
    with pytest.raises(ParameterError, match=r'no design begins: .*; the old gains stay'):
        begun()
