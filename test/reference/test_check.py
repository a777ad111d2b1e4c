"""What cannot be followed is refused, with axis, value, bound and time."""

import math
import re

import numpy as np
import pytest

from maglev_model.parameters import ParameterError, build
from maglev_reference.check import UnreachableError, check_rest, check_samples, utilisation, within
from maglev_reference.motion import Kinematics
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.timeline import Timeline

HOME = np.array([0.025, 0.0, 0.0, 0.0, 0.0])
PARAMETERS = ReferenceParameters()


def still(count=10):
    return Kinematics(np.tile(HOME, (count, 1)), np.zeros((count, 5)), np.zeros((count, 5)))


def refused(overrides):
    with pytest.raises(ParameterError) as caught:
        Timeline(build(ReferenceParameters, overrides))
    return str(caught.value)


def test_standing_at_home_passes():
    check_samples(still(), 0.0, PARAMETERS)
    assert within(utilisation(still(), PARAMETERS))


@pytest.mark.parametrize(
    ('kind', 'axis', 'value', 'words'),
    [
        ('position', 0, 0.0172, ['y is 0.0172 m', '[0.018, 0.031] m']),
        ('position', 1, -0.051, ['x is -0.051 m', '[-0.05, 0.05] m']),
        ('position', 4, 0.0141, ['theta is 0.0141 rad', '[-0.014, 0.014] rad']),
        ('position', 2, math.nan, ['z is nan', 'finite']),
        ('velocity', 3, 0.11, ['the speed of phi is 0.11 rad/s', '[-0.1, 0.1] rad/s']),
        ('acceleration', 2, -15.1, ['the acceleration of z is -15.1 m/s^2', '[-15, 15] m/s^2']),
        ('acceleration', 0, math.inf, ['the acceleration of y is inf', 'finite']),
    ],
)
def test_offence_is_named_with_its_time(kind, axis, value, words):
    samples = still()
    getattr(samples, kind)[6, axis] = value
    with pytest.raises(UnreachableError) as caught:
        check_samples(samples, 2.0, PARAMETERS)
    for word in [*words, 'at 2.006 s']:
        assert word in str(caught.value)
    assert not within(utilisation(samples, PARAMETERS))


def test_each_motor_has_its_own_gap():
    samples = still()
    samples.position[:, 0] = 0.0195
    samples.position[:, 4] = 0.005  # 1.985 mm at the motors
    with pytest.raises(UnreachableError, match=r'the gap at motor 4 is 0\.017515 m'):
        check_samples(samples, 0.0, PARAMETERS)
    samples.position[:, 4] *= -1.0
    with pytest.raises(UnreachableError, match='the gap at motor 2'):
        check_samples(samples, 0.0, PARAMETERS)
    assert utilisation(samples, PARAMETERS) > 1.0


LOCKED = {  # by mode, as its stoppers lock the tilts
    '3dof': [False, False, False, True, True],
    '4dof': [False, False, False, True, False],
}


@pytest.mark.parametrize(('mode', 'axis'), [('3dof', 'phi'), ('3dof', 'theta'), ('4dof', 'phi')])
@pytest.mark.parametrize('kind', ['trajectory', 'step', 'home'])
def test_what_moves_a_locked_axis_is_refused_by_name(mode, axis, kind):
    home = [0.025, 0.0, 0.0, 0.0, 0.0]
    moved = {
        'trajectory': {f'sinusoids.{axis}.amplitude': [1e-4]},
        'step': {
            'trajectory': 'steps',
            'steps.axis': ['y', axis],
            'steps.start': [0.025, 0.0],
            'steps.target': [0.026, 1e-4],
        },
        'home': {'home': [*home[:3], *(0.0015 * (name == axis) for name in ('phi', 'theta'))]},
    }[kind]
    Timeline(build(ReferenceParameters, moved))
    message = refused({'guide.locked': LOCKED[mode], **moved})
    assert f"'guide.locked' locks {axis}" in message
    if kind != 'home':
        farthest = re.search(rf'{axis} is (\S+) rad at ', message)
        assert abs(float(farthest[1])) == pytest.approx(1e-4, rel=1e-3)


def test_what_leaves_the_locked_axes_alone_is_flown():
    four = {'guide.locked': LOCKED['4dof'], 'sinusoids.theta.amplitude': [0.01]}
    Timeline(build(ReferenceParameters, four))
    three = {'guide.locked': LOCKED['3dof'], 'sinusoids.x.amplitude': [0.03]}
    timeline = Timeline(build(ReferenceParameters, three), np.array([0.031, 0, 0, 4e-5, -4e-5]))
    assert timeline.end is not None


def test_a_jump_is_refused_unless_it_is_a_raw_step():
    samples = still()
    samples.position[4:, 1] = 0.01
    jumps = np.zeros(10, dtype=bool)
    with pytest.raises(UnreachableError, match=r'x moves by 0.01 m in one sample at 0.004 s'):
        check_samples(samples, 0.0, PARAMETERS, jumps)
    jumps[4] = True
    check_samples(samples, 0.0, PARAMETERS, jumps)


