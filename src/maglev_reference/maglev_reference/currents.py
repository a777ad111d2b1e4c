"""The motor currents a reference takes, by the forces (1), (2) and the motion (6), (7).

What a controller that knows the machine commands to follow it without error: per motor i_q for the
horizontal accelerations and i_d for the attraction wanted of it, friction included.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from maglev_model.axes import AXES, PHI, FloatArray, X, Y, Z
from maglev_reference.check import UnreachableError
from maglev_reference.geometry import motor_gaps
from maglev_reference.model_parameters import MachineParameters
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.profiles import Kinematics

SLIP = 1e-3  # speed by which Coulomb friction has set in [m/s, rad/s]
_RESERVE = 1.1  # attraction of a motor, in that of its i_q, below which i_d has no slope left
_SLACK = 1e-6


class Currents(NamedTuple):
    """i_d, i_q (n, 4) [A] of motors 1..4; i_d is NaN where no current gives the attraction."""

    direct: FloatArray
    quadrature: FloatArray

    def amplitude(self) -> FloatArray:
        """Phase-current amplitudes (n, 4) [A], infinite where no current will do."""
        size = np.hypot(self.direct, self.quadrature)
        return np.where(np.isfinite(size), size, np.inf)


def friction(velocity: FloatArray, machine: MachineParameters) -> FloatArray:
    """Deceleration by friction (n, 5) [m/s^2, rad/s^2] at velocities (n, 5)."""
    found: FloatArray = np.array(machine.coulomb) * np.tanh(velocity / SLIP)
    found += np.array(machine.viscous) * velocity
    return found


def motor_currents(samples: Kinematics, machine: MachineParameters, radius: float) -> Currents:
    """What samples (n, 5) take; ``radius`` r [m]."""
    wanted = samples.acceleration + friction(samples.velocity, machine)
    gap = motor_gaps(samples.position, radius)
    magnets, winding, thrust = (
        np.exp(np.interp(gap, machine.gap, np.log(table)))
        for table in (machine.attraction, machine.attraction_current, machine.thrust)
    )
    _, mass_x, mass_z = machine.mass
    quadrature = np.empty_like(gap)
    quadrature[:, ::2] = (-mass_z * wanted[:, Z] / (thrust[:, 0] + thrust[:, 2]))[:, None]
    quadrature[:, 1::2] = (-mass_x * wanted[:, X] / (thrust[:, 1] + thrust[:, 3]))[:, None]
    spent = winding * quadrature**2
    attraction = _attraction(samples.position, wanted, _RESERVE * spent, machine, radius)
    square = attraction - spent
    with np.errstate(invalid='ignore'):
        direct = (np.sqrt(magnets) - np.sqrt(square)) / np.sqrt(winding)
    return Currents(direct, quadrature)


def _attraction(
    position: FloatArray,
    wanted: FloatArray,
    least: FloatArray,
    machine: MachineParameters,
    radius: float,
) -> FloatArray:
    """The attraction of each motor (n, 4) [N], at least ``least`` where that is possible.

    Both pairs carry half, or one leaves to the other what that needs for its i_q.
    """
    total = machine.mass[0] * (machine.gravity - wanted[:, Y])
    springs = np.array(machine.spring) * position[:, PHI:]
    tilt = machine.inertia / radius * (wanted[:, PHI:] + springs)
    phi, theta = tilt[:, 0], tilt[:, 1]  # P_1 - P_3, P_4 - P_2
    need_z = 2.0 * np.maximum(least[:, 0] - 0.5 * phi, least[:, 2] + 0.5 * phi)
    need_x = 2.0 * np.maximum(least[:, 1] + 0.5 * theta, least[:, 3] - 0.5 * theta)
    along_z = np.minimum(np.maximum(0.5 * total, need_z), total - need_x)
    along_x = total - along_z
    pairs = (along_z + phi, along_x - theta, along_z - phi, along_x + theta)
    return 0.5 * np.stack(pairs, axis=1)


def current_use(samples: Kinematics, parameters: ReferenceParameters) -> float:
    """The largest share of ``limits.current`` that samples (n, 5) take."""
    limits = parameters.limits
    found = motor_currents(samples, parameters.machine, limits.radius).amplitude()
    return float(found.max()) / limits.current


def check_currents(
    samples: Kinematics, first_time: float, sample_time: float, parameters: ReferenceParameters
) -> None:
    """Refuse samples (n, 5) that take more than ``limits.current``.

    They are ``sample_time`` [s] apart, the first at ``first_time`` [s]. Raises
    :class:`UnreachableError` with the output that asks for most, and the time.
    """
    limits = parameters.limits
    amplitude = motor_currents(samples, parameters.machine, limits.radius).amplitude()
    over = amplitude > limits.current * (1.0 + _SLACK)
    if not over.any():
        return
    row = int(np.argwhere(over)[0, 0])
    motor = int(np.argmax(amplitude[row]))
    need = f'{amplitude[row, motor]:.3g} A in motor {motor + 1}'
    if not np.isfinite(amplitude[row, motor]):
        need = 'more attraction than there is'
    raise UnreachableError(
        f'unreachable reference: {AXES[_culprit(samples, row, parameters)]} needs {need} at '
        f'{first_time + row * sample_time:.3f} s (acceleration, springs and friction), currents '
        f'must stay within {limits.current:g} A'
    )


def _culprit(samples: Kinematics, row: int, parameters: ReferenceParameters) -> int:
    """The output without which least current would be needed at a row."""
    position, velocity, acceleration = (np.tile(values[row], (5, 1)) for values in samples)
    for axis in range(5):
        velocity[axis, axis] = acceleration[axis, axis] = 0.0
        if axis >= PHI:
            position[axis, axis] = 0.0
    left = Kinematics(position, velocity, acceleration)
    found = motor_currents(left, parameters.machine, parameters.limits.radius).amplitude()
    return int(np.argmin(found.max(axis=1)))
