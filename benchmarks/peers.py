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
