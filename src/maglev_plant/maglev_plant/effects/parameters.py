"""Parameters of the effects of a real stage; by default every one of them is off.

What they are worth on a machine, and whence: ``params/rough.yaml``.
"""

from __future__ import annotations

import dataclasses

from maglev_model.parameters import ParameterError, group, parameter

_BY_AXIS = ', by axis y, x, z, phi, theta'
_BY_MOTOR = ', by motor 1..4'
_BY_PHASE = ', by phase a, b, c of motor 1, then 2, 3, 4'
_BY_ENCODER = ', by encoder: gaps 1..4, x, z'

FRICTIONS = ('tanh', 'coulomb', 'lugre')


@dataclasses.dataclass(frozen=True, kw_only=True)
class FrictionParameters:
    """How the guides rub. How much, is ``guide.coulomb``; with all models ``guide.viscous``."""

    model: str = parameter(
        'tanh',
        'tanh, coulomb (set-valued), lugre (presliding by bristles), or the dotted path of a '
        'module with a function force(velocity, level, step, memory)',
    )
    static_ratio: float = parameter(
        1.0, 'static by Coulomb friction, F_s / F_c; 1: no Stribeck effect', within=(1.0, 3.0)
    )
    stribeck_velocity: tuple[float, ...] = parameter(
        (5e-3, 5e-3, 5e-3, 12.6e-3, 12.6e-3),
        'speed over which static friction decays' + _BY_AXIS,
        unit='m/s, rad/s',
        within=(1e-6, 1.0),
        length=5,
    )
    breakaway: tuple[float, ...] = parameter(
        (20e-6, 20e-6, 20e-6, 50e-6, 50e-6),
        'lugre: deflection of the bristles at Coulomb friction' + _BY_AXIS,
        unit='m, rad',
        within=(1e-8, 1e-2),
        length=5,
    )
    damping: float = parameter(0.6, 'lugre: sigma_1 / sqrt(sigma_0 mass)', within=(0.0, 2.0))
    vertical_guides: tuple[float, ...] = parameter(
        (0.0,) * 4,
        "Coulomb friction of the guide at each motor, with that guide's own speed, beside "
        'guide.coulomb of the axes' + _BY_MOTOR,
        unit='N',
        within=(0.0, 100.0),
        length=4,
    )
    tilt_load: tuple[float, ...] = parameter(
        (0.0,) * 5,
        'growth of Coulomb friction with the tilt that presses the guides' + _BY_AXIS,
        unit='1/rad',
        within=(0.0, 1000.0),
        length=5,
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class ModeParameters:
    """Flexible modes, as many as the lists are long: the encoders read the platen + gain * q,
    with q'' + 2 damping w q' + w^2 q = the axis' acceleration."""

    axis: tuple[str, ...] = parameter(
        ('x',), 'axis of each mode', choices=('y', 'x', 'z', 'phi', 'theta')
    )
    frequency: tuple[float, ...] = parameter(
        (120.0,), 'of each mode', unit='Hz', within=(1.0, 2000.0)
    )
    damping: tuple[float, ...] = parameter(
        (0.02,), 'damping ratio of each mode', within=(1e-4, 1.0)
    )
    gain: tuple[float, ...] = parameter(
        (0.0,), 'modal gain of each mode by that of the rigid axis, 0 for none', within=(-2.0, 2.0)
    )

    def __post_init__(self) -> None:
        """Refuse lists of different lengths."""
        lengths = {len(self.axis), len(self.frequency), len(self.damping), len(self.gain)}
        if len(lengths) > 1 or len(self.axis) > 16:
            raise ParameterError(
                "parameters 'effects.modes.axis', 'frequency', 'damping' and 'gain' have "
                f'{len(self.axis)}, {len(self.frequency)}, {len(self.damping)} and '
                f'{len(self.gain)} elements, they must have as many, at most 16'
            )


@dataclasses.dataclass(frozen=True, kw_only=True)
class MotorParameters:
    """How the motors differ from the model's, and what the model leaves out of each."""

    model: str = parameter(
        '',
        'dotted path of a module with a function forces(gap, i_d, i_q, out) in place of (1), (2)',
    )
    magnet: tuple[float, ...] = parameter(
        (1.0,) * 4,
        "strength of the magnets by the model's; K_v1 goes with its square" + _BY_MOTOR,
        within=(0.1, 3.0),
        length=4,
    )
    winding: tuple[float, ...] = parameter(
        (1.0,) * 4,
        "strength of the winding by the model's; K_v3 goes with its square" + _BY_MOTOR,
        within=(0.1, 3.0),
        length=4,
    )
    spread: float = parameter(
        0.0,
        'standard deviation of factors on magnet and winding, drawn by the seed',
        within=(0.0, 0.3),
    )
    place_along: tuple[float, ...] = parameter(
        (0.0,) * 4,
        'how far each motor is further out than the radius' + _BY_MOTOR,
        unit='m',
        within=(-0.1, 0.1),
        length=4,
    )
    place_across: tuple[float, ...] = parameter(
        (0.0,) * 4,
        'how far each is beside its place, towards +Z (2, 4) or +X (1, 3)' + _BY_MOTOR,
        unit='m',
        within=(-0.1, 0.1),
        length=4,
    )
    angle: tuple[float, ...] = parameter(
        (0.0,) * 4,
        'how far the thrust of each is turned out of its axis, towards the other' + _BY_MOTOR,
        unit='rad',
        within=(-0.5, 0.5),
        length=4,
    )
    commutation: tuple[float, ...] = parameter(
        (0.0,) * 4,
        'electrical angle of each that the commutation does not know' + _BY_MOTOR,
        unit='rad',
        within=(-3.2, 3.2),
        length=4,
    )
    cogging: float = parameter(
        0.0,
        'amplitude of the cogging force at the least gap, along and normal; period: slot pitch',
        unit='N',
        within=(0.0, 100.0),
    )
    cogging_phase: tuple[float, ...] = parameter(
        (0.0,) * 4,
        'phase of the cogging at displacement 0' + _BY_MOTOR,
        unit='rad',
        within=(-10.0, 10.0),
        length=4,
    )
    ripple: float = parameter(
        0.0, 'ripple of the thrust by thrust, of a third of the pole pitch', within=(0.0, 0.2)
    )
    end_force: float = parameter(
        0.0,
        'pull back into the stator at the end of travel, with the cube of displacement',
        unit='N',
        within=(0.0, 100.0),
    )
    lateral_force: float = parameter(
        0.0,
        'pull back when the other axis is at its end, with displacement',
        unit='N',
        within=(0.0, 100.0),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class BalanceParameters:
    """Where the centre of mass M_y is, from the middle of the motors' plane."""

    aside_x: float = parameter(0.0, 'along X', unit='m', within=(-0.05, 0.05))
    aside_z: float = parameter(0.0, 'along Z', unit='m', within=(-0.05, 0.05))
    below: float = parameter(0.0, "below the motors' plane", unit='m', within=(-0.1, 0.1))


@dataclasses.dataclass(frozen=True, kw_only=True)
class SpringParameters:
    """The torsional springs of (7), which are the bending guides."""

    growth: float = parameter(
        0.0,
        'growth of both stiffnesses with the gap, from the middle of its range on: the guides are '
        'then more or less drawn out; the tilts push the gap by as much',
        unit='1/m',
        within=(-120.0, 120.0),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class DriveParameters:
    """From the command to what the current loops aim at, phase by phase."""

    dac_bits: int = parameter(0, 'bits of the converters, 0 for none', within=(0, 24))
    dac_range: float = parameter(
        10.0, 'current at plus and minus full scale', unit='A', within=(0.1, 1000.0)
    )
    gain: tuple[float, ...] = parameter(
        (1.0,) * 12, 'gain of each amplifier' + _BY_PHASE, within=(0.0, 2.0), length=12
    )
    gain_spread: float = parameter(
        0.0, 'standard deviation of the gains, drawn by the seed', within=(0.0, 0.3)
    )
    offset: tuple[float, ...] = parameter(
        (0.0,) * 12,
        'offset of each amplifier' + _BY_PHASE,
        unit='A',
        within=(-1.0, 1.0),
        length=12,
    )
    offset_spread: float = parameter(
        0.0,
        'standard deviation of the offsets, drawn by the seed',
        unit='A',
        within=(0.0, 1.0),
    )
    noise: float = parameter(
        0.0,
        'standard deviation of Gaussian noise on each, new every sample',
        unit='A',
        within=(0.0, 1.0),
    )
    latency: float = parameter(
        0.0, 'time from command to amplifier, also fractions', unit='samples', within=(0.0, 3.0)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class WindingParameters:
    """Resistance, inductance L(g) and back-EMF, against the rail; L(g) by co-energy of K_v3."""

    voltage: float = parameter(
        0.0, 'what an amplifier can put out at most; 0: any', unit='V', within=(0.0, 1e4)
    )
    resistance: float = parameter(4.0, 'of a phase', unit='ohm', within=(0.0, 1e3))
    inductance: float = parameter(
        45e-3,
        'of a phase where the gap is gap_max; nearer it grows as K_v3 wants it',
        unit='H',
        within=(1e-4, 10.0),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class SensorParameters:
    """What the encoders read beside the truth, before they count; noise is in ``encoder``."""

    model: str = parameter(
        '',
        'dotted path of a module with a function reading(length, channel, sample, memory) in '
        'place of the counts',
    )
    rounding: str = parameter(
        'nearest', 'whole counts: the nearest or the next below', choices=('nearest', 'floor')
    )
    phase: tuple[float, ...] = parameter(
        (0.0,) * 6,
        'where zero lies within a count' + _BY_ENCODER,
        unit='counts',
        within=(-1.0, 1.0),
        length=6,
    )
    random_phase: bool = parameter(
        False, 'uniform over a count in addition, drawn by the seed as at a homing'
    )
    cycle: float = parameter(
        40e-6, 'period of the scale: four counts', unit='m', within=(1e-9, 1e-2)
    )
    quadrature_error: float = parameter(
        0.0, 'amplitude of the error once a cycle', unit='m', within=(0.0, 1e-4)
    )
    interpolation_error: float = parameter(
        0.0, 'amplitude of the error twice a cycle', unit='m', within=(0.0, 1e-4)
    )
    scale: tuple[float, ...] = parameter(
        (0.0,) * 6,
        'error of the scale by length' + _BY_ENCODER,
        unit='m/m',
        within=(-1e-2, 1e-2),
        length=6,
    )
    squareness: tuple[float, ...] = parameter(
        (0.0,) * 3,
        'what x reads of z, and what the gaps read of x and of z',
        unit='rad',
        within=(-1e-2, 1e-2),
        length=3,
    )
    sampling_jitter: float = parameter(
        0.0,
        'standard deviation of the instant of a sample, all encoders together',
        unit='s',
        within=(0.0, 1e-3),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class CableParameters:
    """The cable to the platen, along x and z."""

    stiffness: float = parameter(0.0, 'towards the middle', unit='N/m', within=(0.0, 1e4))
    hysteresis: float = parameter(0.0, 'friction within the cable', unit='N', within=(0.0, 100.0))
    reach: float = parameter(
        1e-3, 'way over which the hysteresis builds up', unit='m', within=(1e-6, 0.1)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class FloorParameters:
    """Vibration of the floor in y, x and z, from 1 to 80 Hz, phases drawn by the seed."""

    velocity: float = parameter(0.0, 'rms in each third octave', unit='m/s', within=(0.0, 1e-2))


@dataclasses.dataclass(frozen=True, kw_only=True)
class HeatParameters:
    """Warmer than where the model's constants hold, reached exponentially."""

    magnets: float = parameter(
        0.0, 'rise of the magnets in the end', unit='K', within=(-50.0, 100.0)
    )
    copper: float = parameter(
        0.0, 'rise of the windings in the end', unit='K', within=(-50.0, 150.0)
    )
    time: float = parameter(
        0.0, 'time constant; 0: warm from the start', unit='s', within=(0.0, 1e5)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class EffectParameters:
    """All effects."""

    friction: FrictionParameters = group(FrictionParameters)
    modes: ModeParameters = group(ModeParameters)
    motor: MotorParameters = group(MotorParameters)
    balance: BalanceParameters = group(BalanceParameters)
    spring: SpringParameters = group(SpringParameters)
    drive: DriveParameters = group(DriveParameters)
    winding: WindingParameters = group(WindingParameters)
    sensor: SensorParameters = group(SensorParameters)
    cable: CableParameters = group(CableParameters)
    floor: FloorParameters = group(FloorParameters)
    heat: HeatParameters = group(HeatParameters)
