"""Phase currents of the windings: resistance, L(g), back-EMF, and the rail that limits them.

A motor's co-energy, with i the vector of its dq currents, is ``W' = W_m(g) + 3/2 (ψ·i + L(g)
|i|²/2)``. Its derivative by the gap is the force (2), term by term, hence ``dL/dg = -(4/3) K_v3
L_v3``: 93 mH from 20 to 30 mm. Each force of the magnets has the EMF that takes its power:

- along d ``(2/3) K_v2 L_v2`` times the speed of the gap, by (2);
- along q ``-(2/3) K_h L_h`` times that along the motor, by (1): 17 V per m/s at 25 mm.

What the amplifiers give is then copper loss, growth of the field energy ``3/4 L |i|²`` and
mechanical work of the forces, exactly. Were (1) the derivative of W' by the displacement too,
``K_v2 L_v2`` would be ``-(τ/π) d(K_h L_h)/dg``, of which the slots in (4) leave 0.89 to 0.95. K_v3
fixes the slope of L alone; its value at ``gap_max`` is a parameter, and L must stay positive at the
widest gap of a motor.

Each phase has an amplifier that makes its current follow a target by a first-order loop, as long as
the rail's voltage allows: ``v = R i + d(L i)/dt + e``, by the trapezoidal rule.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Final

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.commutation import direct_quadrature_currents, phase_currents
from maglev_model.compiled import borrowing
from maglev_model.compiled.arrays import copy_to
from maglev_model.compiled.records import Record
from maglev_model.machine import Machine
from maglev_model.motor import force_coefficients
from maglev_model.parameters import ParameterError
from maglev_plant.effects.motors import MotorArrays, along_across, motor_coefficients, motor_gap

if TYPE_CHECKING:
    from maglev_plant.parameters import PlantParameters

INTERVALS: Final = 64
_EMF: Final = 2.0 / 3.0
_SLOPE: Final = 4.0 / 3.0


class WindingArrays(Record):
    """Windings and current loops; phases a, b, c of motor 1, then 2, 3, 4."""

    on: bool  # whether the rail limits anything
    voltage: float  # [V]
    resistance: float  # cold [ohm]
    warm_copper: float  # factor on it now
    wave: float  # pi / tau [rad/m]
    offset: Annotated[FloatArray, 4]  # of the electrical angle [rad]
    decay: float  # of a current error over a step, without the rail
    mean: float  # of a current error in a step, likewise
    least_gap: float  # of the table [m]
    spacing: float  # [m]
    fixed: float  # what of L is no motor's own gap inductance [H]
    inductance: Annotated[FloatArray, INTERVALS + 1]  # that, for a winding of strength 1 [H]
    slope: Annotated[FloatArray, INTERVALS + 1]  # [H/m]
    phase: Annotated[FloatArray, 12]  # flowing [A]
    last: Annotated[FloatArray, 10]  # state when the last step began
    middle: Annotated[FloatArray, 10]  # state in the middle of the step that has begun
    limited: bool  # whether the rail limited a phase in this sample


def winding_arrays(parameters: PlantParameters, machine: Machine, step: float) -> WindingArrays:
    """Windings without current, for steps of ``step`` [s]; raises ParameterError."""
    given = parameters.effects.winding
    narrowest, widest = parameters.motor_gaps
    low = min(0.5 * parameters.machine.gap_min, narrowest)
    gaps = np.linspace(low, 1.5 * widest, INTERVALS + 1)
    slope = np.array([_inductance_slope(machine, g) for g in gaps])
    above = np.concatenate([[0.0], np.cumsum(_integrals(machine, gaps))])
    arrays = WindingArrays(
        on=given.voltage > 0.0,
        voltage=given.voltage,
        resistance=given.resistance,
        warm_copper=1.0,
        wave=math.pi / machine.tau,
        offset=parameters.effects.motor.commutation,
        least_gap=low,
        spacing=gaps[1] - gaps[0],
        inductance=above,
        slope=slope,
    )
    arrays.inductance[:] -= inductance(arrays.block[0], 1.0, parameters.machine.gap_max)
    arrays.fixed = given.inductance
    set_current_loop(arrays, parameters.amplifier.bandwidth, step)
    strongest = max(parameters.effects.motor.winding)
    least = inductance(arrays.block[0], strongest, widest)
    if arrays.on and least <= 0.0:
        raise ParameterError(
            f"parameter 'effects.winding.inductance' is {given.inductance:g} H, it must be more "
            f'than {given.inductance - least:.3g} H: K_v3 takes that away until the widest gap of '
            f'a motor, {1e3 * widest:.1f} mm'
        )
    return arrays


def set_current_loop(arrays: WindingArrays, bandwidth: float, step: float) -> None:
    """Let the current loops have a corner frequency [Hz], 0 for no lag."""
    steps = 2.0 * math.pi * bandwidth * step
    arrays.decay = math.exp(-steps) if steps > 0.0 else 0.0
    arrays.mean = -math.expm1(-steps) / steps if steps > 0.0 else 0.0


def _inductance_slope(machine: Machine, gap: float) -> float:
    return float(-_SLOPE * force_coefficients(machine, gap)[2])


def _integrals(machine: Machine, gaps: FloatArray) -> FloatArray:
    """The slope's integral over each interval, by Gauss and Legendre."""
    nodes, weights = np.polynomial.legendre.leggauss(6)
    half = 0.5 * (gaps[1] - gaps[0])
    return np.array(
        [
            half
            * sum(
                weight * _inductance_slope(machine, low + half * (1.0 + node))
                for node, weight in zip(nodes, weights, strict=True)
            )
            for low in gaps[:-1]
        ]
    )


