"""The library's façade: its names, what is refused in place of what is meant, sweeps."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import maglev_study as maglev
from maglev_model.axes import AXES
from maglev_model.parameters import ParameterError

PAGE = Path(__file__).resolve().parents[2] / 'docs' / 'library.md'


def test_every_name_is_there_and_documented() -> None:
    assert set(maglev.__all__) <= set(dir(maglev))
    for name in maglev.__all__:
        assert getattr(maglev, name).__doc__
    with pytest.raises(AttributeError, match="no attribute 'flay'"):
        _ = maglev.flay  # type: ignore[attr-defined]


def test_importing_it_costs_nothing() -> None:
    code = "import sys, maglev_study; print('numpy' in sys.modules, 'numba' in sys.modules)"
    found = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert found.stdout == 'False False\n'


def test_the_page_names_every_function() -> None:
    named = set(re.findall(r'`(?:maglev\.)?(\w+)\(', PAGE.read_text(encoding='utf-8')))
    functions = {name for name in maglev.__all__ if name[0].islower()}
    assert functions <= named


def test_the_examples_of_the_page_run() -> None:
    for library in ('control', 'gymnasium'):
        pytest.importorskip(library, reason=f'{library} comes with the test tools')
    blocks = re.findall('```python\n(.*?)```', PAGE.read_text(encoding='utf-8'), re.DOTALL)
    given: dict[str, Any] = {}
    for block in blocks:
        exec(block.replace('duration=20.0', 'duration=1.0'), given)
    assert 0.0 < given['flight'].mean_error['y'] < 1e-5
    assert given['stiffness'] > 1e8
    assert given['total'] > 1000.0


def test_simulate_runs_the_plant_under_a_function() -> None:
    plant = maglev.build(maglev.PlantParameters, {'initial.position': (0.025, 0.0, 0.0, 0.0, 0.0)})
    current = maglev.hover_currents(plant)
    run = maglev.simulate(lambda _: (current[:4], current[4:]), 0.02, plant=plant)
    assert run.state.shape == (21, 10)
    assert abs(run.state[-1, 0] - 0.025) < 2e-4


@pytest.mark.parametrize(
    ('call', 'error', 'why'),
    [
        (
            lambda: maglev.simulate(print, 1.0, plant={'seed': 1}),  # type: ignore[arg-type]
            TypeError,
            r"'plant' is a dict, it takes PlantParameters: maglev_model\.parameters\.build\(Plant",
        ),
        (
            lambda: maglev.simulate({'seed': 1}, 1.0),  # type: ignore[arg-type]
            TypeError,
            "'law' is a dict, it takes a function of the encoders' reading",
        ),
        (
            lambda: maglev.fly({'trajectory': 'ellipse'}),  # type: ignore[arg-type]
            TypeError,
            "'trajectory' is a dict, it takes a name such as 'ellipse'",
        ),
        (lambda: maglev.simulate(print, math.nan), ValueError, "'duration' is nan s"),
        (lambda: maglev.simulate(lambda _: ([0.0] * 4,) * 3, 1.0), ValueError, 'expected 2'),
        (
            lambda: maglev.fly('ellipse', plant=maglev.ControllerParameters()),  # type: ignore[arg-type]
            TypeError,
            "'plant' is a ControllerParameters, it takes PlantParameters, or a dict",
        ),
        (
            lambda: maglev.fly('ellipse', plant={'initial.position': (25.0, 0.0, 0.0, 0.0, 0.0)}),
            ParameterError,
            r'\[0\]. is 25, it must lie in \[-1, 1\] m, rad; if that is in mm, write 0\.025',
        ),
        (
            lambda: maglev.fly('sinusoids', reference={'sinusoids.y.amplitude': (5.0,)}),
            ParameterError,
            r'write 0\.005|it must lie in',
        ),
        (
            lambda: maglev.sweep('bandwidth', ()),
            ParameterError,
            r'one of plant\., controller\., re',
        ),
        (
            lambda: maglev.sweep('controller.y.bandwith', (100.0,)),
            ParameterError,
            "no parameter 'y.bandwith', did you mean 'y.bandwidth'",
        ),
        (
            lambda: maglev.sweep('plant.seed', (1,), plant=maglev.PlantParameters()),
            TypeError,
            "'plant' is swept over, so it takes a dict",
        ),
    ],
)
def test_what_is_not_meant_is_refused(call: Any, error: type[Exception], why: str) -> None:
    with pytest.raises(error, match=why):
        call()


def test_a_table_and_a_dict_of_it_fly_alike() -> None:
    given = {'seed': 3, 'encoder.gap_noise': 2e-6}
    by_name = maglev.fly('hold', duration=0.3, plant=given)
    table = maglev.fly('hold', duration=0.3, plant=maglev.build(maglev.PlantParameters, given))
    np.testing.assert_array_equal(by_name.run.state, table.run.state)


def test_a_sweep_flies_each_value_or_says_why_not() -> None:
    found = maglev.sweep(
        'controller.y.bandwidth',
        (80.0, 200.0, -1.0),
        'ellipse',
        duration=1.0,
        controller={'friction.adaptation_time': 0.0},
    )
    assert [each.value for each in found] == [80.0, 200.0, -1.0]
    slow, fast, refused = found
    assert fast.mean_error['y'] < slow.mean_error['y']
    for each in (slow, fast):
        assert each.reason == ''
        assert 0.0 <= each.saturated < 0.1
        assert all(each.mean_error[axis] <= each.largest_error[axis] for axis in AXES)
    assert "'y.bandwidth' is -1, it must lie in" in refused.reason
    assert math.isnan(refused.mean_error['y'])
    alone = maglev.fly(
        'ellipse',
        duration=1.0,
        controller={'friction.adaptation_time': 0.0, 'y.bandwidth': 80.0},
    )
    assert slow.mean_error == alone.mean_error


def test_a_batch_flies_machines_over_processes_as_one_by_one() -> None:
    machines = [
        {'offset.mass_y': 1.05},
        {'offset.mass_y': -1.0},
        maglev.build(maglev.PlantParameters, {'offset.K_h': 0.9}),
    ]
    given: dict[str, Any] = {'duration': 0.5, 'controller': {'y.bandwidth': 120.0}}
    alone = maglev.batch(machines, 'ellipse', jobs=1, **given)
    together = maglev.batch(machines, 'ellipse', jobs=2, **given)
    assert repr(together) == repr(alone)
    assert [each.value for each in together] == machines
    heavy, refused, weak = together
    assert "'offset.mass_y' is -1, it must lie in" in refused.reason
    for each, machine in ((heavy, machines[0]), (weak, machines[2])):
        assert each.reason == ''
        flight = maglev.fly('ellipse', plant=machine, **given)
        assert each.mean_error == flight.mean_error
    with pytest.raises(TypeError, match="'plant' is what the machines are"):
        maglev.batch(machines, plant={'seed': 1})


@pytest.mark.parametrize('jobs', [0, -1, 513, 1.5])
def test_jobs_out_of_bounds_are_refused_by_name(jobs: Any) -> None:
    words = re.escape(f"'jobs' is {jobs}, it must be a whole number from 1 to 512")
    with pytest.raises(ParameterError, match=words):
        maglev.sweep('controller.y.bandwidth', [100.0], 'hold', duration=0.1, jobs=jobs)
    with pytest.raises(ParameterError, match=words):
        maglev.batch([{}], 'hold', duration=0.1, jobs=jobs)
