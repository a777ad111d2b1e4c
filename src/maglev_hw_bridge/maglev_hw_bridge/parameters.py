"""Every parameter of the hardware bridge; the defaults fit the emulated boards."""

from __future__ import annotations

import dataclasses

from maglev_hw_bridge.emulation_parameters import EmulationParameters
from maglev_hw_bridge.signal_parameters import (
    BoardParameters,
    CommutationParameters,
    DriveParameters,
    EncoderInputParameters,
    HomingParameters,
)
from maglev_model.machine import MachineParameters
from maglev_model.parameters import ParameterError, group, parameter

_BY_AXIS = ', by axis y, x, z, phi, theta'


@dataclasses.dataclass(frozen=True, kw_only=True)
class FaultParameters:
    """What is a fault; all times are stage time."""

    stale: float = parameter(
        0.005,
        unit='s',
        lower=0.001,
        upper=1.0,
        description='without fresh currents for this long in flight the bridge lands by itself',
    )
    command_limit: float = parameter(
        10.5,
        unit='A',
        lower=0.1,
        upper=200.0,
        description="largest commanded amplitude of a motor's dq current; more is a fault",
    )
    over_current: float = parameter(
        10.5,
        unit='A',
        lower=0.1,
        upper=200.0,
        description='largest phase current that may be asked for before limits; more is a fault',
    )
    jump: float = parameter(
        3e-4,
        unit='m',
        lower=1e-6,
        upper=0.1,
        description='largest change of an encoder from one sample to what the two before foretell',
    )
    residual: float = parameter(
        2e-4,
        unit='m',
        lower=1e-6,
        upper=0.1,
        description='largest |g1 + g3 - g2 - g4|, which is 0 for a rigid platen',
    )
    stuck_gap: float = parameter(
        1e-4,
        unit='m',
        lower=1e-6,
        upper=0.1,
        description='a gap encoder is stuck when the other three see it move this far meanwhile',
    )
    stuck_horizontal: float = parameter(
        3e-4,
        unit='m',
        lower=1e-6,
        upper=0.1,
        description='x or z is stuck when the force should have moved it this far meanwhile',
    )
    friction: float = parameter(
        0.5,
        unit='m/s^2',
        lower=0.0,
        upper=100.0,
        description='deceleration that guide friction along X and Z stays below',
    )
    lower: tuple[float, ...] = parameter(
        (0.0183, -0.048, -0.048, -0.0028, -0.0135),
        unit='m, rad',
        lower=-1.0,
        upper=1.0,
        length=5,
        description='least position in flight' + _BY_AXIS,
    )
    upper: tuple[float, ...] = parameter(
        (0.0313, 0.048, 0.048, 0.0028, 0.0135),
        unit='m, rad',
        lower=-1.0,
        upper=1.0,
        length=5,
        description='greatest position in flight' + _BY_AXIS,
    )
    gap_lower: float = parameter(
        0.0176, unit='m', lower=1e-3, upper=0.2, description='least gap of a motor in flight'
    )
    gap_upper: float = parameter(
        0.0320, unit='m', lower=1e-3, upper=0.2, description='greatest gap of a motor in flight'
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
            raise ParameterError("parameter 'fault.gap_lower' must be less than 'fault.gap_upper'")


@dataclasses.dataclass(frozen=True, kw_only=True)
class BridgeLandingParameters:
    """How the bridge lands the platen without a controller."""

    braking_time: float = parameter(
        0.3, unit='s', lower=0.05, upper=10.0, description='time to stop and level the tilts'
    )
    descent_time: float = parameter(
        1.0, unit='s', lower=0.1, upper=60.0, description='time to descend to the lower stop'
    )
    settle_time: float = parameter(
        0.2, unit='s', lower=0.0, upper=10.0, description='time pressed on the stop before the end'
    )
    depth: float = parameter(
        5e-4,
        unit='m',
        lower=0.0,
        upper=5e-3,
        description='how far below the stop the descent aims, to arrive whatever the model says',
    )
    stiffness: tuple[float, ...] = parameter(
        (6400.0, 2500.0, 2500.0, 6400.0, 6400.0),
        unit='1/s^2',
        lower=1.0,
        upper=1e6,
        length=5,
        description='acceleration per error' + _BY_AXIS,
    )
    damping: tuple[float, ...] = parameter(
        (160.0, 100.0, 100.0, 160.0, 160.0),
        unit='1/s',
        lower=0.1,
        upper=1e4,
        length=5,
        description='acceleration per error rate' + _BY_AXIS,
    )
    rate_bandwidth: float = parameter(
        800.0, unit='rad/s', lower=10.0, upper=2000.0, description='bandwidth of the rate estimate'
    )
    current: float = parameter(
        5.0, unit='A', lower=0.1, upper=100.0, description='largest current of a motor'
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class BridgeParameters:
    """The hardware bridge."""

    sample_time: float = parameter(
        1e-3, unit='s', lower=1e-3, upper=1e-2, description='time between samples'
    )
    driver: str = parameter(
        'emulated', description='which boards: quanser, emulated, or a driver of your own'
    )
    machine: MachineParameters = group(MachineParameters)
    commutation: CommutationParameters = group(CommutationParameters)
    encoder: EncoderInputParameters = group(EncoderInputParameters)
    homing: HomingParameters = group(HomingParameters)
    amplifier: DriveParameters = group(DriveParameters)
    boards: BoardParameters = group(BoardParameters)
    fault: FaultParameters = group(FaultParameters)
    landing: BridgeLandingParameters = group(BridgeLandingParameters)
    emulation: EmulationParameters = group(EmulationParameters)

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
