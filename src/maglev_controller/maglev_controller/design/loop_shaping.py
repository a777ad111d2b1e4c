"""Loop shaping of one axis as it runs sampled: compensators from e to w with an integrator.

A shape ``C(s) = K (1 + ω_i / s) F(s)`` has one figure left open, set here such that the sampled
loop with the plant ``1 / (s² - α)`` has the wanted phase margin at the wanted crossover. All is
computed as it runs: the compensator sampled by Tustin's rule, the plant exactly, with w held.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from maglev_controller.design.axis_design import AxisDesign, following_gain
from maglev_controller.design.derivative import derivative_filter
from maglev_controller.design.state_space import StateSpace, plant_system, response, tustin
from maglev_controller.parameters import CompensatorParameters, ControllerParameters
from maglev_model.axes import AXES
from maglev_model.parameters import ParameterError

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
    sampled = _fit(parameters, crossover, shape, plant_system(period, stiffness=stiffness), axis)
    gain = -np.concatenate(([sampled.direct, 0.0], sampled.output))
    antiwindup = np.zeros(sampled.input.size)
    if parameters.internal_model.antiwindup == 'observer':
        speed = parameters.internal_model.antiwindup_speed
        antiwindup = following_gain(sampled.state, gain[2:], period, speed, axis)
    derivative = parameters.derivative
    return AxisDesign(
        gain=gain,
        transition=sampled.state,
        drive=sampled.input,
        antiwindup=antiwindup,
        derivative=derivative_filter(derivative.bandwidth, period, derivative.discretisation),
        stiffness=stiffness,
    )


def _fit(
    parameters: ControllerParameters,
    crossover: float,
    shape: Shape,
    plant: StateSpace,
    axis: str,
) -> StateSpace:
    """The sampled compensator that has the phase margin at the crossover."""
    figures, period = parameters.compensator, parameters.sample_time
    z = np.array([np.exp(1j * crossover * period)])
    along = complex(response(plant, z)[0]) / complex(z[0]) ** parameters.input_delay

    def loop_gain(ratio: float) -> complex:
        return along * complex(response(tustin(shape(figures, crossover, ratio), period), z)[0])

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
    unit, gain = tustin(shape(figures, crossover, ratio), period), 1.0 / abs(loop_gain(ratio))
    return unit._replace(output=gain * unit.output, direct=gain * unit.direct)
