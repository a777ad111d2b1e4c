"""Loop shaping of one axis as it runs sampled: compensators from e to w with an integrator.

A shape ``C(s) = K (1 + ω_i / s) F(s)`` has one figure left open, found here such that the sampled
loop with the plant ``1 / (s² - α)`` has the wanted phase margin at the wanted crossover. All is
computed as it runs: the compensator sampled by Tustin's rule, the plant exactly, with w held.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_discrete_are
from scipy.optimize import brentq

from maglev_controller.design.derivative import derivative_filter
from maglev_controller.design.gains import AxisDesign
from maglev_controller.design.internal_model import FloatArray, InternalModel, discretise
from maglev_controller.parameters import CompensatorParameters, ControllerParameters
from maglev_model.axes import AXES
from maglev_model.parameters import ParameterError


class StateSpace(NamedTuple):
    """``ξ̇ = A ξ + B e``, or ``ξ⁺ =`` when sampled, with the output ``c ξ + d e``.

    Shapes (n, n), (n,), (n,).
    """

    state: FloatArray
    input: FloatArray
    output: FloatArray
    direct: float


Shape = Callable[[CompensatorParameters, float, float], StateSpace]
"""A family of compensators: of its figures, the crossover ωc [rad/s], and the figure left open."""


def lead_lag(figures: CompensatorParameters, crossover: float, ratio: float) -> StateSpace:
    """``(1 + ω_i/s) (1 + s/ω_z) / (1 + s/ω_p)`` with ``ω_z = ωc / ratio``, ``ω_p = ωc · ratio``."""
    low, zero, pole = crossover / figures.lag, crossover / ratio, crossover * ratio
    integral = low
    at_pole = (1.0 - low / pole) * (1.0 - pole / zero) * pole  # residue
    return StateSpace(np.diag([0.0, -pole]), np.ones(2), np.array([integral, at_pole]), pole / zero)


def second_order_integral(
    figures: CompensatorParameters, crossover: float, ratio: float
) -> StateSpace:
    """``(1 + ω_i/s) (1 + s/ω_z) / (1 + √2 s/ω_r + s²/ω_r²)`` with ``ω_z = ωc / ratio``."""
    low, zero, high = crossover / figures.lag, crossover / ratio, crossover * figures.roll_off
    damping = math.sqrt(2.0) * high
    # Without the integral's ω_i / s: (c_1 s + c_0) / (s² + damping s + high²).
    c_1 = high**2 / zero - low
    c_0 = high**2 * (1.0 + low / zero) - low * damping
    state = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, high], [0.0, -high, -damping]])
    return StateSpace(state, np.array([1.0, 0.0, 1.0]), np.array([low, c_0 / high, c_1]), 0.0)


def tustin(system: StateSpace, period: float) -> StateSpace:
    """The system sampled with ``s = 2 (z - 1) / (T (z + 1))``, ``period`` T [s]."""
    half = 0.5 * period * system.state
    unit = np.eye(system.input.size)
    before = np.linalg.inv(unit - half)
    driven = period * (before @ system.input)
    return StateSpace(
        before @ (unit + half),
        driven,
        system.output @ before,
        system.direct + 0.5 * float(system.output @ driven),
    )


def plant(stiffness: float, period: float) -> tuple[FloatArray, FloatArray]:
    """``ë = α e + w``, w held over ``period`` [s]: state (e, ė), (2, 2), and input, (2,)."""
    transition, drive = discretise(
        np.array([[0.0, 1.0], [stiffness, 0.0]]), np.array([[0.0], [1.0]]), period
    )
    return transition, drive[:, 0]


def response(transition: FloatArray, drive: FloatArray, output: FloatArray, z: complex) -> complex:
    """``output (zI - transition)⁻¹ drive``."""
    return complex(output @ np.linalg.solve(z * np.eye(len(drive)) - transition, drive))


def shaped_axis(
    parameters: ControllerParameters, axis: str, shape: Shape, *, stiffness: float
) -> AxisDesign:
    """One axis with a compensator of a family, for a plant of stiffness α [1/s²].

    Raises :class:`ParameterError`, naming the axis, when the crossover is too high for the sample
    time, or when no compensator of the family has the phase margin.
    """
    figures, period = parameters.compensator, parameters.sample_time
    crossover = figures.crossover[AXES.index(axis)]
    if crossover * period >= 0.25 * math.pi:
        raise ParameterError(
            f'{axis}: a crossover of {crossover:g} rad/s is more than a quarter of what a sample '
            f'time of {period:g} s can hold ({math.pi / period:g} rad/s)'
        )
    open_plant = plant(stiffness, period)
    delay = parameters.input_delay
    sampled = _fit(figures, crossover, shape, open_plant, (period, delay), axis)
    n = sampled.input.size
    total = -np.concatenate(([sampled.direct, 0.0], sampled.output))
    antiwindup = np.zeros(n)
    if parameters.internal_model.antiwindup == 'observer':
        speed = parameters.internal_model.antiwindup_speed
        antiwindup = _antiwindup(sampled, speed * period)
    derivative = parameters.derivative
    return AxisDesign(
        model=InternalModel(
            np.zeros(1),
            sampled.state,
            sampled.input,
            np.zeros(n),
            np.zeros(n, dtype=np.int64),
            'compensator',
        ),
        gain=total,
        total_gain=total,
        transition=sampled.state,
        drive=sampled.input,
        antiwindup=antiwindup,
        derivative=derivative_filter(derivative.bandwidth, period, derivative.discretisation),
        stiffness=stiffness,
    )


def _fit(
    figures: CompensatorParameters,
    crossover: float,
    shape: Shape,
    open_plant: tuple[FloatArray, FloatArray],
    timing: tuple[float, int],
    axis: str,
) -> StateSpace:
    """The sampled compensator with the phase margin; ``timing``: sample time [s], delay."""
    period, delay = timing
    z = complex(np.exp(1j * crossover * period))
    along = response(*open_plant, np.array([1.0, 0.0]), z) / z**delay

    def loop_gain(ratio: float) -> complex:
        found = tustin(shape(figures, crossover, ratio), period)
        return along * (found.direct + response(found.state, found.input, found.output, z))

    def missing(ratio: float) -> float:
        return math.degrees(np.angle(-loop_gain(ratio))) - figures.phase_margin

    ratios = np.geomspace(1.0, 30.0, 60)
    margins = np.array([missing(float(ratio)) for ratio in ratios])
    enough = np.nonzero(margins >= 0.0)[0]
    if enough.size == 0:
        raise ParameterError(
            f'{axis}: a compensator of this kind has at most a phase margin of '
            f'{margins.max() + figures.phase_margin:.1f} deg at {crossover:g} rad/s, not '
            f"{figures.phase_margin:g}: lower 'compensator.crossover' or "
            "'compensator.phase_margin', or raise 'compensator.lag'"
        )
    first = int(enough[0])
    ratio = float(ratios[first])
    if first > 0:
        ratio = float(brentq(missing, ratios[first - 1], ratios[first], xtol=1e-9))
    found, gain = tustin(shape(figures, crossover, ratio), period), 1.0 / abs(loop_gain(ratio))
    return found._replace(output=gain * found.output, direct=gain * found.direct)


def _antiwindup(compensator: StateSpace, noise: float) -> FloatArray:
    """E (n,) by which the compensator follows what was realised, as ``design.observer_gain``."""
    kappa = -compensator.output
    scale = float(np.linalg.norm(kappa))
    direction = kappa / scale
    solution = solve_discrete_are(
        compensator.state.T, direction[:, None], np.eye(kappa.size) * noise**2, np.eye(1)
    )
    gain: FloatArray = compensator.state @ solution @ direction
    gain /= (1.0 + direction @ solution @ direction) * scale
    return gain
