"""The closed loop with somebody else's integrator carrying the plant from sample to sample.

The same encoders and the same compiled regulator, once a sample; between two samples the currents
are held, and the integrator has the plant between its stops, without the amplifiers' limits, which
the benchmark's flight does not meet.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import control
import numpy as np
from scipy.integrate import solve_ivp

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.axes import FloatArray
from maglev_plant.encoder import encode
from maglev_plant.simulation import SimulatedStage
from maglev_study.linear import StageAt, nonlinear_plant
from maglev_study.references import HOVER, References

STEPS = 10  # of MuJoCo in a sample
TOLERANCES = {'rtol': 1e-8, 'atol': 1e-11}

Carry = Callable[[FloatArray, FloatArray], FloatArray]
"""From states and the currents that flow (18,), and those commanded (8,), a sample on (18,)."""


def with_scipy(stage: SimulatedStage) -> Carry:
    """``scipy.integrate.solve_ivp``, adaptive."""
    at = StageAt(stage.parameters, HOVER)
    period, lag = stage.parameters.sample_time, at.lag

    def carry(state: FloatArray, command: FloatArray) -> FloatArray:
        off = state[10:] - command

        def rates(elapsed: float, y: FloatArray) -> FloatArray:
            return at.rates(0.0, y, command + off * np.exp(-lag * elapsed))

        found = solve_ivp(rates, (0.0, period), state[:10], **TOLERANCES)
        return np.append(found.y[:, -1], command + off * np.exp(-lag * period))

    return carry


def with_control(stage: SimulatedStage) -> Carry:
    """``control.input_output_response``, which has SciPy beneath it."""
    plant = nonlinear_plant(stage.parameters)
    instants = np.array([0.0, stage.parameters.sample_time])

    def carry(state: FloatArray, command: FloatArray) -> FloatArray:
        held = np.column_stack((command, command))
        found = control.input_output_response(
            plant, instants, held, state, solve_ivp_kwargs=TOLERANCES
        )
        return np.asarray(found.states[:, -1])

    return carry


def with_mujoco(stage: SimulatedStage) -> Carry:
    """MuJoCo's own Runge-Kutta steps on five bodies, a joint each, under our forces.

    The amplifiers' lag wants shorter steps than where it is integrated exactly. Raises ImportError
    where ``pip install mujoco`` is missing.
    """
    import mujoco

    at = StageAt(stage.parameters, HOVER)
    lag = at.lag
    model = mujoco.MjModel.from_xml_string(_free_axes(stage.parameters.sample_time / STEPS))
    data, order, joined = mujoco.MjData(model), slice(0, 10, 2), np.empty(10)
    command, off = np.zeros(8), np.zeros(8)

    def push(_: object, moving: mujoco.MjData) -> None:
        joined[::2], joined[1::2] = moving.qpos, moving.qvel
        flowing = command + off * np.exp(-lag * moving.time)
        moving.qfrc_passive[:] = at.rates(0.0, joined, flowing)[1::2]

    def carry(state: FloatArray, wanted: FloatArray) -> FloatArray:
        command[:], off[:] = wanted, state[10:] - wanted
        data.time, data.qpos[:], data.qvel[:] = 0.0, state[order], state[1:10:2]
        mujoco.set_mjcb_passive(push)
        mujoco.mj_step(model, data, nstep=STEPS)
        mujoco.set_mjcb_passive(None)
        joined[::2], joined[1::2] = data.qpos, data.qvel
        return np.concatenate((joined, command + off * np.exp(-lag * data.time)))

    return carry


def _free_axes(step: float) -> str:
    """Masses and inertias of 1, free to move along y, x, z and about X and Z: forces are rates."""
    inertia = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    joints = [
        f'<joint type="{kind}" axis="{axis}"/>'
        for kind, axis in zip(
            ('slide', 'slide', 'slide', 'hinge', 'hinge'),
            ('0 1 0', '1 0 0', '0 0 1', '1 0 0', '0 0 1'),
            strict=True,
        )
    ]
    bodies = ''.join(f'<body>{inertia}{joint}</body>' for joint in joints)
    return (
        f'<mujoco><option timestep="{step}" gravity="0 0 0" integrator="RK4"/>'
        f'<worldbody>{bodies}</worldbody></mujoco>'
    )


def fly(
    make: Callable[[SimulatedStage], Carry], stage: SimulatedStage, references: References
) -> tuple[float, FloatArray]:
    """Seconds that the loop takes with an integrator, and the true outputs (n, 5)."""
    regulator, carry, arrays = Regulator(ControllerParameters()), make(stage), stage.arrays
    reading, command = arrays.reading, np.zeros(8)
    outputs = np.empty_like(references.position)
    state = np.append(arrays.state, arrays.flowing)
    start = time.perf_counter()
    for k, reference in enumerate(zip(*references, strict=True)):
        outputs[k] = state[:10:2]
        arrays.state[:] = state[:10]
        encode(arrays.block)
        regulator.step(reading[:4], reading[4], reading[5], *reference, command[:4], command[4:])
        state = carry(state, command)
    return time.perf_counter() - start, outputs
