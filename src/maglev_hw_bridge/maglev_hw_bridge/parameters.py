"""Every parameter of the hardware bridge; the defaults fit the emulated boards."""

from __future__ import annotations

import dataclasses
import math

from maglev_hw_bridge.emulation.parameters import EmulationParameters
from maglev_hw_bridge.signal_parameters import (
    BoardParameters,
    CommutationParameters,
    DriveParameters,
    EncoderInputParameters,
    HomingParameters,
)
from maglev_model.machine import MachineParameters
from maglev_model.parameters import ParameterError, group, parameter
from maglev_plant.effects.parameters import EffectParameters

BEYOND_STOPS = 5e-4
"""How far beyond its stops a platen may be, within tolerances [m]."""

_BY_AXIS = ', by axis y, x, z, phi, theta'


@dataclasses.dataclass(frozen=True, kw_only=True)
class FaultParameters:
    """What is a fault; all times are stage time."""

    stale: float = parameter(
        0.005,
        'without fresh currents for this long in flight the bridge lands by itself',
        unit='s',
        within=(0.001, 1.0),
    )
    command_limit: float = parameter(
        10.5,
        "largest commanded amplitude of a motor's dq current; more is a fault",
        unit='A',
        within=(0.1, 200.0),
    )
    over_current: float = parameter(
        10.5,
        'largest phase current that may be asked for before limits; more is a fault',
        unit='A',
        within=(0.1, 200.0),
    )
    bandwidth: float = parameter(
        200.0,
        'of the observer that foretells what the encoders read',
        unit='rad/s',
        within=(10.0, 1000.0),
    )
    jump: float = parameter(
        6e-5,
        'largest change of an encoder in a sample from what is foretold; more is a slip',
        unit='m',
        within=(1e-6, 0.1),
    )
    residual: float = parameter(
        2e-4,
        'largest |g1 + g3 - g2 - g4|, which is 0 for a rigid platen',
        unit='m',
        within=(1e-6, 0.1),
    )
    stuck_gap: float = parameter(
        2e-4,
        'a gap encoder is stuck when it should have moved this far without a count, all of them '
        'by half of it, or when meanwhile the four have come to contradict each other by half',
        unit='m',
        within=(1e-6, 0.1),
    )
    roll_call: float = parameter(
        3.5e-5,
        'gap encoders that have not counted when another one has left the lower stop by this are '
        'stuck',
        unit='m',
        within=(1e-6, 0.1),
    )
    stuck_horizontal: float = parameter(
        1.5e-4,
        'x or z is stuck when it should have moved this far without a count',
        unit='m',
        within=(1e-6, 0.1),
    )
    silence: float = parameter(
        0.15,
        'x or z that has not counted for so long in flight is asked whether it does, by pushes to '
        'and fro that move it by about one count; 0: never',
        unit='s',
        within=(0.0, 60.0),
    )
    gap_silence: float = parameter(
        0.03,
        'two or more gap encoders that have not counted for so long in flight are asked whether '
        'they do, by pushes to and fro that move y by about one count; twice as long after each '
        'answer; 0: never',
        unit='s',
        within=(0.0, 60.0),
    )
    friction: tuple[float, ...] = parameter(
        (0.8, 0.35, 0.35, 3.0, 3.0),
        'by how much the force on a platen that stands still may differ from the model, friction '
        'and all' + _BY_AXIS,
        unit='m/s^2, rad/s^2',
        within=(0.0, 1000.0),
        length=5,
    )
    unexplained: tuple[float, ...] = parameter(
        (6.0, 6.0, 6.0, 10.0, 10.0),
        'acceleration that what is commanded does not explain; more for 10 ms in flight is a fault '
        'of the motors' + _BY_AXIS,
        unit='m/s^2, rad/s^2',
        within=(0.0, 1000.0),
        length=5,
    )
    lower: tuple[float, ...] = parameter(
        (0.0183, -0.048, -0.048, -0.0028, -0.0135),
        'least position in flight' + _BY_AXIS,
        unit='m, rad',
        within=(-1.0, 1.0),
        length=5,
    )
    upper: tuple[float, ...] = parameter(
        (0.0313, 0.048, 0.048, 0.0028, 0.0135),
        'greatest position in flight' + _BY_AXIS,
        unit='m, rad',
        within=(-1.0, 1.0),
        length=5,
    )
    gap_lower: float = parameter(
        0.0176, 'least gap of a motor in flight', unit='m', within=(1e-3, 0.2)
    )
    gap_upper: float = parameter(
        0.0320, 'greatest gap of a motor in flight', unit='m', within=(1e-3, 0.2)
    )

    def __post_init__(self) -> None:
        """Refuse empty ranges."""
        for axis, (low, high) in enumerate(zip(self.lower, self.upper, strict=True)):
            if low >= high:
                raise ParameterError(
                    f"parameter 'fault.lower[{axis}]' is {low:g}, it must be less than "
                    f"'fault.upper[{axis}]' ({high:g})"
                )
        if self.gap_lower >= self.gap_upper:
            raise ParameterError(
                f"parameter 'fault.gap_lower' is {self.gap_lower:g} m, it must be less than "
                f"'fault.gap_upper' ({self.gap_upper:g} m)"
            )

    @property
    def largest_amplitude(self) -> float:
        """Largest amplitude of a motor's dq current that is no fault [A]."""
        return min(self.command_limit, self.over_current)


