"""The bridge's node: the stage contract over the real stage, managed, with its faults in words."""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from std_srvs.srv import Trigger

from maglev_hw_bridge.drivers.emulated import EmulatedDriver
from maglev_hw_bridge.encoders import HomingError
from maglev_hw_bridge.faults import Fault
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage, Mode
from maglev_model.parameters import parameter
from maglev_model.stage import StageError
from maglev_msgs.msg import PlantState
from maglev_node.node import main as run_main
from maglev_node.stage_node import StageNode, StageNodeParameters
from maglev_node.stamp import copy_stamp
from maglev_node.topics import TRUE_STATE, sample_qos

_EARLY = 0.7
"""Share of a sample time after which the node waits in the driver for the boards' clock."""

_SHORTEST_WAIT = 5e-5  # [s]

_CATCH_UP = 20  # samples at once, at most


@dataclasses.dataclass(frozen=True, kw_only=True)
class BridgeNodeParameters(StageNodeParameters, BridgeParameters):
    """The bridge and how its node runs it."""

    autostart: bool = parameter(
        False,
        description='configure and activate by itself; false: by the life-cycle services',
        read_only=True,
    )


def _open(parameters: BridgeNodeParameters) -> BridgeStage:
    """The stage on open, checked boards. Raises StageError, ParameterError."""
    realtime = parameters.mode == 'realtime'
    stage = BridgeStage(parameters.in_real_time() if realtime else parameters, realtime=realtime)
    stage.configure()
    return stage


