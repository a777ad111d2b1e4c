"""The timeline: its phases, its smoothness, and that blocks do not change its values."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

import maglev_reference
import maglev_reference.timeline
from maglev_controller.reference_buffer import ReferenceBuffer
from maglev_model.contract.phases import Phase
from maglev_model.geometry import motor_gaps
from maglev_model.parameters import (
    SHARED_GROUPS,
    ParameterError,
    build,
    from_yaml,
    read_yaml,
    specs,
    to_yaml,
)
from maglev_reference.check import UnreachableError
from maglev_reference.node import ReferenceNodeParameters
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.run import samples_ahead
from maglev_reference.timeline import Timeline

ROOT = Path(__file__).resolve().parents[2]
DT = 1e-3
OMEGA_0 = 1.5 * np.pi
SHORT = {
    'duration': 0.7,
    'run_in': 0.6,
    'move_time': 0.4,
    'lift_off.time': 0.5,
    'lift_off.settle': 0.1,
    'landing.time': 0.5,
}


def scenario(name, **overrides):
    given_values = read_yaml(ROOT / 'params' / f'scenario_{name}.yaml', 'reference')
    return build(ReferenceParameters, {**given_values, **overrides})


def whole(timeline):
    return timeline.block(0, timeline.end + 20)


def phases(block):
    changes = np.flatnonzero(np.diff(block.segment.astype(int), prepend=-1))
    return [Phase(block.phase[row]).name for row in changes]


def assert_smooth(block, jumps=()):
    """Position and velocity are the integrals of velocity and acceleration, to the rectangle."""
    for values, rates, bound in (
        (block.position, block.velocity, 3e-5),
        (block.velocity, block.acceleration, 3e-2),
    ):
        change = np.diff(values, axis=0)
        mean_rate = 0.5 * (rates[1:] + rates[:-1])
        error = np.abs(change - DT * mean_rate).max(axis=1)
        error[[jump - 1 for jump in jumps]] = 0.0
        assert error.max() < bound * DT


def test_phases_are_those_of_the_message():
    text = (ROOT / 'src/maglev_msgs/msg/Reference.msg').read_text(encoding='utf-8')
    constants = dict(re.findall(r'uint8 (\w+) = (\d+)', text))
    assert {phase.name: str(int(phase)) for phase in Phase} == constants


def test_the_ellipse_is_the_papers():
    timeline = Timeline(scenario('ellipse_4dof', duration=3.0))
    block = whole(timeline)
    assert phases(block) == [
        *('REST', 'LIFT_OFF', 'HOLD', 'HOLD', 'HOLD', 'TRACK', 'HOLD', 'LAND', 'LAND', 'END')
    ]
    track = block.phase == Phase.TRACK
    assert track.sum() == 3000
    time = DT * np.arange(3000)
    expected = np.stack(
        [
            0.005 * np.sin(OMEGA_0 * time - np.pi / 2) + 0.025,
            0.03 * np.sin(OMEGA_0 * time - np.pi / 2),
            0.03 * np.sin(OMEGA_0 * time),
            0.0 * time,
            0.01 * np.sin(OMEGA_0 * time),
        ],
        axis=1,
    )
    assert block.position[track] == pytest.approx(expected, abs=1e-15)
    assert_smooth(block)
    gaps = motor_gaps(block.position[track], 0.397)
    assert gaps.min() > 0.018
    assert gaps.max() < 0.0315


def test_the_3dof_ellipse_does_not_rotate():
    table = scenario('ellipse', duration=0.5)
    assert not whole(Timeline(table)).position[:, 3:].any()
    with_tilt = scenario('ellipse_4dof', duration=0.5)
    assert table.sinusoids.x == with_tilt.sinusoids.x
    assert table.sinusoids.y == with_tilt.sinusoids.y
    assert table.sinusoids.z == with_tilt.sinusoids.z


@pytest.mark.parametrize('shaped', [True, False])
def test_the_steps_are_those_of_table_iii(shaped):
    overrides = {**SHORT, 'steps.settle': 0.2, 'steps.shaped': shaped}
    block = whole(Timeline(scenario('steps', **overrides)))
    firsts = np.flatnonzero(np.diff((block.phase == Phase.STEP).astype(int)) == 1) + 1
    found = []
    for first in firsts:
        before, after = block.position[first - 1], block.target[first]
        axis = int(np.flatnonzero(after != before)[0])
        found.append((axis, before[axis], after[axis]))
        assert np.delete(before, axis) == pytest.approx(np.delete(after, axis))
        assert np.delete(after, axis).tolist() == np.delete([0.025, 0, 0, 0, 0], axis).tolist()
        settling = slice(first - 200, first)
        assert (block.phase[settling] == Phase.HOLD).all()
        assert (block.position[settling] == before).all()
        step = slice(first, first + 700)
        assert (block.phase[step] == Phase.STEP).all()
        assert len(set(block.segment[step])) == 1
        arrived = 200 if shaped else 0
        assert (block.position[step][arrived:] == after).all()
        assert not block.velocity[step][arrived:].any()
        assert not block.acceleration[step][arrived:].any()
        half = (block.position[first + 100, axis] - before[axis]) / (after[axis] - before[axis])
        assert half == pytest.approx(0.5 if shaped else 1.0)
    assert found == [
        (0, 0.02, 0.027),
        (0, 0.03, 0.025),
        (0, 0.025, 0.03),
        (1, 0.0, 0.03),
        (2, 0.0, 0.03),
        (4, 0.0, 0.005),
        (4, 0.0, 0.01),
    ]
    assert_smooth(block, jumps=() if shaped else firsts)


@pytest.mark.parametrize(('axis', 'index'), [('x', 1), ('z', 2)])
def test_a_long_step_takes_the_time_its_acceleration_needs(axis, index):
    step = {'steps.axis': [axis], 'steps.start': [-0.03], 'steps.target': [0.03]}
    table = build(ReferenceParameters, {**SHORT, 'trajectory': 'steps', **step})
    block = whole(Timeline(table))
    rows = block.phase == Phase.STEP
    position = block.position[rows, index]
    assert np.abs(block.acceleration[rows, index]).max() == pytest.approx(5.5, rel=1e-3)
    assert position[250] < 0.03
    assert (position[251:] == 0.03).all()
    assert_smooth(block)


def test_hold_is_measured_at_home():
    table = build(ReferenceParameters, {**SHORT, 'trajectory': 'hold'})
    block = whole(Timeline(table))
    track = block.phase == Phase.TRACK
    assert track.sum() == 700
    assert (block.position[track] == np.array(table.home)).all()


def test_landing_touches_down_at_no_speed_and_never_passes_the_stop():
    block = whole(Timeline(scenario('ellipse_4dof', **SHORT)))
    land = block.phase == Phase.LAND
    y, speed = block.position[land, 0], block.velocity[land, 0]
    assert (np.diff(y) >= 0.0).all()
    assert y.max() <= 0.031
    assert speed[-1] < 1e-5
    crawl = y > 0.031 - 0.0005
    assert speed[crawl].max() <= 0.001 + 1e-12
    assert (np.diff(speed[crawl]) <= 1e-15).all()
    assert (block.position[block.phase == Phase.END] == [0.031, 0, 0, 0, 0]).all()
    assert not block.position[land, 3:].any()


def test_lift_off_rises_without_overshoot_from_where_the_platen_rests():
    rest = np.array([0.03101, 0.02, 0.0004, 0.0, 1e-5])
    block = Timeline(build(ReferenceParameters, SHORT), rest).block(0, 1300)
    assert block.position[0].tolist() == [0.031, 0.02, 0.0004, 0.0, 1e-5]
    lift = block.phase == Phase.LIFT_OFF
    assert (np.diff(block.position[lift, 0]) <= 0.0).all()
    assert (block.position[lift, 1] == 0.02).all()
    assert block.target[lift][0].tolist() == [0.025, 0.02, 0.0, 0.0, 0.0]
    assert block.position[-1].tolist() == [0.025, 0.0, 0.0, 0.0, 0.0]
    assert_smooth(block)


def test_a_platen_that_is_not_on_its_stop_is_refused():
    with pytest.raises(UnreachableError, match='lower stop'):
        Timeline(ReferenceParameters(), np.array([0.025, 0.0, 0.0, 0.0, 0.0]))
    with pytest.raises(ValueError, match='shape'):
        Timeline(ReferenceParameters(), np.zeros(4))


@given(st.lists(st.integers(1, 700), min_size=1, max_size=12), st.integers(0, 3000))
@settings(max_examples=25)
def test_blocks_do_not_change_the_values(counts, first):
    timeline = Timeline(scenario('ellipse_4dof', **SHORT))
    expected = Timeline(scenario('ellipse_4dof', **SHORT)).block(0, 14000)
    for count in counts:
        block = timeline.block(first, count)
        for values, wanted in zip(block, expected, strict=True):
            assert values.dtype == wanted.dtype
            assert (values == wanted[first : first + count]).all()
        first = (first + count) % 4000


def test_samples_count_up_from_zero():
    timeline = Timeline(build(ReferenceParameters, SHORT))
    with pytest.raises(ValueError, match='count up from 0'):
        timeline.block(-1, 3)
    assert len(timeline.block(5, 0).position) == 0


def test_without_autostart_it_rests_until_lift_off():
    parameters = build(ReferenceParameters, SHORT)
    timeline = Timeline(parameters, autostart=False)
    assert timeline.end is None
    assert (timeline.block(10**9, 300).phase == Phase.REST).all()
    rest = timeline.block(0, 1).position[0]
    assert timeline.lift_off(1000, rest)
    assert not timeline.lift_off(1001, rest)
    block = timeline.block(1000, 3000)
    started = Timeline(parameters).block(0, 3000)
    assert block.position == pytest.approx(started.position, abs=1e-15)
    assert (block.phase == started.phase).all()
    assert (block.segment == started.segment + 1).all()
    assert timeline.land(timeline.end) is False
    assert timeline.lift_off(timeline.end + 50, rest)


def test_an_unreachable_reference_is_refused_without_autostart_too():
    parameters = build(ReferenceParameters, {**SHORT, 'sinusoids.x.offset': 0.04})
    Timeline(parameters, autostart=False)
    parameters = build(
        ReferenceParameters,
        {**SHORT, 'sinusoids.x.offset': 0.04, 'sinusoids.x.amplitude': [0.02]},
    )
    with pytest.raises(UnreachableError, match='x is '):
        Timeline(parameters, autostart=False)


@given(st.integers(0, 4410))
@settings(max_examples=40)
def test_it_lands_smoothly_from_wherever_it_is(sample):
    parameters = scenario('ellipse_4dof', **SHORT)
    timeline = Timeline(parameters)
    before = timeline.block(0, sample + 1)
    phase = timeline.phase(sample)
    landed = timeline.land(sample)
    assert landed == (phase not in (Phase.LAND, Phase.END))
    block = whole(timeline)
    if landed:
        after = block.phase[sample:]
        assert set(after) <= {Phase.LAND, Phase.END}
        assert block.segment[sample] > before.segment[max(sample - 1, 0)] or sample == 0
    else:
        assert (block.position[: sample + 1] == before.position).all()
    assert (block.position[:sample] == before.position[:sample]).all()
    assert_smooth(block)
    assert block.position[-1, 0] == 0.031
    assert not block.position[-1, 3:].any()
    assert block.position[:, 0].max() <= 0.031 + 1e-8
    gaps = motor_gaps(block.position, 0.397)
    assert gaps.min() > 0.0185
    assert gaps.max() < 0.033
    assert np.abs(block.position[:, 1:3]).max() < 0.042
    assert not timeline.land(timeline.end + 5)


@pytest.mark.parametrize('late', [0, 1, 50, 699])
def test_it_lands_out_of_a_raw_step(late):
    overrides = {**SHORT, 'steps.settle': 0.2, 'steps.shaped': False}
    timeline = Timeline(scenario('steps', **overrides))
    step = next(segment for segment in timeline.segments if segment.jumps)
    sample = step.first + late
    assert timeline.land(sample)
    block = whole(timeline)
    assert_smooth(block, jumps=[step.first] if late else [])
    assert block.position[sample, 0] == pytest.approx(0.027 if late else 0.02)


@pytest.mark.parametrize('target', [0.025, 0.027])
def test_it_lands_out_of_any_moment_of_a_fast_step(target):
    """In which y speeds up or brakes at up to 36 m/s²: no way leads far beyond a stop."""
    start = {0.025: 0.03, 0.027: 0.02}[target]
    step = {'steps.axis': ['y'], 'steps.start': [start], 'steps.target': [target]}
    values = {**read_yaml(ROOT / 'params' / 'fastest.yaml', 'reference'), **SHORT, **step}
    parameters = scenario('steps', **values, **{'steps.settle': 0.05})
    first = next(each.first for each in Timeline(parameters).segments if each.phase == Phase.STEP)
    for sample in range(first, first + 60, 2):
        timeline = Timeline(parameters)
        assert timeline.land(sample)
        block = whole(timeline)
        assert block.position[sample:, 0].min() > 0.018
        assert block.acceleration[sample:, 0].max() < 9.0  # less than the weight takes
        assert block.position[sample:, 0].max() < 0.0316


@pytest.mark.parametrize(
    ('lead', 'period', 'ahead'), [(0.064, 1e-3, 64), (0.064, 2.5e-4, 256), (0.064, 1.25e-3, 52)]
)
def test_how_far_ahead_it_is_published_is_a_time(lead, period, ahead):
    assert samples_ahead(lead, period) == ahead
    build(ReferenceNodeParameters, {'lead': lead, 'sample_time': period})


def test_no_more_is_published_ahead_than_a_controller_holds():
    most = {'sample_time': 2.5e-4, 'lead': 0.2}
    ahead = samples_ahead(build(ReferenceNodeParameters, most).lead, 2.5e-4)
    assert ahead < ReferenceBuffer().capacity
    with pytest.raises(ParameterError, match=r"'lead' is 0\.2 s, it must be at most 0\.16"):
        build(ReferenceNodeParameters, {**most, 'sample_time': 2e-4})


def test_every_parameter_is_listed_with_its_default():
    listed = read_yaml(ROOT / 'params' / 'reference.yaml', 'reference')
    assert build(ReferenceNodeParameters, listed) == ReferenceNodeParameters()
    shared = {
        name for name in specs(ReferenceNodeParameters) if name.split('.')[0] in SHARED_GROUPS
    }
    empty = {'watchers', 'processors'}  # which ROS takes in no parameter file
    expected = set(specs(ReferenceNodeParameters)) - shared - empty | {'internal_model.sampling'}
    assert set(listed) == expected


def test_the_machine_is_listed_with_its_defaults_for_all_nodes():
    path = ROOT / 'params' / 'machine.yaml'
    listed = read_yaml(path, 'any')
    machine = {
        name for name in specs(ReferenceParameters) if name.startswith(('machine.', 'guide.'))
    }
    assert set(listed) == machine
    assert from_yaml(ReferenceParameters, 'reference', path) == ReferenceParameters()
    for name, value in listed.items():
        elements = value if isinstance(value, list) else [value]
        assert {type(element) for element in elements} == {specs(ReferenceParameters)[name].kind}


def test_the_package_has_no_way_to_the_plant():
    folder = Path(maglev_reference.__file__).parent
    for module in folder.glob('*.py'):
        assert 'maglev_plant' not in module.read_text(encoding='utf-8')
        if module.name != 'node.py':
            assert 'rclpy' not in module.read_text(encoding='utf-8')


def test_axis_names_are_quoted_because_ros_takes_a_bare_y_for_true():
    bare_y = re.compile(r'(?:[\[,:-]\s*)y\s*(?:[\],]|$)', re.MULTILINE)
    assert bare_y.search('axis: [y]')
    texts = [path.read_text(encoding='utf-8') for path in (ROOT / 'params').glob('*.yaml')]
    effective = to_yaml(scenario('steps'), 'reference')
    for text in [*texts, effective]:
        assert not bare_y.search(re.sub('#.*', '', text))
    assert yaml.safe_load(effective)['reference']['ros__parameters']['steps']['axis'][0] == 'y'


def test_hours_of_standing_still_are_checked_at_once(monkeypatch):
    checked = []
    monkeypatch.setattr(
        maglev_reference.timeline, 'check_samples', lambda samples, *_: checked.append(samples)
    )
    hours = Timeline(scenario('hold', duration=36000.0))
    assert hours.end > 36_000_000
    assert sum(len(samples.position) for samples in checked) < 20_000
    away = {'home': [0.040, 0.0, 0.0, 0.0, 0.0], 'duration': 36000.0}
    monkeypatch.undo()
    with pytest.raises(UnreachableError, match=r'y is 0\.04 m'):
        Timeline(scenario('hold', **away))
