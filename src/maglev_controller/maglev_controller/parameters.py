"""Everything that can be set on the regulator, with its defaults: one frozen table.

The defaults are the best regulator there is here; ``params/paper.yaml`` turns it into the paper's.
"""

from __future__ import annotations

import dataclasses

from maglev_model.loop_parameters import AxisLoopParameters, FundamentalParameters
from maglev_model.machine import MachineParameters
from maglev_model.parameters import group, parameter


@dataclasses.dataclass(frozen=True, kw_only=True)
class AxisParameters(AxisLoopParameters):
    """Internal model and gains of one axis."""

    controlled: bool = parameter(
        True,
        description='whether the axis gets control; off: v_phi = v_theta = 0 as in the paper',
    )
    design: str = parameter(
        'bandwidth',
        choices=('bandwidth', 'lqr_discrete', 'lqr_continuous', 'poles'),
        description='gains by discrete LQR with the weights that bandwidth, integration and '
        'learning stand for; by LQR with the weights weight_*; or from closed-loop poles',
    )
    poles_real: tuple[float, ...] = parameter(
        (),
        unit='rad/s',
        lower=-1e5,
        upper=0.0,
        description='real parts of the closed-loop poles, for the design poles',
    )
    poles_imaginary: tuple[float, ...] = parameter(
        (),
        unit='rad/s',
        lower=-1e5,
        upper=1e5,
        description='their imaginary parts, in the same order',
    )
    weight_error: float = parameter(
        0.0,
        lower=0.0,
        upper=1e15,
        description='LQR weight on e^2, for the designs lqr_* [1/m^2 or 1/rad^2]',
    )
    weight_rate: float = parameter(
        0.0, lower=0.0, upper=1e15, description='LQR weight on the error rate squared'
    )
    weight_model: tuple[float, ...] = parameter(
        (),
        lower=0.0,
        upper=1e18,
        description='LQR weight on the internal-model states: one for all; or of the integrator '
        'and of the oscillators; or one per frequency (companion form: per state)',
    )
    weight_effort: float = parameter(
        1.0, lower=1e-15, upper=1e15, description='LQR weight on w^2, R'
    )
    antiwindup: tuple[float, ...] = parameter(
        (0.0,),
        lower=-1e3,
        upper=1e3,
        description='E of (17) [1/A], one for all internal-model states or one for each',
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class RegulatorModelParameters(FundamentalParameters):
    """What the internal models of all axes share."""

    form: str = parameter(
        'modal',
        choices=('modal', 'companion'),
        description='realisation: companion is (15) to the letter, modal is for many frequencies',
    )
    friction_slope: float = parameter(
        1500.0,
        unit='1/s',
        lower=0.0,
        upper=1e6,
        description='steepest friction against velocity that standing still stays stable with: '
        'phases the oscillators of LQR designs, and is checked; 0: not',
    )
    largest_error: tuple[float, ...] = parameter(
        (1e-4, 1e-4, 1e-4, 2e-4, 2e-4),
        unit='m, rad',
        lower=1e-6,
        upper=1.0,
        length=5,
        description='an internal model learns from errors up to this, per axis',
    )
    restart_at_step: bool = parameter(
        False, description='begin every measured step as at enable, with internal models at rest'
    )
    antiwindup: str = parameter(
        'observer',
        choices=('none', 'paper', 'observer'),
        description="paper: (17) with the axes' E; observer: every axis follows what was realised",
    )
    antiwindup_speed: float = parameter(
        30.0, unit='rad/s', lower=1e-3, upper=1e3, description='how fast it follows (observer)'
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class CompensatorParameters:
    """Loop shape of the laws with a compensator from e to w in place of the internal model."""

    crossover: tuple[float, ...] = parameter(
        (300.0, 300.0, 300.0, 300.0, 300.0),
        unit='rad/s',
        lower=1.0,
        upper=1e5,
        length=5,
        description='bandwidth: where the loop gain crosses 1, per axis',
    )
    phase_margin: float = parameter(
        45.0,
        unit='deg',
        lower=5.0,
        upper=85.0,
        description='phase margin there, sampling included',
    )
    lag: float = parameter(
        10.0,
        lower=2.0,
        upper=1000.0,
        description='the integral acts below crossover / lag',
    )
    roll_off: float = parameter(
        8.0,
        lower=1.5,
        upper=100.0,
        description='the second-order roll-off acts above crossover * roll_off (feedback_soi)',
    )
    equilibrium: float = parameter(
        0.025,
        unit='m',
        lower=1e-3,
        upper=0.2,
        description='air gap of the equilibrium that is linearised about (jacobian_lead_lag)',
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class DerivativeParameters:
    """The filter s a / (s + a) that estimates rates."""

    bandwidth: float = parameter(
        1000.0, unit='rad/s', lower=1.0, upper=1e5, description='bandwidth a'
    )
    discretisation: str = parameter(
        'tustin', choices=('tustin', 'matched'), description='how it is sampled'
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class ObserverParameters:
    """The Kalman filter that estimates position and rate, knowing the accelerations commanded."""

    bandwidth: float = parameter(
        800.0,
        unit='rad/s',
        lower=1.0,
        upper=1e5,
        description='where it turns from believing its prediction to believing the encoders',
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class MarginParameters:
    """What the sampled closed loop of every axis must have at least, or is refused."""

    phase: float = parameter(
        20.0, unit='deg', lower=0.0, upper=90.0, description='phase margin at least'
    )
    gain: float = parameter(
        1.5,
        lower=1.0,
        upper=100.0,
        description='gain margin at least, as a factor, up and down',
    )
    sensitivity: float = parameter(
        3.5, lower=1.0, upper=1e3, description='sensitivity peak at most'
    )
    override: bool = parameter(
        False, description='take a loop that is stable without these margins all the same'
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class JumpParameters:
    """How a jump of the reference (a raw step, or the distance to it at enable) is made good."""

    duration: float = parameter(
        0.2,
        unit='s',
        lower=0.0,
        upper=10.0,
        description='time in which the controller itself rounds off a jump; 0 = does not',
    )
    acceleration: tuple[float, ...] = parameter(
        (5.5, 5.5, 5.5, 20.0, 20.0),
        unit='m/s^2, rad/s^2',
        lower=1e-3,
        upper=1e3,
        length=5,
        description='largest acceleration for that, per axis; a longer way takes more time',
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class LimitParameters:
    """Limits of the currents."""

    current: float = parameter(
        7.0,
        unit='A',
        lower=0.1,
        upper=50.0,
        description='largest phase-current amplitude of a motor; sat_7 of (17)',
    )
    error: tuple[float, ...] = parameter(
        (5e-4, 5e-4, 5e-4, 1.5e-3, 1.5e-3),
        unit='m, rad',
        lower=1e-5,
        upper=1.0,
        length=5,
        description='error that is fed back at most, per axis; a larger one is approached at a '
        'speed that the currents can brake',
    )
    levitation_first: bool = parameter(
        True, description='i_q yields to the i_d that carries the platen (exact inverse only)'
    )
    least_attraction: float = parameter(
        0.1,
        lower=0.0,
        upper=0.9,
        description='share of the weight carried however fast y shall fall (exact inverse)',
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class MeasurementParameters:
    """What a measurement must fulfil to be believed."""

    margin: float = parameter(
        5e-4,
        unit='m',
        lower=0.0,
        upper=0.1,
        description='how far beyond the stops gap, x and z may read',
    )
    warp: float = parameter(
        5e-4,
        unit='m',
        lower=1e-6,
        upper=0.1,
        description='largest |g1 + g3 - g2 - g4|, which is 0 for a rigid platen',
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class OwnLandingParameters:
    """The descent the controller makes by itself when the reference is lost."""

    braking_time: float = parameter(
        0.4, unit='s', lower=0.05, upper=10.0, description='time to stop, and to level the tilts'
    )
    descent_time: float = parameter(
        1.5, unit='s', lower=0.1, upper=60.0, description='time to descend to the lower stop'
    )
    settle_time: float = parameter(
        0.5,
        unit='s',
        lower=0.0,
        upper=10.0,
        description='time held on the stop before the current ends',
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class PlatenLostParameters:
    """When a platen that is pressed against a stop is given up, and landed."""

    distance: float = parameter(
        2e-4,
        unit='m',
        lower=0.0,
        upper=0.1,
        description='an output this near to its stop is at it; of the tilts, at the radius',
    )
    time: float = parameter(
        0.5, unit='s', lower=0.001, upper=60.0, description='time it is there, without a break'
    )
    error: tuple[float, ...] = parameter(
        (1e-3, 1e-3, 1e-3, 1e-3, 1e-3),
        unit='m, rad',
        lower=1e-6,
        upper=1.0,
        length=5,
        description='with a larger error than this, per axis',
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class ControllerParameters:
    """All parameters of the regulator. Axes in the paper's output order y, x, z, phi, theta."""

    sample_time: float = parameter(
        1e-3, unit='s', lower=1e-5, upper=0.1, description='sample time', read_only=True
    )
    law: str = parameter(
        'output_regulator',
        description='control law, how e becomes w: a module of maglev_controller.laws by its name, '
        'or any other by its dotted path',
    )
    inverse: str = parameter(
        'exact',
        choices=('exact', 'simplified', 'equilibrium'),
        description="simplified: the paper's (8), (12); exact: per motor through the quadratic (2);"
        ' equilibrium: constant gains, by linearisation (jacobian_lead_lag)',
    )
    feed_forward: bool = parameter(True, description='add the acceleration of the reference to w')
    internal_model: RegulatorModelParameters = group(RegulatorModelParameters)
    compensator: CompensatorParameters = group(CompensatorParameters)
    rate_estimate: str = parameter(
        'observer',
        choices=('observer', 'derivative'),
        description='where rates come from: the observer, or the derivative filter',
    )
    input_delay: int = parameter(
        0,
        lower=0,
        upper=1,
        description='samples by which the currents come late; design and margins count with them',
    )
    observer: ObserverParameters = group(ObserverParameters)
    derivative: DerivativeParameters = group(DerivativeParameters)
    y: AxisParameters = group(AxisParameters)
    x: AxisParameters = group(AxisParameters)
    z: AxisParameters = group(AxisParameters)
    phi: AxisParameters = group(AxisParameters)
    theta: AxisParameters = group(AxisParameters)
    margins: MarginParameters = group(MarginParameters)
    jumps: JumpParameters = group(JumpParameters)
    limits: LimitParameters = group(LimitParameters)
    measurement: MeasurementParameters = group(MeasurementParameters)
    landing: OwnLandingParameters = group(OwnLandingParameters)
    lost: PlatenLostParameters = group(PlatenLostParameters)
    machine: MachineParameters = group(MachineParameters)

    @property
    def axes(self) -> tuple[AxisParameters, ...]:
        """The five axes in output order."""
        return (self.y, self.x, self.z, self.phi, self.theta)
