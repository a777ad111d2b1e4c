"""The last line of an emulated machine, proven to somebody who takes a second to answer."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from maglev_hw_bridge.amplifiers import Amplifiers
from maglev_hw_bridge.commissioning.operators import EmulatedPerson
from maglev_hw_bridge.commissioning.proof import Proof
from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import build

LINES = {'boards.stop_input': 0, 'boards.enable_output': 1}


def nothing(_boards: EmulatedBoards) -> None:
    """A machine that is right."""


def somebody(boards: EmulatedBoards) -> EmulatedPerson:
    """Who does what is asked, and says what is."""
    return EmulatedPerson(boards, lambda _step: None, response=1.0)


def prove(
    claimed: dict[str, object],
    spoil: Callable[[EmulatedBoards], None] = nothing,
    driver_type: type[QuanserDriver] = QuanserDriver,
    whom: Callable[[EmulatedBoards], EmulatedPerson] = somebody,
) -> list[str]:
    """What is told while the last line is proven, of a machine with both lines; none is left."""
    parameters = build(BridgeParameters, {**LINES, **claimed})
    boards = EmulatedBoards(parameters)
    spoil(boards)
    driver = driver_type(parameters, boards, boards.now, boards.sleep)
    told: list[str] = []
    driver.open()
    try:
        Proof(parameters, driver, Amplifiers(parameters), whom(boards), told.append).run()
    finally:
        driver.close()
        assert not np.any(boards.volts)
    return told
