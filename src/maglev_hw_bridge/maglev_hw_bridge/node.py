"""The bridge's node: the stage contract over the real stage, with homing and landing on request."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import ClassVar

from diagnostic_msgs.msg import DiagnosticStatus

from maglev_hw_bridge.doubts import doubts
from maglev_hw_bridge.encoders import HomingError
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage, Mode
from maglev_model.contract.stage import StageError
from maglev_model.parameters import parameter
from maglev_node.node import NodeError
from maglev_node.stage_node import StageNode
from maglev_node.stage_parameters import StageNodeParameters
from maglev_node.topics import TRUE_STATE

_LOAD_PERIOD = 0.1
"""How often the amplifiers' load is looked at [s]."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class BridgeNodeParameters(StageNodeParameters, BridgeParameters):
    """The bridge and how its node runs it."""

    autostart: bool = parameter(
        False, 'configure and activate by itself; false: by the life-cycle services', read_only=True
    )


def _make_stage(parameters: BridgeNodeParameters) -> BridgeStage:
    if parameters.mode == 'realtime':
        return BridgeStage(parameters.in_real_time(), realtime=True)
    return BridgeStage(parameters)


class BridgeNode(StageNode[BridgeNodeParameters, BridgeStage]):
    """Flies the stage on boards, whose clock paces the samples.

    Configure opens and checks the boards, ``~/home`` gives the encoders their zeros, activate arms
    the watchdog and enables the amplifiers at zero current, deactivate lands softly first, cleanup
    closes the boards.
    """

    interface: ClassVar[Mapping[str, str]] = {
        **StageNode.interface,
        TRUE_STATE: 'published with emulated boards: the true state of the emulated stage',
        '~/home': 'std_srvs/Trigger: find the zeros of the encoders, the platen at rest on its'
        ' lower stop at homing.x, homing.z; it is lifted a little to find out whether that is so',
        '~/land': 'std_srvs/Trigger: land without the controller',
    }

    by_hand = (
        'lifecycle set {} configure',
        'service call {}/home std_srvs/srv/Trigger',
        'lifecycle set {} activate',
    )

    def __init__(self) -> None:
        super().__init__('hw_bridge', BridgeNodeParameters, _make_stage)
        self._was_warm = False
        self.offer('~/home', self._home)
        self.offer('~/land', self._land)
        self.create_timer(_LOAD_PERIOD, self._watch_load, clock=self.steady_clock)

    def configure(self) -> None:
        """Get hold of the boards; what is doubtful about them, or came before, is said."""
        super().configure()
        for doubt in doubts(self.parameters):
            self.get_logger().warning(doubt)
        if self.parameters.driver != 'emulated' and not self.stage.memory.proven(self.parameters):
            self.get_logger().warning(
                'watchdog, enable line and emergency stop are not proven as the parameters have '
                'them: commission first'
            )
        self._say_fault('latched since before')

    def activate(self) -> None:
        """Enable the amplifiers; what a service would have to mend needs a node that stays."""
        try:
            super().activate()
        except StageError as error:
            hint = ' (start it with autostart:=false for that)' if self._bringing_up else ''
            raise StageError(f'{error}{hint}') from error

    def deactivate(self) -> None:
        """Land, disable the amplifiers; boards that fail at it are a fault."""
        before = self.stage.mode
        super().deactivate()
        if self.stage.mode is Mode.LOST is not before:
            self._say_fault('fault while deactivated')

    def _say_fault(self, when: str) -> None:
        if self.stage.fault is not None:
            self.get_logger().error(f'{when}: {self.stage.fault}')

    def _home(self) -> tuple[bool, str]:
        self.take_realtime_priority()  # it may lift the platen
        try:
            shift = self.stage.home()
        except (HomingError, StageError) as error:
            raise NodeError(str(error)) from error
        return True, f'homed; the zeros moved by {", ".join(f"{s * 1e3:.2f}" for s in shift)} mm'

    def _land(self) -> tuple[bool, str]:
        self.require_active()
        if self.stage.mode is Mode.LOST:
            raise NodeError(f'no current flows: {self.stage.fault}')
        self.stage.land('asked to')
        now = 'landing' if self.stage.mode is Mode.LANDING else self.stage.mode.value
        return True, f'{now}; ~/reset follows the controller again'

    def _watch_load(self) -> None:
        """Say the first warning of the I²t budget, once."""
        warm = self.configured and self.stage.amplifiers.warm
        if warm and not self._was_warm:
            load = self.stage.amplifiers.load
            self.get_logger().warning(f'amplifiers warm: I2t load {load:.2f}')
        self._was_warm = warm

    def diagnose(self) -> tuple[bytes, str, Mapping[str, object]]:
        """ERROR when a fault is latched; WARN when something is near one."""
        level, message, base = super().diagnose()
        if not self.configured:
            return level, message, base
        stage = self.stage
        facts = {
            **base,
            'state': self.state,
            'bridge': stage.mode.value,
            'i2t_load': round(stage.amplifiers.load, 3),
            'gap_residual_um': round(stage.guard.residual * 1e6, 1),
            'late_ticks': stage.late_ticks,
            'homed': stage.encoders.homed,
        }
        if stage.fault is not None:
            return level, message, facts
        if stage.amplifiers.warm:
            return DiagnosticStatus.WARN, f'amplifiers warm, {stage.amplifiers.load:.2f}', facts
        if self.state == 'active' and stage.mode is not Mode.FOLLOWING:
            return DiagnosticStatus.WARN, f'{stage.mode.value}: {stage.why}', facts
        return level, message, facts
