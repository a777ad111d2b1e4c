"""The web node: a live view of the stage in the browser, with buttons for its operator."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.qos import QoSProfile, ReliabilityPolicy

from maglev_model.contract.wire import HARDWARE_ID, DecodeError
from maglev_monitor.metrics.decoding import decode
from maglev_node.node import MaglevNode, NodeError, NodeParameters
from maglev_node.topics import (
    CONTROLLER_STATE,
    DIAGNOSTICS,
    KEYS,
    SAMPLE_TOPICS,
)
from maglev_view.parameters import WebParameters
from maglev_view.web.calls import Operator
from maglev_view.web.live import Live

if TYPE_CHECKING:
    from maglev_view.web.page import Page

_MISSING = "the live view needs viser: run 'MAGLEV_SETUP=view source setup.sh', then again"


@dataclasses.dataclass(frozen=True, kw_only=True)
class WebNodeParameters(NodeParameters, WebParameters):
    """The web node's parameters."""


class WebNode(MaglevNode[WebNodeParameters]):
    """Serves a page that shows the stage live, and calls services for who clicks on it.

    A watcher that the loop does not know; it takes samples in bursts.
    """

    interface: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(KEYS, 'subscribed: the newest sample'),
        CONTROLLER_STATE: 'subscribed: each sample',
        DIAGNOSTICS: 'subscribed: what nodes say of themselves',
    }

    def __init__(self) -> None:
        super().__init__('web', WebNodeParameters)
        self._page = self._serve()
        self._live = Live(self.parameters)
        self._operator = Operator(self, self._page.answer)
        self._taps = {
            topic: self.poll(topic, SAMPLE_TOPICS[topic], _qos(topic), raw=True) for topic in KEYS
        }
        self.create_subscription(DiagnosticArray, DIAGNOSTICS, self._on_diagnostics, 100)
        self.create_timer(1.0 / self.parameters.rate, self._update, clock=self.steady_clock)
        self.create_timer(0.2, self._operator.look, clock=self.steady_clock)
        self.show(f'live view: {self._page.address}')

    def diagnose(self) -> tuple[bytes, str, Mapping[str, object]]:
        """Where the page is."""
        return DiagnosticStatus.OK, self._page.address, {}

    def _serve(self) -> Page:
        try:
            from maglev_view.web.page import Page
        except ModuleNotFoundError as error:
            if error.name == 'viser':
                raise NodeError(_MISSING) from error
            raise
        try:
            return Page(self.parameters, f'maglev stage {self.get_namespace()}'.rstrip('/ '))
        except OSError as error:
            host = self.parameters.host
            raise NodeError(f"cannot serve the page at '{host}': {error.strerror}") from error

    def _update(self) -> None:
        for topic, tap in self._taps.items():
            messages = [message for message, _ in tap.take()]
            try:
                self._live.take(KEYS[topic], decode(KEYS[topic], messages))
            except DecodeError as error:
                self.fail(str(error))
                return
        while not self._page.wishes.empty():
            self._operator.ask(*self._page.wishes.get())
        self._operator.go_on()
        self._page.show(self._live)

    def _on_diagnostics(self, message: Any) -> None:
        for status in message.status:
            if status.hardware_id != HARDWARE_ID:
                continue
            values = {each.key: each.value for each in status.values}
            self._live.told(status.name, status.level[0], status.message, values)


def _qos(topic: str) -> QoSProfile:
    """Each sample counts of one topic, the newest of the others; nobody repeats one for a view."""
    depth = 16384 if topic == CONTROLLER_STATE else 1
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)
