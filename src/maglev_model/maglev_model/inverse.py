"""From wanted accelerations w to motor currents: the two inverses of the plant (9).

``simplified_inverse`` is the paper's (8), (12), which leaves the quadratic terms of (9) out.
``exact_inverse`` gives every motor the attraction it must have and solves (2) for its i_d, the i_q
given. Both keep the currents within their limits and report what accelerations these give.

Arguments of both, all arrays float64: ``output`` y, x, z, phi, theta (5,) [m, rad]; ``wanted`` w
(5,) [m/s², rad/s²]; ``controlled`` (5,), an axis whose value is 0 gets no control, as the paper's
v_φ = v_θ = 0. Written is the :class:`Answer`. Both return what limited the currents, as bits, 0 for
nothing:

- :data:`CURRENT`: a current or a motor's amplitude is at its limit.
- :data:`LEVITATION` (of the exact inverse): the attraction wanted, of all motors or of a pair, is
  more or less than currents give; or a tilt wants more than its pair's attraction; or i_q was cut
  because of the attraction its motor must have. With CURRENT, where that i_q would fit but for the
  amplitude that i_d leaves.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.compiled import borrowing, compiled
from maglev_model.machine import Machine
from maglev_model.motor import attraction_coefficients
from maglev_model.platen import affine_terms, gaps_from_outputs

CURRENT: Final = 1
LEVITATION: Final = 2

_AT_LIMIT = 1.0 - 1e-9  # of the limit, for rounding

RESERVE = 1.1
"""Attraction a motor gets at least, in b² i_q²: at 1 its i_d has no slope left to act with."""


class CurrentLimits(NamedTuple):
    """What the currents must keep to."""

    current: float  # phase-current amplitude of a motor, sat_7 of (17) [A]
    levitation_first: float  # 1: i_q yields to the i_d that carries the platen; 0: each by itself
    least_attraction: float  # share of the weight always carried, so that the tilts keep authority
    along_z: float = 0.5  # share of the attraction that motors 1 and 3 have where nothing else asks
    tilt: float = 0.5  # share of the attraction by which two opposite motors may differ, at most


class Answer(NamedTuple):
    """What an inverse writes: arrays of float64."""

    direct: FloatArray  # i_d (4,) [A]
    quadrature: FloatArray  # i_q (4,) [A]
    realised: FloatArray  # (5,), what the limited currents give by the inverse's own model
    excess: FloatArray  # (2,), sat(u) − u of u_x, u_z [A]


NO_LIMITS = CurrentLimits(math.inf, 1.0, 0.0)
"""Any current: only what no current at all can give is out of reach."""


@borrowing
def clip(value: float, limit: float) -> float:
    """A value within ``limit`` of 0."""
    return min(max(value, -limit), limit)


@compiled
def simplified_inverse(
    machine: Machine,
    limits: CurrentLimits,
    controlled: FloatArray,
    output: FloatArray,
    wanted: FloatArray,
    answer: Answer,
) -> int:
    """The paper's (12) and (8), each current limited by itself; arguments: see the module."""
    direct, quadrature, realised, excess = answer
    gap = np.empty(4)
    gaps_from_outputs(machine, output, gap)
    a, b, c = np.empty(9), np.empty(6), np.empty(6)
    h_x, h_z = _horizontal_gains(machine, gap)
    u_x = controlled[1] * wanted[1] / h_x
    u_z = controlled[2] * wanted[2] / h_z
    sat_x, sat_z = clip(u_x, limits.current), clip(u_z, limits.current)
    affine_terms(machine, output[0], output[3], output[4], sat_x, sat_z, a, b, c)
    v_y, v_phi, v_theta = _solve_simplified(a, b, c, wanted, controlled)
    unlimited = (
        0.5 * (v_y + v_phi),
        0.5 * (v_y - v_theta),
        0.5 * (v_y - v_phi),
        0.5 * (v_y + v_theta),
    )
    saturated = sat_x != u_x or sat_z != u_z
    for motor in range(4):
        direct[motor] = clip(unlimited[motor], limits.current)
        quadrature[motor] = sat_z if motor % 2 == 0 else sat_x
        saturated = saturated or direct[motor] != unlimited[motor]
    v_y = 0.5 * (direct[0] + direct[1] + direct[2] + direct[3])
    v_phi, v_theta = direct[0] - direct[2], direct[3] - direct[1]
    realised[0] = a[0] + a[2] * v_y + a[1] * v_phi + a[6] * v_theta
    realised[1], realised[2] = h_x * sat_x, h_z * sat_z
    realised[3] = b[0] + b[2] * v_y + b[1] * v_phi
    realised[4] = c[0] + c[2] * v_y + c[1] * v_theta
    excess[0], excess[1] = sat_x - u_x, sat_z - u_z
    return CURRENT if saturated else 0


