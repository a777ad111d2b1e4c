"""Compile all that flies, so that the first run starts as quickly as the second; set-up does it.

    compile_ahead.py answer|stage

Of each half what nodes call goes into a file of its own, with which they do without Numba (see
:mod:`maglev_model.compiled.ahead`), all of it into Numba's cache. Two halves, for two processes at
once.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np

from maglev_model.compiled import ahead, build_ahead

LEVEL = np.array([0.025, 0.0, 0.0, 0.0, 0.0])


def call_answer() -> None:
    """Call what controller and bridge call."""
    from maglev_controller.parameters import ControllerParameters
    from maglev_controller.supervision import Supervisor
    from maglev_hw_bridge.parameters import BridgeParameters
    from maglev_hw_bridge.stage import BridgeStage
    from maglev_model.parameters import build

    Supervisor(ControllerParameters())
    stage = BridgeStage.ready(build(BridgeParameters, {'homing.at_start': True}))
    stage.read()
    stage.hold()
    stage.close()


def call_stage() -> None:
    """Call what plant, reference and view call."""
    from maglev_model.machine import MachineParameters
    from maglev_plant.parameters import PlantParameters
    from maglev_plant.simulation import SimulatedStage
    from maglev_reference.parameters import ReferenceParameters
    from maglev_reference.timeline import Timeline
    from maglev_view.forces import Forces

    stage, none = SimulatedStage(PlantParameters()), np.zeros(4)
    for _ in range(2):
        stage.read()
        stage.write(none, none)
    Timeline(ReferenceParameters())
    Forces(MachineParameters()).at(LEVEL, none, none)


HALVES: dict[str, Callable[[], None]] = {'answer': call_answer, 'stage': call_stage}
"""What is done by one process each."""


def main() -> None:
    """Compile a half: the file last, so that Numba's cache is full also where that goes wrong."""
    half = sys.argv[1]
    build_ahead.record()
    HALVES[half]()
    called = build_ahead.called()
    if half == 'stage':
        from maglev_study import closed_loop

        closed_loop.warm_up()
    folder = ahead.folder()
    if folder is not None:
        build_ahead.build(f'maglev_{half}_ahead', folder, called)


if __name__ == '__main__':
    main()
