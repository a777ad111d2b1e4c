"""Controllers that fail in flight, on emulated boards in real time's order: the bridge lands."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from bridge_flight import Flight, Target, ellipse, hover
from landing import SWIFT_LANDING
from made_up_node import MadeUpNode

from maglev_controller.regulator import MeasurementFault
from maglev_hw_bridge.stage import Mode
from maglev_msgs.msg import Currents, Measurement
from maglev_node.sampling import Sampling

PERIOD = 1e-3
SOFT = 0.01  # [m/s]
LOWER_STOP = 0.031


class Controller:
    """Answers one measurement after the other, each ``service`` [s] after it could begin to."""

    def __init__(self, flight: Flight, session: int = 1) -> None:
        self.session, self.service, self.alive = session, 3e-4, True
        self.distort: Callable[[Currents], list[Currents]] = lambda message: [message]
        self._flight = flight
        self._free = 0.0  # when it can begin with the next [s]
        self._sent: deque[tuple[float, Currents]] = deque()

    def stall(self, time: float) -> None:
        """Do nothing for so long [s]."""
        self._free += time

    def say(self, **fields: Any) -> None:
        """One more message, at once."""
        self._sent.append((0.0, Currents(session=self.session, **fields)))

    def hear(self, now: float, sequence: int, sample: Any, flies: bool) -> None:
        """Begin to answer the measurement of a sample."""
        if not self.alive:
            return
        self._free = max(self._free, now) + self.service
        message = Currents(sequence=sequence, session=self.session, status=Currents.RESTING)
        if flies:
            i_d, i_q = np.zeros(4), np.zeros(4)
            try:
                target = self._flight.target(PERIOD * sequence)
                self._flight.regulator.step(*sample, *target, i_d, i_q)
            except MeasurementFault:
                i_d[:] = i_q[:] = 0.0
            message.status = Currents.FLYING
            message.direct_current, message.quadrature_current = i_d, i_q
        self._sent += [(self._free, each) for each in self.distort(message)]

    def said(self, now: float) -> list[Currents]:
        """What has arrived by now."""
        arrived = []
        while self._sent and self._sent[0][0] <= now:
            arrived.append(self._sent.popleft()[1])
        return arrived


class Loop:
    """A bridge as its node runs it in real time, a controller, and a platen put in the air."""

    def __init__(self, target: Target = ellipse, samples: int = 200) -> None:
        self.flight = Flight(target, dict(SWIFT_LANDING))
        self.stage, self.rig = self.flight.stage, self.flight.rig
        self.flight.boards.place(np.array([LOWER_STOP, 0.0, 0.0, 0.0, 0.0]))
        self.stage.deactivate()
        self.node: Any = MadeUpNode(mode='realtime')
        self.sampling: Any = Sampling(self.node, self.stage)
        self.sampling.start()
        self.controllers = [Controller(self.flight)]
        self.flies = False
        self.detected = 0  # samples until the fault
        self.run(4)
        position, velocity, _ = target(PERIOD * self.sampling.sequence)
        self.rig.place(position, velocity)
        self.stage.guard.forget()
        self.flies = True
        self.run(samples)
        assert (self.stage.mode, self.stage.fault) == (Mode.FOLLOWING, None)
        self.rig.forget_impact()
        self.started = self.sampling.sequence

    def run(self, samples: int) -> None:
        """So many samples, or until there is a fault that there was not."""
        for _ in range(samples):
            now = PERIOD * (self.sampling.sequence + 1)
            self.node.inbox.messages = [
                message for controller in self.controllers for message in controller.said(now)
            ]
            self.node.tick()
            measured = self.node.topics[Measurement].received
            sample = measured.gap, measured.x, measured.z
            for controller in self.controllers:
                controller.hear(now, measured.sequence, sample, self.flies)
            if self.stage.fault is not None and not self.detected:
                self.detected = self.sampling.sequence - self.started

    def lands(self, within: int) -> None:
        """Check that the bridge lands, with a fault that is raised in so many samples."""
        self.run(within)
        assert self.stage.fault is not None, 'not detected'
        assert not self.stage.fault.cut
        for _ in range(25):
            self.run(100)
            if self.stage.mode is Mode.DISABLED:
                break
        self.run(200)
        assert self.stage.mode is Mode.DISABLED
        assert self.rig.impact <= SOFT
        assert self.rig.state[0] == pytest.approx(LOWER_STOP, abs=1e-9)
        assert not np.any(self.flight.boards.volts)


def zero(status: int) -> Callable[[Currents], list[Currents]]:
    def distort(message: Currents) -> list[Currents]:
        message.direct_current[:] = message.quadrature_current[:] = 0.0
        message.status = status
        return [message]

    return distort


def not_a_number(message: Currents) -> list[Currents]:
    message.quadrature_current[2] = np.nan
    return [message]


def renumbered(offset: int) -> Callable[[Currents], list[Currents]]:
    def distort(message: Currents) -> list[Currents]:
        message.sequence += offset
        return [message]

    return distort


def also(**changes: Any) -> Callable[[Currents], list[Currents]]:
    """Beside each message another one."""

    def distort(message: Currents) -> list[Currents]:
        other = Currents(
            sequence=message.sequence + changes.get('offset', 0),
            session=changes.get('session', message.session),
            status=changes.get('status', message.status),
            direct_current=np.full(4, changes.get('current', 5.0)),
        )
        return [message, other]

    return distort


DISTORTED: dict[str, tuple[Callable[[Currents], list[Currents]], str]] = {
    'zeros': (zero(Currents.FLYING), 'zero currents were commanded'),
    'zeros, at rest': (zero(Currents.RESTING), 'zero currents were commanded'),
    'not a number': (not_a_number, 'must be finite'),
    'old numbers': (renumbered(-5), 'after those for sample'),
    'one number again and again': (renumbered(-1), 'after those for sample'),
    'numbers to come': (renumbered(1000), 'still to come'),
    'replayed beside': (also(offset=-100), 'after those for sample'),
    'twice': (also(), 'after those for sample'),
    'another session beside': (also(session=2), 'somebody else'),
    'an old session beside': (also(session=2, offset=-150), 'somebody else'),
    'zeros of somebody else': (also(session=3, status=0, current=0.0), 'somebody else'),
}
PLACES: dict[str, Target] = {
    'on the ellipse': ellipse,
    'high': hover(0.0195),
    'low': hover(0.0305, 0.02, -0.02),
}


@pytest.mark.parametrize('place', PLACES)
@pytest.mark.parametrize('case', DISTORTED)
def test_wrong_currents(case: str, place: str) -> None:
    loop = Loop(PLACES[place], 150)
    distort, said = DISTORTED[case]
    loop.controllers[0].distort = distort
    loop.lands(within=3)
    assert loop.stage.fault is not None
    assert said in loop.stage.fault.reason


@pytest.mark.parametrize('place', PLACES)
def test_killed(place: str) -> None:
    loop = Loop(PLACES[place], 150)
    loop.controllers[0].alive = False
    loop.lands(within=6)


@pytest.mark.parametrize('place', PLACES)
def test_dying_politely(place: str) -> None:
    loop = Loop(PLACES[place], 150)
    loop.controllers[0].alive = False
    loop.controllers[0].say(sequence=loop.sampling.sequence - 1, status=Currents.GAVE_UP)
    loop.lands(within=2)
    assert 'gave up' in str(loop.stage.fault)


@pytest.mark.parametrize('percent', [1, 2, 3, 5, 8, 12, 20, 35, 50])
def test_slow(percent: int) -> None:
    """One that is slower by p % is 5 ms behind after 5 ms / p %."""
    loop = Loop(samples=180 + 7 * percent)
    loop.controllers[0].service = PERIOD * (1.0 + 0.01 * percent)
    loop.lands(within=round(500 / percent) + 10)
    assert loop.stage.fault is not None
    assert loop.stage.fault.kind == 'stale'


@pytest.mark.parametrize('stall', [1, 2, 3, 4, 5, 6, 8, 12, 20, 35, 50])
@pytest.mark.parametrize('place', PLACES)
def test_stalled(stall: int, place: str) -> None:
    loop = Loop(PLACES[place], 150)
    loop.controllers[0].stall(stall * PERIOD)
    if stall <= 4:  # begun 0.7 ms before the next measurement
        loop.run(500)
        assert loop.stage.fault is None
        assert loop.stage.mode is Mode.FOLLOWING
    else:
        loop.lands(within=6)
        assert str(loop.stage.fault).startswith('no fresh currents for 5 ms')


def test_a_second_controller_that_flies_too() -> None:
    loop = Loop()
    second = Controller(loop.flight, session=2)
    loop.controllers.append(second)
    loop.lands(within=3)
    assert 'somebody else' in str(loop.stage.fault)


def test_it_flies_again_once_it_has_been_at_rest() -> None:
    loop = Loop()
    loop.controllers[0].stall(0.02)
    loop.lands(within=6)
    assert loop.stage.reset()[0]
    loop.sampling.controller.forget()
    loop.run(30)  # what flies on is not followed
    assert not loop.stage.flying
    loop.flies = False
    loop.run(5)
    loop.flies = True
    loop.flight.target = hover(0.0309)
    loop.flight.regulator.reset()
    loop.run(30)
    assert loop.stage.flying
    assert loop.stage.fault is None