@borrowing
def _horizontal_gains(machine: Machine, gap: FloatArray) -> tuple[float, float]:
    """h_x, h_z of (11) [m/s² per A]."""
    _, _, h_1 = attraction_coefficients(machine, gap[0])
    _, _, h_2 = attraction_coefficients(machine, gap[1])
    _, _, h_3 = attraction_coefficients(machine, gap[2])
    _, _, h_4 = attraction_coefficients(machine, gap[3])
    return -(h_2 + h_4) / machine.M_x, -(h_1 + h_3) / machine.M_z


@borrowing
def _solve_simplified(
    a: FloatArray, b: FloatArray, c: FloatArray, wanted: FloatArray, controlled: FloatArray
) -> tuple[float, float, float]:
    """v_y, v_φ, v_θ of (12), without the rows and columns of axes that get no control."""
    phi, theta = controlled[3] / b[1], controlled[4] / c[1]
    rest_phi, rest_theta = phi * (wanted[3] - b[0]), theta * (wanted[4] - c[0])
    slope = a[2] - a[1] * phi * b[2] - a[6] * theta * c[2]
    v_y = controlled[0] * (wanted[0] - a[0] - a[1] * rest_phi - a[6] * rest_theta) / slope
    return v_y, rest_phi - phi * b[2] * v_y, rest_theta - theta * c[2] * v_y


@borrowing
def _single_motor_inverse(
    machine: Machine,
    limits: CurrentLimits,
    controlled: FloatArray,
    output: FloatArray,
    wanted: FloatArray,
    answer: Answer,
) -> int:
    """Motor 2 through the quadratic (2). See the module for the arguments.

    ``F_V = M_y (w_y - G)`` and ``F_H = M_x w_x`` with ``F_V = -P``, ``P = (a - b i_d)² + b² i_q²``.
    When levitation comes first, i_q gets what the attraction leaves: ``b² i_q² ≤ P`` and i_d within
    the amplitude. The other motors get no current.
    """
    direct, quadrature, realised, excess = answer
    a, b, h = attraction_coefficients(machine, output[0])
    gain = -h / machine.M_x
    u_x = controlled[1] * wanted[1] / gain
    pull = machine.M_y * (machine.G - wanted[0]) if controlled[0] != 0.0 else a * a
    attraction = max(pull, limits.least_attraction * machine.M_y * machine.G)
    limit = limits.current
    if limits.levitation_first != 0.0:
        root = max((a * a + attraction - (limit * b) ** 2) / (2.0 * a), 0.0)
        limit = min(limit, math.sqrt(max(attraction - root * root, 0.0)) / b)
    i_q = clip(u_x, limit)
    square = attraction - (b * i_q) ** 2
    i_d = (a - math.sqrt(max(square, 0.0))) / b
    limited = clip(i_d, limits.current)
    for motor in range(4):
        direct[motor] = limited if motor == 1 else 0.0
        quadrature[motor] = i_q if motor == 1 else 0.0
    made = (a - b * limited) ** 2 + (b * i_q) ** 2
    for axis in range(5):
        realised[axis] = 0.0
    realised[0], realised[1] = machine.G - made / machine.M_y, gain * i_q
    excess[0], excess[1] = i_q - u_x, 0.0
    limited_by = _cut_by(limits, u_x, i_q, limit)
    if abs(made - pull) > 1e-6 * machine.M_y * machine.G:
        limited_by |= CURRENT if limited != i_d else LEVITATION
        if attraction != pull or square < 0.0:
            limited_by |= LEVITATION
    return _with_amplitude(limits, limited_by, limited, i_q)


@borrowing
def _cut_by(limits: CurrentLimits, wanted: float, given: float, limit: float) -> int:
    """What cut an i_q to its ``limit``: the current, or the attraction that leaves less of it."""
    if given == wanted:
        return 0
    return LEVITATION if limit < limits.current else CURRENT


@borrowing
def _with_amplitude(limits: CurrentLimits, limited_by: int, i_d: float, i_q: float) -> int:
    """``limited_by``, with CURRENT where anything was limited and the amplitude is at its limit."""
    if limited_by != 0 and math.hypot(i_d, i_q) >= _AT_LIMIT * limits.current:
        return limited_by | CURRENT
    return limited_by


