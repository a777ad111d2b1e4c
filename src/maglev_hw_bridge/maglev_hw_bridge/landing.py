"""Landing without a controller: brake, level, descend, and end the current on the lower stop.

A simple law that needs nothing but the encoders: proportional and rate feedback on a smooth way
down, and the exact inverse of (1), (2) with gravity and the springs of (7). Also what a cut would
do: the speed at which the platen then strikes a stop.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.compiled import compiled
from maglev_model.machine import (
    Machine,
    machine_constants,
    machine_from_array,
    machine_to_array,
)
from maglev_model.motor import attraction_coefficients
from maglev_model.platen import gaps_from_outputs, output_accelerations

FloatArray = NDArray[np.float64]

_LEAST_BRAKING = 0.05  # [s]
_BRAKING_UPWARD = 0.1  # of y [s]
_FREE_STEP = 1e-4  # of the motion without current [s]
_LONGEST_FALL = 10.0  # [s]


@compiled
def ease(way: float, speed: float, duration: float, time: float) -> tuple[float, float, float]:
    """What is left of ``way`` [m] at ``time`` [s], with its first and second derivative.

    The quintic that starts with ``way`` and ``speed`` without acceleration and ends at rest in 0
    after ``duration`` [s].
    """
    if time >= duration:
        return 0.0, 0.0, 0.0
    s, v = time / duration, speed * duration
    c_3 = -10.0 * way - 6.0 * v
    c_4 = 15.0 * way + 8.0 * v
    c_5 = -6.0 * way - 3.0 * v
    left = way + s * (v + s * s * (c_3 + s * (c_4 + s * c_5)))
    first = v + s * s * (3.0 * c_3 + s * (4.0 * c_4 + s * 5.0 * c_5))
    second = s * (6.0 * c_3 + s * (12.0 * c_4 + s * 20.0 * c_5))
    return left, first / duration, second / (duration * duration)


@compiled
def currents(
    machine_array: FloatArray,
    position: FloatArray,
    acceleration: FloatArray,
    limit: float,
    i_d: FloatArray,
    i_q: FloatArray,
) -> None:
    """Write the i_d, i_q (4,) [A] that accelerate y, x, z, phi, theta, (5,), by (1), (2), (6), (7).

    ``position`` (5,) [m, rad]; no motor gets more than ``limit`` [A], what carries comes first.
    With a single motor that is motor 2, for y and x.
    """
    machine = machine_from_array(machine_array)
    gap = np.empty(4)
    gaps_from_outputs(machine, position, gap)
    single = machine.motors == 1.0
    share = machine.M_y * (acceleration[0] - machine.G) / machine.motors
    lever = 0.0 if single else 0.5 * machine.I_x / machine.r
    tilt_phi = lever * (acceleration[3] + machine.k_s_phi * position[3])
    tilt_theta = lever * (acceleration[4] + machine.k_s_theta * position[4])
    vertical = (share - tilt_phi, share + tilt_theta, share + tilt_phi, share - tilt_theta)
    factor = np.empty((4, 3))
    for i in range(4):
        factor[i, 0], factor[i, 1], factor[i, 2] = attraction_coefficients(machine, gap[i])
    along_x = factor[1, 2] if single else factor[1, 2] + factor[3, 2]
    u_x = -machine.M_x * acceleration[1] / along_x
    u_z = -machine.M_z * acceleration[2] / (factor[0, 2] + factor[2, 2])
    i_d[:] = 0.0
    i_q[:] = 0.0
    for i in range(1, 2) if single else range(4):
        a, b = factor[i, 0], factor[i, 1]
        wanted = u_z if i % 2 == 0 else u_x
        level = math.sqrt(max(-vertical[i], 0.0))
        carry = min(max((a - level) / b, -limit), limit)
        room = math.sqrt(max(limit * limit - carry * carry, 0.0))
        i_q[i] = min(max(wanted, -room), room)
        pull = max(-vertical[i] - (b * i_q[i]) ** 2, 0.0)
        i_d[i] = min(max((a - math.sqrt(pull)) / b, -limit), limit)


class LandingArrays(NamedTuple):
    """The way down, and the law that follows it; axes y, x, z, phi, theta."""

    machine: FloatArray  # (24,)
    stiffness: FloatArray  # (5,) [1/s²]
    damping: FloatArray  # (5,) [1/s]
    way: FloatArray  # (5,) from the start to where braking ends [m, rad], reversed
    speed: FloatArray  # (5,) at the start
    braking: FloatArray  # (5,) [s]
    level: FloatArray  # (5,) where braking ends [m, rad]
    timing: FloatArray  # (4,): elapsed, when the descent begins, how long it takes [s]; its aim [m]


@compiled
def land(
    arrays: LandingArrays,
    position: FloatArray,
    rate: FloatArray,
    limit: float,
    i_d: FloatArray,
    i_q: FloatArray,
) -> None:
    """Write the currents (4,) [A] for the present instant of the way down."""
    elapsed, start, duration, aim = arrays.timing
    wanted = np.empty(5)
    for axis in range(5):
        left, first, second = ease(
            arrays.way[axis], arrays.speed[axis], arrays.braking[axis], elapsed
        )
        target = arrays.level[axis] + left
        if axis == 0 and elapsed >= start:
            left, first, second = ease(arrays.level[0] - aim, 0.0, duration, elapsed - start)
            target = aim + left
        wanted[axis] = (
            second
            + arrays.damping[axis] * (first - rate[axis])
            + arrays.stiffness[axis] * (target - position[axis])
        )
    currents(arrays.machine, position, wanted, limit, i_d, i_q)


class Landing:
    """One landing after another: :meth:`begin`, then :meth:`step` once a sample until done."""

    def __init__(self, parameters: BridgeParameters) -> None:
        landing, machine, fault = parameters.landing, parameters.machine, parameters.fault
        self._landing = landing
        self._period = parameters.sample_time
        self._lower = np.maximum(np.array(machine.lower_limit), np.array(fault.lower))
        self._upper = np.minimum(np.array(machine.upper_limit), np.array(fault.upper))
        self.direct_current, self.quadrature_current = np.zeros(4), np.zeros(4)
        self.arrays = LandingArrays(
            machine=machine_to_array(machine_constants(machine)),
            stiffness=np.array(landing.stiffness),
            damping=np.array(landing.damping),
            way=np.zeros(5),
            speed=np.zeros(5),
            braking=np.full(5, landing.braking_time),
            level=np.zeros(5),
            timing=np.array(
                [0.0, landing.braking_time, landing.descent_time, machine.gap_max + landing.depth]
            ),
        )

    def begin(self, position: FloatArray, rate: FloatArray) -> None:
        """Start where the platen is: (5,) [m, rad] and per second."""
        a = self.arrays
        room = np.where(rate > 0.0, self._upper - position, position - self._lower)
        times = 1.5 * np.maximum(room, 0.0) / np.maximum(np.abs(rate), 1e-9)
        a.braking[:] = np.clip(times, _LEAST_BRAKING, self._landing.braking_time)
        if rate[0] < 0.0:  # towards the motors, where a tilt still takes room
            a.braking[0] = min(a.braking[0], _BRAKING_UPWARD)
        a.level[:] = np.clip(position + 0.5 * a.braking * rate, self._lower, self._upper)
        a.level[3:] = 0.0
        a.way[:] = position - a.level
        a.speed[:] = rate
        a.timing[0] = 0.0

    def step(self, position: FloatArray, rate: FloatArray) -> bool:
        """Compute the currents of the next sample; true when the landing is over."""
        timing = self.arrays.timing
        timing[0] += self._period
        land(
            self.arrays,
            position,
            rate,
            self._landing.current,
            self.direct_current,
            self.quadrature_current,
        )
        return bool(timing[0] > timing[1] + timing[2] + self._landing.settle_time)


@compiled
def _fall(
    machine: Machine, y: float, speed: float, upper_stop: float, lower_stop: float
) -> tuple[float, float]:
    zero = np.zeros(4)
    time = 0.0
    while upper_stop < y < lower_stop and time < _LONGEST_FALL:
        middle = y + 0.5 * _FREE_STEP * speed
        acceleration = output_accelerations(machine, middle, 0.0, 0.0, zero, zero)[0]
        speed += _FREE_STEP * acceleration
        y += _FREE_STEP * speed
        time += _FREE_STEP
    return y, speed


def impact_of_cut(parameters: BridgeParameters, y: float, speed: float) -> tuple[float, str]:
    """Speed [m/s] at which the platen strikes a stop when currents are cut, and which stop.

    From the air gap ``y`` [m] and its rate [m/s], level, without guide friction.
    """
    machine = parameters.machine
    end, speed = _fall(machine_constants(machine), y, speed, machine.gap_min, machine.gap_max)
    return abs(speed), 'upper' if end <= machine.gap_min else 'lower'