def test_a_velocity_that_is_none_of_its_position_is_refused():
    time = 1e-3 * np.arange(2000)[:, None]
    samples = still(2000)
    samples.position[:, 2:3] += 0.03 * np.sin(2.0 * time)
    samples.acceleration[:, 2:3] -= 0.12 * np.sin(2.0 * time)
    samples.velocity[:, 2:3] += 0.06 * np.cos(2.0 * time)
    check_samples(samples, 0.0, PARAMETERS)
    samples.velocity[:, 2] *= -1.0
    with pytest.raises(UnreachableError, match=r'z moves by \S+e-05 m .* makes -\S+e-05 m'):
        check_samples(samples, 0.0, PARAMETERS)


@pytest.mark.parametrize('axis', ['x', 'z', 'y', 'phi', 'theta'])
def test_amplitude_in_millimetres_is_refused(axis):
    amplitude = {'y': 5.0, 'phi': 2.0, 'theta': 10.0}.get(axis, 30.0)
    message = refused({f'sinusoids.{axis}.amplitude': [amplitude]})
    assert f"'sinusoids.{axis}.amplitude[0]' is {amplitude:g}" in message


def test_sum_of_sinusoids_out_of_range_is_refused():
    message = refused(
        {
            'duration': 2.0,
            'sinusoids.x.amplitude': [0.03, 0.03],
            'sinusoids.x.frequency': [3.0, 9.0],
            'sinusoids.x.phase': [0.0, math.pi],
        }
    )
    assert 'x is ' in message
    assert '[-0.05, 0.05] m' in message


def test_too_fast_is_refused_for_what_is_measured_not_for_the_way_to_it():
    message = refused({'sinusoids.z.amplitude': [0.03], 'sinusoids.z.frequency': [40.0]})
    assert 'the speed of z is 1.199' in message
    assert 'at 11.699 s, it must lie in [-1, 1] m/s' in message


@pytest.mark.parametrize('shaped', [True, False])
def test_steps_are_limited_in_size(shaped):
    message = refused(
        {
            'trajectory': 'steps',
            'steps.shaped': shaped,
            'steps.axis': ['y', 'theta'],
            'steps.start': [0.02, -0.0101],
            'steps.target': [0.03, 0.01],
        }
    )
    assert 'step 2, of theta from -0.0101 to 0.01 rad' in message
    assert '0.02 rad' in message


@pytest.mark.parametrize('profile', ['minimum_jerk', 'fastest'])
def test_a_step_that_its_segment_cuts_short_is_refused(profile):
    step = {'trajectory': 'steps', 'steps.profile': profile}
    with pytest.raises(UnreachableError, match='step 1 takes') as caught:
        Timeline(build(ReferenceParameters, {**step, 'duration': 0.02}))
    assert 'its segment lasts 0.02 s (duration)' in str(caught.value)


def test_a_step_too_quick_is_refused():
    message = refused(
        {
            'trajectory': 'steps',
            'steps.shaping_time': 0.02,
            'steps.acceleration': [1e3] * 5,  # or it would be given more time
        }
    )
    assert 'the speed of y' in message
    assert '[-0.2, 0.2] m/s' in message


def test_step_outside_the_range_is_refused():
    step = {'trajectory': 'steps', 'steps.start': [0.027], 'steps.target': [0.035]}
    assert 'y is 0.035 m' in refused({**step, 'steps.shaped': False})
    assert 'y is 0.031' in refused(step)


def test_home_out_of_range_is_refused():
    assert 'y is ' in refused({'home': [0.0, 0.0, 0.0, 0.0, 0.0], 'trajectory': 'hold'})


def test_lift_off_from_elsewhere_than_the_stop_is_refused():
    check_rest(np.array([0.0305, 0.01, -0.02, 0.0, 0.0]), PARAMETERS)
    with pytest.raises(UnreachableError, match=r'gap of 18.000 mm, not on its lower stop'):
        check_rest(np.array([0.018, 0.0, 0.0, 0.0, 0.0]), PARAMETERS)
    with pytest.raises(UnreachableError, match=r'x is 0.06 m'):
        check_rest(np.array([0.031, 0.06, 0.0, 0.0, 0.0]), PARAMETERS)
    with pytest.raises(UnreachableError, match='not finite'):
        check_rest(np.array([0.031, np.nan, 0.0, 0.0, 0.0]), PARAMETERS)


@pytest.mark.parametrize(
    ('overrides', 'words'),
    [
        ({'steps.axis': ['y', 'x']}, "'axis' 2, 'start' 1, 'target' 1"),
        ({'sinusoids.x.amplitude': [0.01, 0.01]}, "'sinusoids.x'"),
        ({'sinusoids.x.amplitude': []}, "'amplitude' 0"),
        ({'steps.axis': ['w']}, 'one of y, x, z, phi, theta'),
        ({'limits.lower': [0.031, 0.0, 0.0, 0.0, 0.0]}, "'limits.lower' is 0.031 for y"),
        ({'limits.motor_gap': [0.03, 0.02]}, "'limits.motor_gap'"),
        ({'duration': math.nan}, 'finite'),
        ({'sinusoid.y.amplitude': [0.01]}, "did you mean 'sinusoids.y.amplitude'?"),
    ],
)
def test_contradictory_parameters_are_refused(overrides, words):
    assert words in refused(overrides)
