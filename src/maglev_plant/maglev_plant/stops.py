"""The stops: rigid, inelastic, and exact at rest.

Platen positions are confined to a convex set: x, z and the tilts to intervals, and y so that seats
at a radius ρ from the centre stay in the gap range, y + ρ·|φ| ≤ gap_max and y + ρ·|θ| ≤ gap_max,
and likewise at gap_min. A platen on its stop therefore rests level, as on its guides; on a mere
point a slight torque would tilt it, since at 31 mm the magnets undo all but a fiftieth of the
torsional spring of θ.

A step that would leave the set moves to the nearest point of the set instead (nearest in the metric
of kinetic energy), and the velocity is the one that leads there. Projection on a convex set brings
two points no further apart, so contact never adds energy; a platen pressed on a stop stays exactly
there with velocity zero; and nothing holds a platen that is pulled off.

The single gaps have no stops of their own by default: the paper's ellipse in 4DOF takes them from
18.6 to 31.4 mm. With the seats at the movers' radius they do.
"""

from __future__ import annotations

import math

from maglev_model.compiled import compiled
from maglev_plant.arrays import GYRATION, LOCKED, LOWER, SEAT_RADIUS, STATE, UPPER, FloatArray


@compiled
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


@compiled
def _project_on_seat_one_tilt(depth: float, tilt: float, slope: float) -> tuple[float, float]:
    """Nearest point of ``depth + slope·|tilt| ≤ 0``, both lengths [m]."""
    push = (depth + slope * abs(tilt)) / (1.0 + slope * slope)
    if push <= 0.0:
        return depth, tilt
    if abs(tilt) - slope * push >= 0.0:
        return depth - push, tilt - math.copysign(slope * push, tilt)
    return 0.0, 0.0


@compiled
def _seat(
    scalars: FloatArray, axes: FloatArray, depth: float, phi: float, theta: float
) -> tuple[float, float, float]:
    """Bring y's ``depth`` into a stop [m] and the tilts [rad] to the seats' cone, locks kept."""
    radius = scalars[SEAT_RADIUS]
    gyration = scalars[GYRATION]
    slope = radius / gyration
    phi_free, theta_free = axes[LOCKED, 3] == 0.0, axes[LOCKED, 4] == 0.0
    if axes[LOCKED, 0] != 0.0:
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


@compiled
def _clip(axes: FloatArray, axis: int, value: float) -> float:
    return float(min(max(value, axes[LOWER, axis]), axes[UPPER, axis]))


@compiled
def apply_stops(
    scalars: FloatArray, axes: FloatArray, memory: FloatArray, before: FloatArray, step: float
) -> None:
    """Correct ``memory`` after a free step of ``step`` [s] from state ``before``, shape (10,)."""
    for axis in (1, 2):
        here = STATE + 2 * axis
        if memory[here] != _clip(axes, axis, memory[here]):
            start = before[2 * axis]
            end = _clip(axes, axis, start + step * memory[here + 1])
            memory[here] = end
            memory[here + 1] = (end - start) / step
    y, phi, theta = memory[STATE], memory[STATE + 6], memory[STATE + 8]
    reach = scalars[SEAT_RADIUS] * max(abs(phi), abs(theta))
    if (
        y + reach <= axes[UPPER, 0]
        and y - reach >= axes[LOWER, 0]
        and abs(phi) <= axes[UPPER, 3]
        and abs(theta) <= axes[UPPER, 4]
    ):
        return
    y = before[0] + step * memory[STATE + 1]
    phi = _clip(axes, 3, before[6] + step * memory[STATE + 7])
    theta = _clip(axes, 4, before[8] + step * memory[STATE + 9])
    depth, phi, theta = _seat(scalars, axes, y - axes[UPPER, 0], phi, theta)
    y = axes[UPPER, 0] + depth
    depth, phi, theta = _seat(scalars, axes, axes[LOWER, 0] - y, phi, theta)
    y = axes[LOWER, 0] - depth
    _arrive(memory, before, 0, y, step)
    _arrive(memory, before, 6, phi, step)
    _arrive(memory, before, 8, theta, step)


@compiled
def _arrive(
    memory: FloatArray, before: FloatArray, index: int, position: float, step: float
) -> None:
    memory[STATE + index] = position
    memory[STATE + index + 1] = (position - before[index]) / step
