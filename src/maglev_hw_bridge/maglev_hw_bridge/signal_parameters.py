"""Parameters of what is connected to the boards: encoders, amplifiers, and the boards themselves.

Phases are numbered a, b, c of motor 1, then of motors 2, 3, 4; encoders are the gaps of motors
1..4, then x and z.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from maglev_model.parameters import ParameterError, parameter

PHASES = 12
ENCODERS = 6
CHANNELS = 8
"""Analog outputs, and encoder inputs, of one board."""

ENCODER_NAMES = ('gap 1', 'gap 2', 'gap 3', 'gap 4', 'x', 'z')
PHASE_NAMES = tuple(f'motor {motor} phase {phase}' for motor in range(1, 5) for phase in 'abc')

_BY_PHASE = ', by phase a, b, c of motor 1, then of motors 2, 3, 4'
_BY_ENCODER = ', by encoder: gaps of motors 1..4, x, z'


def check_places(what: str, boards: Sequence[int], channels: Sequence[int]) -> None:
    """Refuse two signals on one channel of a board. Raises ParameterError."""
    seen: dict[tuple[int, int], int] = {}
    for index, place in enumerate(zip(boards, channels, strict=True)):
        if place in seen:
            raise ParameterError(
                f"parameter '{what}.channel' puts elements {seen[place]} and {index} on board "
                f'{place[0]}, channel {place[1]}; each needs a channel of its own'
            )
        seen[place] = index


def check_signs(name: str, signs: Sequence[int]) -> None:
    """Refuse a sign of 0. Raises ParameterError."""
    if 0 in signs:
        raise ParameterError(f"parameter '{name}[{signs.index(0)}]' is 0, it must be 1 or -1")


@dataclasses.dataclass(frozen=True, kw_only=True)
class CommutationParameters:
    """From i_d, i_q to three phase currents: inverse Park at the angle pi s / tau + offset."""

    offset: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0, 0.0),
        unit='rad',
        lower=-10.0,
        upper=10.0,
        length=4,
        description='electrical angle of motors 1..4 at displacement 0',
    )
    dq_scaling: str = parameter(
        'amplitude',
        choices=('amplitude', 'rms'),
        description='whether dq currents are amplitudes or RMS values of the phase currents',
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class EncoderInputParameters:
    """Where each encoder is connected, what a count is worth, and which way it counts."""

    board: tuple[int, ...] = parameter(
        (0, 0, 0, 0, 0, 0),
        lower=0,
        upper=1,
        length=ENCODERS,
        description='board, in the order of boards.identifier' + _BY_ENCODER,
    )
    channel: tuple[int, ...] = parameter(
        (0, 1, 2, 3, 4, 5),
        lower=0,
        upper=CHANNELS - 1,
        length=ENCODERS,
        description='encoder input of the board' + _BY_ENCODER,
    )
    resolution: tuple[float, ...] = parameter(
        (10e-6,) * ENCODERS,
        unit='m',
        lower=1e-9,
        upper=1e-3,
        length=ENCODERS,
        description='length of a count' + _BY_ENCODER,
    )
    direction: tuple[int, ...] = parameter(
        (1,) * ENCODERS,
        lower=-1,
        upper=1,
        length=ENCODERS,
        description='1 when counts grow with the length, else -1' + _BY_ENCODER,
    )
    zero: tuple[float, ...] = parameter(
        (0.0,) * ENCODERS,
        unit='m',
        lower=-1.0,
        upper=1.0,
        length=ENCODERS,
        description='length at count 0 until homing gives it' + _BY_ENCODER,
    )

    def __post_init__(self) -> None:
        """Refuse two encoders on one input and directions of 0."""
        check_places('encoder', self.board, self.channel)
        check_signs('encoder.direction', self.direction)


@dataclasses.dataclass(frozen=True, kw_only=True)
class HomingParameters:
    """Homing: the platen rests on its lower stop and at known x and z; that defines the zeros."""

    at_start: bool = parameter(
        False, description='home when the boards are configured; false: by ~/home'
    )
    x: float = parameter(
        -0.05, unit='m', lower=-1.0, upper=1.0, description='where the platen stands along X then'
    )
    z: float = parameter(
        -0.05, unit='m', lower=-1.0, upper=1.0, description='where the platen stands along Z then'
    )
    samples: int = parameter(
        20, lower=2, upper=10_000, description='readings that must agree, one per sample'
    )
    spread: float = parameter(
        3e-5,
        unit='m',
        lower=0.0,
        upper=1e-2,
        description='how far they may lie apart: the platen must be at rest',
    )
    shift: float = parameter(
        5e-4,
        unit='m',
        lower=0.0,
        upper=1.0,
        description='how far a second homing may move a zero from that of the first',
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class DriveParameters:
    """Twelve current amplifiers: volts = sign * current / gain + offset."""

    board: tuple[int, ...] = parameter(
        (0,) * 6 + (1,) * 6,
        lower=0,
        upper=1,
        length=PHASES,
        description='board, in the order of boards.identifier' + _BY_PHASE,
    )
    channel: tuple[int, ...] = parameter(
        (0, 1, 2, 3, 4, 5) * 2,
        lower=0,
        upper=CHANNELS - 1,
        length=PHASES,
        description='analog output of the board' + _BY_PHASE,
    )
    gain: tuple[float, ...] = parameter(
        (1.0,) * PHASES,
        unit='A/V',
        lower=0.01,
        upper=100.0,
        length=PHASES,
        description='current per volt' + _BY_PHASE,
    )
    offset: tuple[float, ...] = parameter(
        (0.0,) * PHASES,
        unit='V',
        lower=-1.0,
        upper=1.0,
        length=PHASES,
        description='voltage that makes no current' + _BY_PHASE,
    )
    sign: tuple[int, ...] = parameter(
        (1,) * PHASES,
        lower=-1,
        upper=1,
        length=PHASES,
        description='-1 where the phase is connected the other way round' + _BY_PHASE,
    )
    voltage_range: float = parameter(
        10.0, unit='V', lower=0.1, upper=20.0, description='the outputs reach plus and minus this'
    )
    slew: float = parameter(
        1e5, unit='A/s', lower=1.0, upper=1e7, description='fastest change of a phase current'
    )
    peak_current: float = parameter(
        7.0, unit='A', lower=0.1, upper=100.0, description='a phase current is limited to this'
    )
    continuous_current: float = parameter(
        5.0, unit='A', lower=0.1, upper=100.0, description='current a phase carries for ever'
    )
    thermal_time: float = parameter(
        2.0,
        unit='s',
        lower=0.01,
        upper=1e4,
        description='time constant of the I2t load, which follows (current / continuous)^2',
    )
    warn_load: float = parameter(
        0.7, lower=0.0, upper=1.0, description='I2t load from which on a warning is given'
    )
    derate_load: float = parameter(
        0.85,
        lower=0.0,
        upper=1.0,
        description='I2t load from which on the peak shrinks; the continuous current is left '
        'halfway to trip_load',
    )
    trip_load: float = parameter(
        0.98, lower=0.0, upper=1.0, description='I2t load that is a fault: the budget is spent'
    )

    def __post_init__(self) -> None:
        """Refuse what each value alone cannot show to be wrong."""
        check_places('amplifier', self.board, self.channel)
        check_signs('amplifier.sign', self.sign)
        if self.continuous_current > self.peak_current:
            raise ParameterError(
                f"parameter 'amplifier.continuous_current' is {self.continuous_current:g} A, it "
                f"must not exceed 'peak_current' ({self.peak_current:g} A)"
            )
        if not self.warn_load <= self.derate_load < self.trip_load:
            raise ParameterError(
                "parameters 'amplifier.warn_load', 'derate_load', 'trip_load' are "
                f'{self.warn_load:g}, {self.derate_load:g}, {self.trip_load:g}: they must rise'
            )


@dataclasses.dataclass(frozen=True, kw_only=True)
class BoardParameters:
    """The two boards and what guards them."""

    type: str = parameter('q8', description="the boards' type, as the vendor names it")
    identifier: tuple[str, ...] = parameter(
        ('0', '1'), length=2, description="the boards' identifiers"
    )
    watchdog: float = parameter(
        0.02,
        unit='s',
        lower=0.002,
        upper=1.0,
        description="the boards' own watchdog: without a sample for this long they put out 0 V",
    )
    buffer: int = parameter(
        50, lower=2, upper=10_000, description='samples the board keeps for a bridge that is late'
    )
    overrun: float = parameter(
        0.005,
        unit='s',
        lower=0.001,
        upper=1.0,
        description='a sample that is read this late is a fault',
    )
    stop_input: int = parameter(
        -1,
        lower=-1,
        upper=31,
        description='digital input of the first board that is an emergency stop; -1: none',
    )
    stop_level: int = parameter(
        0, lower=0, upper=1, description='level of that input that means stop; 0 is fail-safe'
    )
    enable_output: int = parameter(
        -1,
        lower=-1,
        upper=31,
        description='digital output of the first board that enables the amplifiers; -1: none',
    )