@borrowing
def inductance(winding: WindingArrays, strength: float, gap: float) -> float:
    """L(g) [H] of a motor whose winding has that strength, by cubic Hermite interpolation."""
    place = (gap - winding.least_gap) / winding.spacing
    k = min(max(int(place), 0), INTERVALS - 1)
    t, h = place - k, winding.spacing
    a, b = winding.inductance[k], winding.inductance[k + 1]
    value = (
        (1.0 + 2.0 * t) * (1.0 - t) ** 2 * a
        + t * t * (3.0 - 2.0 * t) * b
        + h * t * (1.0 - t) * ((1.0 - t) * winding.slope[k] - t * winding.slope[k + 1])
    )
    return float(winding.fixed + strength * strength * value)


@borrowing
def _flow(
    winding: WindingArrays,
    current: float,
    target: float,
    emf: float,
    before: float,
    after: float,
    step: float,
) -> tuple[float, float]:
    """A phase's current after a step and its mean in it; ``before``, ``after``: L [H]."""
    flowing = target + winding.decay * (current - target)
    mean = target + winding.mean * (current - target)
    if not winding.on:
        return flowing, mean
    half = 0.5 * winding.resistance * winding.warm_copper * step
    needed = ((after + half) * flowing - (before - half) * current) / step + emf
    if abs(needed) <= winding.voltage:
        return flowing, mean
    winding.limited = True
    volts = math.copysign(winding.voltage, needed)
    flowing = (step * (volts - emf) + (before - half) * current) / (after + half)
    return flowing, 0.5 * (current + flowing)


@borrowing
def _find_middle(winding: WindingArrays, state: FloatArray, step: float) -> None:
    """The state in the middle of the step that begins, by the speeds' change in the last one."""
    middle = winding.middle
    copy_to(state, middle)
    for axis in range(5):
        speed = 2 * axis + 1
        middle[speed] += 0.5 * (state[speed] - winding.last[speed])
        middle[speed - 1] += 0.25 * step * (state[speed] + middle[speed])
    copy_to(state, winding.last)


@borrowing
def carry_currents(
    machine: Machine,
    motors: MotorArrays,
    winding: WindingArrays,
    state: FloatArray,
    target: FloatArray,
    step: float,
    mean: FloatArray,
) -> None:
    """Carry the phase currents over a step that begins at a state, towards ``target`` (12,) [A].

    Written: ``mean`` (8,), i_d and i_q in the middle of the step, by which the forces go.
    """
    _find_middle(winding, state, step)
    middle = winding.middle
    for motor in range(motors.first, motors.last):
        gap, gap_rate = motor_gap(motors, motor, middle)
        along, _ = along_across(motors, motor, middle[2], middle[4])
        speed, _ = along_across(motors, motor, middle[3], middle[5])
        angle = winding.wave * along + winding.offset[motor]
        before = after = e_a = e_b = e_c = 0.0
        if winding.on:
            strength = motors.winding[motor]
            _, k_2, _, k_h = motor_coefficients(machine, motors, motor, gap, along)
            before = inductance(winding, strength, gap - 0.5 * step * gap_rate)
            after = inductance(winding, strength, gap + 0.5 * step * gap_rate)
            e_d, e_q = _EMF * k_2 * gap_rate, -_EMF * k_h * speed
            e_a, e_b, e_c = phase_currents(e_d, e_q, angle)
        p = winding.phase[3 * motor : 3 * motor + 3]
        t = target[3 * motor : 3 * motor + 3]
        p[0], a = _flow(winding, p[0], t[0], e_a, before, after, step)
        p[1], b = _flow(winding, p[1], t[1], e_b, before, after, step)
        p[2], c = _flow(winding, p[2], t[2], e_c, before, after, step)
        mean[motor], mean[4 + motor] = direct_quadrature_currents(a, b, c, angle)


@borrowing
def flowing_currents(
    motors: MotorArrays, winding: WindingArrays, state: FloatArray, out: FloatArray
) -> None:
    """i_d and i_q that flow at a state, into ``out`` (8,)."""
    for motor in range(motors.first, motors.last):
        along, _ = along_across(motors, motor, state[2], state[4])
        angle = winding.wave * along + winding.offset[motor]
        p = winding.phase[3 * motor : 3 * motor + 3]
        i_d, i_q = direct_quadrature_currents(p[0], p[1], p[2], angle)
        out[motor], out[4 + motor] = i_d, i_q
