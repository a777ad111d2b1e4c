"""The motor currents a reference takes: what a controller that knows the machine commands.

They follow from (1), (2) and the motion (6), (7) by the model's own inverse: per motor i_q for the
horizontal accelerations and i_d for the attraction wanted of it, friction included.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from maglev_model.axes import AXES, PHI, FloatArray
from maglev_model.currents import exact_currents
from maglev_model.guide import GuideParameters
from maglev_model.inverse import NO_LIMITS
from maglev_model.machine import machine_constants
from maglev_reference.check import UnreachableError
from maglev_reference.motion import Kinematics
from maglev_reference.parameters import ReferenceParameters

_SLACK = 1e-6


def friction(velocity: FloatArray, guide: GuideParameters) -> FloatArray:
    """Deceleration by friction (n, 5) [m/s^2, rad/s^2] at velocities (n, 5)."""
    coulomb, slip = np.array(guide.coulomb), np.array(guide.coulomb_velocity)
    return np.asarray(coulomb * np.tanh(velocity / slip) + np.array(guide.viscous) * velocity)


def motor_currents(
    samples: Kinematics, parameters: ReferenceParameters
) -> tuple[FloatArray, FloatArray, npt.NDArray[np.bool_]]:
    """i_d and i_q of motors 1..4 (n, 4) [A] that samples (n, 5) take.

    The third array (n,) tells where there are such currents: elsewhere more attraction is wanted
    than there is. Of a position beyond the stops, the currents are those at the stop.
    """
    machine = parameters.machine
    position = np.clip(samples.position, machine.lower_limit, machine.upper_limit)
    wanted = samples.acceleration + friction(samples.velocity, parameters.guide)
    limits = NO_LIMITS._replace(tilt=parameters.limits.tilt)
    return exact_currents(machine_constants(machine), position, wanted, limits)


def current_amplitudes(samples: Kinematics, parameters: ReferenceParameters) -> FloatArray:
    """Phase-current amplitudes (n, 4) [A] of samples (n, 5), infinite where no current will do."""
    direct, quadrature, possible = motor_currents(samples, parameters)
    return np.where(possible[:, None], np.hypot(direct, quadrature), np.inf)


def current_utilisation(samples: Kinematics, parameters: ReferenceParameters) -> float:
    """The largest current that samples (n, 5) take, in ``limits.current``."""
    return float(current_amplitudes(samples, parameters).max()) / parameters.limits.current


def check_currents(samples: Kinematics, first_time: float, parameters: ReferenceParameters) -> None:
    """Refuse consecutive samples (n, 5), the first at ``first_time`` [s], for their currents.

    Raises :class:`UnreachableError` where they exceed ``limits.current``, with the output that asks
    for most, and the time.
    """
    limit = parameters.limits.current
    amplitude = current_amplitudes(samples, parameters)
    over = amplitude > limit * (1.0 + _SLACK)
    if not over.any():
        return
    row = int(np.argwhere(over)[0, 0])
    motor = int(np.argmax(amplitude[row]))
    need = f'{amplitude[row, motor]:.3g} A in motor {motor + 1}'
    if not np.isfinite(amplitude[row, motor]):
        need = 'more attraction than there is'
    raise UnreachableError(
        f'unreachable reference: {AXES[_most_demanding(samples, row, parameters)]} needs {need} at '
        f'{first_time + row * parameters.sample_time:.3f} s (acceleration, springs and friction), '
        f'currents must stay within {limit:g} A'
    )


def _most_demanding(samples: Kinematics, row: int, parameters: ReferenceParameters) -> int:
    """The output without which least current would be needed at a row."""
    position, velocity, acceleration = (np.tile(values[row], (5, 1)) for values in samples)
    for axis in range(5):
        velocity[axis, axis] = acceleration[axis, axis] = 0.0
        if axis >= PHI:
            position[axis, axis] = 0.0
    without = Kinematics(position, velocity, acceleration)
    return int(np.argmin(current_amplitudes(without, parameters).max(axis=1)))
