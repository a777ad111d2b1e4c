"""Which single error in the wiring, or in its parameters, explains what the phases move."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np

from maglev_hw_bridge.signal_parameters import ENCODER_NAMES, ENCODERS, PHASE_NAMES, PHASES
from maglev_model.axes import FloatArray

_SEEN = np.array([3e-5] * 4 + [1e-4] * 2)  # less is no answer [m]
_CLEAR = np.array([1.2e-4] * 4 + [4e-4] * 2)  # more says no more [m]
_MARGIN = 0.015  # by which, over all places, one must beat the next, else both are named
_WORST = 0.12  # an explanation further off explains nothing

_WELL = 'all is well'
_OTHERWISE = 'where the wiring is right, check amplifier.*, commutation.* and machine.*'


class Finding(NamedTuple):
    """What the responses mean."""

    fine: bool
    text: str
    explanations: int = 1  # that are left: 0, 1, or 2 that look alike


def diagnose(seen: FloatArray, foretold: FloatArray) -> Finding:
    """Judge what was seen, (12, 2, p, 6) [m], by what the parameters' wiring would show.

    Indices: phase, the current's sign (+, -), place of the platen, encoder. ``foretold``,
    (n, 12, 2, p, 6) [m], has n guesses at the machine before them: every explanation gets the one
    that suits it best, and the first is the likeliest.
    """
    silent = _silent(seen, foretold[0])
    if silent:
        return Finding(False, silent)
    wanted, explanations = _shape(seen), list(_explanations(foretold))
    off = [_off(_shape(shown) - wanted) for _, shown in explanations]
    best = min(range(len(off)), key=lambda one: float(np.mean(off[one])))
    if np.mean(off[best]) > _WORST:
        return Finding(
            False,
            'no single error explains this: check all wiring against amplifier.* and encoder.*',
            0,
        )
    texts = [text for text, _ in explanations]
    alike = [i for i, other in enumerate(off) if np.sum(other - off[best]) < _MARGIN and i != best]
    if alike:
        other = min(alike, key=lambda one: float(np.mean(off[one])))
        either = f'either: {texts[best] or _WELL}; or: {texts[other] or _WELL}'
        known = texts[best] and texts[other]
        return Finding(False, either if known else f'{either}; {_OTHERWISE}', 2)
    text = texts[best]
    return Finding(not text, text or 'every phase and every encoder is as the parameters say')


def _off(difference: FloatArray) -> FloatArray:
    """How far off at each place the guess is that suits best, of (n, 12, 2, p, 6); (p,)."""
    by_place = np.mean(np.abs(difference), axis=(1, 2, 4))
    best: FloatArray = by_place[np.argmin(np.mean(by_place, axis=1))]
    return best


def _shape(response: FloatArray) -> FloatArray:
    """Responses by direction and clearness, within -1 and 1."""
    shape: FloatArray = np.clip(response / _CLEAR, -1.0, 1.0)
    return shape


def _silent(seen: FloatArray, foretold: FloatArray) -> str:
    """What does not answer at all; a phase is not blamed for what no phase has an encoder see."""
    answered, expected = np.abs(seen) > _SEEN, np.abs(foretold) > _SEEN
    sees = np.logical_or.reduce(answered, axis=(0, 1, 2))
    if not sees.any():
        return (
            'no encoder sees any phase: check the supply, the cables of motors and encoders, and '
            'encoder.resolution'
        )
    for phase in range(PHASES):
        unseen = expected[phase][..., ~sees].any() and not expected[phase][..., sees].any()
        if not answered[phase].any() and not unseen:
            return (
                f'{PHASE_NAMES[phase]} moves nothing: check its amplifier, its cable, and element '
                f'{phase} of amplifier.board and amplifier.channel'
            )
    for encoder in range(ENCODERS):
        if expected[..., encoder].any() and not sees[encoder]:
            return (
                f'encoder {ENCODER_NAMES[encoder]} sees nothing: check its cable, and element '
                f'{encoder} of encoder.board, encoder.channel and encoder.resolution'
            )
    return ''


def _explanations(foretold: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    """Every single error, in words, with what it would show; without words: none."""
    yield '', foretold
    for phase, name in enumerate(PHASE_NAMES):
        shown = foretold.copy()
        shown[:, phase] = foretold[:, phase, ::-1]
        yield f'{name} is turned round: change the sign of element {phase} of amplifier.sign', shown
    for encoder, name in enumerate(ENCODER_NAMES):
        shown = foretold.copy()
        shown[..., encoder] *= -1.0
        yield (
            f'encoder {name} counts the other way: change the sign of element {encoder} of '
            'encoder.direction',
            shown,
        )
    for one, two in combinations(range(PHASES), 2):
        shown = foretold.copy()
        shown[:, [one, two]] = foretold[:, [two, one]]
        yield (
            f'{PHASE_NAMES[one]} and {PHASE_NAMES[two]} are exchanged: exchange elements {one} and '
            f'{two} of amplifier.board and of amplifier.channel',
            shown,
        )
    for one, two in combinations(range(ENCODERS), 2):
        shown = foretold.copy()
        shown[..., [one, two]] = foretold[..., [two, one]]
        yield (
            f'encoders {ENCODER_NAMES[one]} and {ENCODER_NAMES[two]} are exchanged: exchange '
            f'elements {one} and {two} of encoder.board and of encoder.channel',
            shown,
        )
