"""What the controller does when a reading, the platen or a law of one's own goes astray."""

from __future__ import annotations

import dataclasses

from maglev_model.parameters import parameter


@dataclasses.dataclass(frozen=True, kw_only=True)
class MeasurementParameters:
    """What a measurement must fulfil to be believed."""

    margin: float = parameter(
        5e-4, 'how far beyond the stops gap, x and z may read', unit='m', within=(0.0, 0.1)
    )
    warp: float = parameter(
        5e-4,
        'largest |g1 + g3 - g2 - g4|, which is 0 for a rigid platen',
        unit='m',
        within=(1e-6, 0.1),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class OwnLandingParameters:
    """The descent the controller makes by itself when the reference is lost."""

    braking_time: float = parameter(
        0.4, 'time to stop, and to level the tilts', unit='s', within=(0.05, 10.0)
    )
    descent_time: float = parameter(
        1.5, 'time to descend to the lower stop', unit='s', within=(0.1, 60.0)
    )
    settle_time: float = parameter(
        0.5, 'time held on the stop before the current ends', unit='s', within=(0.0, 10.0)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class FollowingParameters:
    """How far the platen may be from its reference before the controller gives up."""

    error: tuple[float, ...] = parameter(
        (1e-3, 2e-3, 2e-3, 3e-3, 3e-3),
        'largest error per axis, beyond what jumps of the reference make',
        unit='m, rad',
        within=(1e-6, 1.0),
        length=5,
    )
    time: float = parameter(
        0.0, 'for which it may be larger, without a break', unit='s', within=(0.0, 60.0)
    )
    fading: float = parameter(
        1.0,
        'time in which what a jump allows for fades to 37 %',
        unit='s',
        within=(0.01, 60.0),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class ForeignLawParameters:
    """What a law that is an object of one's own may take."""

    time: float = parameter(
        5e-4, 'time it may take for a sample, wall clock', unit='s', within=(1e-6, 0.1)
    )
    late_samples: int = parameter(
        10,
        'realtime: it may take longer this often in a row; then the controller lands',
        within=(0, 1000),
    )
