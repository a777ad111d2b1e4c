"""Flexible modes: the fastest feedback and the notches with which they stay stable.

A mode a few per cent off its frequency is hardly attenuated by a notch narrow enough to leave the
axis its phase. What counts is where the loop gain points at the resonance. A notch a little above
or below the mode turns it by nearly 90° either way, so the resonance can be put where it damps
itself, whichever the sign of its gain: it is stabilised by phase where it cannot be by gain. For
each mode, lowest first, frequency and width of the notch are chosen such that the sensitivity peak
is least over all frequencies the mode may have; the axis is made slower until that is enough.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np

from maglev_controller.design.axis_design import AxisDesign, controller_system, feedback_system
from maglev_controller.design.notch import Notch, notch, notch_response
from maglev_controller.design.state_space import (
    ComplexArray,
    Mode,
    StateSpace,
    closed_loop,
    plant_system,
    response,
    sampled_frequency,
    spectral_radius,
)

FACTORS: Final = tuple(0.93**power for power in range(17))
"""Of the three speeds of the axis."""

_PLACES = (0.75, 0.82, 0.88, 0.92, 0.96, 1.0, 1.04, 1.08, 1.13, 1.2, 1.35)  # of notch by mode
_WIDTHS = (0.08, 0.16, 0.3, 0.5, 0.8)
_DEPTH = 0.03
_SHARES = (-1.0, -0.5, 0.0, 0.5, 1.0)  # of the tolerance
_LOWEST = 1.0  # frequency looked at [rad/s]
_POINTS = 200


class Case(NamedTuple):
    """What the design has to bear."""

    modes: tuple[Mode, ...]
    tolerance: float  # relative error of their frequencies
    period: float  # [s]
    delay: int  # [samples]
    sensitivity: float  # peak at most


def variants(modes: Sequence[Mode], tolerance: float) -> list[tuple[Mode, ...]]:
    """The modes as they may be: all of them off by as much, none at all, half their gain.

    Where there are several, also each alone, and one off one way and another the other.
    """
    if not modes:
        return [()]
    found: list[tuple[Mode, ...]] = [(), tuple(m._replace(gain=0.5 * m.gain) for m in modes)]
    for share in _SHARES:
        off = tuple(_off(mode, share * tolerance) for mode in modes)
        found.append(off)
        if len(modes) > 1:
            found += [(mode,) for mode in off]
    for signs in itertools.product((-1.0, 1.0), repeat=len(modes)):
        if len(set(signs)) > 1:
            found.append(
                tuple(_off(m, sign * tolerance) for m, sign in zip(modes, signs, strict=True))
            )
    return found


def _off(mode: Mode, share: float) -> Mode:
    return mode._replace(frequency=(1.0 + share) * mode.frequency)


def stabilised(build: Callable[[float], AxisDesign], case: Case) -> AxisDesign:
    """The fastest of ``build(factor)``, with notches, that bears the modes.

    The one of factor 1 where none does, which the margins then refuse.
    """
    if not case.modes:
        return build(1.0)
    grid = _Grid(case)
    best = grid.fitted(build(1.0))
    if best is not None:
        return best
    too_fast, borne = 0, len(FACTORS)
    while borne - too_fast > 1:
        middle = (too_fast + borne) // 2
        design = grid.fitted(build(FACTORS[middle]))
        if design is None:
            too_fast = middle
        else:
            best, borne = design, middle
    return best or build(1.0)


class _Grid:
    """Frequency responses that all candidates share."""

    def __init__(self, case: Case) -> None:
        self._case = case
        self._variants = variants(case.modes, case.tolerance)
        period = case.period
        top = math.pi / period * (1.0 - 1e-6)
        parts = [np.geomspace(_LOWEST, top, _POINTS)]
        for mode in itertools.chain.from_iterable(self._variants):
            span = 4.0 * mode.damping
            near = mode.frequency * np.linspace(1.0 - span, 1.0 + span, 21)
            parts.append(sampled_frequency(near, period))
        omega = np.unique(np.concatenate(parts))
        within = (omega >= _LOWEST) & (omega < top)
        self._z: ComplexArray = np.exp(1j * omega[within] * period)

    def fitted(self, design: AxisDesign) -> AxisDesign | None:
        """The design with notches for all modes, or None where the peak stays too high.

        Of several modes each notch is sought beside all of them; and where that fails, as beside
        one that is unstable without a notch of its own, beside those that have had theirs.
        """
        found = self._notched(design, self._variants)
        if found is None and len(self._case.modes) > 1:
            found = self._notched(design, None)
        return found

    def _notched(
        self, design: AxisDesign, given: Sequence[tuple[Mode, ...]] | None
    ) -> AxisDesign | None:
        """``fitted`` for given variants, or those of the modes so far."""
        case, modes = self._case, sorted(self._case.modes)
        inner = feedback_system(design, case.period, case.delay)
        by_error, by_acting = (
            response(StateSpace(inner.state, drive, inner.output, direct), self._z)
            for drive, direct in ((inner.error_input, inner.direct), (inner.acting_input, 0.0))
        )

        def peak(filtered: ComplexArray, responses: ComplexArray) -> float:
            controller = filtered * by_error / (1.0 - filtered * by_acting)
            return float(np.max(1.0 / np.abs(1.0 - responses * controller)))

        chosen: list[Notch] = []
        series: ComplexArray = np.ones_like(self._z)
        for count, mode in enumerate(modes, start=1):
            beside = variants(modes[:count], case.tolerance) if given is None else given
            plants = [self._plant(each, design.stiffness) for each in beside]
            responses = np.array([response(plant, self._z) for plant in plants])
            ranked = self._ranked(mode, series, functools.partial(peak, responses=responses))
            for candidate in ranked[:6]:
                notches = (*chosen, *candidate)
                if self._stable(dataclasses.replace(design, notches=notches), plants):
                    break
            else:
                return None
            chosen = list(notches)
            for each in candidate:
                series = series * notch_response(each, self._z)
        if peak(series, responses) > case.sensitivity:
            return None
        return dataclasses.replace(design, notches=tuple(chosen))

    def _ranked(
        self, mode: Mode, series: ComplexArray, peak: Callable[[ComplexArray], float]
    ) -> list[tuple[Notch, ...]]:
        """No notch, or one; those with the least peak first."""
        found: list[tuple[float, int, tuple[Notch, ...]]] = [(peak(series), 0, ())]
        for place, width in itertools.product(_PLACES, _WIDTHS):
            frequency = place * mode.frequency
            if frequency * self._case.period < 0.98 * math.pi:
                each = notch(frequency, _DEPTH, width, self._case.period)
                value = peak(series * notch_response(each, self._z))
                found.append((value, len(found), (each,)))
        return [candidate for _, _, candidate in sorted(found)]

    def _plant(self, modes: tuple[Mode, ...], stiffness: float) -> StateSpace:
        return plant_system(self._case.period, self._case.delay, stiffness=stiffness, modes=modes)

    def _stable(self, design: AxisDesign, plants: Sequence[StateSpace]) -> bool:
        controller = controller_system(design, self._case.period, self._case.delay)
        return all(spectral_radius(closed_loop(controller, plant)) < 1.0 for plant in plants)
