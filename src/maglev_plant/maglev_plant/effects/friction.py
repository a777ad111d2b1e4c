"""Friction of the guides and the cable: elements, each with a sliding speed of its own.

An element rubs against ``direction`` · (speeds of the axes). Elements 0..4 are the axes, 5..8 the
vertical guides at the motors, 9 and 10 the cable along x and z. The level is
``F(v) = F_c (1 + c |tilt|) (1 + (F_s/F_c - 1) exp(-(v/v_s)²))``, and the force by kind:

- tanh: ``F(v) tanh(v / v0)``.
- coulomb: set-valued, ``F(v) sign(v)`` and at rest whatever holds the element, up to F_s; by
  impulses after each free step (Moreau's time stepping), the elements in turn until they agree.
- lugre: bristles with ``ż = v - |v| z / z_0``, ``z_0 = F(v) / σ_0``, force ``σ_0 z + σ_1 ż``
  (Canudas de Wit et al., IEEE TAC 40(3), 1995). The rate |v| / z_0 of a bristle is 7000 1/s at
  0.14 m/s, so it is carried exponentially: |z| never exceeds z_0, at any step.
- the cable: as lugre without σ_1 and without static friction (Dahl's model).
- foreign: a function of the user's, see ``foreign``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Final

import numpy as np
from numpy.typing import NDArray

from maglev_model.axes import PHI, THETA, FloatArray, X, Z
from maglev_model.compiled import borrowing, compiled
from maglev_model.compiled.records import Record
from maglev_plant.effects.foreign import call_friction, friction_address
from maglev_plant.effects.parameters import FRICTIONS

if TYPE_CHECKING:
    from maglev_plant.parameters import PlantParameters

ELEMENTS: Final = 11
GUIDES: Final = 5  # the first of the vertical guides
CABLE: Final = 9

NONE, TANH, COULOMB, LUGRE, FOREIGN = range(5)
_SWEEPS: Final = 100
_AGREED: Final = 1e-12  # [m/s], [rad/s]
MEMORY: Final = 4


class FrictionArrays(Record):
    """All elements; what a foreign model keeps is its ``memory``."""

    kind: Annotated[NDArray[np.int64], ELEMENTS]
    direction: Annotated[FloatArray, ELEMENTS, 5]
    level: Annotated[FloatArray, ELEMENTS]  # F_c [N, N m]
    tilt_load: Annotated[FloatArray, ELEMENTS]  # [1/rad]
    slip: Annotated[FloatArray, ELEMENTS]  # v0 of tanh [m/s, rad/s]
    static_ratio: float  # F_s / F_c
    stribeck: Annotated[FloatArray, ELEMENTS]  # [m/s, rad/s]
    stiffness: Annotated[FloatArray, ELEMENTS]  # sigma_0 [N/m, N m]
    damping: Annotated[FloatArray, ELEMENTS]  # sigma_1 [N s/m, N m s]
    address: int  # of the foreign model
    set_valued: bool  # whether some element is
    bristle: Annotated[FloatArray, ELEMENTS]  # z [m, rad]
    held: Annotated[FloatArray, ELEMENTS]  # force of the foreign model in this step
    memory: Annotated[FloatArray, ELEMENTS, MEMORY]


def friction_arrays(
    parameters: PlantParameters, mass: FloatArray, place: FloatArray
) -> FrictionArrays:
    """Elements of a stage; ``mass`` (5,) by axis, ``place`` (4, 2) of the motors along X and Z."""
    friction, guide, cable = (
        parameters.effects.friction,
        parameters.guide,
        parameters.effects.cable,
    )
    speeds, breakaway = np.array(friction.stribeck_velocity), np.array(friction.breakaway)
    arrays = FrictionArrays(static_ratio=friction.static_ratio)
    arrays.direction[:5] = np.eye(5)
    for i, (along_x, along_z) in enumerate(place):
        arrays.direction[GUIDES + i, [0, PHI, THETA]] = 1.0, -along_z, along_x
    arrays.direction[CABLE, X] = arrays.direction[CABLE + 1, Z] = 1.0
    cables = np.full(2, cable.hysteresis)
    arrays.level[:] = [*np.array(guide.coulomb) * mass, *friction.vertical_guides, *cables]
    arrays.tilt_load[:GUIDES] = friction.tilt_load
    arrays.tilt_load[GUIDES:CABLE] = friction.tilt_load[0]
    arrays.slip[:] = [*guide.coulomb_velocity, *[guide.coulomb_velocity[0]] * 4, 1.0, 1.0]
    arrays.stribeck[:] = [*speeds, *[speeds[0]] * 4, 1.0, 1.0]
    reach = np.array([*breakaway, *[breakaway[0]] * 4, cable.reach, cable.reach])
    arrays.stiffness[:] = arrays.level / reach
    masses = np.array([*mass, *[0.25 * mass[0]] * 4])
    arrays.damping[:CABLE] = friction.damping * np.sqrt(arrays.stiffness[:CABLE] * masses)
    if friction.model in FRICTIONS:
        kind = 1 + FRICTIONS.index(friction.model)
    else:
        kind, arrays.address = FOREIGN, friction_address(friction.model)
    arrays.kind[:CABLE] = np.where(arrays.level[:CABLE] > 0.0, kind, NONE)
    arrays.kind[CABLE:] = LUGRE if cable.hysteresis > 0.0 else NONE
    arrays.set_valued = kind == COULOMB
    return arrays


@borrowing
def _sliding(friction: FrictionArrays, e: int, state: FloatArray) -> float:
    """Speed of an element at a state x1..x10."""
    if e < GUIDES:
        return float(state[2 * e + 1])
    speed = 0.0
    for axis in range(5):
        speed += friction.direction[e, axis] * state[2 * axis + 1]
    return speed


@borrowing
def _level(friction: FrictionArrays, e: int, velocity: float, tilt: float) -> float:
    """F(v) of an element."""
    level = friction.level[e] * (1.0 + friction.tilt_load[e] * tilt)
    if friction.static_ratio > 1.0 and e < CABLE:
        ratio = velocity / friction.stribeck[e]
        level *= 1.0 + (friction.static_ratio - 1.0) * math.exp(-ratio * ratio)
    return float(level)


@borrowing
def _deflected(z: float, rest: float, velocity: float, time: float) -> float:
    """A bristle ``z`` after a time at a velocity; ``rest`` is what it slides at."""
    end = math.copysign(rest, velocity)
    return z - (end - z) * math.expm1(-abs(velocity) * time / rest)


@borrowing
def _tilt(state: FloatArray) -> float:
    return math.sqrt(state[6] * state[6] + state[8] * state[8])


@borrowing
def add_friction(
    friction: FrictionArrays, state: FloatArray, elapsed: float, force: FloatArray
) -> None:
    """Add what the elements exert at a state, ``elapsed`` [s] into the step, to ``force`` (5,)."""
    tilt = _tilt(state)
    for e in range(ELEMENTS):
        kind = friction.kind[e]
        if kind in (NONE, COULOMB):
            continue
        velocity = _sliding(friction, e, state)
        if kind == FOREIGN:
            resisting = friction.held[e]
        else:
            level = _level(friction, e, velocity, tilt)
            if kind == TANH:
                resisting = level * math.tanh(velocity / friction.slip[e])
            else:
                rest = level / friction.stiffness[e]
                z = _deflected(friction.bristle[e], rest, velocity, elapsed)
                rate = velocity - abs(velocity) * z / rest
                resisting = friction.stiffness[e] * z + friction.damping[e] * rate
        for axis in range(5):
            force[axis] -= friction.direction[e, axis] * resisting


@borrowing
def begin_step(friction: FrictionArrays, state: FloatArray, step: float) -> None:
    """Ask a foreign model for the force it exerts in the step that begins."""
    for e in range(CABLE):
        if friction.kind[e] == FOREIGN:
            velocity = _sliding(friction, e, state)
            level = _level(friction, e, velocity, _tilt(state))
            memory = friction.memory[e].ctypes.data
            friction.held[e] = call_friction(friction.address, velocity, level, step, memory)


@borrowing
def carry_bristles(
    friction: FrictionArrays, before: FloatArray, state: FloatArray, step: float
) -> None:
    """Deflect the bristles as a step from state ``before`` has, at its mean speed."""
    tilt = _tilt(state)
    for e in range(ELEMENTS):
        if friction.kind[e] == LUGRE:
            velocity = 0.5 * (_sliding(friction, e, before) + _sliding(friction, e, state))
            rest = _level(friction, e, velocity, tilt) / friction.stiffness[e]
            friction.bristle[e] = _deflected(friction.bristle[e], rest, velocity, step)


@compiled
def apply_coulomb(
    friction: FrictionArrays,
    inverse: FloatArray,
    before: FloatArray,
    state: FloatArray,
    step: float,
) -> None:
    """Take from a free step what set-valued friction does not let pass.

    ``inverse`` (5, 5) is the mass matrix's; an impulse is spread evenly over the step, and an axis
    that rests before and after has not moved.
    """
    tilt, impulse, taken = _tilt(state), np.zeros(ELEMENTS), np.zeros(5)
    velocity = state[1::2].copy()
    for _ in range(_SWEEPS):
        change = 0.0
        for e in range(CABLE):
            if friction.kind[e] != COULOMB:
                continue
            direction = friction.direction[e]
            answer = inverse @ direction
            mobility = float(direction @ answer)
            if mobility <= 0.0:
                continue
            speed = float(direction @ velocity)
            level = _level(friction, e, _sliding(friction, e, before), tilt) * step
            wanted = min(max(impulse[e] + speed / mobility, -level), level)
            part = wanted - impulse[e]
            impulse[e] = wanted
            velocity -= part * answer
            taken += part * answer
            change = max(change, abs(part) * mobility)
        if change <= _AGREED:
            break
    for axis in range(5):
        rests = abs(velocity[axis]) <= _AGREED
        if rests and before[2 * axis + 1] == 0.0:
            state[2 * axis] = before[2 * axis]
        else:
            state[2 * axis] -= 0.5 * step * taken[axis]
        state[2 * axis + 1] = 0.0 if rests else velocity[axis]
