"""The paper's experiments are known by what is flown, whatever a run is called."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from maglev_model.paper import ELLIPSE, STEPS, TRACKING
from maglev_monitor.metrics.curves import COLUMNS
from maglev_monitor.report.published import first_number, published_step, published_tracking

PERIOD = 1e-3


def followed(frequency: float = ELLIPSE.frequency, tilt: float = 0.0, gap: float = 0.025) -> Any:
    """A run along the paper's ellipse, or one beside it."""
    angle = frequency * PERIOD * np.arange(700.0) + 0.3
    x, z = 0.03 * np.sin(angle - 0.5 * np.pi), 0.03 * np.sin(angle)
    values = np.zeros((len(angle), max(part.stop for part in COLUMNS.values())))
    y = gap + 0.005 * np.sin(angle - 0.5 * np.pi)
    values[:, COLUMNS['reference']] = np.stack([y, x, z, 0 * x, tilt * np.sin(angle)], axis=1)
    run = SimpleNamespace(sample_time=PERIOD)
    return SimpleNamespace(
        curves=SimpleNamespace(tail=(np.arange(4000, 4700), values)), run=run, result={}
    )


def test_both_ellipses_are_known() -> None:
    assert published_tracking(followed()) is TRACKING['ellipse']
    assert published_tracking(followed(tilt=0.01)) is TRACKING['ellipse_4dof']


@pytest.mark.parametrize('other', [{'frequency': 4.75}, {'tilt': 0.009}, {'gap': 0.0251}])
def test_another_one_is_none_of_the_papers(other: dict[str, float]) -> None:
    assert published_tracking(followed(**other)) is None


def test_steps_are_known_by_their_ends() -> None:
    for step in STEPS:
        ends = {'axis': step.axis, 'from': step.start, 'to': step.target}
        assert published_step(ends) is step
        assert published_step({**ends, 'to': step.target + 1e-5}) is None
        assert published_step({**ends, 'axis': 'phi'}) is None


@pytest.mark.parametrize(
    ('words', 'number'), [('14.3 %', 14.3), ('< 3 s', 3.0), ('about 5 s', 5.0)]
)
def test_figures_in_words(words: str, number: float) -> None:
    assert first_number(words) == number
