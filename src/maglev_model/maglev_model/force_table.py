"""The forces of a motor from a table over its air gap, for a plant that asks for them at each step.

In each of :data:`ROWS` intervals a polynomial through the values at Chebyshev's nodes. What it
gives differs from :mod:`maglev_model.motor` by at most :data:`TOLERANCE`, relatively, or it is not
used. Beyond the gaps that the stops leave, the formulas serve.
"""

from __future__ import annotations

import math
from typing import Annotated, Final

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.compiled import borrowing, compiled
from maglev_model.compiled.records import Record
from maglev_model.machine import Machine, MachineParameters
from maglev_model.machine_array import MachineArray, machine_from_array, machine_to_array
from maglev_model.motor import force_coefficients

ROWS: Final = 128
TOLERANCE: Final = 1e-13

_TERMS: Final = 6
_COEFFICIENTS: Final = 4
_NODES = 0.5 * np.cos(math.pi * (np.arange(_TERMS) + 0.5) / _TERMS)
_BETWEEN = 0.5 * np.cos(math.pi * np.arange(_TERMS + 1) / _TERMS)  # where it errs most


class ForceTable(Record):
    """``k_1``, ``k_2``, ``k_3``, ``k_h`` of one machine, as polynomials in the gap."""

    first: float  # gap [m]
    per_metre: float  # intervals
    row: Annotated[FloatArray, ROWS, _TERMS, _COEFFICIENTS]  # by powers, from that of zero


def force_table(parameters: MachineParameters, machine: Machine) -> ForceTable:
    """The table for all gaps that the stops of a machine leave its motors.

    ``machine`` has the constants, which may be off those of the ``parameters``.
    """
    tilt = parameters.radius * max(parameters.phi_max, parameters.theta_max)
    first, last = parameters.gap_min - tilt, parameters.gap_max + tilt
    width = (last - first) / ROWS
    middle = first + width * (np.arange(ROWS)[:, np.newaxis] + 0.5)
    constants = machine_to_array(machine)
    row = np.linalg.solve(
        np.vander(_NODES, increasing=True), _evaluated(constants, middle + width * _NODES)
    )
    found = np.vander(_BETWEEN, _TERMS, increasing=True) @ row
    exact = _evaluated(constants, middle + width * _BETWEEN)
    with np.errstate(invalid='ignore'):  # the formulas may not be finite everywhere
        good = bool(np.all(np.abs(found - exact) <= TOLERANCE * np.abs(exact)))
    return ForceTable(first=first if good else math.inf, per_metre=1.0 / width, row=row)


def _evaluated(constants: MachineArray, gaps: FloatArray) -> FloatArray:
    """By the formulas, at all of some gaps [m]: an array with one more dimension of four."""
    out = np.empty((gaps.size, _COEFFICIENTS))
    _evaluate(constants, gaps.ravel(), out)
    return out.reshape(*gaps.shape, _COEFFICIENTS)


@compiled
def _evaluate(constants: MachineArray, gaps: FloatArray, out: FloatArray) -> None:
    machine = machine_from_array(constants)
    for n in range(gaps.size):
        out[n, 0], out[n, 1], out[n, 2], out[n, 3] = force_coefficients(machine, gaps[n])


@borrowing
def tabulated_coefficients(
    table: ForceTable, machine: Machine, gap: float
) -> tuple[float, float, float, float]:
    """As :func:`~maglev_model.motor.force_coefficients` of the machine that the table is of."""
    place = (gap - table.first) * table.per_metre
    if not 0.0 <= place < ROWS:
        return force_coefficients(machine, gap)
    number = int(place)
    u = place - number - 0.5
    row = table.row[number]
    k_1, k_2, k_3, k_h = (
        row[_TERMS - 1, 0],
        row[_TERMS - 1, 1],
        row[_TERMS - 1, 2],
        row[_TERMS - 1, 3],
    )
    for power in range(_TERMS - 2, -1, -1):
        k_1 = k_1 * u + row[power, 0]
        k_2 = k_2 * u + row[power, 1]
        k_3 = k_3 * u + row[power, 2]
        k_h = k_h * u + row[power, 3]
    return k_1, k_2, k_3, k_h
