"""The file in which the controller's node keeps what was learned."""

from __future__ import annotations

from pathlib import Path

import pytest
import rclpy
from std_srvs.srv import SetBool

from maglev_controller.node import ControllerNode


def test_what_was_learned_over_as_many_passes_again_is_saved_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / 'learned.npz'
    given = ('-p', 'learning.period:=0.4', '-p', f'learning.file:={path}')
    monkeypatch.setattr('sys.argv', ['controller', '--ros-args', *given])
    rclpy.init(args=[])
    controller = ControllerNode()
    learning = controller.supervisor.learning
    assert learning is not None
    for _ in range(2):
        controller._on_learn(SetBool.Request(data=True), SetBool.Response())
        controller._save_learned()
        assert not path.exists()  # there is nothing yet
        learning.arrays.state['flown'] = 8
        controller._save_learned()
        path.unlink()
        controller._save_learned()
        assert not path.exists()  # it was
    controller.destroy_node()
    rclpy.try_shutdown()
