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
        unit='m/s^2, rad/s^2',
        lower=0.0,
        upper=100.0,
        length=5,
        description='Coulomb friction f in f tanh(v / v0)' + _BY_AXIS,
    )
    coulomb_velocity: tuple[float, ...] = parameter(
        (1e-3, 1e-3, 1e-3, 1e-3, 1e-3),
        unit='m/s, rad/s',
        lower=1e-6,
        upper=0.1,
        length=5,
        description='velocity v0 in f tanh(v / v0)' + _BY_AXIS,
    )
    viscous: tuple[float, ...] = parameter(
        (0.5, 0.5, 0.5, 0.5, 0.5),
        unit='1/s',
        lower=0.0,
        upper=1000.0,
        length=5,
        description='viscous friction' + _BY_AXIS,
    )
    locked: tuple[bool, ...] = parameter(
        (False, False, False, False, False),
        length=5,
        description='stopper inserted: the axis keeps its initial position' + _BY_AXIS,
    )