@compiled
def exact_inverse(
    machine: Machine,
    limits: CurrentLimits,
    controlled: FloatArray,
    output: FloatArray,
    wanted: FloatArray,
    answer: Answer,
) -> int:
    """Per motor through the quadratic (2). See the module for the arguments.

    With P the attraction of a motor, (6) and (7) ask for ΣP = M_y (G − w_y), P_1 − P_3 and P_4 −
    P_2. The fourth condition, of (8) that both pairs have the same sum of i_d, is here that they
    have the same attraction, P_1 + P_3 = P_2 + P_4. By (2), P = (a − b i_d)² + b² i_q², so i_d =
    (a − √(P − b² i_q²)) / b. Attraction cannot be negative: w_y is limited so that
    ``least_attraction`` stays, and a tilt gets at most the share ``tilt`` of it. Since P ≥ b² i_q²,
    a pair that needs much i_q, or turns the platen with more than half of the attraction, gets more
    than half, and what that cannot serve limits u_x and u_z. Of a machine with a single motor it is
    that motor that (2) is solved for.
    """
    work = np.empty((5, 4))
    return exact_inverse_with(work, machine, limits, controlled, output, wanted, answer)


@borrowing
def exact_inverse_with(
    work: FloatArray,
    machine: Machine,
    limits: CurrentLimits,
    controlled: FloatArray,
    output: FloatArray,
    wanted: FloatArray,
    answer: Answer,
) -> int:
    """As :func:`exact_inverse`, with room (5, 4) to work in."""
    if machine.motors == 1.0:
        return _single_motor_inverse(machine, limits, controlled, output, wanted, answer)
    direct, quadrature, realised, excess = answer
    gap, a, b, h, attraction = work[0], work[1], work[2], work[3], work[4]
    gaps_from_outputs(machine, output, gap)
    for motor in range(4):
        a[motor], b[motor], h[motor] = attraction_coefficients(machine, gap[motor])
    h_x, h_z = -(h[1] + h[3]) / machine.M_x, -(h[0] + h[2]) / machine.M_z
    u_x = controlled[1] * wanted[1] / h_x
    u_z = controlled[2] * wanted[2] / h_z
    limited_by = _allocate(machine, limits, controlled, output, wanted, a, b, u_x, u_z, attraction)
    limit_x = _quadrature_limit(limits, a, b, attraction, 1)
    limit_z = _quadrature_limit(limits, a, b, attraction, 0)
    sat_x, sat_z = clip(u_x, limit_x), clip(u_z, limit_z)
    limited_by |= _cut_by(limits, u_x, sat_x, limit_x) | _cut_by(limits, u_z, sat_z, limit_z)
    for motor in range(4):
        quadrature[motor] = sat_z if motor % 2 == 0 else sat_x
    for first in range(2):
        together = controlled[3 + first] == 0.0
        limited_by |= _direct_currents(
            limits, a, b, first, together, attraction, quadrature, direct
        )
    for motor in range(4):
        limited_by = _with_amplitude(limits, limited_by, direct[motor], quadrature[motor])
        root = a[motor] - b[motor] * direct[motor]
        attraction[motor] = root * root + (b[motor] * quadrature[motor]) ** 2
    lever = machine.r / machine.I_x
    total = attraction[0] + attraction[1] + attraction[2] + attraction[3]
    realised[0] = machine.G - total / machine.M_y
    realised[1], realised[2] = h_x * sat_x, h_z * sat_z
    realised[3] = lever * (attraction[0] - attraction[2]) - machine.k_s_phi * output[3]
    realised[4] = lever * (attraction[3] - attraction[1]) - machine.k_s_theta * output[4]
    excess[0], excess[1] = sat_x - u_x, sat_z - u_z
    return limited_by


