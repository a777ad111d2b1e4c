"""What a controller with an internal model leaves of friction: the error to expect of a course.

With its LQR weights (W⁴, 2 W², W⁴ i² on the integrator, W⁴ m² on each oscillator) the closed loop
of (13), (14), (16) turns a disturbing acceleration of angular frequency ω into an error of
c / sqrt((ω² + W²)² + W⁴ (i² / ω² + m² Σ p_k)) times it, p_k = (ω² + ω_k²) / (ω² - ω_k²)² for an
oscillator at ω_k: that is Kalman's identity for the return difference, with c = 1 in continuous
time. Sampled, the identity holds with a constant c above 1, and an observer whose bandwidth is far
above ω makes it larger by another constant; c is the parameter ``sampling``. With oscillators that
hold at rest (``internal_model.rest``) the sampled loop's error is within 20 % of this up to 600
rad/s. By default they are turned for friction at rest, which is left out: from the highest of them
to three times its frequency the error is then as little as half of this, a little below one it is
up to 2.6 times. Of the courses in ``params/`` that repeat, with the models that
:mod:`maglev_reference.match` gives them, the loop leaves 0.5 to 0.9 of the error that is told.
Friction is the disturbance there is; the rest of the machine the controller inverts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from maglev_model.axes import AXES, FloatArray
from maglev_model.loop_parameters import AxisLoopParameters
from maglev_reference.currents import friction
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.trajectories import Course, course

_POINTS = 16384  # over one period
_LONGEST = 120.0  # what is looked at of a course that does not repeat [s]
_REST = 2.0  # after it, in which the error dies away [s]
_HELD = 1e-3  # relative difference up to which a frequency counts as held
_WEAK = 0.05  # of the largest harmonic; those below it are not named
_STILL = 1e-9  # amplitude below which an output stands still [m, rad]
_NAMED = 3
_OFFER = (
    "internal models to match: 'ros2 run maglev_reference match' makes an overlay of them from the "
    'parameter files of the reference'
)


def compliance(
    frequency: FloatArray, held: Sequence[float], loop: AxisLoopParameters, sampling: float
) -> FloatArray:
    """Error per disturbing acceleration [s^2] at each ``frequency`` (n,) [rad/s].

    ``held`` are the frequencies of the internal model [rad/s], ``loop`` gives W, i and m,
    ``sampling`` is c.
    """
    omega = np.asarray(frequency, dtype=float)
    stiffness = (omega**2 + loop.bandwidth**2) ** 2
    with np.errstate(divide='ignore'):
        for mode in held:
            if mode > 0.0:
                learnt = loop.learning**2 * (omega**2 + mode**2) / (omega**2 - mode**2) ** 2
            else:
                learnt = loop.integration**2 / omega**2
            stiffness = stiffness + loop.bandwidth**4 * learnt
    return np.asarray(sampling / np.sqrt(stiffness))


def expected_error(path: Course, parameters: ReferenceParameters) -> FloatArray:
    """The error (5,) [m, rad] friction leaves, root of its mean square over the course.

    It is that of a course that has been followed for long; the encoders' resolution comes on top.
    """
    expected = np.empty(5)
    length = _span(path, parameters)
    total = length if path.period is not None else length + _REST
    amplitude = disturbance_lines(path, parameters)
    omega = 2.0 * np.pi / total * np.arange(len(amplitude), dtype=np.float64)
    sampling = parameters.internal_model.sampling
    loops = zip(parameters.held_frequencies, parameters.loops, strict=True)
    for axis, (held, loop) in enumerate(loops):
        error = amplitude[:, axis] * compliance(omega, held, loop, sampling)
        mean_square = error[0] ** 2 + 0.5 * (error[1:] ** 2).sum()
        expected[axis] = math.sqrt(mean_square * total / length)
    return expected


def disturbance_lines(path: Course, parameters: ReferenceParameters) -> FloatArray:
    """Amplitudes (m, 5) [m/s^2, rad/s^2] of friction at the multiples 0, 1, ... of a frequency.

    That is 2 pi over the period or, for a course without, over its length with a rest behind it.
    """
    length = _span(path, parameters)
    count = _POINTS if path.period is not None else round(length / parameters.sample_time)
    step = length / max(2, count)
    motion = path.motion.evaluate(step * np.arange(max(2, count), dtype=np.float64))
    disturbance = friction(motion.velocity, parameters.guide)
    if path.period is None:
        disturbance = np.concatenate((disturbance, np.zeros((round(_REST / step), 5))))
    lines: FloatArray = np.abs(np.fft.rfft(disturbance, axis=0)) * (2.0 / len(disturbance))
    lines[0] *= 0.5
    return lines


def _span(path: Course, parameters: ReferenceParameters) -> float:
    """What is looked at of a course [s]."""
    return path.period or min(path.length or parameters.duration, _LONGEST)


def harmonics(path: Course) -> tuple[tuple[float, ...], ...]:
    """The angular frequencies [rad/s] of each output, the constant part aside.

    Empty for an output that stands still, or moves once and for all.
    """
    if any(path.lines) or path.period is None:
        return path.lines
    time = path.period / _POINTS * np.arange(_POINTS, dtype=np.float64)
    motion = path.motion.evaluate(time)
    spectrum = np.abs(np.fft.rfft(motion.position, axis=0))[1:]
    lines = []
    for column in spectrum.T:
        size = column.max()
        strong = np.flatnonzero(column > max(_WEAK * size, _STILL * _POINTS))
        lines.append(tuple(2.0 * np.pi / path.period * float(order + 1) for order in strong))
    return tuple(lines)


def warnings(parameters: ReferenceParameters) -> list[str]:
    """What to know before the course is followed, a line each.

    A frequency the internal model of an output does not hold, with the error expected; a course
    that is cut off by ``duration``.
    """
    if parameters.trajectory == 'steps':
        return []
    path = course(parameters)
    error = expected_error(path, parameters)
    told = []
    for axis, lines in enumerate(harmonics(path)):
        held = np.array(parameters.held_frequencies[axis])
        missed = [line for line in lines if not np.any(np.abs(held - line) <= _HELD * line)]
        if missed:
            told.append(_missed(axis, missed, float(error[axis])))
    if told and path.period is not None:
        told.append(_OFFER)
    if path.length is not None and path.length > parameters.duration:
        told.append(
            f'the course takes {path.length:.2f} s, its first {parameters.duration:g} s are '
            "followed (parameter 'duration')"
        )
    return told


def summary(parameters: ReferenceParameters) -> list[str]:
    """The expected errors, in a line; nothing for steps."""
    if parameters.trajectory == 'steps':
        return []
    error = 1e6 * expected_error(course(parameters), parameters)
    units = ('um', 'um', 'um', 'urad', 'urad')
    listed = ', '.join(
        f'{axis} {value:.1f} {unit}' for axis, value, unit in zip(AXES, error, units, strict=True)
    )
    return [f'expected error by friction (rms): {listed}']


def _missed(axis: int, missed: Sequence[float], error: float) -> str:
    named = ', '.join(f'{line:.4g}' for line in missed[:_NAMED])
    more = f' and {len(missed) - _NAMED} more' if len(missed) > _NAMED else ''
    unit = 'um' if axis < 3 else 'urad'
    return (
        f'the internal model of {AXES[axis]} does not hold {named}{more} rad/s: expected error '
        f'{1e6 * error:.1f} {unit} rms'
    )
