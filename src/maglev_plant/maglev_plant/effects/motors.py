"""Forces of four motors that differ, each where it really is, with what (1), (2) leave out.

Magnets stronger by m and a winding stronger by w make ``K_v1 m²``, ``K_v2 m w``, ``K_v3 w²`` and
``K_h m w``, so that the fields still superpose. A motor at (X, Z) of the platen has the gap
``y + X sin θ - Z sin φ``, (5), and turns the platen with ``X F_V`` about θ and ``-Z F_V`` about φ.

Cogging, end and lateral forces have potentials, with s along the motor and u across it:
``-A t_1/2π cos(2π s/t_1 + ψ) exp(-2π (g - g_min)/t_1)``, ``F_e s⁴/(4 s_max³)``,
``F_l u²/(2 u_max)``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.compiled import borrowing
from maglev_model.compiled.records import Record
from maglev_model.force_table import ForceTable, force_table, tabulated_coefficients
from maglev_model.machine import Machine
from maglev_model.motor import forces_of_currents
from maglev_plant.effects.foreign import call_motor, motor_address
from maglev_plant.random_numbers import drawn

if TYPE_CHECKING:
    from maglev_plant.parameters import PlantParameters


class MotorArrays(Record):
    """The four motors; of a machine with one, motor 2 in the middle."""

    forces: ForceTable  # of one as its machine says
    first: int  # motors first to last - 1
    last: int
    place: Annotated[FloatArray, 4, 2]  # X, Z [m]
    cosine: Annotated[FloatArray, 4]  # of the angle of the thrust
    sine: Annotated[FloatArray, 4]
    magnet: Annotated[FloatArray, 4]
    winding: Annotated[FloatArray, 4]
    warm_magnet: float  # factor on every magnet now
    cogging: float  # [N]
    cogging_wave: float  # 2 pi / t_1 [rad/m]
    cogging_gap: float  # [m]
    cogging_phase: Annotated[FloatArray, 4]
    ripple: float
    ripple_wave: float  # [rad/m]
    end: Annotated[FloatArray, 4]  # [N/m³]
    lateral: Annotated[FloatArray, 4]  # [N/m]
    address: int  # of the foreign model, 0 for none
    out: Annotated[FloatArray, 2]  # what it writes


def motor_places(parameters: PlantParameters) -> FloatArray:
    """Where the motors are on the platen, along X and Z [m], shape (4, 2)."""
    motor, r = parameters.effects.motor, parameters.machine.radius
    if parameters.machine.motors == 1:
        return np.zeros((4, 2))
    out, across = np.array(motor.place_along), np.array(motor.place_across)
    return np.array(
        [
            [across[0], r + out[0]],
            [r + out[1], across[1]],
            [across[2], -r - out[2]],
            [-r - out[3], across[3]],
        ]
    )


def motor_arrays(parameters: PlantParameters, machine: Machine) -> MotorArrays:
    """The motors of a stage, spread by its seed."""
    motor, single = parameters.effects.motor, parameters.machine.motors == 1
    spread = 1.0 + motor.spread * drawn(parameters.seed, 'motor').standard_normal((2, 4))
    x_max, z_max = parameters.machine.x_max, parameters.machine.z_max
    along, across = np.array([z_max, x_max] * 2), np.array([x_max, z_max] * 2)
    return MotorArrays(
        forces=force_table(parameters.machine, machine),
        first=1 if single else 0,
        last=2 if single else 4,
        place=motor_places(parameters),
        cosine=np.cos(motor.angle),
        sine=np.sin(motor.angle),
        magnet=np.array(motor.magnet) * spread[0],
        winding=np.array(motor.winding) * spread[1],
        warm_magnet=1.0,
        cogging=motor.cogging,
        cogging_wave=2.0 * math.pi / machine.t_1,
        cogging_gap=parameters.machine.gap_min,
        cogging_phase=motor.cogging_phase,
        ripple=motor.ripple,
        ripple_wave=6.0 * math.pi / machine.tau,
        end=motor.end_force / along**3,
        lateral=motor.lateral_force / across,
        address=motor_address(motor.model) if motor.model else 0,
    )


@borrowing
def motor_gap(motors: MotorArrays, motor: int, state: FloatArray) -> tuple[float, float]:
    """Gap [m] of a motor and its rate [m/s], at a state x1..x10."""
    x, z = motors.place[motor, 0], motors.place[motor, 1]
    gap = state[0] + x * math.sin(state[8]) - z * math.sin(state[6])
    return gap, state[1] + x * state[9] - z * state[7]


@borrowing
def along_across(motors: MotorArrays, motor: int, x: float, z: float) -> tuple[float, float]:
    """A displacement or speed (x, z) along a motor's thrust and across it."""
    main, other = (z, x) if motor % 2 == 0 else (x, z)
    cosine, sine = motors.cosine[motor], motors.sine[motor]
    return main * cosine + other * sine, other * cosine - main * sine


@borrowing
def thrust_factor(motors: MotorArrays, along: float) -> float:
    """By how much ripple makes the thrust larger at a displacement [m] along the motor."""
    return 1.0 + motors.ripple * math.cos(motors.ripple_wave * along)


@borrowing
def motor_coefficients(
    machine: Machine, motors: MotorArrays, motor: int, gap: float, along: float
) -> tuple[float, float, float, float]:
    """k_1, k_2, k_3, k_h of ``force_coefficients`` for one of the motors."""
    k_1, k_2, k_3, k_h = tabulated_coefficients(motors.forces, machine, gap)
    m, w = motors.magnet[motor] * motors.warm_magnet, motors.winding[motor]
    return m * m * k_1, m * w * k_2, w * w * k_3, m * w * thrust_factor(motors, along) * k_h


@borrowing
def add_motor_forces(
    machine: Machine,
    motors: MotorArrays,
    state: FloatArray,
    current: FloatArray,
    force: FloatArray,
) -> None:
    """Add what the motors exert at a state, with i_d, i_q (8,) flowing, to ``force`` (5,)."""
    for motor in range(motors.first, motors.last):
        gap, _ = motor_gap(motors, motor, state)
        along, across = along_across(motors, motor, state[2], state[4])
        i_d, i_q = current[motor], current[4 + motor]
        if motors.address != 0:
            call_motor(motors.address, gap, i_d, i_q, motors.out.ctypes.data)
            down, push = motors.out[0], motors.out[1]
        else:
            coefficients = motor_coefficients(machine, motors, motor, gap, along)
            down, push = forces_of_currents(coefficients, i_d, i_q)
        if motors.cogging > 0.0:
            wave = motors.cogging_wave
            size = motors.cogging * math.exp(-wave * (gap - motors.cogging_gap))
            angle = wave * along + motors.cogging_phase[motor]
            push -= size * math.sin(angle)
            down -= size * math.cos(angle)
        push -= motors.end[motor] * along * along * along
        sideways = -motors.lateral[motor] * across
        cosine, sine = motors.cosine[motor], motors.sine[motor]
        main, other = push * cosine - sideways * sine, push * sine + sideways * cosine
        force[0] += down
        if motor % 2 == 0:
            force[2] += main
            force[1] += other
        else:
            force[1] += main
            force[2] += other
        force[3] -= motors.place[motor, 1] * down
        force[4] += motors.place[motor, 0] * down
