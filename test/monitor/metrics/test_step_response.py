"""Step responses as they are judged: against python-control."""

from __future__ import annotations

from typing import Any

import control
import numpy as np
import pytest
from run_figures import figures

from maglev_model.parameters import build
from maglev_monitor.metrics.decoding import Records
from maglev_monitor.metrics.run_parameters import RunParameters
from maglev_monitor.metrics.step_response import StepTracker


def step_result(position: Any, start: float, target: float, sample_time: float = 1e-3) -> Any:
    """The tracker's figures for a response of y, other axes at zero."""
    parameters = build(RunParameters, {'sample_time': sample_time})
    from_, to = np.zeros(5), np.zeros(5)
    from_[0], to[0] = start, target
    tracker = StepTracker(parameters, from_, to, 100)
    values = np.zeros((len(position), 3, 5))
    values[:, 0, 0] = position
    values[:, 1, :] = np.nan
    sequence = 100 + np.arange(len(position))
    for part in np.array_split(np.arange(len(position)), 7):
        tracker.add(sequence[part], values[part])
    assert tracker.results(1)[0]['settling_time'] is None
    return tracker.results(0)[0]


@pytest.mark.parametrize(('start', 'target'), [(0.020, 0.027), (0.030, 0.025)])
@pytest.mark.parametrize('damping', [0.2, 0.5, 0.9])
def test_steps_agree_with_python_control(start: float, target: float, damping: float) -> None:
    system = control.tf([36.0], [1.0, 12.0 * damping, 36.0])
    time = np.arange(0.0, 8.0, 1e-3)
    response = control.step_response(system, time).outputs
    found = step_result(start + (target - start) * response, start, target)
    share = 1e-4 / abs(target - start)
    info = control.step_info(response, time, SettlingTimeThreshold=share, yfinal=1.0)
    assert found['overshoot_percent'] == pytest.approx(info['Overshoot'], abs=1e-6)
    assert found['settling_time'] == pytest.approx(info['SettlingTime'], abs=1.1e-3)
    finer = control.step_info(response, time, SettlingTimeThreshold=share / 10.0, yfinal=1.0)
    assert found['encoder_time'] == pytest.approx(finer['SettlingTime'], abs=1.1e-3)
    assert (found['from'], found['to'], found['axis']) == (start, target, 'y')


def test_a_step_that_stays_outside_never_settles() -> None:
    found = step_result(np.full(500, 0.0268), 0.020, 0.027)
    assert found['settling_time'] is None
    assert found['encoder_time'] is None
    assert found['overshoot_percent'] == 0.0
    assert found['duration'] == 0.5


def test_settled_means_to_stay() -> None:
    position = np.full(500, 0.027)
    position[[0, 250]] = 0.0272
    found = step_result(position, 0.020, 0.027)
    assert found['settling_time'] == pytest.approx(0.251)
    assert found['overshoot_percent'] == pytest.approx(0.2 / 7.0 * 100.0)


def test_one_count_of_error_is_within_the_encoder_bound() -> None:
    found = step_result(np.full(300, 2701 * 1e-5), 0.020, 0.027)
    assert found['encoder_time'] == 0.0


def test_a_step_that_began_before_the_recording_has_no_figures(
    run: Any, records: dict[str, Records]
) -> None:
    """Where it started nobody knows, nor when."""
    first = int(np.flatnonzero(run.segment == 3)[100])
    shaped = records['reference'].copy()
    shaped['position'][first : first + 50, 0] -= 1e-3
    found = figures({**records, 'reference': shaped})
    assert [step['axis'] for step in found['steps']] == ['y', 'theta']
    late = {key: part[first:] for key, part in {**records, 'reference': shaped}.items()}
    assert [step['axis'] for step in figures(late)['steps']] == ['theta']
