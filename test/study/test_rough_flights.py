"""Flights on the rough plant as a library, and its figures."""

from __future__ import annotations

import math

import numpy as np
import pytest
from rough import PARAMS

from maglev_controller.parameters import ControllerParameters
from maglev_model.axes import X
from maglev_model.parameters import from_yaml, replace
from maglev_monitor.metrics.repeatability import repeatability
from maglev_study.references import HOVER, ellipse, held, scan
from maglev_study.rough_flights import (
    FRICTIONS,
    Experiment,
    experiments,
    fly_rough,
    laws,
    machines,
    plant_of,
    positioning,
)


def test_a_scan_goes_to_and_fro_at_its_speed_and_its_derivatives_fit() -> None:
    way, speed = np.array([1e-3, 5e-3, 0.0, 0.0, 0.0]), np.array([1e-3, 5e-3, 0.0, 0.0, 0.0])
    course = scan(way, speed, 2, 1e-3)
    position, velocity, acceleration = course
    assert position[0] == pytest.approx(HOVER - way)
    assert np.ptp(position, axis=0) == pytest.approx(2.0 * way, rel=1e-3, abs=1e-15)
    assert np.gradient(position[:, X], 1e-3)[2:-2] == pytest.approx(velocity[2:-2, X], abs=2e-4)
    found = np.gradient(velocity[:, X], 1e-3)[2:-2]
    assert found == pytest.approx(acceleration[2:-2, X], abs=2e-3)
    middle = np.abs(velocity[len(velocity) // 8, :2])
    assert np.all(middle >= speed[:2])
    assert np.all(middle <= 1.2 * speed[:2])


def test_the_three_positions_are_told_apart() -> None:
    """A zero a third of a count off, on every encoder: invisible to the loop, not to the truth."""
    plant = plant_of(PARAMS, effects__sensor__phase=(1.0 / 3.0,) * 6)
    experiment = Experiment('hold', held(HOVER, 2.0, 1e-3), 1.0)
    outcome = fly_rough(plant, laws(PARAMS)['default law'], experiment)
    assert outcome.true is not None
    assert outcome.own is not None
    assert outcome.measured is not None
    assert outcome.true.bias[:3] - outcome.own.bias[:3] == pytest.approx(-10e-6 / 3.0, abs=1e-9)
    plain = fly_rough(plant_of(PARAMS), laws(PARAMS)['default law'], experiment)
    assert plain.true is not None
    assert plain.own is not None
    assert plain.true.mean == pytest.approx(plain.own.mean, abs=1e-12)


def test_the_default_law_flies_the_rough_plant() -> None:
    rough, law = plant_of(PARAMS, 'rough'), laws(PARAMS, 'rough')['default law']
    assert law.input_delay == 1
    found = next(experiments(1e-3))
    short = Experiment(
        found.name, type(found.references)(*(a[:6000] for a in found.references)), 2.0
    )
    outcome = fly_rough(rough, law, short)
    assert not outcome.lost
    assert outcome.own is not None
    assert np.all(outcome.own.mean < [4e-6, 4e-6, 4e-6, 15e-6, 15e-6])


def test_holds_are_nearer_where_less_is_learned_within_a_count() -> None:
    """Near the middle of a count of x, the farthest from its edges, on every friction."""
    law = laws(PARAMS, 'rough')['default law']
    whole = replace(law, {'internal_model.within_count': 1.0})
    *_, last = experiments(1e-3, hold=6.0)
    assert abs(math.remainder(last.references.position[-1, X], 1e-5)) < 5e-7
    found = {law: [], whole: []}
    for plant in machines(PARAMS, len(FRICTIONS)):
        for flown, errors in found.items():
            own = fly_rough(plant, flown, last).own
            assert own is not None
            errors.append(own.rms)
    rms = np.array(found[law])
    assert np.all(rms < [3.5e-6, 3.5e-6, 3.5e-6, 15e-6, 15e-6])
    assert np.mean(rms[:, X]) < 0.9 * np.mean(np.array(found[whole])[:, X])


def test_machines_that_are_drawn_differ_and_are_the_same_again() -> None:
    first, again = list(machines(PARAMS, 4)), list(machines(PARAMS, 4))
    assert first == again
    assert [plant.effects.friction.model for plant in first] == [
        'lugre',
        'coulomb',
        'tanh',
        'lugre',
    ]
    aside = [(plant.effects.balance.aside_x, plant.effects.balance.aside_z) for plant in first]
    assert np.hypot(*np.array(aside).T) == pytest.approx(0.002)
    assert len({*aside}) == len({plant.seed for plant in first}) == 4


def test_a_platen_that_is_lost_is_said_to_be() -> None:
    """A mode that the law does not know, of gain -1 and 1 % damping at 60 Hz."""
    plant = plant_of(
        PARAMS,
        effects__modes__axis=('y',),
        effects__modes__frequency=(60.0,),
        effects__modes__damping=(0.01,),
        effects__modes__gain=(-1.0,),
    )
    experiment = Experiment('hold', held(HOVER, 3.0, 1e-3), 1.0)
    assert fly_rough(plant, laws(PARAMS)['default law'], experiment).lost


def test_repeatability_is_iso_230_2_s() -> None:
    """Two targets, worked by hand."""
    upward = np.array([[1.0, 3.0, 2.0], [0.0, 0.0, 0.0]])
    downward = np.array([[5.0, 5.0, 5.0], [1.0, -1.0, 0.0]])
    found = repeatability(upward, downward)
    assert found.reversal == 3.0
    assert found.bidirectional == pytest.approx(2.0 * 1.0 + 3.0)
    assert found.bias == pytest.approx(3.5)
    assert found.three_sigma == pytest.approx(3.0)
    assert found.accuracy == pytest.approx(5.0 - (-2.0))
    with pytest.raises(ValueError, match='one shape'):
        repeatability(upward, downward[:1])


def test_positioning_finds_what_the_scale_hides() -> None:
    plant = plant_of(PARAMS, effects__sensor__scale=(0.0,) * 4 + (1e-3, 0.0))
    found = positioning(plant, laws(PARAMS)['default law'], X, rounds=2)
    assert found is not None
    assert found['true'].bias == pytest.approx(1e-3 * 0.8 * 0.02, abs=4e-6)
    assert found['own'].bias < 4e-6


def test_without_guides_nanometres_are_left() -> None:
    """``contactless.yaml`` as it stands: the ellipse within a count of its sensors in the mean."""
    table = from_yaml(ControllerParameters, 'controller', PARAMS / 'contactless.yaml')
    experiment = Experiment('ellipse', ellipse(10.0, 0.010, 1e-3, grow=2.0), 3.0)
    found = fly_rough(plant_of(PARAMS, 'contactless'), table, experiment).true
    assert found is not None
    assert np.all(1e9 * found.mean < [8.0, 8.0, 8.0, 25.0, 25.0])