@dataclasses.dataclass(frozen=True, kw_only=True)
class BridgeLandingParameters:
    """How the bridge lands the platen without a controller."""

    braking_time: float = parameter(
        0.3, 'time to stop and level the tilts', unit='s', within=(0.05, 10.0)
    )
    descent_time: float = parameter(
        1.0, 'time to descend to the lower stop', unit='s', within=(0.1, 60.0)
    )
    blind_braking_time: float = parameter(
        0.05, 'the first where an axis is seen by no encoder', unit='s', within=(0.05, 10.0)
    )
    blind_descent_time: float = parameter(
        0.28, 'the second where a tilt is seen by no encoder', unit='s', within=(0.1, 60.0)
    )
    adrift_descent_time: float = parameter(
        0.15, 'the second where x or z is seen by no encoder', unit='s', within=(0.1, 60.0)
    )
    settle_time: float = parameter(
        0.2, 'time pressed on the stop before the end', unit='s', within=(0.0, 10.0)
    )
    depth: float = parameter(
        2e-4,
        'how far below the stop the descent aims, to arrive whatever the model says',
        unit='m',
        within=(0.0, 5e-3),
    )
    stiffness: tuple[float, ...] = parameter(
        (6400.0, 2500.0, 2500.0, 6400.0, 6400.0),
        'acceleration per error' + _BY_AXIS,
        unit='1/s^2',
        within=(1.0, 1e6),
        length=5,
    )
    damping: tuple[float, ...] = parameter(
        (160.0, 100.0, 100.0, 160.0, 160.0),
        'acceleration per error rate' + _BY_AXIS,
        unit='1/s',
        within=(0.1, 1e4),
        length=5,
    )
    stray: tuple[float, ...] = parameter(
        (1e-3, 1e-3, 1e-3, 1.5e-3, 3e-3),
        'farther from its way down the platen is not held any more, and currents are cut; with '
        'sound amplifiers it stays within half of it' + _BY_AXIS,
        unit='m, rad',
        within=(1e-5, 0.1),
        length=5,
    )
    current: float = parameter(5.0, 'largest current of a motor', unit='A', within=(0.1, 100.0))

    @property
    def longest(self) -> float:
        """How long a landing may take, also one that an encoder does not see [s]."""
        blind = self.blind_braking_time + max(self.blind_descent_time, self.adrift_descent_time)
        return max(self.braking_time + self.descent_time, blind) + self.settle_time


