"""Encoders that leap away from what the observer foretells: slips, jumps, resets and noise."""

from __future__ import annotations

from typing import Final

from maglev_hw_bridge.sensing.guard_arrays import LOST, NOISY, PUT_RIGHT, SOUND, GuardArrays
from maglev_model.axes import PHI, THETA, Y
from maglev_model.compiled import borrowing
from maglev_model.machine_array import machine_from_array

PROBATION: Final = 0.02
"""Time after a slip in which noise would leap again [s]."""

_TAMED = 0.2  # how much of what is noisy is believed
_FAR_OFF = 1.5e-3  # what a noisy one says farther off than this is no news [m]


@borrowing
def _drift(g: GuardArrays, i: int) -> float:
    """How far friction may carry what an encoder should read off the model in probation [m]."""
    if i >= 4:
        held = g.friction[i - 3]
    else:
        held = (
            g.friction[Y]
            + machine_from_array(g.machine).r * g.friction[PHI if i % 2 == 0 else THETA]
        )
    return float(0.5 * held * (g.on_probation * g.period) ** 2)


@borrowing
def _tame(g: GuardArrays, i: int, error: float) -> None:
    """Believe a little of what is noisy, and nothing where it is far off."""
    g.believed[i] -= (1.0 - _TAMED) * error if abs(error) < _FAR_OFF else error


@borrowing
def _leap(g: GuardArrays, i: int, error: float, step: float) -> None:
    """Put an encoder right that leapt; where it leaps again, do without it.

    But where x and z both leap again and again, and count, they are followed slowly: unseen, the
    platen would be pushed along by motors out of phase, faster than it lands.
    """
    if g.trust[i] == SOUND:
        g.trust[i], g.probation[i], g.slip[i] = PUT_RIGHT, g.on_probation, error
        g.offset[i] += error
        g.believed[i] -= error
    elif i >= 4 and g.trust[9 - i] != SOUND and step != 0.0:
        g.trust[i], g.probation[i] = NOISY, 0
        g.offset[i] -= g.slip[i]
        g.believed[i] -= error
    else:
        g.trust[i] = LOST


@borrowing
def find_leaps(g: GuardArrays) -> bool:
    """Find and put right what leaps; whether there is some."""
    found = False
    for i in range(6):
        step = g.believed[i] - g.past[0, i]
        error = step - g.step[i]
        if g.trust[i] == NOISY:
            _tame(g, i, error)
            continue
        again = step - (g.past[0, i] - g.past[1, i])
        away = g.probation[i] == 1 and abs(g.believed[i] - g.length[i]) > g.max_jump + _drift(g, i)
        if g.trust[i] == LOST or (min(abs(error), abs(again)) <= g.max_jump and not away):
            continue
        found, g.blamed[i] = True, 1
        _leap(g, i, error, step)
    return found
