"""Metrics of one's own: a mistake in one is told, and costs the run none of its figures."""

from __future__ import annotations

import math
import sys
import types
from typing import Any

import numpy as np
import pytest
from run_figures import RUN, figures

from maglev_model.parameters import ParameterError, build
from maglev_monitor.metrics.decoding import Records
from maglev_monitor.metrics.run_parameters import RunParameters

RUNS = build(RunParameters, {'metrics.modules': ('my.sound', 'my.own')})


class Sound:
    """Counts rows."""

    def __init__(self) -> None:
        self.rows = 0

    def add(self, rows: Any, position: Any) -> None:
        assert len(position) == len(rows)
        self.rows += len(rows)

    def result(self) -> Any:
        return {'rows': self.rows, 'half': np.float64(0.5), 'none': None, 'nan': math.nan}


class Raises(Sound):
    def add(self, rows: Any, position: Any) -> None:
        raise ValueError('no field of name foo')


class Writes(Sound):
    def add(self, rows: Any, position: Any) -> None:
        rows['reference'] *= 1e6


class WritesPositions(Sound):
    def add(self, rows: Any, position: Any) -> None:
        position *= 1e6


class Returns(Sound):
    def __init__(self, result: Any) -> None:
        super().__init__()
        self.result = lambda: result  # type: ignore[method-assign]


def with_own(monkeypatch: pytest.MonkeyPatch, records: dict[str, Records], own: Any) -> Any:
    for name, made in (('sound', Sound()), ('own', own)):
        module = types.ModuleType(f'my.{name}')
        module.metric = lambda _, made=made: made  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, f'my.{name}', module)
    monkeypatch.setitem(sys.modules, 'my', types.ModuleType('my'))
    return figures(records, RUNS)


@pytest.mark.parametrize(
    ('own', 'why'),
    [
        (Raises(), 'ValueError: no field of name foo (test_further.py, line '),
        (Writes(), 'ValueError: '),
        (WritesPositions(), 'ValueError: '),
        (Returns(3.0), 'TypeError: '),
        (
            Returns({'gaps': np.zeros(4)}),
            "TypeError: 'gaps' of its result is no number: ndarray",
        ),
    ],
)
def test_a_metric_that_fails(
    own: Any, why: str, monkeypatch: pytest.MonkeyPatch, records: dict[str, Records]
) -> None:
    plain, found = figures(records), with_own(monkeypatch, records, own)
    assert found['axes'] == plain['axes']
    assert found['own_axes'] == plain['own_axes']
    assert list(found['further']) == ['my.sound']
    assert found['further']['my.sound']['rows'] == plain['run_samples']
    assert found['verdict'] == 'fail'
    assert len(found['reasons']) == 1
    assert found['reasons'][0].startswith(f'the further metric my.own raised {why}')


def test_figures_of_sound_ones(
    monkeypatch: pytest.MonkeyPatch, records: dict[str, Records]
) -> None:
    found = with_own(monkeypatch, records, Sound())
    assert found['further']['my.own'] == pytest.approx(
        {'rows': found['run_samples'], 'half': 0.5, 'none': None, 'nan': math.nan}, nan_ok=True
    )
    assert found['verdict'] == 'pass'
    assert 'further' not in figures(records, RUN)


@pytest.mark.parametrize('own', [None, object()])
def test_what_is_no_metric(
    own: Any, monkeypatch: pytest.MonkeyPatch, records: dict[str, Records]
) -> None:
    with pytest.raises(ParameterError, match=r"'metrics\.modules' names 'my\.own', a metric with"):
        with_own(monkeypatch, records, own)
