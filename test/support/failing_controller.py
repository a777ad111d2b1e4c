"""The controller's node, but that it fails as its first argument says from sample 2500 on."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from maglev_controller import node, supervision
from maglev_controller.node import ControllerNode

FROM = 2500


class _Failing(ControllerNode):
    """Fails in a callback beside the loop, once."""

    _has_failed = False

    def _take_references(self) -> None:
        if sys.argv[1] == 'beside' and self._sequence >= FROM and not self._has_failed:
            self._has_failed = True
            raise RuntimeError('made to fail')
        super()._take_references()


def _fail(step: Callable[..., None]) -> Callable[..., None]:
    """Let a supervisor's step fail, by a defect or as when a measurement cannot be believed."""
    samples = 0

    def failing(self: Any, row: int, gap: Any, x: float, z: float) -> None:
        nonlocal samples
        samples += 1
        if samples > FROM and sys.argv[1] == 'law':
            raise RuntimeError('made to fail')
        if samples > FROM and sys.argv[1] == 'measurement':
            gap = gap * float('nan')
        step(self, row, gap, x, z)

    return failing


if __name__ == '__main__':
    how = sys.argv[1]
    supervision.Supervisor.step = _fail(supervision.Supervisor.step)  # type: ignore[method-assign]
    node.run_main(_Failing, 'controller')
