"""Flies on emulated boards, or commissions them, and prints what was compiled while they ran.

The argument is ``landing`` or ``commission``.
"""

from __future__ import annotations

import sys

from bridge_flight import HOME, Flight, ellipse
from compiled_functions import compiled

from maglev_hw_bridge.commissioning.commission import Commissioning
from maglev_hw_bridge.commissioning.operators import EmulatedPerson
from maglev_hw_bridge.commissioning.response import Pulses
from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import Mode
from maglev_model.parameters import build

late: set[str] = set()


def fly() -> None:
    """To a fault in flight, and to the end of the landing."""
    flight = Flight(ellipse)
    ready = compiled()
    flight.run(100)
    flight.run(50, controlled=False)
    assert flight.stage.fault is not None
    flight.until_no_current()
    assert flight.stage.mode is Mode.DISABLED
    late.update(compiled(since=ready))


def commission() -> None:
    """The proof of the last line and the pulses of one phase."""
    parameters = build(BridgeParameters, HOME)
    boards = EmulatedBoards(parameters)
    driver = QuanserDriver(parameters, boards, boards.now, boards.sleep)
    person = EmulatedPerson(boards, lambda _: None)
    steps = Commissioning(parameters, driver, peak=1.5, operator=person, tell=lambda _: None)
    start, stop, ready = driver.start, driver.stop, compiled()

    def started() -> None:
        ready.update(compiled())
        start()

    def stopped() -> None:
        late.update(compiled(since=ready))
        stop()

    driver.start, driver.stop = started, stopped  # type: ignore[method-assign]
    steps._boards()
    steps._last_line()
    steps._homing()
    Pulses(parameters, driver, steps._encoders, steps._amplifiers, 1.5).phase(0)
    driver.close()


{'landing': fly, 'commission': commission}[sys.argv[1]]()
MADE_UP = 'maglev_hw_bridge.emulation.rig.', 'maglev_controller.'  # what flies, and who answers
print({name for name in late if not name.startswith(MADE_UP)} or 'nothing')
