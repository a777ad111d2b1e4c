"""The simulated stage in one record: the true machine, constants, and what changes with time."""

from __future__ import annotations

import dataclasses
import math
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from maglev_model.axes import FloatArray
from maglev_model.compiled.records import Record
from maglev_model.machine import Machine, machine_constants
from maglev_model.machine_array import MachineArray
from maglev_plant.effects.arrays import EffectArrays, effect_arrays
from maglev_plant.parameters import PlantParameters


class StageArrays(Record):
    """What ``dynamics.advance`` and ``encoder.encode`` take; its block is all there is of a stage.

    Axes are y, x, z, phi, theta; currents i_d of motors 1..4, then i_q; phases a, b, c of motor 1,
    then 2, 3, 4.
    """

    machine: MachineArray  # the true one

    step: float  # of integration [s]
    substeps: int  # per sample
    lag_start: float  # share of a current's lag at the start of a step, see _lag
    lag_middle: float  # in its middle
    lag_end: float  # left at its end; 0 without lag

    peak: float  # of a phase [A]
    continuous: float  # [A]
    thermal_gain: float  # 1 - exp(-sample time / thermal time)
    thermal_recovery: float  # load

    gap_resolution: float  # [m]
    horizontal_resolution: float
    gap_noise: float
    horizontal_noise: float
    seed: int

    coulomb: Annotated[FloatArray, 5]  # friction [m/s², rad/s²]
    coulomb_velocity: Annotated[FloatArray, 5]  # [m/s, rad/s]
    viscous: Annotated[FloatArray, 5]  # [1/s]
    locked: Annotated[NDArray[np.int8], 5]  # 1: locked
    constant: Annotated[FloatArray, 5]  # disturbance [m/s², rad/s²]
    amplitude: Annotated[FloatArray, 5]
    angular_frequency: Annotated[FloatArray, 5]  # [rad/s]
    phase: Annotated[FloatArray, 5]  # [rad]
    sinusoids: bool  # whether some disturbance is one

    lower: Annotated[FloatArray, 5]  # stops [m, rad]
    upper: Annotated[FloatArray, 5]
    seat_radius: float  # [m]
    gyration: float  # √(I_x / M_y) [m]
    stop_impulse: Annotated[FloatArray, 16]  # of the last contact, by faces, see ``stops`` [N s]

    sample: int  # number of samples so far
    state: Annotated[FloatArray, 10]  # x1..x10
    flowing: Annotated[FloatArray, 8]  # currents [A]
    target: Annotated[FloatArray, 8]  # what the amplifiers aim at [A]
    load: Annotated[FloatArray, 12]  # thermal load by phase
    limited: Annotated[NDArray[np.int8], 12]  # 1 where that phase has spent its budget

    lag: Annotated[FloatArray, 8]  # of the currents; this and the next two are ``advance``'s own
    current: Annotated[FloatArray, 3, 8]  # at the start, in the middle and at the end of a step
    work: Annotated[FloatArray, 6, 10]

    command: Annotated[FloatArray, 8]  # currents [A]
    reading: Annotated[FloatArray, 6]  # gaps of motors 1..4, x, z [m]

    effects: EffectArrays  # of a real stage


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
    )


def stage_arrays(parameters: PlantParameters) -> StageArrays:
    """A stage at its initial state, without current, amplifiers cold."""
    machine = true_machine(parameters)
    stage = StageArrays(
        machine=machine,
        seat_radius=parameters.stop.seat_radius,
        gyration=math.sqrt(machine.I_x / machine.M_y),
        lower=parameters.machine.lower_limit,
        upper=parameters.machine.upper_limit,
        **_integration(parameters),
        **_amplifiers(parameters),
        **_encoders(parameters),
        **_guides(parameters),
        **_disturbances(parameters, machine),
        effects=effect_arrays(parameters, machine, parameters.sample_time / parameters.substeps),
    )
    stage.state[::2] = parameters.initial.position
    stage.state[1::2] = np.array(parameters.initial.velocity) * np.logical_not(stage.locked)
    stage.effects.winding.last[:] = stage.state
    return stage


def _integration(parameters: PlantParameters) -> dict[str, Any]:
    step = parameters.sample_time / parameters.substeps
    start, middle, end = _lag(2.0 * math.pi * parameters.amplifier.bandwidth * step)
    return {
        'step': step,
        'substeps': parameters.substeps,
        'lag_start': start,
        'lag_middle': middle,
        'lag_end': end,
    }


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


def _amplifiers(parameters: PlantParameters) -> dict[str, Any]:
    amplifier = parameters.amplifier
    return {
        'peak': amplifier.peak_current,
        'continuous': amplifier.continuous_current,
        'thermal_gain': -math.expm1(-parameters.sample_time / amplifier.thermal_time),
        'thermal_recovery': amplifier.thermal_recovery,
    }


def _encoders(parameters: PlantParameters) -> dict[str, Any]:
    return {**dataclasses.asdict(parameters.encoder), 'seed': parameters.seed}


def _guides(parameters: PlantParameters) -> dict[str, Any]:
    return dataclasses.asdict(parameters.guide)


def _disturbances(parameters: PlantParameters, machine: Machine) -> dict[str, Any]:
    disturbance = parameters.disturbance
    mass = np.array([machine.M_y, machine.M_x, machine.M_z, machine.I_x, machine.I_x])
    return {
        'constant': np.array(disturbance.constant) / mass,
        'amplitude': np.array(disturbance.amplitude) / mass,
        'angular_frequency': 2.0 * math.pi * np.array(disturbance.frequency),
        'phase': disturbance.phase,
        'sinusoids': any(disturbance.amplitude),
    }
