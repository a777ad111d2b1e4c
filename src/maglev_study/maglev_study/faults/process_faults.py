"""What the controller's and the bridge's processes do wrong, and what their operators may do."""

from __future__ import annotations

import numpy as np

from maglev_model.contract.controller_watch import Status
from maglev_study.faults.flight import Answer, Bridge
from maglev_study.faults.kinds import CUT, NOMINAL, NOTHING, Begin, Expected, Fault, Kind, Run
from maglev_study.faults.programme import BEFORE_THE_FIRST_SAMPLE, PHASES

SAMPLING = tuple(phase for phase in PHASES if phase not in BEFORE_THE_FIRST_SAMPLE)
"""Phases in which samples are taken."""

# -- the controller --------------------------------------------------------------------------------

_BLAME_CURRENTS = r'currents|i_d|command|controller|carry|old|age'


def controller(
    name: str,
    act: Begin,
    sizes: tuple[int, int] = (0, 0),
    seen: float | None = None,
    *,
    shows: bool = True,
) -> Kind:
    def begin(run: Run, fault: Fault) -> None:
        act(run, fault)
        if shows:
            run.shows.append(run.flight.samples + 1)

    return Kind(
        f'controller: {name}',
        lambda rng: Fault(f'controller: {name}', (), float(rng.integers(sizes[0], sizes[1] + 1))),
        begin,
        lambda fault: Expected(NOMINAL, seen, _BLAME_CURRENTS, aloft=True),
        SAMPLING,
    )


def die(run: Run, _: Fault) -> None:
    run.flight.controller.alive = False


def give_up(run: Run, _: Fault) -> None:
    run.flight.inbox = run.flight.controller.last_words()


def zeros(run: Run, _: Fault) -> None:
    run.flight.controller.twist = lambda answer: [
        answer._replace(direct=np.zeros(4), quadrature=np.zeros(4))
    ]


def nan(run: Run, fault: Fault) -> None:
    def twist(answer: Answer) -> list[Answer]:
        direct = answer.direct.copy()
        direct[int(fault.size) % 4] = np.nan
        return [answer._replace(direct=direct)]

    run.flight.controller.twist = twist


def slow(run: Run, fault: Fault) -> None:
    run.flight.controller.pace = 1.0 / (1.0 + fault.size / 100.0)


def stall(run: Run, fault: Fault) -> None:
    flight, controller = run.flight, run.flight.controller
    end = flight.samples + flight.samples_in(1e-3 * fault.size)
    controller.stalled = True

    def each() -> None:
        if flight.samples >= end:
            controller.stalled = False

    flight.each = each


def replay(run: Run, fault: Fault) -> None:
    """What was said up to a while ago is said over and over, with the numbers it had."""
    heard: list[Answer] = []
    samples = run.flight.samples_in(1e-3 * fault.size)

    def twist(answer: Answer) -> list[Answer]:
        heard.append(answer)
        return [heard[(len(heard) - 1) % samples]]

    run.flight.controller.twist = twist


def foreign(run: Run, _: Fault) -> None:
    """Somebody else publishes as well, with numbers and currents of its own."""
    number = int(run.rng.integers(0, 2**31))
    session = int(run.rng.integers(1, 2**31))
    i_d, i_q = run.rng.uniform(-5.0, 5.0, 4), run.rng.uniform(-5.0, 5.0, 4)

    def twist(answer: Answer) -> list[Answer]:
        nonlocal number
        number += 1
        return [answer, Answer(number, i_d, i_q, Status.FLYING, session, False)]

    run.flight.controller.twist = twist


# -- the bridge's process, and its operator --------------------------------------------------------


def operator(
    name: str,
    act: Begin,
    impact: float | None = NOMINAL,
    blame: str = NOTHING,
    phases: tuple[str, ...] = PHASES,
    seen: float | None = None,
) -> Kind:
    def begin(run: Run, fault: Fault) -> None:
        if seen is not None:
            run.shows.append(run.flight.samples + 1)
        act(run, fault)

    return Kind(
        name, lambda rng: Fault(name), begin, lambda fault: Expected(impact, seen, blame), phases
    )


def stopped() -> Kind:
    return Kind(
        'bridge stopped',
        lambda rng: Fault('bridge stopped', (), float(rng.integers(1, 51))),
        lambda run, fault: run.flight.world.delay(run.flight.samples_in(1e-3 * fault.size)),
        lambda fault: Expected(NOMINAL if fault.size < 18 else CUT, None, 'late|watchdog'),
        SAMPLING,
    )


def press(run: Run, _: Fault) -> None:
    run.flight.world.stop_pressed = True
    run.flight.forbidden = 'with the stop pressed'


def skip_homing(run: Run, _: Fault) -> None:
    run.flight.skip_homing = True
    run.flight.forbidden = 'without homing'


_HOT = 100.0  # I2t load that does not cool while the test machine takes its time


def heat(run: Run, _: Fault) -> None:
    run.flight.bridge.stage.amplifiers.arrays.load[:] = _HOT
    run.flight.forbidden = 'hot'


def second(run: Run, _: Fault) -> None:
    if not run.flight.world.cards:
        return  # the first has not opened them yet
    other = Bridge(run.flight.parameters, run.flight.world)
    if other.configure():
        other.stray = 'a second bridge had the boards of the first'
        run.flight.bridge.stray = other.stray
    other.die()
