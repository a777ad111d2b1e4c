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
        (0,) * 6 + (1,) * 6, lower=0, upper=1, length=12, description='board of each phase'
    )
    phase_channel: tuple[int, ...] = parameter(
        (0, 1, 2, 3, 4, 5) * 2, lower=0, upper=7, length=12, description='analog output of each'
    )
    phase_sign: tuple[int, ...] = parameter(
        (1,) * 12, lower=-1, upper=1, length=12, description='1, or -1 for a phase turned round'
    )
    gain: tuple[float, ...] = parameter(
        (1.0,) * 12, unit='A/V', lower=0.01, upper=100.0, length=12, description='of each amplifier'
    )
    offset: tuple[float, ...] = parameter(
        (0.0,) * 12, unit='V', lower=-1.0, upper=1.0, length=12, description='of each amplifier'
    )
    angle: tuple[float, ...] = parameter(
        (0.0,) * 4,
        unit='rad',
        lower=-10.0,
        upper=10.0,
        length=4,
        description='electrical angle of motors 1..4 at displacement 0',
    )
    encoder_board: tuple[int, ...] = parameter(
        (0,) * 6, lower=0, upper=1, length=6, description='board of each encoder'
    )
    encoder_channel: tuple[int, ...] = parameter(
        (0, 1, 2, 3, 4, 5), lower=0, upper=7, length=6, description='encoder input of each'
    )
    encoder_direction: tuple[int, ...] = parameter(
        (1,) * 6, lower=-1, upper=1, length=6, description='1 when counts grow with the length'
    )
    encoder_start: tuple[int, ...] = parameter(
        (0,) * 6,
        lower=-(2**31),
        upper=2**31 - 1,
        length=6,
        description='count of each encoder at the initial position',
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class WindingParameters:
    """Amplifiers and windings: a current loop that the supply limits. R and L are assumptions."""

    bandwidth: float = parameter(
        2000.0,
        unit='Hz',
        lower=1.0,
        upper=1e5,
        description='corner frequency of the first-order current loop',
    )
    voltage: float = parameter(
        28.0, unit='V', lower=0.1, upper=1e3, description='what an amplifier can put out at most'
    )
    peak_current: float = parameter(
        7.0, unit='A', lower=0.1, upper=100.0, description='what an amplifier delivers at most'
    )
    resistance: float = parameter(
        2.0, unit='ohm', lower=1e-3, upper=1e3, description='resistance of a phase'
    )
    inductance: float = parameter(
        5e-3, unit='H', lower=1e-6, upper=10.0, description='inductance of a phase'
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class InjectionParameters:
    """Faults of the emulated hardware, from a sample on; -1 for none."""

    dead_phase: int = parameter(-1, lower=-1, upper=11, description='phase 0..11 without current')
    stuck_encoder: int = parameter(-1, lower=-1, upper=5, description='encoder 0..5 that stops')
    jumping_encoder: int = parameter(-1, lower=-1, upper=5, description='encoder 0..5 that jumps')
    jump: int = parameter(
        100, unit='counts', lower=-(2**31), upper=2**31 - 1, description='how far it jumps'
    )
    late: int = parameter(
        0, unit='samples', lower=0, upper=1000, description='how late one sample is read'
    )
    error: bool = parameter(False, description='whether the boards raise an error')
    stop_input: bool = parameter(False, description='whether the emergency stop is pressed')
    expired_watchdog: bool = parameter(False, description="whether the boards' watchdog expires")
    sample: int = parameter(
        -1, lower=-1, upper=2**31 - 1, description='sample from which on the faults are there'
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class EmulationParameters:
    """The machine behind the emulated boards."""

    seed: int = parameter(0, lower=0, upper=2**31 - 1, description='seed of the encoder noise')
    patience: float = parameter(
        0.0,
        unit='s',
        lower=0.0,
        upper=1.0,
        description='realtime, emulated boards only, as a desktop now and then stops its processes:'
        ' fault.stale, boards.overrun and boards.watchdog are at least this, and when the bridge is'
        ' stopped for longer than a quarter of it, so are the boards; 0: as real ones',
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
