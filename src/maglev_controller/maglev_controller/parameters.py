"""Everything that can be set on the regulator, with its defaults: one frozen table.

The defaults are the best regulator there is here; ``params/paper.yaml`` turns it into the paper's.
"""

from __future__ import annotations

import dataclasses
import math

from maglev_node.parameters import group, parameter
from maglev_plant.machine import MachineParameters

REFERENCE_FREQUENCY = 1.5 * math.pi
"""ω0 of the paper's sinusoids [rad/s]."""

POLES_REAL = (-162.0, -134.0, -12.5, *(-2.8, -3.7, -4.0, -3.9, -3.1) * 2)
POLES_IMAGINARY = (0.0, 0.0, 0.0, 3.9, 8.9, 13.4, 17.5, 22.0, -3.9, -8.9, -13.4, -17.5, -22.0)
"""Where the default LQR weights put the closed-loop poles, rounded [rad/s]."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class AxisParameters:
    """Internal model and gains of one axis."""

    controlled: bool = parameter(
        True,
        description='whether the axis gets control; off: v_phi = v_theta = 0 as in the paper',
    )
    multiples: tuple[float, ...] = parameter(
        (0.0, 1.0, 2.0, 3.0, 4.0, 5.0),
        lower=0.0,
        upper=100.0,
        description='frequencies of the internal model, as multiples of its fundamental',
    )
    design: str = parameter(
        'lqr_discrete',
        choices=('poles', 'lqr_continuous', 'lqr_discrete'),
        description='gains from closed-loop poles or from LQR weights',
    )
    poles_real: tuple[float, ...] = parameter(
        POLES_REAL,
        unit='rad/s',
        lower=-1e5,
        upper=0.0,
        description='real parts of the closed-loop poles',
    )
    poles_imaginary: tuple[float, ...] = parameter(
        POLES_IMAGINARY,
        unit='rad/s',
        lower=-1e5,
        upper=1e5,
        description='their imaginary parts, in the same order',
    )
    weight_error: float = parameter(
        5e8, lower=0.0, upper=1e15, description='LQR weight on e^2 [1/m^2 or 1/rad^2]'
    )
    weight_rate: float = parameter(
        4.5e4, lower=0.0, upper=1e15, description='LQR weight on the error rate squared'
    )
    weight_model: tuple[float, ...] = parameter(
        (5e10,),
        lower=0.0,
        upper=1e18,
        description='LQR weight on each internal-model state: one for all, or one per frequency '
        '(companion form: one per state)',
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
class InternalModelParameters:
    """What the internal models of all axes share."""

    form: str = parameter(
        'modal',
        choices=('modal', 'companion'),
        description='realisation: companion is (15) to the letter, modal is for many frequencies',
    )
    fundamental: float = parameter(
        REFERENCE_FREQUENCY,
        unit='rad/s',
        lower=1e-3,
        upper=1e3,
        description='frequency of the reference, omega_0',
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
        10.0, unit='rad/s', lower=1e-3, upper=1e3, description='how fast it follows (observer)'
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
        (4.0, 4.0, 4.0, 10.0, 10.0),
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
class LandingParameters:
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
class ControllerParameters:
    """All parameters of the regulator. Axes in the paper's output order y, x, z, phi, theta."""

    sample_time: float = parameter(
        1e-3, unit='s', lower=1e-5, upper=0.1, description='sample time', read_only=True
    )
    inverse: str = parameter(
        'exact',
        choices=('exact', 'simplified'),
        description="simplified: the paper's (8), (12); exact: per motor through the quadratic (2)",
    )
    feed_forward: bool = parameter(True, description='add the acceleration of the reference to w')
    internal_model: InternalModelParameters = group(InternalModelParameters)
    derivative: DerivativeParameters = group(DerivativeParameters)
    y: AxisParameters = group(AxisParameters)
    x: AxisParameters = group(AxisParameters)
    z: AxisParameters = group(AxisParameters)
    phi: AxisParameters = group(AxisParameters)
    theta: AxisParameters = group(AxisParameters)
    jumps: JumpParameters = group(JumpParameters)
    limits: LimitParameters = group(LimitParameters)
    measurement: MeasurementParameters = group(MeasurementParameters)
    landing: LandingParameters = group(LandingParameters)
    machine: MachineParameters = group(MachineParameters)

    @property
    def axes(self) -> tuple[AxisParameters, ...]:
        """The five axes in output order."""
        return (self.y, self.x, self.z, self.phi, self.theta)
