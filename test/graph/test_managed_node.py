"""A managed node that is asked for transitions at any time."""

from __future__ import annotations

import time

import pytest
import rclpy
from graph import Observer
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from small_stage import SmallStage


def test_who_is_faster_than_autostart_disturbs_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr('sys.argv', ['small_stage'])
    rclpy.init(args=[])
    node, observer = SmallStage(), Observer()
    try:
        client = observer.node.create_client(ChangeState, '/small/change_state')
        activate = Transition(id=Transition.TRANSITION_ACTIVATE)
        asked = observer.begin_to_ask(client, ChangeState.Request(transition=activate))
        observer.serve(0.1)  # in which the request arrives: it is served before the timer
        end = time.monotonic() + 1.0
        node.spin(lambda: time.monotonic() > end)
        observer.wait(lambda: observer.serve(0.01) is None and asked.done())
        assert asked.result().success
        assert node.state == 'active'
        assert not node.failed
    finally:
        observer.close()
        node.destroy_node()
        rclpy.try_shutdown()
