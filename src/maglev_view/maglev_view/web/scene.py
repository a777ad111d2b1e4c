"""The stage in 3D: boxes that move, stators in the colours of their currents, two paths."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from maglev_model.axes import PHI, FloatArray
from maglev_model.machine import MachineParameters
from maglev_view.colours import STEEL, Colour, colour_of
from maglev_view.frames import FACE_HEIGHT, PLATEN, STAGE, Vector, motors, mounts, platen_pose
from maglev_view.parts import parts

FLOWN, PLANNED = (0, 114, 178), (213, 94, 0)
"""Colours of the two paths."""

_GLASS = 0.3  # what the frame is made of, so that the platen is seen


class StageScene:
    """Builds the stage on a server's scene and keeps it as the stage is."""

    def __init__(self, scene: Any, machine: MachineParameters) -> None:
        scene.set_up_direction('+z')
        scene.add_grid('/floor', 2.0, 2.0, cell_size=0.1, section_size=0.5)
        scene.add_frame(f'/{STAGE}', show_axes=False, position=(0.0, 0.0, FACE_HEIGHT))
        self._platen = scene.add_frame(f'/{STAGE}/{PLATEN}', show_axes=False)
        self._reference = scene.add_frame(
            f'/{STAGE}/reference', axes_length=0.12, axes_radius=0.003, visible=False
        )
        self._stators = _add_boxes(scene, machine)
        self._shown: dict[int, tuple[int, int, int]] = {}
        self._scene = scene
        for motor in motors(machine):
            x, y, _ = motor.position
            where = (x, y, 0.12)
            scene.add_label(f'/{STAGE}/label_{motor.number}', str(motor.number), position=where)
        self._flown = _Line(scene, 'flown', FLOWN)
        self._planned = _Line(scene, 'planned', PLANNED)

    def place(
        self, outputs: FloatArray | None, reference: FloatArray | None, magnified: float
    ) -> None:
        """Put the platen and its reference where they are, tilts ``magnified`` so many times.

        Both are y, x, z, phi, theta, shape (5,) [m, rad], None where not known.
        """
        for frame, at in ((self._platen, outputs), (self._reference, reference)):
            if at is not None:
                shown = at.copy()
                shown[PHI:] *= magnified
                position, (x, y, z, w) = platen_pose(shown)
                frame.position, frame.wxyz = position, (w, x, y, z)
        self._reference.visible = reference is not None

    def say(self, text: str) -> None:
        """Write a line above the stage."""
        self._scene.add_label(f'/{STAGE}/text', text, position=(0.0, 0.0, 0.25))

    def colour(self, shares: Iterable[float]) -> None:
        """Colour the stators by the shares of the limit that their currents use."""
        for motor, share in enumerate(shares, 1):
            if motor in self._stators:
                shown = _bytes(colour_of(share))
                if shown != self._shown.get(motor):
                    self._shown[motor] = self._stators[motor].color = shown

    def draw(self, flown: Sequence[Vector], planned: Sequence[Vector]) -> None:
        """Draw both paths [m]."""
        self._flown.draw(flown)
        self._planned.draw(planned)


class _Line:
    """A path through points."""

    def __init__(self, scene: Any, name: str, colour: tuple[int, int, int]) -> None:
        self._scene, self._colour = scene, colour
        self._name = f'/{STAGE}/{name}'
        self._drawn: tuple[int, Vector] | None = None

    def draw(self, points: Sequence[Vector]) -> None:
        """Draw it, if it has changed."""
        if len(points) < 2 or (len(points), points[-1]) == self._drawn:
            return
        self._drawn = (len(points), points[-1])
        line = np.array(points, np.float32)
        segments = np.stack([line[:-1], line[1:]], axis=1)
        self._scene.add_line_segments(self._name, segments, self._colour, thickness=0.003)


def _add_boxes(scene: Any, machine: MachineParameters) -> dict[int, Any]:
    """Add all boxes; the handles of the stators by the numbers of their motors."""
    above = {mount.child: mount for mount in mounts(machine)}
    paths = {STAGE: f'/{STAGE}', PLATEN: f'/{STAGE}/{PLATEN}'}
    for motor in motors(machine):
        for name in (motor.stator, motor.mover):
            mount = above[name]
            paths[name] = f'{paths[mount.parent]}/{name}'
            scene.add_frame(paths[name], show_axes=False, position=mount.position)
    stators = {}
    for number, part in enumerate(parts(machine)):
        name, colour = f'{paths[part.frame]}/box_{number}', _bytes(part.colour)
        opacity = _GLASS if part.colour == STEEL else None
        box = scene.add_box(name, colour, part.size, position=part.centre, opacity=opacity)
        if part.frame.startswith('stator'):
            stators[part.motor] = box
    return stators


def _bytes(colour: Colour) -> tuple[int, int, int]:
    red, green, blue = (round(255.0 * part) for part in colour)
    return red, green, blue
