"""Moves as fast as currents, voltage and levitation allow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.axes import FloatArray
from maglev_model.contract.phases import Phase
from maglev_model.parameters import from_yaml, replace
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_reference.check import UnreachableError, utilisation
from maglev_reference.currents import current_utilisation, motor_currents
from maglev_reference.fastest import Fastest
from maglev_reference.motion import Kinematics
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.timeline import Timeline
from maglev_reference.voltages import voltage_amplitudes
from maglev_reference.waypoints import Waypoints
from maglev_study.closed_loop import run
from maglev_study.references import HOVER, References, held, joined
from maglev_study.rough_flights import plant_of

PARAMS = Path(__file__).resolve().parents[2] / 'params'
FILES = (PARAMS / 'controller.yaml', PARAMS / 'fastest.yaml')
PERIOD = 1e-3
MOVES = {
    'y': ((0.020, 0.0, 0.0, 0.0, 0.0), (0.027, 0.0, 0.0, 0.0, 0.0)),
    'x': (tuple(HOVER), (0.025, 0.03, 0.0, 0.0, 0.0)),
    'z': (tuple(HOVER), (0.025, 0.0, 0.03, 0.0, 0.0)),
    'theta': (tuple(HOVER), (0.025, 0.0, 0.0, 0.0, 0.010)),
    'all': ((0.020, 0.0, 0.0, 0.0, 0.0), (0.027, 0.03, 0.03, 0.003, 0.010)),
}
# reached within a count (20 µrad) and staying there [s]; what the model alone would take is
# printed by benchmarks/steps.py
TIMES = {'y': 0.06, 'x': 0.125, 'z': 0.115, 'theta': 0.040, 'all': 0.15}
BOUND = np.array([1e-5, 1e-5, 1e-5, 2e-5, 2e-5])


def parameters(**values: object) -> ReferenceParameters:
    named = {name.replace('__', '.'): value for name, value in values.items()}
    return replace(from_yaml(ReferenceParameters, 'reference', *FILES), named)


def sampled(move: Fastest, faster: float = 1.0) -> Kinematics:
    """The samples of a move, or of the same in less time."""
    time = np.arange(0.0, move.duration + 2 * PERIOD, PERIOD)
    position, velocity, acceleration = move.evaluate(time)
    return Kinematics(position, faster * velocity, faster**2 * acceleration)


@pytest.mark.parametrize('name', MOVES)
def test_a_move_is_within_limits_and_hardly_faster_is_not(name: str) -> None:
    table = parameters()
    start, target = (np.array(end) for end in MOVES[name])
    move = Fastest(start, target, table)
    samples = sampled(move)
    used = max(utilisation(samples, table), current_utilisation(samples, table))
    assert used <= 1.0 + 1e-6
    assert current_utilisation(sampled(move, 1.2), table) > 1.0
    np.testing.assert_allclose(samples.position[0], start, atol=1e-15)
    assert not samples.velocity[0].any()
    np.testing.assert_array_equal(samples.position[-1], target)
    assert not samples.velocity[-1].any()
    assert not samples.acceleration[-1].any()
    # what a sample's acceleration makes of its velocity is the next one's
    after = samples.velocity[:-1] + PERIOD * samples.acceleration[:-1]
    np.testing.assert_allclose(after, samples.velocity[1:], atol=1e-9)
    middle = 0.5 * (samples.velocity[1:] + samples.velocity[:-1])
    np.testing.assert_allclose(
        np.diff(samples.position, axis=0) / PERIOD, middle, atol=5e-3 * np.abs(middle).max()
    )


@pytest.mark.parametrize('name', MOVES)
def test_the_platen_arrives_with_it(name: str) -> None:
    """On the benchmark plant: within a count for good, no more than 1 % beyond."""
    start, target = (np.array(end) for end in MOVES[name])
    move = Fastest(start, target, parameters())
    references = References(*move.evaluate(np.arange(0.0, 0.6, PERIOD)))
    plant = from_yaml(PlantParameters, 'plant', PARAMS / 'machine.yaml', PARAMS / 'benchmark.yaml')
    stage = SimulatedStage(replace(plant, {'initial.position': tuple(start)}))
    law = Regulator(from_yaml(ControllerParameters, 'controller', *FILES))
    output = run(law, stage, joined(held(start, 2.0, PERIOD), references)).output[2000:]
    outside = np.flatnonzero(np.any(np.abs(output - target) > BOUND, axis=1))
    assert PERIOD * (outside[-1] + 1) < TIMES[name]
    assert overshoot(output, start, target) < 0.01


def overshoot(output: FloatArray, start: FloatArray, target: FloatArray) -> float:
    """How far any output goes beyond its target, by the way it has."""
    moving = target != start
    return float(np.max((output - target)[:, moving] / (target - start)[moving]))


@pytest.mark.parametrize('name', MOVES)
def test_on_the_rough_plant_it_keeps_within_what_its_voltage_gives(name: str) -> None:
    files = (FILES[0], PARAMS / 'rough.yaml', FILES[1])
    start, target = (np.array(end) for end in MOVES[name])
    move = Fastest(start, target, from_yaml(ReferenceParameters, 'reference', *files))
    references = References(*move.evaluate(np.arange(0.0, 0.6, PERIOD)))
    stage = SimulatedStage(
        replace(plant_of(PARAMS, 'rough'), {'initial.position': tuple(start)}),
    )
    law = Regulator(from_yaml(ControllerParameters, 'controller', *files))
    own = run(law, stage, joined(held(start, 2.0, PERIOD), references)).own[2000:]
    assert overshoot(own, start, target) < 0.005
    assert np.all(np.abs(own[400:] - target) < BOUND)


def test_the_voltage_makes_it_longer() -> None:
    start, target = (np.array(end) for end in MOVES['theta'])
    free, bound = Fastest(start, target, parameters()), parameters(limits__voltage=28.0)
    within = Fastest(start, target, bound)
    assert voltage_amplitudes(sampled(free), bound).max() > 28.0
    assert voltage_amplitudes(sampled(within), bound).max() <= 28.0
    assert within.duration > free.duration


@pytest.mark.parametrize('name', MOVES)
def test_a_low_voltage_is_kept_too(name: str) -> None:
    bound = parameters(limits__voltage=6.0)
    move = Fastest(*(np.array(end) for end in MOVES[name]), bound)
    assert voltage_amplitudes(sampled(move), bound).max() <= 6.0


def test_a_voltage_that_holding_takes_is_refused() -> None:
    start, target = (np.array(end) for end in MOVES['y'])
    with pytest.raises(UnreachableError, match=r'4\.51 V, .* at most 4 V \(limits\.voltage\)'):
        Fastest(start, target, parameters(limits__voltage=4.0))


def test_voltages_by_hand() -> None:
    """At rest R i; where only a gap's rate differs, the EMF of the magnets and L' i as well."""
    table = parameters()
    still = Kinematics(np.tile(HOVER, (3, 1)), np.zeros((3, 5)), np.zeros((3, 5)))
    direct, quadrature, _ = motor_currents(still, table)
    np.testing.assert_allclose(
        voltage_amplitudes(still, table), 4.0 * np.hypot(direct, quadrature)[1:], rtol=1e-9
    )


def test_no_inductance_is_negative_however_far_the_stop() -> None:
    """5 mm beyond gap_max K_v3 would take 17 mH away; a tenth of what is given is left."""
    table = parameters(limits__inductance=5e-3, limits__resistance=0.0)
    far, pushed = np.tile(HOVER, (9, 1)), np.zeros((9, 5))
    far[:, 0] = table.machine.gap_max + 5e-3
    pushed[:, 1] = np.linspace(0.0, 1.0, 9)
    samples = Kinematics(far, np.zeros((9, 5)), pushed)
    direct, quadrature, _ = motor_currents(samples, table)
    slope = np.hypot(np.diff(direct, axis=0), np.diff(quadrature, axis=0)) / table.sample_time
    np.testing.assert_allclose(voltage_amplitudes(samples, table), 5e-4 * slope, rtol=1e-9)


def test_steps_and_waypoints_take_the_profile() -> None:
    for name, given in (
        ('steps', {'steps__settle': 0.1}),
        ('waypoints', {'waypoints__x': (0.0, 0.03), 'waypoints__dwell': 0.1}),
    ):
        table = parameters(trajectory=name, duration=0.5, run_in=0.0, **given)
        timeline = Timeline(table)
        measured = next(s for s in timeline.segments if s.phase in (1, 3, 4) and s.samples == 500)
        block = timeline.block(measured.first, 400)
        moved = np.flatnonzero(np.abs(np.diff(block.position, axis=0)).max(axis=1) > 0.0)
        assert len(moved) * PERIOD < 0.125


def test_a_step_of_no_way_stands() -> None:
    still = {'steps__start': (0.022,), 'steps__target': (0.022,)}
    timeline = Timeline(parameters(trajectory='steps', duration=0.5, **still))
    (step,) = (each for each in timeline.segments if each.phase == Phase.STEP)
    block = timeline.block(step.first, 500)
    np.testing.assert_array_equal(block.position[:, 0], 0.022)
    assert not block.velocity.any()


@pytest.mark.parametrize('repeat', [False, True])
@pytest.mark.parametrize(
    'x', [(0.0,), (0.0, 0.0, 0.01), (0.0, 0.01, 0.01, 0.0), (0.0, 0.01, 0.0, 0.0)]
)
def test_it_rests_at_every_waypoint(x: tuple[float, ...], repeat: bool) -> None:
    """At one that is given twice, twice, as at any other profile's."""
    still = {f'waypoints__{axis}': (0.0,) * len(x) for axis in ('z', 'phi', 'theta')}
    given = {'waypoints__y': (0.025,) * len(x), 'waypoints__x': x, 'waypoints__repeat': repeat}
    table = parameters(**still, **given, waypoints__dwell=0.5)
    stood = []
    for profile in ('fastest', 'minimum_jerk'):
        motion = Waypoints(replace(table, {'waypoints.profile': profile}))
        moved = motion.evaluate(np.arange(0.0, motion.length, PERIOD))
        stood.append(int(np.sum(~moved.velocity.any(axis=1))))
    assert stood[0] == pytest.approx(stood[1], abs=2 * len(x))
