"""What a machine flies: every phase that a fault is to meet, one after another, once."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from maglev_model.contract.phases import Phase
from maglev_model.loop_parameters import REFERENCE_FREQUENCY
from maglev_model.quintic import minimum_jerk
from maglev_study.references import HOVER, References, ellipse_at, held, joined, shaped

PHASES = (
    'homing',
    'arming',
    'rest',
    'lift-off',
    'hover',
    'ellipse',
    'steps',
    'far',
    'landing 1/3',
    'landing 2/3',
    'landing 3/3',
    'after a fault',
    'reset',
)
"""In the order in which they are flown."""

ON_THE_GROUND = ('homing', 'arming', 'rest', 'after a fault', 'reset')
BEFORE_THE_FIRST_SAMPLE = ('homing', 'arming')

ROOM: Mapping[str, tuple[float, float]] = {
    'motors': (4, 4),
    'gap_min': (0.0, 0.018),
    'gap_max': (0.031, 1.0),
    'x_max': (0.05, 1.0),
    'z_max': (0.05, 1.0),
    'theta_max': (0.014, 1.0),
}
"""What the programme takes of a machine, by its parameter [m, rad]."""

_HEIGHTS = (0.0186, 0.0305)  # of hovering [m]
_THETA = 0.01  # amplitude of the ellipse [rad]
_GROW = 0.8  # of the ellipse, and to shrink again [s]
_FAR = 0.045  # [m]
_CALM = 0.1  # after raw steps [s]
_THIRD = 0.5  # of a landing [s]

STOP, RESET = 'stop', 'reset'


@dataclasses.dataclass(frozen=True)
class Programme:
    """A reference for each sample, where each phase lies, and what the operator does when."""

    references: References
    kind: tuple[int, ...]  # of Phase, by sample
    spans: Mapping[str, tuple[int, int]]  # first sample, and the first after it
    actions: Mapping[int, str]  # by sample
    period: float  # of the samples [s]

    def sample_of(self, phase: str, instant: float) -> int:
        """The sample at a share 0..1 of a phase."""
        start, end = self.spans[phase]
        return min(start + int(instant * (end - start)), max(end - 1, start))

    def jumps(self, sample: int) -> bool:
        """Whether the reference is one that nothing can follow closely."""
        start, end = self.spans['steps']
        return start <= sample < end + round(_CALM / self.period)


class _Maker:
    def __init__(self, floor: float, period: float) -> None:
        self.period = period
        self.parts: list[References] = []
        self.kind: list[int] = []
        self.spans: dict[str, tuple[int, int]] = dict.fromkeys(BEFORE_THE_FIRST_SAMPLE, (0, 0))
        self.rest = self.place = _at(y=floor)

    def add(self, kind: Phase, *parts: References, name: str = '') -> None:
        start = len(self.kind)
        for part in parts:
            self.parts.append(part)
            self.kind += [int(kind)] * len(part.position)
            self.place = part.position[-1]
        if name:
            self.spans[name] = (start, len(self.kind))

    def go(self, goal: np.ndarray, time: float, hold: float) -> References:
        part = shaped(self.place, goal, time, hold, self.period)
        self.place = goal
        return part

    def stay(self, place: np.ndarray, time: float) -> References:
        self.place = place
        return held(place, time, self.period)


def programme(number: int, floor: float, period: float) -> Programme:
    """The programme of a machine; even ones are landed by the controller, odd by the bridge.

    ``floor`` is the gap at its lower stop [m], ``period`` that of its samples [s].
    """
    rng = np.random.default_rng([104729, number])
    make = _Maker(floor, period)
    make.add(Phase.REST, make.stay(make.rest, 0.05), name='rest')
    make.add(Phase.LIFT_OFF, make.go(HOVER, 0.8, 0.1), name='lift-off')
    heights = [_at(y=y) for y in rng.uniform(*_HEIGHTS, 3)]
    make.add(Phase.HOLD, *(make.go(place, 0.4, 0.3) for place in heights), name='hover')
    make.add(Phase.HOLD, make.go(HOVER, 0.4, 0.05))
    make.add(Phase.TRACK, _ellipse(1.4 * _GROW, period), name='ellipse')
    make.add(Phase.STEP, *_steps(make, rng), name='steps')
    make.add(Phase.HOLD, make.go(HOVER, 0.6, 0.05))
    signs = rng.choice((-1.0, 1.0), 2)
    make.add(
        Phase.HOLD,
        make.go(_at(x=_FAR * signs[0], z=_FAR * signs[1]), 0.7, 0.2),
        make.go(_at(x=-_FAR * signs[0], z=_FAR * signs[1], y=rng.uniform(0.022, 0.029)), 0.9, 0.2),
        name='far',
    )
    make.add(Phase.HOLD, make.go(HOVER, 0.7, 0.1))
    actions = _end(make, by_bridge=number % 2 == 1)
    make.add(Phase.REST, make.stay(make.rest, 0.1))
    make.add(Phase.LIFT_OFF, make.go(HOVER, 0.8, 0.0))
    make.add(Phase.HOLD, make.go(_at(y=rng.uniform(0.02, 0.029), x=0.02), 0.6, 3.0))
    return Programme(joined(*make.parts), tuple(make.kind), make.spans, actions, period)


def _at(y: float = 0.025, x: float = 0.0, z: float = 0.0) -> np.ndarray:
    return np.array([y, x, z, 0.0, 0.0])


def _ellipse(plateau: float, period: float) -> References:
    """The paper's ellipse in 4DOF; grows from a point, and shrinks to it again."""
    samples = np.arange(round((2.0 * _GROW + plateau) / period), dtype=np.float64)
    time = period * samples[:, None]
    place, speed, bend = ellipse_at(REFERENCE_FREQUENCY * time, _THETA)
    up, up_rate, up_bend = minimum_jerk(np.clip(time / _GROW, 0.0, 1.0))
    down, down_rate, down_bend = minimum_jerk(np.clip((time - _GROW - plateau) / _GROW, 0.0, 1.0))
    scale = up - down
    rate = (up_rate - down_rate) / _GROW
    curve = (up_bend - down_bend) / _GROW**2
    away = place - HOVER
    return References(
        HOVER + scale * away,
        scale * speed + rate * away,
        scale * bend + 2.0 * rate * speed + curve * away,
    )


def _steps(make: _Maker, rng: np.random.Generator) -> list[References]:
    """Raw jumps of y, x, z and theta, which add up."""
    place, parts = HOVER.copy(), []
    for axis, size in rng.permutation([(0, 0.003), (1, 0.03), (2, 0.03), (4, 0.006)]):
        place = place.copy()
        place[int(axis)] += size * rng.choice((-1.0, 1.0))
        parts.append(make.stay(place, 0.35))
    return parts


def _end(make: _Maker, *, by_bridge: bool) -> dict[int, str]:
    """The landing, a fault latched on the ground, and its reset."""
    start = len(make.kind)
    if by_bridge:
        make.add(Phase.HOLD, make.stay(HOVER, 2.5))
        stop = start
    else:
        make.add(Phase.LAND, make.go(make.rest, 1.5, 0.1))
        make.add(Phase.REST, make.stay(make.rest, 0.1))
        stop = len(make.kind) - 1
    length = round(_THIRD / make.period)
    for third in range(3):
        begin = start + third * length
        make.spans[f'landing {third + 1}/3'] = (begin, begin + length)
    make.add(Phase.REST, make.stay(make.rest, 0.1), name='after a fault')
    reset = len(make.kind)
    make.add(Phase.REST, make.stay(make.rest, 0.1), name='reset')
    return {stop: STOP, reset: RESET}
