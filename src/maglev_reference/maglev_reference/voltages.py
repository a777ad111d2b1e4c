"""The voltage a reference takes: ``v = R i + d(L i)/dt + e`` of every motor, dq.

By co-energy the slope of L follows from K_v3, ``dL/dg = -(4/3) K_v3 L_v3``, and the EMF from K_v2
and K_h: in d ``(2/3) K_v2 L_v2`` times the speed of the gap, in q ``-(2/3) K_h L_h`` times that
along the motor, with ω L across.
"""

from __future__ import annotations

import math

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.geometry import motor_gaps
from maglev_model.machine import machine_constants
from maglev_model.motor import force_coefficients, inductances
from maglev_reference.currents import motor_currents
from maglev_reference.motion import Kinematics
from maglev_reference.parameters import ReferenceParameters

_GRID = 65  # gaps between which L is interpolated


def voltage_amplitudes(samples: Kinematics, parameters: ReferenceParameters) -> FloatArray:
    """Phase voltages (n - 1, 4) [V] that consecutive samples (n, 5) take between each other."""
    step, limits = parameters.sample_time, parameters.limits
    machine = machine_constants(parameters.machine)
    direct, quadrature, _ = motor_currents(samples, parameters)
    gap = motor_gaps(samples.position, parameters.machine.radius)
    stop = parameters.machine.gap_max
    table = np.linspace(min(gap.min(), stop), max(gap.max(), stop), _GRID)
    factors = np.array([force_coefficients(machine, g) for g in table])
    inductance = inductances(table, factors[:, 2], stop, limits.inductance)
    length, k_2, k_h = (
        np.interp(gap, table, y) for y in (inductance, factors[:, 1], factors[:, 3])
    )
    along = samples.velocity[:, [2, 1, 2, 1]]
    middle = [0.5 * (v[1:] + v[:-1]) for v in (direct, quadrature, length, along, k_2, k_h)]
    i_d, i_q, inductance, along, k_2, k_h = middle
    across = math.pi / machine.tau * along * inductance
    rate = np.diff(gap, axis=0) / step
    in_d = np.diff(length * direct, axis=0) / step - across * i_q + 2.0 / 3.0 * k_2 * rate
    in_q = np.diff(length * quadrature, axis=0) / step + across * i_d - 2.0 / 3.0 * k_h * along
    return np.asarray(np.hypot(limits.resistance * i_d + in_d, limits.resistance * i_q + in_q))


def voltage_utilisation(samples: Kinematics, parameters: ReferenceParameters) -> float:
    """The largest voltage that samples (n, 5) take, in ``limits.voltage``; 0 where any will do."""
    if parameters.limits.voltage == 0.0 or len(samples.position) < 2:
        return 0.0
    return float(voltage_amplitudes(samples, parameters).max()) / parameters.limits.voltage
