"""The simulated stage as flat arrays, which compiled functions take quickly from Python.

``scalars`` begins with the :class:`~maglev_model.machine.Machine` of the true plant; ``axes`` holds
what exists once per axis; ``memory`` is everything that changes with time.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from maglev_model.commutation import SCALES
from maglev_model.machine import Machine, machine_constants
from maglev_plant.parameters import PlantParameters

FloatArray = NDArray[np.float64]

# Indices into scalars, after the machine.
STEP: Final = len(Machine._fields)  # integration step [s]
SUBSTEPS: Final = STEP + 1
LAG_START: Final = STEP + 2  # share of a current's lag at the start of a step, see _lag
LAG_MIDDLE: Final = STEP + 3  # in its middle
LAG_END: Final = STEP + 4  # left at its end; 0 without lag
PEAK: Final = STEP + 5  # [A]
CONTINUOUS: Final = STEP + 6  # [A]
THERMAL_GAIN: Final = STEP + 7  # 1 - exp(-sample time / thermal time)
THERMAL_RECOVERY: Final = STEP + 8
DQ_SCALE: Final = STEP + 9
GAP_RESOLUTION: Final = STEP + 10  # [m]
HORIZONTAL_RESOLUTION: Final = STEP + 11
GAP_NOISE: Final = STEP + 12
HORIZONTAL_NOISE: Final = STEP + 13
SEED: Final = STEP + 14
SEAT_RADIUS: Final = STEP + 15  # [m]
GYRATION: Final = STEP + 16  # √(I_x / M_y) [m]
SINUSOIDS: Final = STEP + 17  # 1 when some disturbance is a sinusoid
SCALARS: Final = STEP + 18

# Rows of axes.
COULOMB: Final = 0  # [m/s², rad/s²]
COULOMB_VELOCITY: Final = 1  # [m/s, rad/s]
VISCOUS: Final = 2  # [1/s]
CONSTANT: Final = 3  # disturbance [m/s², rad/s²]
AMPLITUDE: Final = 4
ANGULAR_FREQUENCY: Final = 5  # [rad/s]
PHASE: Final = 6  # [rad]
LOWER: Final = 7  # stops [m, rad]
UPPER: Final = 8
LOCKED: Final = 9  # 1 when locked
ROWS: Final = 10

# Slices of memory, by their first index.
STATE: Final = 0  # x1..x10
FLOWING: Final = 10  # i_d of motors 1..4, then i_q [A]
TARGET: Final = 18  # what the amplifiers aim at, in the same order [A]
LOAD: Final = 26  # thermal load of phases a, b, c of motor 1, then 2, 3, 4
LIMITED: Final = 38  # 1 where that phase has spent its budget
SAMPLE: Final = 50  # number of samples so far
MEMORY: Final = 51


class StageArrays(NamedTuple):
    """What ``dynamics.advance`` and ``encoder.encode`` take."""

    scalars: FloatArray  # (SCALARS,)
    axes: FloatArray  # (ROWS, 5)
    memory: FloatArray  # (MEMORY,)
    command: FloatArray  # (8,): i_d of motors 1..4, then i_q [A]
    reading: FloatArray  # (6,): gaps of motors 1..4, x, z [m]


def true_machine(parameters: PlantParameters) -> Machine:
    """The machine with its offsets applied: the plant as it is, not as the controller knows it."""
    offset = parameters.offset
    p = parameters.machine
    machine = machine_constants(
        dataclasses.replace(
            p,
            mass_x=p.mass_x * offset.mass_x,
            mass_z=p.mass_z * offset.mass_z,
            mass_y=p.mass_y * offset.mass_y,
            inertia=p.inertia * offset.inertia,
            spring_phi=p.spring_phi * offset.spring_phi,
            spring_theta=p.spring_theta * offset.spring_theta,
        )
    )
    return machine._replace(
        K_v1=machine.K_v1 * offset.K_v1,
        K_v2=machine.K_v2 * offset.K_v2,
        K_v3=machine.K_v3 * offset.K_v3,
        K_h=machine.K_h * offset.K_h,
        C_v1=machine.C_v1 * offset.K_v1,
        C_v2=machine.C_v2 * offset.K_v2,
        C_v3=machine.C_v3 * offset.K_v3,
        C_x=machine.C_x * offset.K_h,
        C_z=machine.C_z * offset.K_h,
    )


def stage_arrays(parameters: PlantParameters) -> StageArrays:
    """The arrays of a stage at its initial state, without current."""
    machine = true_machine(parameters)
    return StageArrays(
        scalars=_scalars(parameters, machine),
        axes=_axes(parameters, machine),
        memory=initial_memory(parameters),
        command=np.zeros(8),
        reading=np.zeros(6),
    )


def initial_memory(parameters: PlantParameters) -> FloatArray:
    """``memory`` at the initial state, without current, amplifiers cold."""
    memory = np.zeros(MEMORY)
    memory[STATE : STATE + 10 : 2] = parameters.initial.position
    free = np.logical_not(parameters.guide.locked)
    memory[STATE + 1 : STATE + 10 : 2] = np.array(parameters.initial.velocity) * free
    return memory


def _scalars(parameters: PlantParameters, machine: Machine) -> FloatArray:
    amplifier, encoder = parameters.amplifier, parameters.encoder
    step = parameters.sample_time / parameters.substeps
    scalars = np.zeros(SCALARS)
    scalars[:STEP] = machine
    scalars[STEP] = step
    scalars[SUBSTEPS] = parameters.substeps
    scalars[LAG_START : LAG_END + 1] = _lag(2.0 * math.pi * amplifier.bandwidth * step)
    scalars[PEAK] = amplifier.peak_current
    scalars[CONTINUOUS] = amplifier.continuous_current
    scalars[THERMAL_GAIN] = -math.expm1(-parameters.sample_time / amplifier.thermal_time)
    scalars[THERMAL_RECOVERY] = amplifier.thermal_recovery
    scalars[DQ_SCALE] = SCALES[amplifier.dq_scaling]
    scalars[GAP_RESOLUTION] = encoder.gap_resolution
    scalars[HORIZONTAL_RESOLUTION] = encoder.horizontal_resolution
    scalars[GAP_NOISE] = encoder.gap_noise
    scalars[HORIZONTAL_NOISE] = encoder.horizontal_noise
    scalars[SEED] = parameters.seed
    scalars[SEAT_RADIUS] = parameters.stop.seat_radius
    scalars[GYRATION] = math.sqrt(machine.I_x / machine.M_y)
    scalars[SINUSOIDS] = float(any(parameters.disturbance.amplitude))
    return scalars


def _lag(steps: float) -> tuple[float, float, float]:
    """Shares of a current's lag that the integrator sees at start, middle and end of a step.

    ``steps`` is the step in time constants of the current loop, 0 for a loop without lag. The end
    is exact. Start and middle are what gives the classical Runge-Kutta weights the exact impulse
    and displacement of the decaying current, also where a step is longer than the time constant.
    """
    if steps == 0.0:
        return 0.0, 0.0, 0.0
    end = math.exp(-steps)
    mean = -math.expm1(-steps) / steps
    moment = (1.0 - mean) / steps  # of e^(-steps u) weighed with 1 - u, u from 0 to 1
    if steps < 1e-2:
        moment = 0.5 - steps / 6.0 + steps**2 / 24.0 - steps**3 / 120.0
    middle = 3.0 * (mean - moment) - 0.5 * end
    return 6.0 * moment - 2.0 * middle, middle, end


def _axes(parameters: PlantParameters, machine: Machine) -> FloatArray:
    guide, disturbance = parameters.guide, parameters.disturbance
    mass = np.array([machine.M_y, machine.M_x, machine.M_z, machine.I_x, machine.I_x])
    axes = np.zeros((ROWS, 5))
    axes[COULOMB] = guide.coulomb
    axes[COULOMB_VELOCITY] = guide.coulomb_velocity
    axes[VISCOUS] = guide.viscous
    axes[CONSTANT] = np.array(disturbance.constant) / mass
    axes[AMPLITUDE] = np.array(disturbance.amplitude) / mass
    axes[ANGULAR_FREQUENCY] = 2.0 * math.pi * np.array(disturbance.frequency)
    axes[PHASE] = disturbance.phase
    axes[LOWER] = parameters.machine.lower_limit
    axes[UPPER] = parameters.machine.upper_limit
    axes[LOCKED] = guide.locked
    return axes
