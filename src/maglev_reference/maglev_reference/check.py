"""Whether a reference can be followed: position, gap at every motor, speed, acceleration, jumps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from maglev_model.axes import AXES, UNITS, FloatArray, Y
from maglev_model.geometry import motor_gaps
from maglev_model.parameters import ParameterError
from maglev_reference.motion import Kinematics
from maglev_reference.parameters import ReferenceParameters

_SLACK = 1e-6  # of a range, for rounding
_STILL = 1e-9  # [m, rad]: as good as no move
_MOTORS = tuple(f'the gap at motor {motor}' for motor in range(1, 5))


class UnreachableError(ParameterError):
    """A reference leaves the limits; the message names axis, value, bound and time."""


def check_samples(
    samples: Kinematics,
    first_time: float,
    parameters: ReferenceParameters,
    jumps: npt.NDArray[np.bool_] | None = None,
) -> None:
    """Refuse consecutive samples (n, 5), the first at ``first_time`` [s], that leave the limits.

    ``jumps`` (n,) marks those at which the position may jump from the sample before. Raises
    :class:`UnreachableError` for the first offence of a kind, in time.
    """
    limits = parameters.limits
    count = np.arange(len(samples.position), dtype=np.float64)
    time = first_time + parameters.sample_time * count
    checks = (
        ('{}', '', limits.lower, limits.upper),
        ('the speed of {}', '/s', [-v for v in limits.velocity], limits.velocity),
        ('the acceleration of {}', '/s^2', [-a for a in limits.acceleration], limits.acceleration),
    )
    for values, (name, per_time, lower, upper) in zip(samples, checks, strict=True):
        names = [name.format(axis) for axis in AXES]
        units = [unit + per_time for unit in UNITS]
        _within(values, np.array(lower), np.array(upper), time, names, units)
    gaps = motor_gaps(samples.position, parameters.machine.radius)
    low, high = limits.motor_gap
    _within(gaps, np.full(4, low), np.full(4, high), time, _MOTORS, ('m',) * 4)
    _check_jumps(samples, time, parameters, jumps)


def check_locked(
    position: FloatArray,
    measured: npt.NDArray[np.bool_],
    first_time: float,
    parameters: ReferenceParameters,
) -> None:
    """Refuse consecutive positions (n, 5), the first at ``first_time`` [s], that stoppers prevent.

    What is measured, where ``measured`` (n,), leaves an axis of ``guide.locked`` at home. Raises
    :class:`UnreachableError`.
    """
    away = np.abs(position - np.array(parameters.home)) * parameters.guide.locked
    away[~measured] = 0.0
    row, column = np.unravel_index(np.argmax(away), away.shape)
    if not away[row, column] > _STILL:
        return
    raise UnreachableError(
        f'unreachable reference: {AXES[column]} is {position[row, column]:.6g} {UNITS[column]} at '
        f"{first_time + row * parameters.sample_time:.3f} s, but parameter 'guide.locked' locks "
        f'{AXES[column]}: it must stay at home, at {parameters.home[column]:g} {UNITS[column]}'
    )


def utilisation(samples: Kinematics, parameters: ReferenceParameters) -> float:
    """How much samples (n, 5) use of the limit they are nearest to; up to 1 they are within."""
    limits = parameters.limits
    lower, upper = np.array(limits.lower), np.array(limits.upper)
    gaps = motor_gaps(samples.position, parameters.machine.radius)
    low, high = limits.motor_gap
    used = (
        np.abs(samples.position - 0.5 * (lower + upper)) / (0.5 * (upper - lower)),
        np.abs(gaps - 0.5 * (low + high)) / (0.5 * (high - low)),
        np.abs(samples.velocity) / np.array(limits.velocity),
        np.abs(samples.acceleration) / np.array(limits.acceleration),
    )
    return max(float(part.max()) for part in used)


def within(used: float) -> bool:
    """Whether a :func:`utilisation` is within limits, rounding aside."""
    return used <= 1.0 + _SLACK


def check_rest(position: FloatArray, parameters: ReferenceParameters) -> None:
    """Refuse to lift off from a position (5,) [m, rad] that is not at rest on the lower stop.

    Raises :class:`UnreachableError`.
    """
    gap, tolerance = parameters.lift_off.rest_gap, parameters.lift_off.rest_tolerance
    if not np.isfinite(position).all():
        raise UnreachableError(
            f'lift-off refused: the position {position.tolist()} of the platen is not finite; '
            'check the encoders'
        )
    if abs(position[Y] - gap) > tolerance:
        raise UnreachableError(
            f'lift-off refused: the platen is at a gap of {1e3 * position[Y]:.3f} mm, not on its '
            f'lower stop at {1e3 * gap:.3f} mm; lower it by hand or correct lift_off.rest_gap'
        )
    for axis, locked in enumerate(parameters.guide.locked):
        if locked and abs(position[axis] - parameters.home[axis]) > tolerance:
            raise UnreachableError(
                f"lift-off refused: parameter 'guide.locked' locks {AXES[axis]} at "
                f'{position[axis]:.6g} {UNITS[axis]}, but home is at {parameters.home[axis]:g} '
                f'{UNITS[axis]}'
            )
    samples = Kinematics(position[None, :], np.zeros((1, 5)), np.zeros((1, 5)))
    check_samples(samples, 0.0, parameters)


def _within(
    values: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    time: FloatArray,
    names: Sequence[str],
    units: Sequence[str],
) -> None:
    slack = _SLACK * (upper - lower)
    good = np.isfinite(values) & (values >= lower - slack) & (values <= upper + slack)
    if good.all():
        return
    row, column = np.argwhere(~good)[0]
    bound = f'lie in [{lower[column]:g}, {upper[column]:g}]'
    if not np.isfinite(values[row, column]):
        bound = 'be finite'
    raise UnreachableError(
        f'unreachable reference: {names[column]} is {values[row, column]:.6g} {units[column]} at '
        f'{time[row]:.3f} s, it must {bound} {units[column]}'
    )


def _check_jumps(
    samples: Kinematics,
    time: FloatArray,
    parameters: ReferenceParameters,
    jumps: npt.NDArray[np.bool_] | None,
) -> None:
    """Refuse a way from sample to sample that no acceleration within limits makes of velocities."""
    period, velocity = parameters.sample_time, samples.velocity
    change = np.diff(samples.position, axis=0)
    expected = 0.5 * period * (velocity[1:] + velocity[:-1])
    bound = 0.25 * period**2 * np.array(parameters.limits.acceleration)
    bad = np.abs(change - expected) > bound * (1.0 + _SLACK) + 1e-12
    if jumps is not None:
        bad &= ~jumps[1:, None]
    if not bad.any():
        return
    row, column = np.argwhere(bad)[0]
    raise UnreachableError(
        f'unreachable reference: {AXES[column]} moves by {change[row, column]:.6g} {UNITS[column]} '
        f'in one sample at {time[row + 1]:.3f} s, where its velocity makes '
        f'{expected[row, column]:.6g} {UNITS[column]}'
    )
