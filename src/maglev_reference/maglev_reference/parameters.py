"""The reference's parameters: what to follow, how to get there and back, within which limits."""

from __future__ import annotations

import dataclasses

from maglev_model.axes import AXES
from maglev_model.guide import GuideParameters
from maglev_model.loop_parameters import (
    AxisLoopParameters,
    FundamentalParameters,
    HorizontalLoopParameters,
    LevitationLoopParameters,
)
from maglev_model.machine import MachineParameters
from maglev_model.parameters import ParameterError, group, parameter
from maglev_reference.trajectory_parameters import (
    ChirpParameters,
    CircleParameters,
    FileParameters,
    HelixParameters,
    LissajousParameters,
    SinusoidParameters,
    SquareParameters,
    StepParameters,
    WaypointParameters,
)

TRAJECTORIES = (
    'hold',
    'sinusoids',
    'steps',
    'circle',
    'helix',
    'lissajous',
    'waypoints',
    'square',
    'chirp',
    'file',
)


@dataclasses.dataclass(frozen=True, kw_only=True)
class ReferenceLimits:
    """What is refused before moving. Arrays are in the order y, x, z, phi, theta.

    The gap at a motor includes the tilt, (5). The paper gives its upper end as 31 mm for the platen
    and 33 mm for the motors; its 4DOF ellipse needs 31.4 mm at motors 2 and 4.
    """

    lower: tuple[float, ...] = parameter(
        (0.018, -0.05, -0.05, -0.003, -0.014),
        'least position of each output',
        unit='m, rad',
        within=(-0.1, 0.1),
        length=5,
    )
    upper: tuple[float, ...] = parameter(
        (0.031, 0.05, 0.05, 0.003, 0.014),
        'greatest position of each output',
        unit='m, rad',
        within=(-0.1, 0.1),
        length=5,
    )
    motor_gap: tuple[float, ...] = parameter(
        (0.018, 0.033),
        'least and greatest air gap at each motor, tilt included',
        unit='m',
        within=(0.01, 0.1),
        length=2,
    )
    velocity: tuple[float, ...] = parameter(
        (0.2, 1.0, 1.0, 0.1, 0.5),
        'greatest speed of each output',
        unit='m/s, rad/s',
        within=(1e-4, 10.0),
        length=5,
    )
    acceleration: tuple[float, ...] = parameter(
        (5.0, 15.0, 15.0, 5.0, 20.0),
        'greatest acceleration of each output',
        unit='m/s^2, rad/s^2',
        within=(1e-3, 100.0),
        length=5,
    )
    step: tuple[float, ...] = parameter(
        (0.01, 0.06, 0.06, 0.006, 0.02),
        'greatest step of each output',
        unit='m, rad',
        within=(0.0, 0.1),
        length=5,
    )
    current: float = parameter(
        6.0,
        'greatest phase current of a motor, friction included; the amplifiers give 7 A, '
        'the rest is for feedback',
        unit='A',
        within=(0.1, 100.0),
    )
    tilt: float = parameter(
        0.5,
        "share of the attraction by which two opposite motors may differ, the law's limits.tilt",
        within=(0.1, 0.9),
    )
    voltage: float = parameter(
        0.0, 'of a phase that a fastest move takes at most; 0: any', unit='V', within=(0.0, 1e4)
    )
    resistance: float = parameter(4.0, 'of a phase', unit='ohm', within=(0.0, 1e3))
    inductance: float = parameter(
        45e-3, 'of a phase where the gap is gap_max', unit='H', within=(1e-4, 10.0)
    )
    smoothing: float = parameter(
        0.01,
        'time over which the acceleration of a fastest move turns; longer where the voltage '
        'needs it',
        unit='s',
        within=(0.001, 1.0),
    )

    def __post_init__(self) -> None:
        for axis, lower, upper in zip(AXES, self.lower, self.upper, strict=True):
            if not lower < upper:
                raise ParameterError(
                    f"parameter 'limits.lower' is {lower:g} for {axis}, it must be below "
                    f"'limits.upper', {upper:g}"
                )
        if not self.motor_gap[0] < self.motor_gap[1]:
            raise ParameterError(f"parameter 'limits.motor_gap' is {self.motor_gap}, it must rise")


