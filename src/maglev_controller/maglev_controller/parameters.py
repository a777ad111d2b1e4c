"""Everything that can be set on the regulator, with its defaults: one frozen table.

The defaults are the best regulator there is here; ``params/paper.yaml`` turns it into the paper's.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from maglev_controller.learning_parameters import LearningParameters
from maglev_controller.stage_parameters import (
    EncoderParameters,
    FrictionParameters,
    ModeParameters,
    WindingParameters,
)
from maglev_controller.supervision_parameters import (
    FollowingParameters,
    ForeignLawParameters,
    MeasurementParameters,
    OwnLandingParameters,
)
from maglev_model.axes import FloatArray
from maglev_model.loop_parameters import (
    AxisLoopParameters,
    FundamentalParameters,
    HorizontalLoopParameters,
    LevitationLoopParameters,
)
from maglev_model.machine import MachineParameters
from maglev_model.parameters import group, parameter


@dataclasses.dataclass(frozen=True, kw_only=True)
class AxisParameters(AxisLoopParameters):
    """Internal model and gains of one axis."""

    controlled: bool = parameter(
        True, 'whether the axis gets control; off: v_phi = v_theta = 0 as in the paper'
    )
    design: str = parameter(
        'bandwidth',
        'gains by discrete LQR with the weights that bandwidth, integration and learning '
        'stand for; by LQR with the weights weight_*; or from closed-loop poles',
        choices=('bandwidth', 'lqr_discrete', 'lqr_continuous', 'poles'),
    )
    poles_real: tuple[float, ...] = parameter(
        (),
        'real parts of the closed-loop poles, for the design poles',
        unit='rad/s',
        within=(-1e5, 0.0),
    )
    poles_imaginary: tuple[float, ...] = parameter(
        (), 'their imaginary parts, in the same order', unit='rad/s', within=(-1e5, 1e5)
    )
    weight_error: float = parameter(
        0.0, 'LQR weight on e^2, for the designs lqr_* [1/m^2 or 1/rad^2]', within=(0.0, 1e15)
    )
    weight_rate: float = parameter(0.0, 'LQR weight on the error rate squared', within=(0.0, 1e15))
    weight_model: tuple[float, ...] = parameter(
        (),
        'LQR weight on the internal-model states: one for all; or of the integrator and of '
        'the oscillators; or one per frequency (companion form: per state)',
        within=(0.0, 1e18),
    )
    weight_effort: float = parameter(1.0, 'LQR weight on w^2, R', within=(1e-15, 1e15))
    antiwindup: tuple[float, ...] = parameter(
        (0.0,),
        'E of (17) [m/A, in companion form m s^2/A to m/A], one for all internal-model states or '
        'one for each',
        within=(-1e3, 1e3),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class LevitationAxisParameters(LevitationLoopParameters, AxisParameters):
    """Internal model and gains of y."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class HorizontalAxisParameters(HorizontalLoopParameters, AxisParameters):
    """Internal model and gains of x or z."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class RegulatorModelParameters(FundamentalParameters):
    """What the internal models of all axes share."""

    form: str = parameter(
        'modal',
        'realisation: companion is (15) to the letter, modal is for many frequencies',
        choices=('modal', 'companion'),
    )
    rest: str = parameter(
        'fade',
        "where an axis' reference rests, its oscillators fade, and standing still is stable "
        'and quiet with any friction (modal form); or they hold, as in the paper',
        choices=('fade', 'hold'),
    )
    within_count: float = parameter(
        1.0,
        'share of an error within a count of x or z that it learns from where the reference rests '
        '(fade); with less than all of it guides that stick hold the platen less at the edges of '
        'counts, and without friction it drifts between them; and with less it learns at their '
        'edges, too: of the way that is left to one that comes back over one',
        within=(0.0, 1.0),
    )
    slide_speed: tuple[float, ...] = parameter(
        (0.0, 0.0),
        'about how fast a platen slides along x and z that has broken loose; above 0, where '
        'within_count is below 1, one that stuck and comes back over the edge of a count is let '
        'slide on by the way that is left',
        unit='m/s',
        within=(0.0, 1.0),
        length=2,
    )
    largest_error: tuple[float, ...] = parameter(
        (1e-4, 1e-4, 1e-4, 2e-4, 2e-4),
        'an internal model learns from errors up to this, per axis',
        unit='m, rad',
        within=(1e-6, 1.0),
        length=5,
    )
    restart_at_step: bool = parameter(
        False, 'begin every measured step as at enable, with internal models at rest'
    )
    antiwindup: str = parameter(
        'observer',
        "paper: (17) with the axes' E; observer: every axis follows what was realised",
        choices=('none', 'paper', 'observer'),
    )
    antiwindup_speed: float = parameter(
        30.0, 'how fast it follows (observer)', unit='rad/s', within=(1e-3, 1e3)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class CompensatorParameters:
    """Loop shape of the laws with a compensator from e to w in place of the internal model."""

    crossover: tuple[float, ...] = parameter(
        (300.0, 300.0, 300.0, 300.0, 300.0),
        'bandwidth: where the loop gain crosses 1, per axis',
        unit='rad/s',
        within=(1.0, 1e5),
        length=5,
    )
    phase_margin: float = parameter(
        45.0, 'phase margin there, sampling included', unit='deg', within=(5.0, 85.0)
    )
    lag: float = parameter(10.0, 'the integral acts below crossover / lag', within=(2.0, 1000.0))
    roll_off: float = parameter(
        8.0,
        'the second-order roll-off acts above crossover * roll_off (feedback_soi)',
        within=(1.5, 100.0),
    )
    equilibrium: float = parameter(
        0.025,
        'air gap of the equilibrium that is linearised about (jacobian_lead_lag)',
        unit='m',
        within=(1e-3, 0.2),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class DerivativeParameters:
    """The filter s a / (s + a) that estimates rates."""

    bandwidth: float = parameter(1000.0, 'bandwidth a', unit='rad/s', within=(1.0, 1e5))
    discretisation: str = parameter('tustin', 'how it is sampled', choices=('tustin', 'matched'))


@dataclasses.dataclass(frozen=True, kw_only=True)
class ObserverParameters:
    """The Kalman filter that estimates position and rate, knowing the accelerations commanded."""

    bandwidth: float = parameter(
        850.0,
        'where it turns from believing its prediction to believing the encoders',
        unit='rad/s',
        within=(1.0, 1e5),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class MarginParameters:
    """What the sampled closed loop of every axis must have at least, or is refused."""

    phase: float = parameter(20.0, 'phase margin at least', unit='deg', within=(0.0, 90.0))
    gain: float = parameter(
        1.5, 'gain margin at least, as a factor, up and down', within=(1.0, 100.0)
    )
    sensitivity: float = parameter(3.5, 'sensitivity peak at most', within=(1.0, 1e3))
    override: bool = parameter(
        False, 'take a loop that is stable without these margins all the same'
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class JumpParameters:
    """How a jump of the reference (a raw step, or the distance to it at enable) is made good."""

    duration: float = parameter(
        0.2,
        'time in which the controller itself rounds off a jump; 0 = does not',
        unit='s',
        within=(0.0, 10.0),
    )
    acceleration: tuple[float, ...] = parameter(
        (5.5, 5.5, 5.5, 20.0, 20.0),
        'largest acceleration for that, per axis; a longer way takes more time',
        unit='m/s^2, rad/s^2',
        within=(1e-3, 1e3),
        length=5,
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class LimitParameters:
    """Limits of the currents."""

    current: float = parameter(
        7.0,
        'largest phase-current amplitude of a motor; sat_7 of (17)',
        unit='A',
        within=(0.1, 50.0),
    )
    error: tuple[float, ...] = parameter(
        (5e-4, 5e-4, 5e-4, 1.5e-3, 1.5e-3),
        'error that is fed back at most, per axis; a larger one is approached at a speed '
        'that the currents can brake',
        unit='m, rad',
        within=(1e-5, 1.0),
        length=5,
    )
    levitation_first: bool = parameter(
        True, 'i_q yields to the i_d that carries the platen (exact inverse only)'
    )
    least_attraction: float = parameter(
        0.1,
        'share of the weight carried however fast y shall fall (exact inverse)',
        within=(0.0, 0.9),
    )
    tilt: float = parameter(
        0.5,
        'share of the attraction by which two opposite motors may differ; above one half the other '
        'two spare it (exact inverse, levitation first)',
        within=(0.1, 0.9),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class ControllerParameters:
    """All parameters of the regulator. Axes in the paper's output order y, x, z, phi, theta."""

    sample_time: float = parameter(
        1e-3, 'sample time', unit='s', within=(1e-5, 0.1), read_only=True
    )
    law: str = parameter(
        'output_regulator',
        'control law, how e becomes w: a module of maglev_controller.laws by its name, or '
        'any other by its dotted path',
    )
    foreign: ForeignLawParameters = group(ForeignLawParameters)
    inverse: str = parameter(
        'exact',
        "simplified: the paper's (8), (12); exact: per motor through the quadratic (2); "
        'equilibrium: constant gains, by linearisation (jacobian_lead_lag)',
        choices=('exact', 'simplified', 'equilibrium'),
    )
    feed_forward: bool = parameter(True, 'add the acceleration of the reference to w')
    internal_model: RegulatorModelParameters = group(RegulatorModelParameters)
    compensator: CompensatorParameters = group(CompensatorParameters)
    rate_estimate: str = parameter(
        'observer',
        'where rates come from: the observer, or the derivative filter',
        choices=('observer', 'derivative'),
    )
    input_delay: int = parameter(
        0,
        'samples by which the currents come late; design and margins count with them',
        within=(0, 1),
    )
    observer: ObserverParameters = group(ObserverParameters)
    derivative: DerivativeParameters = group(DerivativeParameters)
    encoder: EncoderParameters = group(EncoderParameters)
    friction: FrictionParameters = group(FrictionParameters)
    modes: ModeParameters = group(ModeParameters)
    winding: WindingParameters = group(WindingParameters)
    learning: LearningParameters = group(LearningParameters)
    y: LevitationAxisParameters = group(LevitationAxisParameters)
    x: HorizontalAxisParameters = group(HorizontalAxisParameters)
    z: HorizontalAxisParameters = group(HorizontalAxisParameters)
    phi: AxisParameters = group(AxisParameters)
    theta: AxisParameters = group(AxisParameters)
    margins: MarginParameters = group(MarginParameters)
    jumps: JumpParameters = group(JumpParameters)
    limits: LimitParameters = group(LimitParameters)
    measurement: MeasurementParameters = group(MeasurementParameters)
    landing: OwnLandingParameters = group(OwnLandingParameters)
    following: FollowingParameters = group(FollowingParameters)
    machine: MachineParameters = group(MachineParameters)

    @property
    def axes(self) -> tuple[AxisParameters, ...]:
        """The five axes in output order."""
        return (self.y, self.x, self.z, self.phi, self.theta)

    @property
    def reach(self) -> tuple[FloatArray, FloatArray]:
        """Least and greatest outputs (5,) [m, rad]: at the stops, and the margin beyond them."""
        margin = np.full(5, self.measurement.margin)
        margin[3:] /= self.machine.radius
        lower, upper = self.machine.lower_limit, self.machine.upper_limit
        return np.array(lower) - margin, np.array(upper) + margin