@borrowing
def _allocate(
    machine: Machine,
    limits: CurrentLimits,
    controlled: FloatArray,
    output: FloatArray,
    wanted: FloatArray,
    a: FloatArray,
    b: FloatArray,
    u_x: float,
    u_z: float,
    attraction: FloatArray,
) -> int:
    """The attraction each motor shall have, (4,) [N]; LEVITATION where not all is possible."""
    weight = machine.M_y * machine.G
    total = machine.M_y * (machine.G - wanted[0])
    if controlled[0] == 0.0:
        total = a[0] * a[0] + a[1] * a[1] + a[2] * a[2] + a[3] * a[3]
    least = limits.least_attraction * weight
    saturated = total < least
    total = max(total, least)
    inertia = machine.I_x / machine.r
    phi = controlled[3] * inertia * (wanted[3] + machine.k_s_phi * output[3])
    theta = controlled[4] * inertia * (wanted[4] + machine.k_s_theta * output[4])
    most = limits.tilt * total
    saturated = saturated or abs(phi) > most or abs(theta) > most
    phi, theta = clip(phi, most), clip(theta, most)
    along_z = limits.along_z * total
    if limits.levitation_first != 0.0:
        bound = limits.current
        need_z = _pair_need(clip(u_z, bound), b[0], b[2], phi, 0.25 * least)
        need_x = _pair_need(clip(u_x, bound), b[1], b[3], -theta, 0.25 * least)
        if need_x + need_z > total:
            along_z = total * need_z / (need_x + need_z)
        else:
            along_z = min(max(along_z, need_z), total - need_x)
    along_x = total - along_z
    saturated = saturated or abs(phi) > along_z or abs(theta) > along_x
    phi, theta = clip(phi, along_z), clip(theta, along_x)
    attraction[0], attraction[2] = 0.5 * (along_z + phi), 0.5 * (along_z - phi)
    attraction[1], attraction[3] = 0.5 * (along_x - theta), 0.5 * (along_x + theta)
    return LEVITATION if saturated else 0


@borrowing
def _pair_need(i_q: float, b_one: float, b_two: float, difference: float, least: float) -> float:
    """Attraction [N] a pair needs for its i_q, when the first motor has ``difference`` more."""
    one = 2.0 * max(RESERVE * (b_one * i_q) ** 2, least) - difference
    two = 2.0 * max(RESERVE * (b_two * i_q) ** 2, least) + difference
    return max(one, two)


@borrowing
def _quadrature_limit(
    limits: CurrentLimits, a: FloatArray, b: FloatArray, attraction: FloatArray, first: int
) -> float:
    """Largest |i_q| [A] of a pair of motors, ``first`` and ``first + 2``.

    When levitation comes first, it is the i_q at which the motor still makes its attraction P
    within the amplitude L: i_d² + i_q² = (a² − 2 a s + P) / b² ≤ L² with s = √(P − b² i_q²).
    """
    largest = limits.current
    if limits.levitation_first == 0.0:
        return largest
    for motor in (first, first + 2):
        span = (limits.current * b[motor]) ** 2
        least_root = (a[motor] * a[motor] + attraction[motor] - span) / (2.0 * a[motor])
        room = attraction[motor] - max(least_root, 0.0) ** 2
        largest = min(largest, math.sqrt(max(room, 0.0)) / b[motor])
    return largest


@borrowing
def _direct_currents(
    limits: CurrentLimits,
    a: FloatArray,
    b: FloatArray,
    first: int,
    together: bool,
    attraction: FloatArray,
    quadrature: FloatArray,
    direct: FloatArray,
) -> int:
    """i_d of motors ``first`` and ``first + 2``, one for both where their tilt gets no control.

    Returns what limited them.
    """
    one, two = first, first + 2
    spent_one = (b[one] * quadrature[one]) ** 2
    spent_two = (b[two] * quadrature[two]) ** 2
    if together:
        square = b[one] * b[one] + b[two] * b[two]
        middle = a[one] * b[one] + a[two] * b[two]
        rest = a[one] ** 2 + a[two] ** 2 + spent_one + spent_two - attraction[one] - attraction[two]
        discriminant = middle * middle - square * rest
        impossible = discriminant < 0.0
        direct[one] = (middle - math.sqrt(max(discriminant, 0.0))) / square
        direct[two] = direct[one]
    else:
        square_one, square_two = attraction[one] - spent_one, attraction[two] - spent_two
        # The limit on i_q is computed with the same numbers; what is left below zero is rounding.
        impossible = (
            min(square_one + 1e-9 * attraction[one], square_two + 1e-9 * attraction[two]) < 0.0
        )
        direct[one] = (a[one] - math.sqrt(max(square_one, 0.0))) / b[one]
        direct[two] = (a[two] - math.sqrt(max(square_two, 0.0))) / b[two]
    limited_by = LEVITATION if impossible else 0
    for motor in (one, two):
        limited = clip(direct[motor], limits.current)
        if abs(limited - direct[motor]) > 1e-9:
            limited_by |= CURRENT
        direct[motor] = limited
    return limited_by
