"""A flight of real nodes, and how it goes."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from graph import Nodes, Observer, Process
from landing import SWIFT_LANDING

from maglev_node.topics import CURRENTS, MEASUREMENT, TRUE_STATE

ELLIPSE = 'scenario_ellipse.yaml'
LONG = 'duration:=200.0'
BRISK = (
    *('lift_off.time:=0.5', 'lift_off.settle:=0.0', 'move_time:=0.4'),
    *('landing.time:=0.5', 'landing.crawl_distance:=1.0e-4'),
)
"""For the reference: up and down in a second where the default takes four."""
SWIFT = tuple(f'{name}:={value}' for name, value in SWIFT_LANDING.items())
WATCHED = 'watchers:=[observer]'  # by the test
LOWER_STOP = 0.031


def starts(
    nodes: Nodes,
    *arguments: str,
    mode: str = 'lockstep',
    plant: tuple[str, ...] = (),
    controller: tuple[str, ...] = (),
    watched: tuple[str, ...] = (WATCHED,),
) -> tuple[Callable[[], Process], ...]:
    """What starts plant, controller and reference on the ellipse; ``arguments`` are the last's."""
    common = f'mode:={mode}', *watched
    on_the_ellipse = *common, 'run_in:=1.0', *BRISK
    return (
        partial(nodes.start, 'plant', *common, *plant, params=('benchmark.yaml',)),
        partial(nodes.start, 'controller', *common, *SWIFT, *controller),
        partial(nodes.start, 'reference', *on_the_ellipse, *arguments, params=(ELLIPSE,)),
    )


def fly(nodes: Nodes, *arguments: str, **options: Any) -> dict[str, Process]:
    """Start them, as :func:`starts` says."""
    plant, controller, reference = starts(nodes, *arguments, **options)
    return {'plant': plant(), 'controller': controller(), 'reference': reference()}


def samples(observer: Observer, count: int) -> None:
    """Wait until the stage has taken so many more."""
    end = observer.newest(MEASUREMENT).sequence + count
    observer.wait(lambda: observer.newest(MEASUREMENT).sequence > end)


def idles(observer: Observer) -> bool:
    """Whether the loop goes on, and takes no more samples than it must while nothing shall move."""
    observer.wait(lambda: observer.newest(MEASUREMENT) is not None)
    first, begun = observer.newest(MEASUREMENT).sequence, time.monotonic()
    observer.serve(2.0)
    rate: float = (observer.newest(MEASUREMENT).sequence - first) / (time.monotonic() - begun)
    return 5.0 < rate < 80.0


def gap(observer: Observer) -> float:
    """The true air gap now [m]."""
    newest = observer.newest(TRUE_STATE)
    return LOWER_STOP if newest is None else float(newest.state[0])


def airborne(observer: Observer) -> bool:
    """Whether the platen is well off its stop."""
    return gap(observer) < 0.026


def impact_speed(observer: Observer) -> float:
    """Greatest speed at which the platen came near one of its vertical stops [m/s]."""
    states = observer.look()[TRUE_STATE].every('state')
    near = (states[:, 0] > LOWER_STOP - 1e-5) | (states[:, 0] < 0.018 + 1e-5)
    return float(np.max(np.abs(states[near, 1]), initial=0.0))


def landed_without_current(observer: Observer) -> bool:
    """Whether the platen rests and nothing flows or is commanded."""
    state, currents = observer.newest(TRUE_STATE), observer.newest(CURRENTS)
    return bool(
        abs(state.state[0] - LOWER_STOP) < 1e-5
        and not np.any(currents.direct_current)
        and not np.any(currents.quadrature_current)
        and np.max(np.abs(state.direct_current)) < 1e-6
    )
