"""What is guaranteed beside what was flown: disk margins of the five axes as one loop."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from maglev_controller.laws import control_law
from maglev_model.axes import THETA, FloatArray
from maglev_plant.effects.parameters import EffectParameters
from maglev_plant.parameters import PlantParameters
from maglev_study.comparison.contestants import Contestant
from maglev_study.multiloop import Guarantee, MultiLoop, multiloop
from maglev_study.references import HOVER
from maglev_study.robustness.draw import NOMINAL
from maglev_study.robustness.fleet import Plan
from maglev_study.workers import results

GAPS = (0.020, 0.0225, 0.025, 0.0275, 0.030)
"""Air gaps looked at [m], those within the machine's stops."""

TILTS, SPEEDS, DELAYS = (0.0, 0.010), (0.0, 0.1), (0, 1)
"""Tilts theta [rad], likewise; speeds of each axis [m/s, rad/s]; delays of currents [samples]."""

MOST_MACHINES = 30
"""Drawn machines whose margins are computed, the first ones."""

SETS = 64
"""Of gains of the eight amplifiers, each up or down, with which the loop is tried."""

LARGEST = 40.0
"""Gain beyond which none is tried [dB]."""


class Place(NamedTuple):
    """Where a loop is linearised."""

    gap: float
    tilt: float
    speed: float
    delay: int

    def text(self) -> str:
        """In words."""
        moving = f'moving at {self.speed:g} m/s' if self.speed else 'at rest'
        tilted = f', tilted by {1e3 * self.tilt:g} mrad' if self.tilt else ', level'
        return f'{1e3 * self.gap:g} mm{tilted}, {moving}'

    def loop(self, contestant: Contestant, plant: PlantParameters) -> MultiLoop:
        """The loop of a law there; ``effects.*`` of the plant are left out."""
        at = np.array(HOVER)
        at[0], at[THETA] = self.gap, self.tilt if contestant.tilts else 0.0
        return multiloop(
            dataclasses.replace(plant, effects=EffectParameters()),
            at,
            speed=self.speed,
            delay=self.delay,
            controller=contestant.controller,
        )


HOVERING = Place(float(HOVER[0]), 0.0, SPEEDS[-1], 0)
"""Where the machines are compared."""


@dataclasses.dataclass(frozen=True)
class Found:
    """The guarantees at one place, of a machine by its number: at the currents, at the readings."""

    law: str
    machine: int
    place: Place
    current: Guarantee
    reading: Guarantee


@dataclasses.dataclass(frozen=True)
class Guarantees:
    """Of one law: over the range and of machines; and what gains the worst loop does not bear.

    ``over`` the nominal machine at all places, ``machines`` the nominal and drawn ones at
    :data:`HOVERING`; ``unstable`` [dB] with which of the :data:`SETS` of gains the loop at
    ``worst`` first is.
    """

    law: str
    over: tuple[Found, ...]
    machines: tuple[Found, ...]
    unstable: float

    def worst(self, delay: int) -> Found:
        """The least guarantee at the currents, so many samples late."""
        return min(
            (one for one in self.over if one.place.delay == delay),
            key=lambda one: one.current.disk,
        )


def guarantees(
    plan: Plan,
    *,
    jobs: int = 1,
    scheduler: str = '',
    heard: Callable[[int, int], object] = lambda done, wanted: None,
) -> list[Guarantees]:
    """For each law of a campaign that has a linear model.

    ``heard`` is told how many loops of how many are looked at. Raises ParameterError where a
    machine has no such loop, as one that cannot hover at :data:`HOVERING`, and what
    :func:`~maglev_study.workers.results` raises.
    """
    laws = [one for one in plan.contestants if control_law(one.controller).make is None]
    tasks = [task for one in laws for task in _tasks(plan.part(one))]
    found: list[Found] = []
    for one in results(_found, tasks, jobs=jobs, scheduler=scheduler):
        found.append(one)
        heard(len(found), len(tasks))
    found.sort(key=lambda one: (one.law, one.machine, one.place))
    return [_of_law(law, [one for one in found if one.law == law.name]) for law in laws]


def _tasks(part: Plan) -> Iterator[tuple[Plan, int, Place]]:
    machine = part.contestants[0].plant.machine
    gaps = [gap for gap in GAPS if machine.gap_min <= gap <= machine.gap_max]
    tilts = [tilt for tilt in TILTS if tilt <= machine.theta_max]
    for place in itertools.product(gaps, tilts, SPEEDS, DELAYS):
        yield part, NOMINAL, Place(*place)
    for number in range(1, min(part.machines, MOST_MACHINES) + 1):
        yield part, number, HOVERING


def _found(part: Plan, number: int, place: Place) -> Found:
    (contestant,) = part.contestants
    loop = place.loop(contestant, part.draw(contestant, number).plant)
    return Found(contestant.name, number, place, *loop.guarantees())


def _of_law(contestant: Contestant, found: Sequence[Found]) -> Guarantees:
    over = tuple(one for one in found if one.machine == NOMINAL)
    machines = tuple(one for one in found if one.place == HOVERING)
    made = Guarantees(contestant.name, over, machines, 0.0)
    loop = made.worst(0).place.loop(contestant, contestant.plant)
    return dataclasses.replace(made, unstable=first_unstable(loop))


def first_unstable(loop: MultiLoop) -> float:
    """The least gain [dB] with which one of many sets of amplifiers, each up or down, is unstable.

    No guarantee can be larger.
    """
    signs = np.random.default_rng(0).choice((-1.0, 1.0), (SETS, 8))
    signs[0], signs[1] = 1.0, -1.0
    least = LARGEST
    for one in signs:
        if loop.stable(_gains(one, least)):
            continue
        low, high = 0.0, least
        while high - low > 0.01:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if loop.stable(_gains(one, middle)) else (low, middle)
        least = high
    return least


def _gains(signs: FloatArray, decibel: float) -> FloatArray:
    return np.asarray(10.0 ** (signs * decibel / 20.0))
