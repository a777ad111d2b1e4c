"""The linear guides: what they rub with, and which axes are locked."""

from __future__ import annotations

import dataclasses

from maglev_model.parameters import parameter

_BY_AXIS = ', by axis y, x, z, phi, theta'


@dataclasses.dataclass(frozen=True, kw_only=True)
class GuideParameters:
    """Friction of the linear guides, as a deceleration per axis, and stoppers that lock an axis."""

    coulomb: tuple[float, ...] = parameter(
        (0.303, 0.171, 0.149, 1.32, 1.32),
        'Coulomb friction f in f tanh(v / v0)' + _BY_AXIS,
        unit='m/s^2, rad/s^2',
        within=(0.0, 100.0),
        length=5,
    )
    coulomb_velocity: tuple[float, ...] = parameter(
        (1e-3, 1e-3, 1e-3, 1e-3, 1e-3),
        'velocity v0 in f tanh(v / v0)' + _BY_AXIS,
        unit='m/s, rad/s',
        within=(1e-6, 0.1),
        length=5,
    )
    viscous: tuple[float, ...] = parameter(
        (0.5, 0.5, 0.5, 0.5, 0.5),
        'viscous friction' + _BY_AXIS,
        unit='1/s',
        within=(0.0, 1000.0),
        length=5,
    )
    locked: tuple[bool, ...] = parameter(
        (False, False, False, False, False),
        'stopper inserted: the axis keeps its initial position' + _BY_AXIS,
        length=5,
    )
