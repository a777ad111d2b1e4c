"""Parameters of the emulated boards: how the machine behind them is really wired and built."""

from __future__ import annotations

import dataclasses

from maglev_model.guide import GuideParameters
from maglev_model.parameters import group, parameter
from maglev_plant.parameters import (
    DisturbanceParameters,
    EncoderParameters,
    InitialParameters,
    OffsetParameters,
    StopParameters,
)


@dataclasses.dataclass(frozen=True, kw_only=True)
class WiringParameters:
    """The truth that ``amplifier`` and ``encoder`` must agree with; same orders."""

    phase_board: tuple[int, ...] = parameter(
        (0,) * 6 + (1,) * 6, 'board of each phase', within=(0, 1), length=12
    )
    phase_channel: tuple[int, ...] = parameter(
        (0, 1, 2, 3, 4, 5) * 2, 'analog output of each', within=(0, 7), length=12
    )
    phase_sign: tuple[int, ...] = parameter(
        (1,) * 12, '1, or -1 for a phase turned round', within=(-1, 1), length=12
    )
    gain: tuple[float, ...] = parameter(
        (1.0,) * 12, 'of each amplifier', unit='A/V', within=(0.01, 100.0), length=12
    )
    offset: tuple[float, ...] = parameter(
        (0.0,) * 12, 'of each amplifier', unit='V', within=(-1.0, 1.0), length=12
    )
    angle: tuple[float, ...] = parameter(
        (0.0,) * 4,
        'electrical angle of motors 1..4 at displacement 0',
        unit='rad',
        within=(-10.0, 10.0),
        length=4,
    )
    encoder_board: tuple[int, ...] = parameter(
        (0,) * 6, 'board of each encoder', within=(0, 1), length=6
    )
    encoder_channel: tuple[int, ...] = parameter(
        (0, 1, 2, 3, 4, 5), 'encoder input of each', within=(0, 7), length=6
    )
    encoder_direction: tuple[int, ...] = parameter(
        (1,) * 6, '1 when counts grow with the length', within=(-1, 1), length=6
    )
    encoder_start: tuple[int, ...] = parameter(
        (0,) * 6,
        'count of each encoder at the initial position',
        within=(-(2**31), 2**31 - 1),
        length=6,
    )
    stop_line: int = parameter(
        -1,
        "digital line of the first board with the emergency stop's contact; -1: as boards says",
        within=(-1, 31),
    )
    stop_level: int = parameter(
        -1, 'its level when it is pressed; -1: as boards says', within=(-1, 1)
    )
    enable_line: int = parameter(
        -1, 'digital line that enables the amplifiers; -1: as boards says', within=(-1, 31)
    )
    enable_level: int = parameter(
        -1, 'its level that enables them; -1: as boards says', within=(-1, 1)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class WindingParameters:
    """Amplifiers and windings: a current loop that the supply limits. R and L are assumptions."""

    bandwidth: float = parameter(
        2000.0, 'corner frequency of the first-order current loop', unit='Hz', within=(1.0, 1e5)
    )
    voltage: float = parameter(
        28.0, 'what an amplifier can put out at most', unit='V', within=(0.1, 1e3)
    )
    peak_current: float = parameter(
        7.0, 'what an amplifier delivers at most', unit='A', within=(0.1, 100.0)
    )
    resistance: float = parameter(2.0, 'resistance of a phase', unit='ohm', within=(1e-3, 1e3))
    inductance: float = parameter(5e-3, 'inductance of a phase', unit='H', within=(1e-6, 10.0))


@dataclasses.dataclass(frozen=True, kw_only=True)
class InjectionParameters:
    """Faults of the emulated hardware, from a sample on; -1 for none."""

    dead_phase: int = parameter(-1, 'phase 0..11 without current', within=(-1, 11))
    stuck_encoder: int = parameter(-1, 'encoder 0..5 that stops', within=(-1, 5))
    jumping_encoder: int = parameter(-1, 'encoder 0..5 that jumps', within=(-1, 5))
    jump: int = parameter(100, 'how far it jumps', unit='counts', within=(-(2**31), 2**31 - 1))
    late: int = parameter(0, 'how late one sample is read', unit='samples', within=(0, 1000))
    error: bool = parameter(False, 'whether the boards raise an error')
    stop_input: bool = parameter(False, 'whether the emergency stop is pressed')
    expired_watchdog: bool = parameter(False, "whether the boards' watchdog expires")
    sample: int = parameter(-1, 'sample from which on the faults are there', within=(-1, 2**31 - 1))


@dataclasses.dataclass(frozen=True, kw_only=True)
class EmulationParameters:
    """The machine behind the emulated boards."""

    seed: int = parameter(0, 'seed of the encoder noise', within=(0, 2**31 - 1))
    patience: float = parameter(
        0.0,
        'realtime, emulated boards only, as a desktop now and then stops its processes: '
        'fault.stale, boards.overrun and boards.watchdog are at least this, and when the '
        'bridge is stopped for longer than a quarter of it, so are the boards; 0: as real '
        'ones',
        unit='s',
        within=(0.0, 1.0),
    )
    wiring: WiringParameters = group(WiringParameters)
    winding: WindingParameters = group(WindingParameters)
    encoder: EncoderParameters = group(EncoderParameters)
    guide: GuideParameters = group(GuideParameters)
    stop: StopParameters = group(StopParameters)
    disturbance: DisturbanceParameters = group(DisturbanceParameters)
    offset: OffsetParameters = group(OffsetParameters)
    initial: InitialParameters = group(InitialParameters)
    inject: InjectionParameters = group(InjectionParameters)
