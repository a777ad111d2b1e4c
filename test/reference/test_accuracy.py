"""What error is expected, against the closed loop; and every trajectory's error on that loop."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from maglev_controller.design.axis_design import controller_system
from maglev_controller.design.state_space import plant_system, response
from maglev_controller.laws import control_law
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.axes import AXES
from maglev_model.contract.phases import Phase
from maglev_model.parameters import ParameterError, build, from_yaml, read_yaml, replace
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_reference import match
from maglev_reference.accuracy import compliance, expected_error, harmonics, summary, warnings
from maglev_reference.parameters import TRAJECTORIES, ReferenceParameters
from maglev_reference.timeline import Timeline
from maglev_reference.trajectories import course
from maglev_study.closed_loop import run
from maglev_study.references import References

PARAMS = Path(__file__).resolve().parents[2] / 'params'
OMEGA_0 = 1.5 * math.pi
HOVER = np.array([0.025, 0.0, 0.0, 0.0, 0.0])
SCENARIOS = (
    *('circle', 'helix', 'lissajous', 'sinusoids', 'point_to_point', 'waypoints', 'square'),
    *('chirp', 'file'),
)
MATCHED = ('circle', 'helix', 'lissajous', 'waypoints', 'square')


WITHOUT_FRICTION_AHEAD = {'friction.adaptation_time': 0.0}
"""What is expected is the error without, so it is an upper bound with it."""


def tables(*names, **overrides):
    """Reference and controller parameters from overlays of params/."""
    paths = [PARAMS / f'{name}.yaml' for name in names]
    reference = from_yaml(ReferenceParameters, 'reference', *paths)
    changes = {name.replace('__', '.'): value for name, value in overrides.items()}
    if reference.trajectory == 'file':
        changes['file.path'] = str(PARAMS / 'figure_of_eight.csv')
    controller = from_yaml(ControllerParameters, 'controller', *paths)
    return replace(reference, changes), replace(controller, WITHOUT_FRICTION_AHEAD)


def tracked(reference, controller):
    """Mean and rms error (5,) [um, urad] in the tracking window on the benchmark plant."""
    timeline = Timeline(reference)
    segments = timeline.segments
    first = next(segment for segment in segments if segment.phase == Phase.HOLD).first
    last = next(segment for segment in segments if segment.phase == Phase.TRACK).last
    block = timeline.block(first, last - first + 1)
    plant = read_yaml(PARAMS / 'benchmark.yaml', 'plant')
    plant['initial.position'] = tuple(block.position[0])
    outcome = run(
        Regulator(controller),
        SimulatedStage(build(PlantParameters, plant)),
        References(block.position, block.velocity, block.acceleration),
    )
    error = 1e6 * (outcome.output - block.position)[block.phase == Phase.TRACK]
    return np.abs(error).mean(axis=0), np.sqrt((error**2).mean(axis=0))


@pytest.mark.parametrize('name', SCENARIOS)
def test_every_trajectory_is_tracked_at_moderate_speed(name):
    reference, controller = tables(f'scenario_{name}', duration=12.0)
    if name == 'chirp':
        reference, controller = tables(f'scenario_{name}', chirp__time=12.0, duration=12.0)
    timeline = Timeline(reference)
    track = next(segment for segment in timeline.segments if segment.phase == Phase.TRACK)
    block = timeline.block(track.first, track.samples)
    linear = slice(0, 3)
    assert np.abs(block.velocity[:, linear]).max() <= 0.2 + 1e-9
    assert np.abs(block.acceleration[:, linear]).max() <= 2.0 + 1e-9
    assert np.abs(block.velocity[:, 1:3]).max() > 0.03
    mean, rms = tracked(reference, controller)
    assert mean[linear].max() <= 5.0
    assert mean[3:].max() <= 20.0
    expected = 1e6 * expected_error(course(reference), reference)
    resolution = np.array([4.0, 4.0, 4.0, 12.0, 12.0])
    assert (rms <= 1.3 * expected + resolution).all()
    assert (expected <= 1.3 * rms + 0.5).all()


@pytest.mark.parametrize('name', MATCHED)
def test_a_matching_internal_model_brings_it_to_the_figures_of_the_ellipse(name):
    plain, default = tables(f'scenario_{name}', duration=12.0)
    reference, controller = tables(f'scenario_{name}', f'matched_{name}', duration=12.0)
    better = expected_error(course(reference), reference)
    before = expected_error(course(plain), plain)
    moving = before > 1e-9
    # 0.9: the default's integrator leaves only high harmonics, few of which may be held
    assert (better[moving] < 0.9 * before[moving]).all()
    mean, _ = tracked(reference, controller)
    bound = np.array([1.5, 1.6, 1.6, 8.0, 8.0])
    if name == 'waypoints':
        bound[:3] = 3.5  # it rests half of the time, where the encoders' resolution shows
    assert (mean[moving] <= bound[moving]).all()
    assert (mean <= tracked(plain, default)[0] + 0.2).all()


@pytest.mark.parametrize('name', MATCHED)
def test_the_matching_overlays_are_what_the_tool_gives(name, capsys):
    assert match.run([str(PARAMS / f'scenario_{name}.yaml')]) == 0
    text = capsys.readouterr().out
    given = yaml.safe_load((PARAMS / f'matched_{name}.yaml').read_text(encoding='utf-8'))
    found = yaml.safe_load(text)
    values, wanted = (content['/**']['ros__parameters'] for content in (found, given))
    frequency = values['internal_model'].pop('fundamental')
    assert frequency == pytest.approx(wanted['internal_model'].pop('fundamental'), rel=1e-12)
    assert values == wanted
    assert set(found) == set(given) == {'/**'}


def test_a_file_is_matched_as_its_scenario_is(capsys):
    path = str(PARAMS / 'figure_of_eight.csv')
    assert match.run([path]) == 0
    fundamental = yaml.safe_load(capsys.readouterr().out)['/**']['ros__parameters'][
        'internal_model'
    ]
    given = from_yaml(ReferenceParameters, 'reference', PARAMS / 'scenario_file.yaml')
    period = course(replace(given, {'file.path': path})).period
    assert fundamental == {'fundamental': 2.0 * math.pi / period}


def test_each_axis_has_its_own_loop():
    reference, _ = tables('scenario_circle')
    quick, _ = tables('scenario_circle', x__learning=30.0)
    wide, _ = tables('scenario_circle', x__bandwidth=400.0)
    expected, better, best = (
        expected_error(course(table), table) for table in (reference, quick, wide)
    )
    assert better[1] < 0.9 * expected[1]
    assert best[1] < 0.3 * expected[1]
    for other in (better, best):
        assert np.delete(other, 1).tolist() == np.delete(expected, 1).tolist()


def test_what_is_matched_keeps_within_count_and_total():
    reference, _ = tables('scenario_circle')
    frequency, found = match.matched(reference, count=3, total=1000.0)
    assert {len(multiples) for multiples in found.values()} == {4}
    frequency, found = match.matched(reference, count=50, total=60.0)
    for multiples in found.values():
        assert len(multiples) > 1
        assert frequency * sum(multiples) <= 60.0


def test_what_does_not_repeat_cannot_be_matched(capsys, tmp_path):
    assert match.run([str(PARAMS / 'scenario_chirp.yaml')]) == 2
    assert "trajectory 'chirp' does not repeat" in capsys.readouterr().err
    assert match.run([str(tmp_path / 'none.yaml')]) == 2
    assert 'cannot read' in capsys.readouterr().err
    with pytest.raises(ParameterError, match="'steps' does not repeat"):
        match.matched(tables('scenario_steps')[0])


@pytest.mark.parametrize('frequency', [2.0, 7.0, 40.0, 100.0, 300.0])
def test_the_compliance_is_the_closed_loops(frequency):
    mass, force = 10.6, 8.0
    plant = {
        **read_yaml(PARAMS / 'ideal.yaml', 'plant'),
        'initial.position': tuple(HOVER),
        'disturbance.amplitude': (0.0, force, 0.0, 0.0, 0.0),
        'disturbance.frequency': (0.0, frequency / (2.0 * math.pi), 0.0, 0.0, 0.0),
    }
    count = 12000
    still = References(np.tile(HOVER, (count, 1)), np.zeros((count, 5)), np.zeros((count, 5)))
    outcome = run(
        Regulator(build(ControllerParameters, {'internal_model.rest': 'hold'})),
        SimulatedStage(build(PlantParameters, plant)),
        still,
    )
    error = outcome.output[-6000:, 1]
    table = ReferenceParameters()
    held, sampling = table.held_frequencies[1], table.internal_model.sampling
    wanted = compliance(np.array([frequency]), held, table.x, sampling)
    found = math.sqrt(2.0) * error.std() / (force / mass)
    assert found == pytest.approx(wanted[0], rel=0.25)


@pytest.mark.parametrize('axis', ['y', 'x', 'phi'])
def test_the_compliance_is_the_sampled_loops_but_where_oscillators_are_turned(axis):
    omega = np.geomspace(0.3, 600.0, 2000)
    table, z = ReferenceParameters(), np.exp(1e-3j * omega)
    held = table.held_frequencies[AXES.index(axis)]
    told = compliance(omega, held, getattr(table, axis), table.internal_model.sampling)
    plant = response(plant_system(1e-3), z)
    share = {}
    for rest in ('hold', 'fade'):
        law = build(ControllerParameters, {'internal_model.rest': rest})
        loop = response(controller_system(control_law(law).design(law, axis), 1e-3, 0), z)
        share[rest] = np.abs(plant / (1.0 - plant * loop)) / told
    assert np.all(np.abs(share['hold'] - 1.0) < 0.2)
    assert np.all((share['fade'] > 0.5) & (share['fade'] < 2.6))
    beyond = (omega > 1.02 * max(held)) & (omega < 2.9 * max(held))
    assert np.all(share['fade'][beyond] < 0.85)
    assert np.all(np.abs(share['fade'][omega > 3.2 * max(held)] - 1.0) < 0.2)


def test_a_held_frequency_leaves_nothing_and_a_constant_neither():
    table = ReferenceParameters().x
    found = compliance(np.array([0.0, OMEGA_0, 3.0]), (0.0, OMEGA_0), table, 2.05)
    assert found[:2].tolist() == [0.0, 0.0]
    assert 1e-6 < found[2] < 1.0 / table.bandwidth**2


def test_the_internal_model_is_the_controllers():
    reference, controller = ReferenceParameters(), ControllerParameters()
    assert reference.internal_model.fundamental == controller.internal_model.fundamental
    for loop, axis in zip(reference.loops, controller.axes, strict=True):
        assert axis.design == 'bandwidth'
        for name in ('multiples', 'bandwidth', 'integration', 'learning'):
            assert getattr(axis, name) == getattr(loop, name)


def test_the_ellipse_is_held():
    reference, _ = tables('scenario_ellipse_4dof')
    assert warnings(reference) == []
    lines = harmonics(course(reference))
    assert lines == ((OMEGA_0,), (OMEGA_0,), (OMEGA_0,), (), (OMEGA_0,))
    assert warnings(tables('scenario_steps')[0]) == []
    assert summary(tables('scenario_steps')[0]) == []
    [line] = summary(reference)
    assert 'x 1.3 um' in line
    assert 'phi 0.0 urad' in line


def test_a_frequency_that_is_not_held_is_named_with_the_error():
    *found, offer = warnings(tables('scenario_circle')[0])
    assert len(found) == 2
    assert 'ros2 run maglev_reference match' in offer
    assert found[0].startswith('the internal model of x does not hold 5 rad/s: expected error 1.')
    assert found[0].endswith('um rms')
    assert ' of z ' in found[1]
    assert warnings(tables('scenario_circle', 'matched_circle')[0]) == []


def test_the_harmonics_of_a_square_are_odd():
    reference, _ = tables('scenario_square')
    path = course(reference)
    base = 2.0 * math.pi / path.period
    lines = harmonics(path)
    assert lines[0] == lines[3] == lines[4] == ()
    orders = np.array(lines[1]) / base
    assert orders == pytest.approx(np.round(orders), abs=1e-9)
    assert set(np.round(orders) % 2) == {1.0}
    assert orders[0] == pytest.approx(1.0)


def test_what_duration_cuts_off_is_said():
    reference, _ = tables('scenario_point_to_point', duration=0.8)
    assert any('its first 0.8 s are followed' in line for line in warnings(reference))
    assert warnings(tables('scenario_point_to_point')[0]) == []


@pytest.mark.parametrize('name', SCENARIOS)
def test_blocks_do_not_change_the_values(name):
    reference, _ = tables(f'scenario_{name}', duration=1.0, run_in=0.5)
    whole = Timeline(reference).block(0, 6000)
    timeline = Timeline(reference)
    for first, count in ((4700, 700), (0, 3), (3999, 1), (4000, 257), (511, 1026)):
        block = timeline.block(first, count)
        for values, wanted in zip(block, whole, strict=True):
            assert (values == wanted[first : first + count]).all()


@pytest.mark.parametrize('name', SCENARIOS)
def test_the_whole_way_is_smooth(name):
    timeline = Timeline(tables(f'scenario_{name}', duration=4.0, run_in=0.5)[0])
    block = timeline.block(0, timeline.end + 10)
    for values, rates, bound in (
        (block.position, block.velocity, 3e-5),
        (block.velocity, block.acceleration, 3e-2),
    ):
        change = np.diff(values, axis=0) - 0.5e-3 * (rates[1:] + rates[:-1])
        assert np.abs(change).max() < bound * 1e-3
    land = timeline.land(4000)
    assert land
    assert timeline.block(timeline.end, 1).position[0, 0] == 0.031


def test_every_trajectory_has_its_scenario():
    found = {
        read_yaml(path, 'reference').get('trajectory') for path in PARAMS.glob('scenario_*.yaml')
    }
    assert found >= set(TRAJECTORIES)
