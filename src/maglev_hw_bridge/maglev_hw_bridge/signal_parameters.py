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


def check_places(name: str, boards: Sequence[int], channels: Sequence[int]) -> None:
    """Refuse two signals on one channel of a board, by the channels' name.

    Raises ParameterError.
    """
    seen: dict[tuple[int, int], int] = {}
    for index, place in enumerate(zip(boards, channels, strict=True)):
        if place in seen:
            raise ParameterError(
                f"parameter '{name}' puts elements {seen[place]} and {index} on board "
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
        'electrical angle of motors 1..4 at displacement 0',
        unit='rad',
        within=(-10.0, 10.0),
        length=4,
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class EncoderInputParameters:
    """Where each encoder is connected, what a count is worth, and which way it counts."""

    board: tuple[int, ...] = parameter(
        (0, 0, 0, 0, 0, 0),
        'board, in the order of boards.identifier' + _BY_ENCODER,
        within=(0, 1),
        length=ENCODERS,
    )
    channel: tuple[int, ...] = parameter(
        (0, 1, 2, 3, 4, 5),
        'encoder input of the board' + _BY_ENCODER,
        within=(0, CHANNELS - 1),
        length=ENCODERS,
    )
    resolution: tuple[float, ...] = parameter(
        (10e-6,) * ENCODERS,
        'length of a count' + _BY_ENCODER,
        unit='m',
        within=(1e-9, 1e-3),
        length=ENCODERS,
    )
    direction: tuple[int, ...] = parameter(
        (1,) * ENCODERS,
        '1 when counts grow with the length, else -1' + _BY_ENCODER,
        within=(-1, 1),
        length=ENCODERS,
    )
    zero: tuple[float, ...] = parameter(
        (0.0,) * ENCODERS,
        'length at count 0 until homing gives it' + _BY_ENCODER,
        unit='m',
        within=(-1.0, 1.0),
        length=ENCODERS,
    )

    def __post_init__(self) -> None:
        """Refuse two encoders on one input and directions of 0."""
        check_places('encoder.channel', self.board, self.channel)
        check_signs('encoder.direction', self.direction)


@dataclasses.dataclass(frozen=True, kw_only=True)
class HomingParameters:
    """Homing: the platen rests on its lower stop and at known x and z; that defines the zeros."""

    at_start: bool = parameter(
        False, 'emulated boards only: home when they are configured; false: by ~/home'
    )
    x: float = parameter(
        -0.05, 'where the platen stands along X then', unit='m', within=(-1.0, 1.0)
    )
    z: float = parameter(
        -0.05, 'where the platen stands along Z then', unit='m', within=(-1.0, 1.0)
    )
    samples: int = parameter(20, 'readings that must agree, one per sample', within=(2, 10_000))
    spread: float = parameter(
        3e-5, 'how far they may lie apart: the platen must be at rest', unit='m', within=(0.0, 1e-2)
    )
    shift: float = parameter(
        5e-4,
        'how far a second homing may move a zero from that of the first',
        unit='m',
        within=(0.0, 1.0),
    )
    lift: float = parameter(
        3e-4,
        'how far ~/home lifts the platen to find out that the stop below it is the lower one; '
        '0: not at all, who calls it vouches for that',
        unit='m',
        within=(0.0, 1e-3),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class DriveParameters:
    """Twelve current amplifiers: volts = sign * current / gain + offset."""

    board: tuple[int, ...] = parameter(
        (0,) * 6 + (1,) * 6,
        'board, in the order of boards.identifier' + _BY_PHASE,
        within=(0, 1),
        length=PHASES,
    )
    channel: tuple[int, ...] = parameter(
        (0, 1, 2, 3, 4, 5) * 2,
        'analog output of the board' + _BY_PHASE,
        within=(0, CHANNELS - 1),
        length=PHASES,
    )
    gain: tuple[float, ...] = parameter(
        (1.0,) * PHASES,
        'current per volt' + _BY_PHASE,
        unit='A/V',
        within=(0.01, 100.0),
        length=PHASES,
    )
    offset: tuple[float, ...] = parameter(
        (0.0,) * PHASES,
        'voltage that makes no current' + _BY_PHASE,
        unit='V',
        within=(-1.0, 1.0),
        length=PHASES,
    )
    sign: tuple[int, ...] = parameter(
        (1,) * PHASES,
        '-1 where the phase is connected the other way round' + _BY_PHASE,
        within=(-1, 1),
        length=PHASES,
    )
    voltage_range: float = parameter(
        10.0, 'the outputs reach plus and minus this', unit='V', within=(0.1, 20.0)
    )
    slew: float = parameter(1e5, 'fastest change of a phase current', unit='A/s', within=(1.0, 1e7))
    peak_current: float = parameter(
        7.0, 'a phase current is limited to this', unit='A', within=(0.1, 100.0)
    )
    continuous_current: float = parameter(
        5.0, 'current a phase carries for ever', unit='A', within=(0.1, 100.0)
    )
    thermal_time: float = parameter(
        2.0,
        'time constant of the I2t load, which follows (current / continuous)^2',
        unit='s',
        within=(0.01, 1e4),
    )
    warn_load: float = parameter(
        0.7, 'I2t load from which on a warning is given', within=(0.0, 1.0)
    )
    derate_load: float = parameter(
        0.85,
        'I2t load from which on the peak shrinks; the continuous current is left halfway '
        'to trip_load',
        within=(0.0, 1.0),
    )
    trip_load: float = parameter(
        0.98, 'I2t load that is a fault: the budget is spent', within=(0.0, 1.0)
    )

    def __post_init__(self) -> None:
        """Refuse what each value alone cannot show to be wrong."""
        check_places('amplifier.channel', self.board, self.channel)
        check_signs('amplifier.sign', self.sign)
        self._check_reach()
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

    def _check_reach(self) -> None:
        """Refuse an output that cannot ask for the peak current either way round."""
        for phase, (gain, offset) in enumerate(zip(self.gain, self.offset, strict=True)):
            reach = gain * (self.voltage_range - abs(offset))
            if reach < self.peak_current:
                raise ParameterError(
                    f"parameter 'amplifier.gain[{phase}]' is {gain:g} A/V: with "
                    f"'voltage_range' ({self.voltage_range:g} V) and 'offset[{phase}]' "
                    f"({offset:g} V) that reaches {reach:g} A, less than 'peak_current' "
                    f'({self.peak_current:g} A)'
                )


@dataclasses.dataclass(frozen=True, kw_only=True)
class BoardParameters:
    """The two boards and what guards them."""

    type: str = parameter('q8', "the boards' type, as the vendor names it")
    identifier: tuple[str, ...] = parameter(('0', '1'), "the boards' identifiers", length=2)
    watchdog: float = parameter(
        0.02,
        "the boards' own watchdog: without a sample for this long they put out 0 V",
        unit='s',
        within=(0.002, 1.0),
    )
    buffer: int = parameter(
        50,
        'samples the board keeps for a bridge that is late, at least those that come until its '
        'watchdog expires',
        within=(2, 10_000),
    )
    overrun: float = parameter(
        0.005, 'a sample that is read this late is a fault', unit='s', within=(0.001, 1.0)
    )
    stop_input: int = parameter(
        -1, 'digital input of the first board that is an emergency stop; -1: none', within=(-1, 31)
    )
    stop_level: int = parameter(
        1,
        'level of that input that means stop; it should be what a broken wire reads, open_level',
        within=(0, 1),
    )
    stop_time: float = parameter(
        5.0,
        'after an emergency stop the amplifiers are disabled when the platen has landed, at the '
        'latest after this',
        unit='s',
        within=(0.1, 120.0),
    )
    enable_output: int = parameter(
        -1,
        'digital output of the first board that enables the amplifiers; -1: none',
        within=(-1, 31),
    )
    enable_level: int = parameter(
        0,
        'level of that output that enables them; it must not be what the line becomes when the '
        'watchdog expires',
        within=(0, 1),
    )
    open_level: int = parameter(
        1, 'level of a digital line that nothing drives: a Q8 pulls it up', within=(0, 1)
    )
    digital_expiry: str = parameter(
        'tristate',
        'what digital outputs become when the watchdog expires; a Q8 knows tristate only',
        choices=('tristate', 'low', 'high', 'no_change'),
    )
    analog_expiry: str = parameter(
        'zero',
        'what analog outputs become then: 0 V, as a Q8 must, or the voltage that makes no current',
        choices=('zero', 'no_current'),
    )
    memory: str = parameter(
        '',
        "file, by its whole path, that keeps the amplifiers' I2t load and a latched fault while no "
        'bridge runs, and that keeps a second one from the boards; empty: one by boards.type and '
        'identifier in $XDG_STATE_HOME/maglev-stage (~/.local/state), none with emulated boards',
    )

    def __post_init__(self) -> None:
        """Refuse one board twice, an enable line that expiry would turn on, and shared lines."""
        if self.identifier[0] == self.identifier[1]:
            raise ParameterError(
                f"parameter 'boards.identifier' names board '{self.identifier[0]}' twice, the "
                'bridge drives two'
            )
        if self.enable_output < 0:
            return
        if self.enable_output == self.stop_input:
            raise ParameterError(
                f"parameter 'boards.enable_output' is {self.enable_output}, which is "
                "'boards.stop_input' as well; each needs a line of its own"
            )
        if self.expired_level in (self.enable_level, None):
            becomes = ('low', 'high')[self.enable_level] if self.expired_level is not None else 'on'
            raise ParameterError(
                f"parameter 'boards.enable_level' is {self.enable_level}: with digital_expiry "
                f"'{self.digital_expiry}' and open_level {self.open_level} the line stays or goes "
                f'{becomes} when the watchdog expires, and the amplifiers would be on; let the '
                'other level enable them, through an inverter or a relay'
            )

    @property
    def expired_level(self) -> int | None:
        """Level of the digital outputs when the watchdog has expired; None: as they were."""
        levels = {'tristate': self.open_level, 'low': 0, 'high': 1, 'no_change': None}
        return levels[self.digital_expiry]