@dataclasses.dataclass(frozen=True, kw_only=True)
class LiftOffParameters:
    """From the lower stop to the home position."""

    wait: float = parameter(0.2, 'rest on the stop before lift-off', unit='s', within=(0.001, 60.0))
    time: float = parameter(1.5, 'time of lift-off', unit='s', within=(0.1, 60.0))
    settle: float = parameter(1.0, 'hold after lift-off', unit='s', within=(0.0, 60.0))
    rest_gap: float = parameter(0.031, 'gap on the lower stop', unit='m', within=(0.018, 0.1))
    rest_tolerance: float = parameter(
        0.001,
        'how far from rest_gap the platen may be found before lift-off',
        unit='m',
        within=(0.0, 0.05),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class DescentParameters:
    """From any position down to the lower stop, the last part at crawling speed."""

    brake_time: float = parameter(
        0.5, 'time to come to rest when told to land while moving', unit='s', within=(0.05, 10.0)
    )
    time: float = parameter(2.0, 'time of the descent', unit='s', within=(0.1, 60.0))
    crawl_distance: float = parameter(
        0.0005, 'last part of the descent', unit='m', within=(1e-5, 0.005)
    )
    crawl_speed: float = parameter(
        0.001, 'speed where the last part begins', unit='m/s', within=(1e-4, 0.01)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class InternalModelParameters(FundamentalParameters):
    """The controller's internal models (14): what repeats at their frequencies is learnt."""

    sampling: float = parameter(
        2.05,
        'error with sampling and observer, by that of the same weights without',
        within=(1.0, 100.0),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class ReferenceParameters:
    """The reference node's table.

    From ``machine`` on the groups are the other nodes' too: what the stage is, by which currents
    and friction are foretold, and the controller's loops, by which the expected error is.
    """

    sample_time: float = parameter(
        0.001, 'time from one sample to the next', unit='s', within=(1e-4, 0.01)
    )
    trajectory: str = parameter(
        'sinusoids',
        f'what is followed while measured: {", ".join(TRAJECTORIES)}, '
        'or the dotted path of a module',
    )
    duration: float = parameter(
        60.0,
        'measured time: of the tracking window, or of each step',
        unit='s',
        within=(0.01, 36000.0),
    )
    run_in: float = parameter(
        8.0,
        'time on the trajectory before the tracking window, so that transients decay',
        unit='s',
        within=(0.0, 600.0),
    )
    home: tuple[float, ...] = parameter(
        (0.025, 0.0, 0.0, 0.0, 0.0),
        'where the platen hovers: y, x, z, phi, theta',
        unit='m, rad',
        within=(-0.05, 0.05),
        length=5,
    )
    move_time: float = parameter(
        1.0,
        'time of moves to and from what is measured; longer where limits need it',
        unit='s',
        within=(0.05, 60.0),
    )
    lift_off: LiftOffParameters = group(LiftOffParameters)
    sinusoids: SinusoidParameters = group(SinusoidParameters)
    steps: StepParameters = group(StepParameters)
    circle: CircleParameters = group(CircleParameters)
    helix: HelixParameters = group(HelixParameters)
    lissajous: LissajousParameters = group(LissajousParameters)
    waypoints: WaypointParameters = group(WaypointParameters)
    square: SquareParameters = group(SquareParameters)
    chirp: ChirpParameters = group(ChirpParameters)
    file: FileParameters = group(FileParameters)
    landing: DescentParameters = group(DescentParameters)
    limits: ReferenceLimits = group(ReferenceLimits)
    machine: MachineParameters = group(MachineParameters)
    guide: GuideParameters = group(GuideParameters)
    internal_model: InternalModelParameters = group(InternalModelParameters)
    y: LevitationLoopParameters = group(LevitationLoopParameters)
    x: HorizontalLoopParameters = group(HorizontalLoopParameters)
    z: HorizontalLoopParameters = group(HorizontalLoopParameters)
    phi: AxisLoopParameters = group(AxisLoopParameters)
    theta: AxisLoopParameters = group(AxisLoopParameters)

    def __post_init__(self) -> None:
        """Refuse a trajectory that is none of ours and no path of a module."""
        if '.' not in self.trajectory and self.trajectory not in TRAJECTORIES:
            raise ParameterError(
                f"parameter 'trajectory' is '{self.trajectory}', it must be one of "
                f'{", ".join(TRAJECTORIES)}, or the dotted path of a module'
            )

    @property
    def loops(self) -> tuple[AxisLoopParameters, ...]:
        """The controller's loops in output order."""
        return (self.y, self.x, self.z, self.phi, self.theta)

    @property
    def held_frequencies(self) -> tuple[tuple[float, ...], ...]:
        """The frequencies of the internal models [rad/s], by output."""
        fundamental = self.internal_model.fundamental
        return tuple(tuple(fundamental * k for k in loop.multiples) for loop in self.loops)
