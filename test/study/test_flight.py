"""A whole flight in one call."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from maglev_model.axes import AXES, THETA, X, Y, Z
from maglev_model.contract.phases import Phase
from maglev_model.parameters import ParameterError, read_yaml, replace
from maglev_reference.parameters import ReferenceParameters
from maglev_study.flight import ELLIPSE, ELLIPSE_4DOF, FlightRecord, fly

PARAMS = Path(__file__).resolve().parents[2] / 'params'


@pytest.fixture(scope='module')
def ellipse() -> FlightRecord:
    return fly('ellipse', duration=10.0)


def test_the_ellipse(ellipse: FlightRecord) -> None:
    mean = [1e6 * ellipse.mean_error[axis] for axis in AXES]
    assert mean[:3] == pytest.approx([1.24, 1.25, 1.24], abs=0.05)
    assert mean[3:] == pytest.approx([0.0, 0.0], abs=1e-6)


def test_from_the_lower_stop_and_back(ellipse: FlightRecord) -> None:
    assert (ellipse.phase[0], ellipse.phase[-1]) == (Phase.REST, Phase.END)
    assert ellipse.output[[0, -1], Y] == pytest.approx(0.031, abs=1e-5)  # a count
    assert ellipse.time[[0, 1, -1]] == pytest.approx([0.0, 0.001, 0.001 * (ellipse.time.size - 1)])
    assert np.count_nonzero(ellipse.measured) == 10_000
    assert np.ptp(ellipse.output[ellipse.measured], axis=0)[:3] == pytest.approx(
        [0.01, 0.06, 0.06], abs=1e-4
    )


@pytest.mark.parametrize(
    ('name', 'known'),
    [('scenario_ellipse.yaml', ELLIPSE), ('scenario_ellipse_4dof.yaml', ELLIPSE_4DOF)],
)
def test_the_ellipses_are_the_scenarios(name: str, known: dict[str, object]) -> None:
    default = ReferenceParameters()
    assert replace(default, known) == replace(default, read_yaml(PARAMS / name, 'reference'))


def test_steps_are_measured() -> None:
    flown = fly('steps', duration=1.0)
    assert set(flown.phase[flown.measured]) == {Phase.STEP}
    assert flown.reference.position[flown.measured][-1, Y] == pytest.approx(0.027)


def test_a_frequency_is_given_once() -> None:
    """To the controller's internal models, and what is flown follows them."""
    once = {'internal_model.fundamental': 6.0}
    flown = fly('circle', duration=0.5, controller=once, reference={'run_in': 0.0})
    velocity = flown.reference.velocity[flown.measured]
    assert np.hypot(velocity[:, X], velocity[:, Z]) == pytest.approx(0.03 * 6.0)
    assert flown.mean_error['x'] < 1e-5


def test_files_and_names(tmp_path: Path) -> None:
    """Each node takes its own sections; a name wins over a file, a file over the default."""
    overlay = tmp_path / 'overlay.yaml'
    overlay.write_text(
        'plant: {ros__parameters: {initial: {position: [0.031, 0.001, 0.0, 0.0, 0.0]}}}\n'
        'controller: {ros__parameters: {machine: {mass_y: 7.0}}}\n'
        'reference: {ros__parameters: {trajectory: circle, run_in: 0.0, duration: 1.0}}\n'
    )
    lifted = fly(files=[overlay], reference={'duration': 0.5, 'trajectory': 'hold'})
    assert np.count_nonzero(lifted.measured) == 500
    assert np.ptp(lifted.reference.position[lifted.measured]) == pytest.approx(0.025)
    assert lifted.output[0, 1] == 0.001
    heavier = fly('hold', duration=0.5, files=[overlay], controller={'machine.mass_y': 6.9})
    assert np.ptp(heavier.run.direct_current - lifted.run.direct_current) > 0.0
    assert np.abs(heavier.error[heavier.measured]).max() < 1e-3


def test_rotated(ellipse: FlightRecord) -> None:
    flown = fly('ellipse_4dof', duration=2.0, reference={'run_in': 4.0})
    assert np.ptp(flown.output[flown.measured, THETA]) == pytest.approx(0.02, abs=1e-4)
    assert ellipse.output[:, THETA] == pytest.approx(0.0, abs=1e-9)


def test_what_is_wrong_is_named() -> None:
    with pytest.raises(ParameterError, match="'trajectory' is 'elipse', it must be one of ellipse"):
        fly('elipse')
    with pytest.raises(ParameterError, match=r"no parameter 'encoder.gap_noize'"):
        fly('ellipse', plant={'encoder.gap_noize': 1e-6})
    with pytest.raises(ParameterError, match=r"'sample_time' of the plant is 0.002 s, the ref"):
        fly('ellipse', plant={'sample_time': 0.002})
    with pytest.raises(ParameterError, match='unreachable reference'):
        fly('ellipse', reference={'sinusoids.x.amplitude': [0.05], 'limits.upper': [0.031] * 5})
    for files in ('missing.yaml', Path('missing.yaml'), ['missing.yaml']):
        with pytest.raises(ParameterError, match=r"cannot read parameter file 'missing\.yaml'"):
            fly('ellipse', files=files)
