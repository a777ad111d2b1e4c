"""The parameters of what a law is told of encoders, flexible modes, windings and friction."""

from __future__ import annotations

import dataclasses
import math

from maglev_controller.design.notch import MOST
from maglev_controller.design.state_space import Mode
from maglev_model.parameters import ParameterError, parameter


@dataclasses.dataclass(frozen=True, kw_only=True)
class EncoderParameters:
    """What is known of the encoders: a reading says no more than which count the length is in."""

    gap_resolution: float = parameter(
        10e-6, 'count of the gap encoders, 0 for none', unit='m', within=(0.0, 1e-3)
    )
    horizontal_resolution: float = parameter(
        10e-6, 'count of the x and z encoders, 0 for none', unit='m', within=(0.0, 1e-3)
    )
    rounding: str = parameter(
        'nearest',
        'whole counts are the nearest, or the next below: then half a count is added',
        choices=('nearest', 'floor'),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class ModeParameters:
    """Flexible modes the feedback has to bear, as many as the lists are long.

    The encoders read the platen + gain q, q'' + 2 damping w q' + w^2 q = the axis' acceleration.
    """

    axis: tuple[str, ...] = parameter(
        ('x',), 'axis of each mode', choices=('y', 'x', 'z', 'phi', 'theta')
    )
    frequency: tuple[float, ...] = parameter((120.0,), 'of each mode', unit='Hz', within=(1.0, 1e4))
    damping: tuple[float, ...] = parameter((0.01,), 'damping ratio of each', within=(1e-4, 1.0))
    gain: tuple[float, ...] = parameter(
        (0.0,), 'modal gain of each by that of the rigid axis; 0: none', within=(-2.0, 2.0)
    )
    tolerance: float = parameter(
        0.05, 'how far off, of themselves, the frequencies may be', within=(0.0, 0.3)
    )
    sensitivity: float = parameter(
        2.5, 'sensitivity peak that the design goes for, wherever the modes are', within=(1.2, 1e3)
    )

    def __post_init__(self) -> None:
        """Refuse lists of different lengths, and more modes of an axis than it has notches."""
        lengths = len(self.axis), len(self.frequency), len(self.damping), len(self.gain)
        if len(set(lengths)) > 1:
            raise ParameterError(
                "parameters 'modes.axis', 'frequency', 'damping' and 'gain' have "
                '{}, {}, {} and {} elements, they must have as many'.format(*lengths)
            )
        for name in set(self.axis):
            if len(self.of(name)) > MOST:
                raise ParameterError(
                    f"parameter 'modes.axis' names {len(self.of(name))} modes of {name}, "
                    f'an axis has at most {MOST}'
                )

    def of(self, axis: str) -> tuple[Mode, ...]:
        """The modes of one axis that have a gain."""
        given = zip(self.axis, self.frequency, self.damping, self.gain, strict=True)
        return tuple(
            Mode(2.0 * math.pi * frequency, damping, gain)
            for name, frequency, damping, gain in given
            if name == axis and gain != 0.0
        )


@dataclasses.dataclass(frozen=True, kw_only=True)
class WindingParameters:
    """The windings and the rail: what currents can be asked for from sample to sample."""

    voltage: float = parameter(
        0.0, 'that an amplifier can put out at most; 0: any', unit='V', within=(0.0, 1e4)
    )
    resistance: float = parameter(4.0, 'of a phase', unit='ohm', within=(0.0, 1e3))
    inductance: float = parameter(
        45e-3,
        'of a phase where the gap is gap_max; nearer it grows as K_v3 wants it',
        unit='H',
        within=(1e-4, 10.0),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class FrictionParameters:
    """Friction fed forward, its level learned in flight."""

    adaptation_time: float = parameter(
        2.0,
        'time over which its level is learned; 0: none is fed forward',
        unit='s',
        within=(0.0, 1e3),
    )
    way: tuple[float, ...] = parameter(
        (2e-6, 3e-6, 3e-6, 3e-6, 3e-6),
        'way over which it turns after a reversal, per axis',
        unit='m, rad',
        within=(1e-8, 1.0),
        length=5,
    )
    initial: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0, 0.0, 0.0),
        'level that it begins with at every enable, per axis',
        unit='m/s^2, rad/s^2',
        within=(0.0, 100.0),
        length=5,
    )
    largest: tuple[float, ...] = parameter(
        (1.0, 1.0, 1.0, 5.0, 5.0),
        'level that is learned at most, per axis',
        unit='m/s^2, rad/s^2',
        within=(0.0, 100.0),
        length=5,
    )
