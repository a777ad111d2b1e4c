"""The stage as boxes: Table I's dimensions, and where it has none, some that look like Fig. 1."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from maglev_model.machine import MachineParameters
from maglev_view.colours import ALUMINIUM, IRON, MAGNET, STEEL, Colour
from maglev_view.frames import FACE_HEIGHT, PLATEN, STAGE, Motor, Vector, motors

WIDTH, HEIGHT = 1.2, 0.3
"""Of the hardware, Table I [m]."""

SLOTS_PER_POLE_PAIR = 6  # 18 slots and 3 pole pairs, Table I

_BEAM = 0.04  # [m], as all that follows
_STATOR_HEIGHT = HEIGHT - FACE_HEIGHT - _BEAM
_PLATE = 0.012
_BASE = 0.02


class Part(NamedTuple):
    """A box on a frame: edges and centre [m]; ``motor`` is its motor's number, 0 for none."""

    frame: str
    size: Vector
    centre: Vector
    colour: Colour
    motor: int = 0


def parts(machine: MachineParameters) -> tuple[Part, ...]:
    """All boxes of a machine."""
    return (*_frame(machine), *_platen(machine))


def stator_length(machine: MachineParameters) -> float:
    """The length of a stator [m], from its slots."""
    return SLOTS_PER_POLE_PAIR * machine.pole_pairs * machine.slot_pitch


def mover_length(machine: MachineParameters) -> float:
    """The length of a row of magnets [m]."""
    return (machine.magnets - 1) * machine.pole_pitch + machine.magnet_width


def _along(motor: Motor, length: float, width: float, height: float) -> Vector:
    """The edges of a box that lies along a motor."""
    return (length, width, height) if motor.direction[0] else (width, length, height)


def _frame(machine: MachineParameters) -> Iterator[Part]:
    side, corner = WIDTH, 0.5 * (WIDTH - _BEAM)
    top = HEIGHT - FACE_HEIGHT - 0.5 * _BEAM
    yield Part(STAGE, (side, side, _BASE), (0.0, 0.0, 0.5 * _BASE - FACE_HEIGHT), ALUMINIUM)
    for sign in (-1.0, 1.0):
        yield Part(STAGE, (side, _BEAM, _BEAM), (0.0, sign * corner, top), STEEL)
        yield Part(STAGE, (_BEAM, side, _BEAM), (sign * corner, 0.0, top), STEEL)
        for other in (-1.0, 1.0):
            middle = 0.5 * HEIGHT - FACE_HEIGHT
            centre = (sign * corner, other * corner, middle)
            yield Part(STAGE, (_BEAM, _BEAM, HEIGHT), centre, STEEL)
    yield Part(STAGE, (side, _BEAM, _BEAM), (0.0, 0.0, top), STEEL)
    yield Part(STAGE, (_BEAM, side, _BEAM), (0.0, 0.0, top), STEEL)
    length = stator_length(machine)
    for motor in motors(machine):
        size = _along(motor, length, machine.magnet_length, _STATOR_HEIGHT)
        centre = (0.0, 0.0, 0.5 * _STATOR_HEIGHT)
        yield Part(motor.stator, size, centre, IRON, motor.number)


def _platen(machine: MachineParameters) -> Iterator[Part]:
    row, depth = mover_length(machine), -machine.magnet_height - 0.5 * _PLATE
    for motor in motors(machine):
        first = -0.5 * (machine.magnets - 1) * machine.pole_pitch
        size = _along(motor, machine.magnet_width, machine.magnet_length, machine.magnet_height)
        for magnet in range(machine.magnets):
            x, y, _ = ((first + magnet * machine.pole_pitch) * along for along in motor.direction)
            centre = (x, y, -0.5 * machine.magnet_height)
            yield Part(motor.mover, size, centre, MAGNET, motor.number)
        size = _along(motor, row, 2.0 * machine.magnet_length, _PLATE)
        yield Part(motor.mover, size, (0.0, 0.0, depth), ALUMINIUM)
    if machine.motors > 1:
        side = 2.0 * machine.radius - row
        yield Part(PLATEN, (side, side, _PLATE), (0.0, 0.0, depth), ALUMINIUM)