class BridgeNode(StageNode):
    """Samples are paced by the boards; faults land the platen and stay until ``~/reset``.

    Configure opens and checks the boards, activate arms their watchdog and enables the amplifiers
    at zero current, deactivate lands softly first, cleanup closes the boards.
    """

    stage: BridgeStage | None

    def __init__(self) -> None:
        super().__init__('hw_bridge', BridgeNodeParameters, _open)
        self._applied_sequence = -1
        self._reported: Fault | None = None
        self._was_warm = False
        self._truth = PlantState()
        self._truth.header.frame_id = 'stage'
        self._truth_publisher: Any = None
        self.create_service(Trigger, '~/home', self._home)
        self.create_service(Trigger, '~/land', self._land)

    # -- life cycle --------------------------------------------------------------------------------

    def configure(self) -> None:
        """Open and check the boards; emulated ones also publish the true state."""
        super().configure()
        assert self.stage is not None
        if isinstance(self.stage.driver, EmulatedDriver):
            self._truth_publisher = self.create_publisher(PlantState, TRUE_STATE, sample_qos())

    def cleanup(self) -> None:
        """Close the boards."""
        super().cleanup()
        if self._truth_publisher is not None:
            self.destroy_publisher(self._truth_publisher)
            self._truth_publisher = None

    def start_stage(self) -> None:
        """Arm the watchdog, enable the amplifiers."""
        assert self.stage is not None
        self.stage.activate()
        self._applied_sequence = -1

    def stop_stage(self) -> None:
        """Land, then disable."""
        assert self.stage is not None
        self._land_now('deactivated')
        self.stage.deactivate()

    @property
    def tick_period(self) -> float:
        """Shorter than a sample: the boards' clock decides."""
        return _EARLY * self.sample_time

    def may_stop(self) -> bool:
        """Land before the process ends."""
        if self.state == 'active':
            self._land_now('shut down')
        return True

    def _land_now(self, why: str) -> None:
        """Land, publishing every sample, and be done with it."""
        assert self.stage is not None
        self.stage.land(why)
        self._go_on_alone()

    def _go_on_alone(self) -> None:
        """Sample without a controller until the bridge has landed, if it flies."""
        assert self.stage is not None
        while self.stage.flying or self.stage.mode is Mode.LANDING:
            self._hold()
            if self.stage.mode is Mode.LOST:
                return
            self._advance()
        self._hold()

    # -- samples -----------------------------------------------------------------------------------

    def _on_tick(self) -> None:
        assert self.stage is not None
        for _ in range(_CATCH_UP):
            self._tick()
            if self.stage.mode is Mode.LOST or self.stage.driver.late < self.sample_time:
                break

    def _tick(self) -> None:
        assert self.stage is not None
        if self.stage.mode is Mode.LOST:
            return
        self._advance()
        self._rearm()
        self.take_currents()
        newest = self._currents_sequence
        if self._answered and newest < self.sequence - 1:
            self.late_samples += 1
        if newest != self._applied_sequence:
            self._applied_sequence = newest
            self._apply(self._direct, self._quadrature)
        else:
            self._hold()

    def _rearm(self) -> None:
        """Come back a little before the boards' next tick, and serve the graph until then."""
        assert self.stage is not None
        passed = self.stage.driver.late + time.monotonic() - self._sample_wall_time
        wait = max(_EARLY * self.sample_time - passed, _SHORTEST_WAIT)
        self._timer.timer_period_ns = int(1e9 * wait)
        self._timer.reset()

    def _apply(self, direct_current: Any, quadrature_current: Any) -> None:
        assert self.stage is not None
        if self.stage.mode is Mode.LOST:
            return
        if not self.heeds(direct_current, quadrature_current):
            self._hold()
            return
        try:
            self.stage.write(direct_current, quadrature_current)
        except StageError:
            pass  # latched; reported below
        except ValueError as error:
            if self.stage.fault is None:
                self.get_logger().error(f'currents refused: {error}')
        self._report()

    def _hold(self) -> None:
        assert self.stage is not None
        if self.stage.mode is not Mode.LOST:
            with contextlib.suppress(StageError):  # latched; reported below
                self.stage.hold()
        self._report()

    def _advance(self) -> None:
        super()._advance()
        self._report()

    def watched(self) -> bool:
        """Whether the true state, where there is one, is watched too."""
        if self._truth_publisher is None:
            return super().watched()
        watchers = self._truth_publisher.get_subscription_count()
        return super().watched() and bool(watchers >= self.parameters.watchers)

    def publish_more(self) -> None:
        """The true state of this sample, where the boards are emulated."""
        if self._truth_publisher is None or self.stage is None:
            return
        assert isinstance(self.stage.driver, EmulatedDriver)
        message, truth = self._truth, self.stage.driver.truth()
        copy_stamp(self.measurement.header.stamp, message.header.stamp)
        message.sequence = self.sequence
        message.state = truth.state
        message.direct_current = truth.current[:4]
        message.quadrature_current = truth.current[4:]
        message.thermal_load = self.stage.amplifiers.arrays.load.reshape(4, 3).max(axis=1)
        self._truth_publisher.publish(message)

    def lost(self, error: StageError) -> None:
        """Boards that are lost are a fault like any other: the node waits for ``~/reset``."""

    def _watch_lockstep(self) -> None:
        assert self.stage is not None
        if self.stage.mode is not Mode.LOST:
            super()._watch_lockstep()

    def unanswered(self, message: str) -> None:
        """Land without the controller, then wait for one again."""
        self.get_logger().error(message)
        self._go_on_alone()
        self._answered = False

    # -- faults ------------------------------------------------------------------------------------

    def _report(self) -> None:
        """Say a new fault, and the first warning of the I²t budget, once."""
        assert self.stage is not None
        fault = self.stage.fault
        if fault is not self._reported:
            self._reported = fault
            if fault is not None:
                self.get_logger().error(f'fault at sample {self.sequence}: {fault}')
        warm = self.stage.amplifiers.warm
        if warm and not self._was_warm:
            load = self.stage.amplifiers.load
            self.get_logger().warning(f'amplifiers warm: I2t load {load:.2f}')
        self._was_warm = warm

    def _emergency_stop(self, _request: Any, response: Any) -> Any:
        if self.state != 'active' or self.stage is None:
            response.success, response.message = False, f'{self.state}: no current flows'
            return response
        self.stage.stop()
        self._report()
        response.success = True
        response.message = 'lands, then no current; call ~/reset'
        return response

    def _reset(self, _request: Any, response: Any) -> Any:
        if self.stage is None:
            response.success, response.message = False, 'not configured'
            return response
        lost = self.stage.mode is Mode.LOST
        response.success, response.message = self.stage.reset()
        if response.success:
            self._armed = False
        self._report()
        if response.success and lost and self._timer is not None:
            self._answered = False
            self._advance()
        return response

    def _land(self, _request: Any, response: Any) -> Any:
        if self.state != 'active' or self.stage is None:
            response.success, response.message = False, f'{self.state}: no current flows'
            return response
        self.stage.land('asked to')
        response.success, response.message = True, 'landing; ~/reset follows the controller again'
        return response

    def _home(self, _request: Any, response: Any) -> Any:
        if self.stage is None:
            response.success, response.message = False, 'not configured: the boards are not open'
            return response
        try:
            shift = self.stage.home()
        except (HomingError, StageError) as error:
            response.success, response.message = False, str(error)
            return response
        response.success = True
        moved = ', '.join(f'{value * 1e3:.2f}' for value in shift)
        response.message = f'homed; the zeros moved by {moved} mm'
        return response

    def diagnose(self) -> tuple[bytes, str, Mapping[str, object]]:
        """ERROR when a fault is latched; WARN when something is near one."""
        level, message, base = super().diagnose()
        stage = self.stage
        if stage is None:
            return level, message, base
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
            facts['fault'], facts['remedy'] = stage.fault.kind, stage.fault.remedy
            return DiagnosticStatus.ERROR, str(stage.fault), facts
        if stage.amplifiers.warm:
            return DiagnosticStatus.WARN, f'amplifiers warm, {stage.amplifiers.load:.2f}', facts
        if self.state == 'active' and stage.mode is not Mode.FOLLOWING:
            return DiagnosticStatus.WARN, f'{stage.mode.value}: {stage.why}', facts
        return level, message, facts


def main() -> None:
    """Entry point of the executable ``hw_bridge``."""
    run_main(BridgeNode, 'hw_bridge')
