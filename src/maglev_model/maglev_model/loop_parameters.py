"""How fast an axis' loop is and what it learns: what controller and reference both have to know."""

from __future__ import annotations

import dataclasses
import math

from maglev_model.parameters import parameter

REFERENCE_FREQUENCY = 1.5 * math.pi
"""ω0 of the paper's sinusoids [rad/s]."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class FundamentalParameters:
    """What the internal models of all axes are built on."""

    fundamental: float = parameter(
        REFERENCE_FREQUENCY, 'frequency of the reference, omega_0', unit='rad/s', within=(1e-3, 1e3)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class AxisLoopParameters:
    """The three numbers of an axis' loop, and the frequencies of its internal model (14).

    With a bandwidth W and the speeds i and m at which integrator and oscillators learn, the LQR
    weights are W⁴ on e², 2 W² on ė², W⁴ i² on the integrator and W⁴ m² on the oscillators' states.
    """

    multiples: tuple[float, ...] = parameter(
        (0.0, 1.0, 2.0, 3.0, 4.0, 5.0),
        'frequencies of the internal model, as multiples of its fundamental',
        within=(0.0, 100.0),
    )
    bandwidth: float = parameter(
        200.0, 'bandwidth of the feedback, W', unit='rad/s', within=(0.1, 1e4)
    )
    integration: float = parameter(
        90.0, 'how fast the integrator learns, i', unit='rad/s', within=(1e-3, 1e4)
    )
    learning: float = parameter(
        10.0, 'how fast the oscillators learn, m', unit='rad/s', within=(1e-3, 1e4)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class LevitationLoopParameters(AxisLoopParameters):
    """Those of y, which in 3DOF, where four gaps count alike, lets less of their counts through."""

    bandwidth: float = parameter(
        195.0, 'bandwidth of the feedback, W', unit='rad/s', within=(0.1, 1e4)
    )
    integration: float = parameter(
        50.0, 'how fast the integrator learns, i', unit='rad/s', within=(1e-3, 1e4)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class HorizontalLoopParameters(AxisLoopParameters):
    """Those of x and z, whose encoders pass more of their counts on than an axis of four gaps."""

    bandwidth: float = parameter(
        180.0, 'bandwidth of the feedback, W', unit='rad/s', within=(0.1, 1e4)
    )
    integration: float = parameter(
        81.0, 'how fast the integrator learns, i', unit='rad/s', within=(1e-3, 1e4)
    )
    learning: float = parameter(
        9.0, 'how fast the oscillators learn, m', unit='rad/s', within=(1e-3, 1e4)
    )
