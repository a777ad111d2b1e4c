"""Currents within the voltage: what the windings allow from one sample to the next.

A phase's amplifier has ``v = R i + d(L i)/dt + e`` and no more than its rail. By co-energy the
slope of L follows from K_v3, ``dL/dg = -(4/3) K_v3 L_v3``, and the EMF from K_v2 and K_h: in d
``(2/3) K_v2 L_v2`` times the speed of the gap, in q ``-(2/3) K_h L_h`` times that along the motor.
In the frame that turns with the electrical angle the same holds for i_d and i_q with ω L across.
Currents that would need more are approached as far as the voltage takes them, of each motor by
itself and in the direction wanted; what the platen then makes of it is what the law calls realised.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from maglev_controller.step.arrays import EXACT, INTERVALS, Record
from maglev_model.axes import FloatArray
from maglev_model.compiled import borrowing
from maglev_model.machine import Machine, machine_constants
from maglev_model.motor import force_coefficients, inductances
from maglev_model.platen import gaps_from_outputs, output_accelerations

if TYPE_CHECKING:
    from maglev_controller.parameters import ControllerParameters

USED: Final = 0.85
"""Share of the voltage that is used: the current loop is to arrive within the sample."""


def winding_settings(parameters: ControllerParameters) -> dict[str, ArrayLike]:
    """The fields of WINDING."""
    given, limits = parameters.winding, parameters.machine
    machine = machine_constants(limits)
    reach = limits.radius * max(limits.phi_max, limits.theta_max)
    gaps = np.linspace(0.5 * limits.gap_min, limits.gap_max + reach, INTERVALS + 1)
    k_3 = np.array([force_coefficients(machine, gap)[2] for gap in gaps])
    return {
        'limits': given.voltage > 0.0,
        'voltage': USED * given.voltage,
        'resistance': given.resistance,
        'least_gap': gaps[0],
        'spacing': gaps[1] - gaps[0],
        'inductance': inductances(gaps, k_3, limits.gap_max, given.inductance),
    }


@borrowing
def _inductance(winding: Record, gap: float) -> tuple[float, float]:
    """L [H] and its slope [H/m] at an air gap."""
    place = (gap - winding.least_gap) / winding.spacing
    k = min(max(int(place), 0), INTERVALS - 1)
    rise = winding.inductance[k + 1] - winding.inductance[k]
    return winding.inductance[k] + (place - k) * rise, rise / winding.spacing


@borrowing
def _share(voltage: float, free_d: float, free_q: float, step_d: float, step_q: float) -> float:
    """Largest share, 0 to 1, of a step's voltages that with the free ones is within the rail."""
    square = step_d * step_d + step_q * step_q
    along = free_d * step_d + free_q * step_q
    rest = free_d * free_d + free_q * free_q - voltage * voltage
    if square + 2.0 * along + rest <= 0.0:
        return 1.0
    if square == 0.0:
        return 0.0
    root = along * along - square * rest
    if root < 0.0:
        return min(max(-along / square, 0.0), 1.0)
    return min(max((math.sqrt(root) - along) / square, 0.0), 1.0)


@borrowing
def keep_within_voltage(
    settings: Record,
    machine: Machine,
    sample: Record,
    axes: Record,
    direct: FloatArray,
    quadrature: FloatArray,
) -> bool:
    """Shorten the steps of ``direct`` and ``quadrature`` (4,) to what the voltage gives.

    True when one was; ``realised`` of the sample is then what all currents make, where the inverse
    is exact. Of another inverse it is what that has told and what the shortening changes of it: by
    how much its own model is off is no acceleration that was lost. ``asked`` of the sample, from
    which the next step goes, is kept without limits too: they may be set in flight.
    """
    if not settings.winding.limits:
        for motor in range(4):
            sample.asked[motor], sample.asked[4 + motor] = direct[motor], quadrature[motor]
        return False
    winding, before, shortened = settings.winding, sample.asked, False
    gap, whole_d, whole_q = sample.work[0], sample.work[1], sample.work[2]  # the inverse is done
    gaps_from_outputs(machine, sample.position, gap)
    rate = axes[0].smooth_velocity
    tilt_phi = machine.r * axes[3].smooth_velocity
    tilt_theta = machine.r * axes[4].smooth_velocity
    for motor in range(4):
        whole_d[motor], whole_q[motor] = direct[motor], quadrature[motor]
        turn = (-tilt_phi, tilt_theta, tilt_phi, -tilt_theta)[motor]
        speed = axes[2].smooth_velocity if motor % 2 == 0 else axes[1].smooth_velocity
        inductance, slope = _inductance(winding, gap[motor])
        _, k_2, _, k_h = force_coefficients(machine, gap[motor])
        i_d, i_q = before[motor], before[4 + motor]
        still = winding.resistance + slope * (rate + turn)
        across = math.pi / machine.tau * speed * inductance
        free_d = still * i_d - across * i_q + 2.0 / 3.0 * k_2 * (rate + turn)
        free_q = still * i_q + across * i_d - 2.0 / 3.0 * k_h * speed
        per_ampere = inductance / settings.period + 0.5 * winding.resistance
        step_d, step_q = direct[motor] - i_d, quadrature[motor] - i_q
        share = _share(winding.voltage, free_d, free_q, per_ampere * step_d, per_ampere * step_q)
        if share < 1.0:
            shortened = True
            direct[motor], quadrature[motor] = i_d + share * step_d, i_q + share * step_q
        before[motor], before[4 + motor] = direct[motor], quadrature[motor]
    if shortened:
        y, phi, theta = sample.position[0], sample.position[3], sample.position[4]
        made = output_accelerations(machine, y, phi, theta, direct, quadrature)
        if settings.inverse == EXACT:
            for index in range(5):
                sample.realised[index] = made[index]
        else:
            whole = output_accelerations(machine, y, phi, theta, whole_d, whole_q)
            for index in range(5):
                sample.realised[index] += made[index] - whole[index]
    return shortened
