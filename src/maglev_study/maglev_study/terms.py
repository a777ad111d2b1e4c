"""How large the terms of (9) are over the operating range: the paper's (10) and Fig. 3.

The paper keeps a_1, a_2, a_3, a_7, b_1..b_3, c_1..c_3 and drops the products of inputs. What is
dropped is weighed here against what is kept, at the currents that the platen needs.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from maglev_model.axes import FloatArray
from maglev_model.machine import Machine
from maglev_model.motor import force_coefficients
from maglev_model.platen import affine_terms

POWERS = {
    'a': (
        (0, 0, 0),
        (0, 1, 0),
        (1, 0, 0),
        (1, 1, 0),
        (0, 2, 0),
        (2, 0, 0),
        (0, 0, 1),
        (1, 0, 1),
        (0, 0, 2),
    ),
    'b': ((0, 0, 0), (0, 1, 0), (1, 0, 0), (1, 1, 0), (0, 2, 0), (2, 0, 0)),
    'c': ((0, 0, 0), (0, 0, 1), (1, 0, 0), (1, 0, 1), (0, 0, 2), (2, 0, 0)),
}
"""The power of v_y, v_phi and v_theta that each term of (9) multiplies; ``POWERS['a'][0]`` is that
of a_1."""

MAIN = {'a': 2, 'b': 1, 'c': 1}
"""The linear term of each equation by which its own input acts: a_3, b_2, c_2."""

_NEWTON_STEPS = 30


@dataclasses.dataclass(frozen=True, kw_only=True)
class TiltRange:
    """The tilts that (10) maximises over, from minus to plus these [rad], and in how many steps."""

    phi: float = 0.003
    theta: float = 0.014
    steps: int = 12

    def __iter__(self) -> Iterator[tuple[float, float]]:
        """All pairs phi, theta of the grid [rad]; zero is one of them when ``steps`` is even."""
        for phi in np.linspace(-self.phi, self.phi, self.steps + 1):
            for theta in np.linspace(-self.theta, self.theta, self.steps + 1):
                yield float(phi), float(theta)


@dataclasses.dataclass(frozen=True)
class Terms:
    """The terms of (9) at one place, or what is largest of each: a (..., 9), b and c (..., 6)."""

    a: FloatArray
    b: FloatArray
    c: FloatArray

    def __getitem__(self, equation: str) -> FloatArray:
        """The terms of the equation ``a``, ``b`` or ``c``."""
        found: FloatArray = getattr(self, equation)
        return found


def terms(machine: Machine, y: float, phi: float, theta: float) -> Terms:
    """The terms of (9) at one air gap [m] and tilt [rad], with u_x = u_z = 0."""
    found = Terms(np.empty(9), np.empty(6), np.empty(6))
    affine_terms(machine, y, phi, theta, 0.0, 0.0, found.a, found.b, found.c)
    return found


def largest_terms(machine: Machine, gaps: ArrayLike, tilts: TiltRange) -> Terms:
    """The largest magnitudes over the tilts, for each air gap: (10).

    ``gaps`` [m], shape (n,); a is shaped (n, 9), b and c (n, 6), in the units of
    :func:`maglev_model.platen.affine_terms`.
    """
    rows = []
    for gap in np.asarray(gaps, float):
        places = [terms(machine, float(gap), phi, theta) for phi, theta in tilts]
        rows.append([np.abs([place[name] for place in places]).max(axis=0) for name in 'abc'])
    return Terms(*(np.array(column) for column in zip(*rows, strict=True)))


def input_matrix(
    machine: Machine, y: float, phi: float, theta: float, *, at_motors: bool = False
) -> FloatArray:
    """The matrix that (12) inverts: rows y, phi, theta, columns v_y, v_phi, v_theta, shape (3, 3).

    ``at_motors`` gives the rows of phi and theta as accelerations at the motors (times r), so that
    all entries are in m/s² per ampere and a condition number does not depend on units.
    """
    found = terms(machine, y, phi, theta)
    matrix = np.array(
        [
            [found.a[2], found.a[1], found.a[6]],
            [found.b[2], found.b[1], 0.0],
            [found.c[2], 0.0, found.c[1]],
        ]
    )
    if at_motors:
        matrix[1:] *= machine.r
    return matrix


def condition_range(
    machine: Machine, gap: float, tilts: TiltRange, *, at_motors: bool = False
) -> tuple[float, float]:
    """Least and greatest condition number (2-norm) of the matrix in (12) over the tilts."""
    found = [
        float(np.linalg.cond(input_matrix(machine, gap, phi, theta, at_motors=at_motors)))
        for phi, theta in tilts
    ]
    return min(found), max(found)


def hover_current(machine: Machine, gap: float) -> float:
    """The direct current i_d of each motor that carries the level platen [A], by (2), (6).

    ``gap`` [m]. Raises ValueError when not even full field weakening makes the attraction as small
    as the weight.
    """
    k_1, k_2, k_3, _ = force_coefficients(machine, gap)
    weight = machine.M_y * machine.G / machine.motors
    root = k_2 * k_2 - 4.0 * k_3 * (k_1 - weight)
    if root < 0.0:
        raise ValueError(f'no direct current makes the platen hover at a gap of {gap:g} m')
    return float((k_2 - math.sqrt(root)) / (2.0 * k_3))


def contributions(found: Terms, inputs: ArrayLike) -> Terms:
    """What each term of (9) adds to the accelerations with inputs v_y, v_phi, v_theta [A]."""
    v = np.asarray(inputs, float)
    return Terms(*(found[name] * np.prod(v ** np.array(POWERS[name]), axis=1) for name in 'abc'))


def holding_inputs(machine: Machine, y: float, phi: float, theta: float) -> FloatArray:
    """The inputs v_y, v_phi, v_theta [A] with which (9) has no acceleration, shape (3,).

    Raises ValueError when the platen cannot be held there.
    """
    found = terms(machine, y, phi, theta)
    v = np.zeros(3)
    for _ in range(_NEWTON_STEPS):
        parts = contributions(found, v)
        acceleration = np.array([parts[name].sum() for name in 'abc'])
        if np.abs(acceleration).max() < 1e-10:
            return v
        v = v - np.linalg.solve(_gradient(found, v), acceleration)
    raise ValueError(
        f'the platen cannot be held at y = {y:g} m, phi = {phi:g} rad, theta = {theta:g} rad'
    )


def _gradient(found: Terms, v: FloatArray) -> FloatArray:
    """Derivatives of the right-hand sides of (9) by v, shape (3, 3)."""
    gradient = np.zeros((3, 3))
    for row, name in enumerate('abc'):
        for term, powers in zip(found[name], POWERS[name], strict=True):
            for column, power in enumerate(powers):
                if power:
                    rest = np.array(powers)
                    rest[column] -= 1
                    gradient[row, column] += term * power * float(np.prod(v**rest))
    return gradient


@dataclasses.dataclass(frozen=True)
class Holding:
    """What it takes to hold any tilt at one air gap, and what dropping terms does to it.

    ``current`` is the largest direct current of any motor [A]; ``linear`` and ``dropped`` the
    largest sums of the linear and of the dropped terms of y, phi, theta [m/s², rad/s²], shape (3,).
    """

    current: float
    linear: FloatArray
    dropped: FloatArray


def holding(machine: Machine, gap: float, tilts: TiltRange) -> Holding:
    """Hold the platen at all tilts of a range; raises ValueError where it cannot be held."""
    current, sums = 0.0, []
    for phi, theta in tilts:
        v = holding_inputs(machine, gap, phi, theta)
        parts = contributions(terms(machine, gap, phi, theta), v)
        current = max(current, float(np.abs(direct_currents(v)).max()))
        sums.append([[_of_order(parts, name, order) for name in 'abc'] for order in (1, 2)])
    linear, dropped = np.abs(sums).max(axis=0)
    return Holding(current, linear, dropped)


def direct_currents(inputs: ArrayLike) -> FloatArray:
    """The direct currents u_y1..u_y4 from v_y, v_phi, v_theta, (8) [A], shape (4,)."""
    v_y, v_phi, v_theta = np.asarray(inputs, float)
    return 0.5 * np.array([v_y + v_phi, v_y - v_theta, v_y - v_phi, v_y + v_theta])


def negligible_up_to(largest: Terms, share: float) -> Terms:
    """The direct current up to which a term stays below a share of the linear one [A].

    The linear one is a_3, b_2 or c_2 (:data:`MAIN`). With ``i_d`` in the motors at most ``i``, the
    inputs are at most ``2 i``, so a dropped term is to the linear one as ``2 i |term| / |linear|``.
    Shaped as ``largest``; infinite for terms that are zero, NaN for those that are no products.
    """
    columns = []
    for name in 'abc':
        values = largest[name]
        linear = values[..., MAIN[name], None]
        with np.errstate(divide='ignore'):
            current = share * linear / (2.0 * values)
        columns.append(np.where(_order(name) == 2, current, np.nan))
    return Terms(*columns)


def dropped() -> Iterator[tuple[str, int]]:
    """The terms that (11) leaves out: equation and index, ``('a', 3)`` being a_4."""
    for name in 'abc':
        for index in np.flatnonzero(_order(name) == 2):
            yield name, int(index)


def _order(name: str) -> NDArray[np.int64]:
    order: NDArray[np.int64] = np.array(POWERS[name]).sum(axis=1)
    return order


def _of_order(parts: Terms, name: str, order: int) -> float:
    return float(parts[name][_order(name) == order].sum())