@dataclasses.dataclass(frozen=True, kw_only=True)
class BridgeParameters:
    """The hardware bridge."""

    sample_time: float = parameter(1e-3, 'time between samples', unit='s', within=(1e-4, 1e-2))
    driver: str = parameter('emulated', 'which boards: quanser, emulated, or a driver of your own')
    machine: MachineParameters = group(MachineParameters)
    commutation: CommutationParameters = group(CommutationParameters)
    encoder: EncoderInputParameters = group(EncoderInputParameters)
    homing: HomingParameters = group(HomingParameters)
    amplifier: DriveParameters = group(DriveParameters)
    boards: BoardParameters = group(BoardParameters)
    fault: FaultParameters = group(FaultParameters)
    landing: BridgeLandingParameters = group(BridgeLandingParameters)
    emulation: EmulationParameters = group(EmulationParameters)
    effects: EffectParameters = group(EffectParameters)  # of the emulated machine

    def __post_init__(self) -> None:
        """Refuse what the groups alone cannot show to be wrong."""
        for name, low in (
            ('boards.watchdog', self.boards.watchdog),
            ('fault.stale', self.fault.stale),
        ):
            if low < 2.0 * self.sample_time:
                raise ParameterError(
                    f"parameter '{name}' is {low:g} s, it must be at least two sample times "
                    f'({2.0 * self.sample_time:g} s)'
                )
        if self.fault.command_limit < self.amplifier.continuous_current:
            raise ParameterError(
                f"parameter 'fault.command_limit' is {self.fault.command_limit:g} A, it must be at "
                f"least 'amplifier.continuous_current' ({self.amplifier.continuous_current:g} A)"
            )
        if self.landing.current > self.fault.largest_amplitude:
            raise ParameterError(
                f"parameter 'landing.current' is {self.landing.current:g} A, it must not exceed "
                f"'fault.command_limit' ({self.fault.command_limit:g} A) or 'fault.over_current' "
                f'({self.fault.over_current:g} A): a landing that asks for more is cut'
            )
        if self.boards.stop_time < self.landing.longest:
            raise ParameterError(
                f"parameter 'boards.stop_time' is {self.boards.stop_time:g} s, a landing takes "
                f'{self.landing.longest:g} s'
            )

    @property
    def kept_samples(self) -> int:
        """Samples that a board keeps, so that its watchdog expires before any is lost."""
        until_expiry = math.ceil(self.boards.watchdog / self.sample_time)
        return max(self.boards.buffer, until_expiry)

    def check_homing(self) -> None:
        """Refuse a home that no platen rests at, and one at the start with real boards.

        Raises ParameterError.
        """
        for axis in ('x', 'z'):
            home, stop = getattr(self.homing, axis), getattr(self.machine, f'{axis}_max')
            if abs(home) > stop + BEYOND_STOPS:
                raise ParameterError(
                    f"parameter 'homing.{axis}' is {home:g} m, beyond the stops at plus and minus "
                    f"'machine.{axis}_max' ({stop:g} m)"
                )
        if self.fault.gap_upper < self.machine.gap_max:
            raise ParameterError(
                f"parameter 'fault.gap_upper' is {self.fault.gap_upper:g} m, but the platen rests "
                f"at 'machine.gap_max' ({self.machine.gap_max:g} m)"
            )
        if self.homing.at_start and self.driver != 'emulated':
            raise ParameterError(
                f"parameter 'homing.at_start' is true with driver '{self.driver}': only an emulated"
                ' platen is known to rest on its lower stop; set it false and home by ~/home'
            )

    def in_real_time(self) -> BridgeParameters:
        """What holds in real time: with emulated boards no time is below ``emulation.patience``."""
        if self.driver != 'emulated':
            return self
        patience = self.emulation.patience
        boards = dataclasses.replace(
            self.boards,
            watchdog=max(self.boards.watchdog, patience),
            overrun=max(self.boards.overrun, patience),
        )
        fault = dataclasses.replace(self.fault, stale=max(self.fault.stale, patience))
        return dataclasses.replace(self, boards=boards, fault=fault)
