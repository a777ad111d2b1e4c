"""The parameters of what is followed while it is measured, a group for each kind of trajectory."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from maglev_model.axes import AXES
from maglev_model.loop_parameters import REFERENCE_FREQUENCY
from maglev_model.parameters import ParameterError, group, parameter

PROFILES = ('minimum_jerk', 'fastest')
_FUNDAMENTAL = '0: that of the internal models, internal_model.fundamental'


def same_length(where: str, names: Sequence[str], lengths: Sequence[int]) -> None:
    """Refuse arrays of one group that are not of one length, at least 1."""
    if len(set(lengths)) > 1 or lengths[0] == 0:
        listed = ', '.join(
            f"'{name}' {length}" for name, length in zip(names, lengths, strict=True)
        )
        raise ParameterError(
            f"parameters of '{where}' need as many elements each, one at least: {listed}"
        )


@dataclasses.dataclass(frozen=True, kw_only=True)
class TiltSinusoids:
    """offset + sum_i amplitude_i sin(frequency_i t + phase_i); t = 0 as measuring starts."""

    offset: float = parameter(0.0, 'mean position', unit='rad', within=(-0.014, 0.014))
    amplitude: tuple[float, ...] = parameter(
        (0.0,), 'amplitude of each sinusoid', unit='rad', within=(-0.014, 0.014)
    )
    frequency: tuple[float, ...] = parameter(
        (0.0,),
        f'angular frequency of each sinusoid; {_FUNDAMENTAL}',
        unit='rad/s',
        within=(0.0, 200.0),
    )
    phase: tuple[float, ...] = parameter(
        (0.0,), 'phase of each sinusoid', unit='rad', within=(-2.0 * math.pi, 2.0 * math.pi)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class GapSinusoids(TiltSinusoids):
    """The same for the air gap y."""

    offset: float = parameter(0.025, 'mean position', unit='m', within=(0.018, 0.031))
    amplitude: tuple[float, ...] = parameter(
        (0.0,), 'amplitude of each sinusoid', unit='m', within=(-0.0065, 0.0065)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class TravelSinusoids(TiltSinusoids):
    """The same for a displacement, x or z."""

    offset: float = parameter(0.0, 'mean position', unit='m', within=(-0.05, 0.05))
    amplitude: tuple[float, ...] = parameter(
        (0.0,), 'amplitude of each sinusoid', unit='m', within=(-0.05, 0.05)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class SinusoidParameters:
    """Sums of sinusoids, a group for each axis."""

    y: GapSinusoids = group(GapSinusoids)
    x: TravelSinusoids = group(TravelSinusoids)
    z: TravelSinusoids = group(TravelSinusoids)
    phi: TiltSinusoids = group(TiltSinusoids)
    theta: TiltSinusoids = group(TiltSinusoids)

    def axes(self) -> tuple[TiltSinusoids, ...]:
        """The five groups in output order."""
        return (self.y, self.x, self.z, self.phi, self.theta)

    def __post_init__(self) -> None:
        for name, axis in zip(AXES, self.axes(), strict=True):
            lengths = (len(axis.amplitude), len(axis.frequency), len(axis.phase))
            same_length(f'sinusoids.{name}', ('amplitude', 'frequency', 'phase'), lengths)


@dataclasses.dataclass(frozen=True, kw_only=True)
class StepParameters:
    """A sequence of steps, each of one axis from start to target; the other axes stay at home."""

    axis: tuple[str, ...] = parameter(('y',), 'the axis of each step', choices=AXES)
    start: tuple[float, ...] = parameter(
        (0.02,), 'where each step begins', unit='m, rad', within=(-0.05, 0.05)
    )
    target: tuple[float, ...] = parameter(
        (0.027,), 'where each step ends', unit='m, rad', within=(-0.05, 0.05)
    )
    settle: float = parameter(2.0, 'rest before each step', unit='s', within=(0.0, 60.0))
    shaped: bool = parameter(True, 'steps by their profile; false: the reference jumps')
    profile: str = parameter(
        'minimum_jerk',
        'of a shaped step: minimum jerk, or the fastest within limits.*',
        choices=PROFILES,
    )
    shaping_time: float = parameter(
        0.2, 'least time of a shaped step', unit='s', within=(0.01, 10.0)
    )
    acceleration: tuple[float, ...] = parameter(
        (5.0, 5.5, 5.5, 5.0, 20.0),
        'greatest acceleration of a shaped step; a longer way takes more time',
        unit='m/s^2, rad/s^2',
        within=(1e-3, 1e3),
        length=5,
    )

    def __post_init__(self) -> None:
        lengths = (len(self.axis), len(self.start), len(self.target))
        same_length('steps', ('axis', 'start', 'target'), lengths)


@dataclasses.dataclass(frozen=True, kw_only=True)
class CircleParameters:
    """A circle in x and z about home, begun at its greatest z."""

    radius: float = parameter(0.03, 'its radius', unit='m', within=(1e-5, 0.05))
    frequency: float = parameter(
        0.0, f'angular frequency; {_FUNDAMENTAL}', unit='rad/s', within=(0.0, 200.0)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class HelixParameters:
    """A conical helix: circles in x and z about home while gap and radius go to and fro evenly."""

    radius: tuple[float, ...] = parameter(
        (0.01, 0.03), 'radius at one end and at the other', unit='m', within=(0.0, 0.05), length=2
    )
    gap: tuple[float, ...] = parameter(
        (0.022, 0.028),
        'air gap at one end and at the other',
        unit='m',
        within=(0.018, 0.031),
        length=2,
    )
    turns: int = parameter(4, 'turns from one end to the other', within=(1, 1000))
    frequency: float = parameter(
        0.0, f'angular frequency of the turns; {_FUNDAMENTAL}', unit='rad/s', within=(0.0, 200.0)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class LissajousParameters:
    """Each output follows home + amplitude sin(multiple fundamental t + phase).

    Arrays are in the order y, x, z, phi, theta.
    """

    fundamental: float = parameter(
        REFERENCE_FREQUENCY / 3.0,
        f'angular frequency; {_FUNDAMENTAL}',
        unit='rad/s',
        within=(0.0, 200.0),
    )
    amplitude: tuple[float, ...] = parameter(
        (0.0, 0.03, 0.03, 0.0, 0.0),
        'amplitude of each output',
        unit='m, rad',
        within=(-0.05, 0.05),
        length=5,
    )
    multiple: tuple[int, ...] = parameter(
        (1, 2, 3, 1, 1), 'frequency of each output, in fundamentals', within=(1, 100), length=5
    )
    phase: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0, 0.0, 0.0),
        'phase of each output',
        unit='rad',
        within=(-2.0 * math.pi, 2.0 * math.pi),
        length=5,
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class WaypointParameters:
    """From rest to rest along straight minimum-jerk moves, all outputs of a move at one time.

    Two points without ``repeat`` are a point-to-point move. A move takes the shortest time that
    keeps every output within ``velocity`` and ``acceleration``.
    """

    y: tuple[float, ...] = parameter(
        (0.025, 0.025), 'air gap at each point', unit='m', within=(-0.05, 0.05)
    )
    x: tuple[float, ...] = parameter(
        (-0.03, 0.03), 'x at each point', unit='m', within=(-0.05, 0.05)
    )
    z: tuple[float, ...] = parameter((0.0, 0.0), 'z at each point', unit='m', within=(-0.05, 0.05))
    phi: tuple[float, ...] = parameter(
        (0.0, 0.0), 'phi at each point', unit='rad', within=(-0.05, 0.05)
    )
    theta: tuple[float, ...] = parameter(
        (0.0, 0.0), 'theta at each point', unit='rad', within=(-0.05, 0.05)
    )
    velocity: tuple[float, ...] = parameter(
        (0.05, 0.2, 0.2, 0.02, 0.1),
        'greatest speed of each output: y, x, z, phi, theta',
        unit='m/s, rad/s',
        within=(1e-4, 10.0),
        length=5,
    )
    acceleration: tuple[float, ...] = parameter(
        (1.0, 2.0, 2.0, 0.5, 2.0),
        'greatest acceleration of each output: y, x, z, phi, theta',
        unit='m/s^2, rad/s^2',
        within=(1e-3, 100.0),
        length=5,
    )
    profile: str = parameter(
        'minimum_jerk',
        'of a move: minimum jerk within velocity and acceleration, or the fastest within limits.*',
        choices=PROFILES,
    )
    dwell: float = parameter(0.5, 'rest at each point', unit='s', within=(0.0, 600.0))
    repeat: bool = parameter(False, 'back to the first point and again; false: stay at the last')

    def points(self) -> tuple[tuple[float, ...], ...]:
        """The five arrays in output order."""
        return (self.y, self.x, self.z, self.phi, self.theta)

    def __post_init__(self) -> None:
        same_length('waypoints', AXES, [len(values) for values in self.points()])


@dataclasses.dataclass(frozen=True, kw_only=True)
class SquareParameters:
    """A rounded square in x and z about home, followed at constant speed, over and over."""

    side: float = parameter(0.06, 'its side', unit='m', within=(1e-3, 0.1))
    corner: float = parameter(
        0.01,
        'smallest radius of curvature of a corner; speed^2 / corner is the greatest acceleration',
        unit='m',
        within=(1e-4, 0.05),
    )
    speed: float = parameter(0.1, 'speed along the square', unit='m/s', within=(1e-4, 2.0))


@dataclasses.dataclass(frozen=True, kw_only=True)
class ChirpParameters:
    """A sinusoid of one output about home, its frequency rising or falling evenly."""

    axis: str = parameter('x', 'the output', choices=AXES)
    amplitude: float = parameter(0.0005, 'amplitude', unit='m, rad', within=(-0.05, 0.05))
    frequency: tuple[float, ...] = parameter(
        (math.pi, 20.0 * math.pi),
        'angular frequency at the beginning and at the end',
        unit='rad/s',
        within=(0.01, 1000.0),
        length=2,
    )
    time: float = parameter(
        60.0,
        'time of the sweep, rounded to whole half periods; the frequencies before and '
        'after it are those of its ends',
        unit='s',
        within=(0.1, 36000.0),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class FileParameters:
    """A trajectory from a CSV file."""

    path: str = parameter('', 'the file, absolute or from the folder the node was started in')
    repeat: bool = parameter(
        False, 'over and over; its last row is its first again. False: stay at the last'
    )
