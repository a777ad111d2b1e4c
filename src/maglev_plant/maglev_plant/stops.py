"""The stops: rigid, inelastic, and exact at rest.

Platen positions are confined to a convex set: x, z and the tilts to intervals, and y so that seats
at a radius ρ from the centre stay in the gap range, y + ρ·|φ| ≤ gap_max and y + ρ·|θ| ≤ gap_max,
and likewise at gap_min. A platen on its stop therefore rests level, as on its guides; on a mere
point a slight torque would tilt it, since at 31 mm the magnets undo all but a fiftieth of the
torsional spring of θ.

A step that would leave the set moves to the nearest point of the set instead (nearest in the metric
of kinetic energy), and the velocity is the one that leads there. Projection on a convex set brings
two points no further apart, so contact never adds energy; a platen pressed on a stop stays exactly
there with velocity zero; and nothing holds a platen that is pulled off. Where the centre of mass is
aside (``effects.balance``) tilts and displacements are coupled, and the nearest point is sought by
impulses on what is touched, in turns until they agree (projected Gauss-Seidel: Hildreth, Naval
Research Logistics Quarterly 4, 1957).

The single gaps have no stops of their own by default: the paper's ellipse in 4DOF takes them from
18.6 to 31.4 mm. With the seats at the movers' radius they do.
"""

from __future__ import annotations

import math

from maglev_model.axes import PHI, THETA, FloatArray, X, Y, Z
from maglev_model.compiled import borrowing
from maglev_plant.arrays import StageArrays

_FACES = 16  # of the set: two of x, of z and of each tilt, then four seats above and four below
_SWEEPS = 500
_AGREED = 1e-8  # of what a step would leave the set by, at which impulses agree
_LEFT = 1e-6  # of the impulses, left to the exact projection


@borrowing
def _project_on_seat(
    depth: float, phi: float, theta: float, slope: float
) -> tuple[float, float, float]:
    """Nearest point of the cone ``depth + slope·max(|phi|, |theta|) ≤ 0``, all lengths [m]."""
    steep, flat = max(abs(phi), abs(theta)), min(abs(phi), abs(theta))
    push = (depth + slope * steep) / (1.0 + slope * slope)
    if push <= 0.0:
        return depth, phi, theta
    if steep - slope * push >= flat:
        depth -= push
        steep -= slope * push
    else:
        edge = max((steep + flat - slope * depth) / (2.0 + slope * slope), 0.0)
        depth, steep, flat = -slope * edge, edge, edge
    if abs(phi) >= abs(theta):
        return depth, math.copysign(steep, phi), math.copysign(flat, theta)
    return depth, math.copysign(flat, phi), math.copysign(steep, theta)


@borrowing
def _project_on_seat_one_tilt(depth: float, tilt: float, slope: float) -> tuple[float, float]:
    """Nearest point of ``depth + slope·|tilt| ≤ 0``, both lengths [m]."""
    push = (depth + slope * abs(tilt)) / (1.0 + slope * slope)
    if push <= 0.0:
        return depth, tilt
    if abs(tilt) - slope * push >= 0.0:
        return depth - push, tilt - math.copysign(slope * push, tilt)
    return 0.0, 0.0


@borrowing
def _seat(stage: StageArrays, depth: float, phi: float, theta: float) -> tuple[float, float, float]:
    """Bring y's ``depth`` into a stop [m] and the tilts [rad] to the seats' cone, locks kept."""
    radius, gyration = stage.seat_radius, stage.gyration
    slope = radius / gyration
    phi_free, theta_free = not stage.locked[PHI], not stage.locked[THETA]
    if stage.locked[Y]:
        if radius > 0.0:
            tilt = max(-depth, 0.0) / radius
            phi = min(max(phi, -tilt), tilt) if phi_free else phi
            theta = min(max(theta, -tilt), tilt) if theta_free else theta
        return depth, phi, theta
    if phi_free and theta_free:
        depth, b, c = _project_on_seat(depth, gyration * phi, gyration * theta, slope)
        return depth, b / gyration, c / gyration
    if phi_free:
        depth, b = _project_on_seat_one_tilt(depth, gyration * phi, slope)
        return min(depth, -radius * abs(theta)), b / gyration, theta
    if theta_free:
        depth, c = _project_on_seat_one_tilt(depth, gyration * theta, slope)
        return min(depth, -radius * abs(phi)), phi, c / gyration
    return min(depth, -radius * max(abs(phi), abs(theta))), phi, theta


@borrowing
def _clip(stage: StageArrays, axis: int, value: float) -> float:
    return float(min(max(value, stage.lower[axis]), stage.upper[axis]))


@borrowing
def _arrive(stage: StageArrays, before: FloatArray, axis: int, position: float) -> None:
    stage.state[2 * axis] = position
    stage.state[2 * axis + 1] = (position - before[2 * axis]) / stage.step


