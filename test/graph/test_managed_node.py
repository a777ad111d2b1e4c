"""A managed node that is asked for transitions at any time."""

from __future__ import annotations

import time

import pytest
import rclpy
from graph import Observer
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from small_stage import SmallStage


class Slow(SmallStage):
    """Whose own start has its turn when a service has activated it already."""

    def _autostart(self) -> None:
        if self.state == 'active':
            super()._autostart()
            self.had_its_turn = True


def test_who_is_faster_than_autostart_disturbs_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr('sys.argv', ['small_stage'])
    rclpy.init(args=[])
    node, observer = Slow(), Observer()
    node.had_its_turn = False
    try:
        client = observer.node.create_client(ChangeState, '/small/change_state')
        activate = Transition(id=Transition.TRANSITION_ACTIVATE)
        asked = observer.begin_to_ask(client, ChangeState.Request(transition=activate))
        end = time.monotonic() + 60.0

        def done() -> bool:
            observer.serve(1e-3)
            return (asked.done() and node.had_its_turn) or time.monotonic() > end

        node.spin(done)
        assert asked.result().success
        assert node.had_its_turn
        assert node.state == 'active'
        assert not node.failed
    finally:
        observer.close()
        node.destroy_node()
        rclpy.try_shutdown()
