"""The file in which the controller's node keeps what was learned."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import rclpy
from std_srvs.srv import SetBool

from maglev_controller.learning import IterativeLearning
from maglev_controller.node import ControllerNode

Learner = tuple[ControllerNode, IterativeLearning, Path]


@pytest.fixture
def learner(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Learner]:
    path = tmp_path / 'learned.npz'
    given = ('-p', 'learning.period:=0.4', '-p', f'learning.file:={path}')
    monkeypatch.setattr('sys.argv', ['controller', '--ros-args', *given])
    rclpy.init(args=[])
    controller = ControllerNode()
    assert controller.supervisor.learning is not None
    yield controller, controller.supervisor.learning, path
    controller.destroy_node()
    rclpy.try_shutdown()


def ask(controller: ControllerNode, learn: bool) -> None:
    controller._on_learn(SetBool.Request(data=learn), SetBool.Response())


def fly(learning: IterativeLearning, passes: int) -> None:
    """As if so many had been flown, of which the first was the best."""
    state = learning.arrays.state
    state['best'], state['used'], state['flown'] = 0, 1, passes
    learning.arrays.tables[1] += 0.1
    learning.arrays.history[:passes] += 1e-6


def test_what_was_learned_over_as_many_passes_again_is_saved_too(learner: Learner) -> None:
    controller, learning, path = learner
    controller._save_learned()
    assert not path.exists()  # there is nothing yet
    for _ in range(2):
        ask(controller, True)
        fly(learning, 8)
        controller._save_learned()
        path.unlink()
        controller._save_learned()
        assert not path.exists()  # it was


@pytest.mark.parametrize('lands_after', [True, False])
def test_what_flies_is_in_the_file_when_learning_ends_after_a_landing(
    lands_after: bool, learner: Learner
) -> None:
    """By ``~/learn``, or before another pass of the next flight is over."""
    controller, learning, path = learner
    fly(learning, 3)
    controller._save_learned()
    assert np.any(np.load(path)['table'])
    if lands_after:
        learning.end()
        controller._save_learned()
    else:
        ask(controller, False)
    assert not np.any(learning.table)
    np.testing.assert_array_equal(np.load(path)['table'], learning.table)
