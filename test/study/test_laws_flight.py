"""The control laws in flight on the benchmark plant, in the compiled loop and sample by sample."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from maglev_model.axes import THETA, X, Y
from maglev_model.parameters import replace
from maglev_study.closed_loop import run
from maglev_study.comparison.contestants import Contestant, find_contestants
from maglev_study.comparison.flight import Flight, judge
from maglev_study.references import HOVER, ellipse, held, shaped

PARAMS = Path(__file__).resolve().parents[2] / 'params'
LAWS = ('jacobian_lead_lag', 'feedback_lead_lag', 'feedback_soi', 'regulator_3dof')
FLOOR = np.array([0.031, 0.0, 0.0, 0.0, 0.0])


def contestant(name: str) -> Contestant:
    """A law as it is compared."""
    return find_contestants(PARAMS, [name])[0]


@pytest.mark.parametrize('name', LAWS)
def test_every_law_lifts_off_and_follows_the_ellipse(name: str) -> None:
    """From the lower stop, and then in 4DOF, or 3DOF with the tilts locked."""
    law = contestant(name)
    flight = Flight(law)
    flight.stage.arrays.state[0] = FLOOR[Y]
    lifted = run(flight.regulator, flight.stage, shaped(FLOOR, HOVER, 1.5, 4.0, flight.period))
    assert lifted.output[:, Y].min() > 0.0248
    assert abs(lifted.output[-1, Y] - 0.025) < 5e-5
    references = ellipse(10.0, 0.010 if law.tilts else 0.0, flight.period, grow=2.0)
    outcome = flight.follow(references)
    assert outcome is not None
    error = 1e6 * np.abs(outcome.output - references.position)[-4000:].mean(axis=0)
    bound = {'regulator_3dof': [40, 95, 85, 1e-9, 1e-9], 'jacobian_lead_lag': [30, 4, 4, 5, 40]}
    assert np.all(error < bound.get(name, [3, 4, 4, 2, 10]))
    assert law.tilts == (name != 'regulator_3dof')


@pytest.mark.parametrize('name', LAWS)
def test_integral_action_takes_constant_forces_away(name: str) -> None:
    """10 N on every displacement: all but gone at rest, where loops are fast."""
    flight = Flight(contestant(name), disturbance__constant=(10.0, 10.0, 10.0, 0.0, 0.0))
    outcome = flight.follow(held(HOVER, 6.0, flight.period))
    assert outcome is not None
    bound = 6e-5 if name == 'regulator_3dof' else 1.5e-5
    assert np.abs(outcome.output[-1000:, :3] - HOVER[:3]).max() < bound


@pytest.mark.parametrize('axis', [Y, X, THETA])
def test_feedback_linearisation_makes_small_steps_alike_at_any_gap(axis: int) -> None:
    """On the ideal plant a small step is the linear loop's, at 20 mm as at 29 mm."""
    law = contestant('feedback_lead_lag')
    ideal: dict[str, object] = {
        'guide__coulomb': (0.0,) * 5,
        'guide__viscous': (0.0,) * 5,
        'encoder__gap_resolution': 0.0,
        'encoder__horizontal_resolution': 0.0,
        'amplifier__bandwidth': 0.0,
    }
    responses = []
    for gap in (0.020, 0.029):
        start = HOVER.copy()
        start[Y] = gap
        target = start.copy()
        target[axis] += 2e-5
        flight = Flight(law, **ideal)
        assert flight.approach(start, 1.0, 2.0)
        outcome = flight.step(start, target, 0.0, 0.2)
        assert outcome is not None
        responses.append((outcome.output[:, axis] - start[axis]) / 2e-5)
    np.testing.assert_allclose(responses[0], responses[1], atol=0.02)
    assert 1.1 < responses[0].max() < 1.6


def test_jacobian_linearisation_is_local() -> None:
    """A raw step of 1 mm loses the platen; feedback linearisation of the same bandwidth holds it.

    Small ones are held everywhere that is reached smoothly.
    """
    for name, gap, size, survives in (
        ('jacobian_lead_lag', 0.025, 1e-3, False),
        ('feedback_lead_lag', 0.025, 1e-3, True),
        ('jacobian_lead_lag', 0.025, 1e-4, True),
        ('jacobian_lead_lag', 0.021, 1e-4, True),
    ):
        start = HOVER.copy()
        start[Y] = gap
        target = start.copy()
        target[Y] += size
        flight = Flight(contestant(name))
        assert flight.approach(start, 2.0, 2.0)
        assert (flight.step(start, target, 0.0, 2.0) is not None) == survives


def test_antiwindup_lets_the_integrator_go() -> None:
    """A force beyond reach for half a second: back in place at once with it, later without."""
    law = contestant('feedback_lead_lag')
    times = {}
    for kind in ('observer', 'none'):
        changed = replace(law.controller, {'internal_model.antiwindup': kind})
        flight = Flight(Contestant(kind, changed, law.plant))
        assert flight.approach(HOVER, 0.5, 1.0)
        target = HOVER.copy()
        target[Y] = 0.0265
        outcome = flight.step(HOVER, target, 0.0, 3.0)
        assert outcome is not None
        assert outcome.saturated.any()
        times[kind] = judge(outcome.output[:, Y], 0.025, 0.0265, 1e-4, flight.period)
    assert times['observer'].settling < 0.3
    assert times['observer'].overshoot < times['none'].overshoot


@pytest.mark.parametrize('name', ['jacobian_lead_lag', 'feedback_soi'])
def test_sample_by_sample_as_in_the_compiled_loop(name: str) -> None:
    """The node's way of stepping, bit for bit."""
    law = contestant(name)
    first = Flight(law)
    references = ellipse(0.6, 0.010, first.period, grow=2.0)
    outcome = first.follow(references)
    assert outcome is not None
    second = Flight(law)
    direct, quadrature = np.zeros(4), np.zeros(4)
    for k, reference in enumerate(zip(*references, strict=True)):
        sample = second.stage.read()
        np.testing.assert_array_equal(second.stage.state, outcome.state[k])
        second.regulator.step(*sample, *reference, direct, quadrature)
        np.testing.assert_array_equal(direct, outcome.direct_current[k])
        np.testing.assert_array_equal(quadrature, outcome.quadrature_current[k])
        second.stage.write(direct, quadrature)