@borrowing
def apply_stops(stage: StageArrays, before: FloatArray) -> None:
    """Correct the state after a free step from state ``before``, shape (10,)."""
    state, step = stage.state, stage.step
    for axis in (X, Z):
        if state[2 * axis] != _clip(stage, axis, state[2 * axis]):
            free = before[2 * axis] + step * state[2 * axis + 1]
            _arrive(stage, before, axis, _clip(stage, axis, free))
    y, phi, theta = state[0], state[6], state[8]
    reach = stage.seat_radius * max(abs(phi), abs(theta))
    if (
        y + reach <= stage.upper[Y]
        and y - reach >= stage.lower[Y]
        and abs(phi) <= stage.upper[PHI]
        and abs(theta) <= stage.upper[THETA]
    ):
        return
    y = before[0] + step * state[1]
    phi = _clip(stage, PHI, before[6] + step * state[7])
    theta = _clip(stage, THETA, before[8] + step * state[9])
    depth, phi, theta = _seat(stage, y - stage.upper[Y], phi, theta)
    y = stage.upper[Y] + depth
    depth, phi, theta = _seat(stage, stage.lower[Y] - y, phi, theta)
    y = stage.lower[Y] - depth
    _arrive(stage, before, Y, y)
    _arrive(stage, before, PHI, phi)
    _arrive(stage, before, THETA, theta)


@borrowing
def _face(stage: StageArrays, face: int) -> tuple[int, float, int, float, float]:
    """One face of the set, ``n q[i] + m q[j] ≤ bound``: i, n, j, m and the bound."""
    sign = 1.0 - 2.0 * (face % 2)
    if face < 8:
        axis = X + face // 2
        return axis, sign, axis, 0.0, stage.upper[axis] if sign > 0.0 else -stage.lower[axis]
    tilt = PHI + (face // 2) % 2
    if face < 12:
        return Y, 1.0, tilt, sign * stage.seat_radius, stage.upper[Y]
    return Y, -1.0, tilt, sign * stage.seat_radius, -stage.lower[Y]


@borrowing
def _outside(stage: StageArrays, face: int, position: FloatArray, step: float) -> float:
    """How far behind a face a state is after another ``step`` [m, rad]."""
    i, n, j, m, bound = _face(stage, face)
    first = position[2 * i] + step * stage.state[2 * i + 1]
    second = position[2 * j] + step * stage.state[2 * j + 1]
    return float(n * first + m * second - bound)


@borrowing
def _push(
    stage: StageArrays, inverse: FloatArray, before: FloatArray, face: int, impulse: float
) -> tuple[float, float]:
    """Bring the step to a face, if it leaves the set there: the face's impulse then, and the way.

    ``impulse`` is what the face has given so far, of which it takes back what is too much.
    """
    way = _outside(stage, face, before, stage.step)
    if way <= 0.0 and impulse == 0.0:
        return 0.0, 0.0
    i, n, j, m, _ = _face(stage, face)
    gain = n * n * inverse[i, i] + 2.0 * n * m * inverse[i, j] + m * m * inverse[j, j]
    if gain <= 0.0:
        return 0.0, 0.0
    given = max(impulse + way / (stage.step * gain), 0.0)
    _give(stage, inverse, face, given - impulse)
    return given, abs(given - impulse) * stage.step * gain


@borrowing
def _give(stage: StageArrays, inverse: FloatArray, face: int, impulse: float) -> None:
    """Let a face give an impulse."""
    i, n, j, m, _ = _face(stage, face)
    for axis in range(5):
        stage.state[2 * axis + 1] -= impulse * (n * inverse[axis, i] + m * inverse[axis, j])


@borrowing
def _agree(stage: StageArrays, before: FloatArray) -> None:
    """Let all faces give what brings the velocity to that of the nearest point.

    Beginning with what they gave at the step before: a platen at rest takes the same from them.
    """
    inverse, impulse = stage.effects.balance.inverse, stage.stop_impulse
    furthest = 0.0
    for face in range(_FACES):
        furthest = max(furthest, _outside(stage, face, before, stage.step))
    for face in range(_FACES):
        if impulse[face] > 0.0:
            _give(stage, inverse, face, impulse[face])
    for _ in range(_SWEEPS):
        way = 0.0
        for face in range(_FACES):
            impulse[face], change = _push(stage, inverse, before, face, impulse[face])
            way = max(way, change)
        if way <= _AGREED * furthest:
            return


@borrowing
def apply_coupled_stops(stage: StageArrays, before: FloatArray, free: FloatArray) -> None:
    """As :func:`apply_stops` where masses are coupled; ``free`` (10,) is for its use."""
    state, balance, outside = stage.state, stage.effects.balance, False
    for face in range(_FACES):
        outside = outside or _outside(stage, face, state, 0.0) > 0.0
    if not outside:
        return
    for i in range(10):
        free[i] = state[i]
    _agree(stage, before)
    for i in range(1, 10, 2):
        state[i] = free[i] + (1.0 - _LEFT) * (state[i] - free[i])
        state[i - 1] = before[i - 1] + stage.step * state[i]
    apply_stops(stage, before)
    for axis, tilt, slide in ((X, THETA, balance.slide_x), (Z, PHI, balance.slide_z)):
        if stage.stop_impulse[2 * (axis - X)] + stage.stop_impulse[2 * (axis - X) + 1] == 0.0:
            turned = state[2 * tilt + 1] - free[2 * tilt + 1]
            state[2 * axis + 1] = free[2 * axis + 1] - slide * turned
            state[2 * axis] = before[2 * axis] + stage.step * state[2 * axis + 1]
