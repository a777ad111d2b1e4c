"""The controller's node, but that it fails as its first argument says from sample 1200 on."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from maglev_controller import supervision
from maglev_controller.node import ControllerNode
from maglev_msgs.msg import Measurement
from maglev_node.executable import run_nodes

FROM = 1200
HOW = sys.argv.pop(1)


class _Failing(ControllerNode):
    """Fails once as it takes references, beside the loop or for a measurement that needs them."""

    _has_failed = _in_loop = False

    def _on_measurement(self, message: Measurement) -> None:
        self._in_loop = True
        super()._on_measurement(message)
        self._in_loop = False

    def _take_references(self) -> None:
        if self._sequence >= FROM and not self._has_failed:
            if ('in_loop' if self._in_loop else 'beside') == HOW:
                self._has_failed = True
                raise RuntimeError('made to fail')
            if HOW == 'in_loop':
                return  # so that they run out
        super()._take_references()


def _fail(step: Callable[..., None]) -> Callable[..., None]:
    """Let a supervisor's step fail, by a defect or as when a measurement cannot be believed."""
    samples = 0

    def failing(self: Any, row: int, gap: Any, x: float, z: float) -> None:
        nonlocal samples
        samples += 1
        if samples > FROM and HOW == 'law':
            raise RuntimeError('made to fail')
        if samples > FROM and HOW == 'measurement':
            gap = gap * float('nan')
        step(self, row, gap, x, z)

    return failing


if __name__ == '__main__':
    supervision.Supervisor.step = _fail(supervision.Supervisor.step)  # type: ignore[method-assign]
    run_nodes('controller', _Failing)
