"""Encoders that stand still while the platen moves: which of them are stuck."""

from __future__ import annotations

import math
from typing import Final

from maglev_hw_bridge.sensing import observer
from maglev_hw_bridge.sensing.guard_arrays import LOST, PUT_RIGHT, SOUND, GuardArrays, gap_residual
from maglev_hw_bridge.sensing.observer import Flags
from maglev_model.axes import PHI, THETA, X, Y, Z
from maglev_model.compiled import borrowing
from maglev_model.machine_array import machine_from_array

# What speaks against encoders that stand still.
UNSEEN: Final = 1
CONTRADICTED: Final = 2

SETTLING: Final = 0.1
"""Time until the disturbance is found [s]."""

_DOUBT = 2.5e-5  # an encoder that should have moved this far is not followed [m]
_CERTAIN = 1.5  # as many times max_unseen it is stuck whatever the others read
_DOUBTFUL_RESIDUAL = 6e-5  # [m]
_DENIED = 1e-4  # of a motion that far the others must show half, where they can [m]
_GROUND = 1e-3  # this near the lower stop no gap is at stake any more [m]
_HEARD = 5  # counts one way that no stuck encoder makes
_FASTEST = 0.5  # that a platen moves [m/s]
_LEAP = 0.035  # no platen leaves it that fast [m/s]
_AGREED = 2e-5  # how near the others must read to what is foretold then [m]


@borrowing
def _least_step(g: GuardArrays, i: int) -> float:
    """How far an encoder should at least move in this sample by the model alone [m]."""
    rate = g.least_rate
    if i >= 4:
        return float(g.period * rate[i - 3])
    tilt = machine_from_array(g.machine).r * (rate[PHI] if i % 2 == 0 else -rate[THETA])
    return float(g.period * (rate[Y] + (tilt if i >= 2 else -tilt)))


@borrowing
def _at_rest(g: GuardArrays, i: int) -> bool:
    """Whether friction, or the lower stop, may hold an encoder where it is."""
    if i >= 4:
        return bool(g.least_rate[i - 3] == 0.0)
    if not g.rigid and g.position[Y] > g.upper[Y] - _GROUND:
        return True
    return bool(g.least_rate[Y] == 0.0 and g.least_rate[PHI if i % 2 == 0 else THETA] == 0.0)


@borrowing
def look(g: GuardArrays, flying: bool, counted: Flags) -> None:
    """Which encoders counted, and how far each of the others should have moved since it did."""
    residual = gap_residual(g.believed)
    settled = g.samples >= g.settling
    if not (settled or g.rested):
        for axis in (Y, PHI, THETA):
            observer.restart_model(g, axis)
    for i in range(6):
        counted[i] = g.trust[i] != LOST and g.believed[i] != g.past[0, i]
        if i >= 4 and counted[i] and abs(g.unseen[i]) > _DOUBT:
            observer.take_at_its_word(g, i - 3, g.believed[i])
        judged = flying and (settled or (g.rested and i < 4))
        if counted[i] or not judged or _at_rest(g, i):
            g.unseen[i] = 0.0
        else:
            g.unseen[i] += _least_step(g, i)
        if i < 4:
            g.still[i] += 1
            if counted[i] or not g.rigid:
                g.residual_then[i], g.still[i] = residual, 0
        asked = flying and settled and g.trust[i] != LOST
        asked = asked and not (counted[i] or observer.supported(g, Y))
        g.silent[i] = g.silent[i] + 1 if asked else 0
        g.probation[i] = max(g.probation[i] - 1, 0)


@borrowing
def _reach(g: GuardArrays, i: int, speed: float) -> float:
    """How far an encoder comes in a sample at a speed; a count may always be [m]."""
    return float(max(g.period * speed, 1.5 * g.count[i]))


@borrowing
def await_lift_off(g: GuardArrays) -> None:
    g.answered[:], g.left[:] = int(not observer.supported(g, Y)), 0.0
    if observer.near_lower_stop(g):
        observer.rest(g)


@borrowing
def _excused(g: GuardArrays, i: int) -> bool:
    """Whether the other three gaps show that this one has no reason to answer yet.

    A platen that tilts as it lifts off turns about a corner.
    """
    for k in range(4):
        if k != i and (g.trust[k] == LOST or g.answered[k] == 0):
            return False
    across, left, right = g.left[(i + 2) % 4], g.left[(i + 1) % 4], g.left[(i + 3) % 4]
    return bool(abs(left + right - across) <= g.roll_call)


@borrowing
def _risen_unheard(g: GuardArrays) -> bool:
    """Whether no gap encoder has told of a platen that has risen for sure."""
    unseen = math.inf if g.rested else 0.0
    for i in range(4):
        if g.trust[i] != LOST:
            unseen = 0.0 if g.answered[i] != 0 else min(unseen, abs(g.unseen[i]))
    return bool(g.roll_call < unseen < math.inf)


@borrowing
def call_the_roll(g: GuardArrays, flying: bool, counted: Flags) -> bool:
    """Do without gap encoders that do not answer when the platen lifts off; whether there are some.

    Two that are stuck look like a tilt, which the controller undoes by one that nobody sees: soon
    neither the others nor, with the stop's support unknown, the model could tell. All of them are
    called by the currents, where the lift of homing has found out which it takes.
    """
    if not flying:
        await_lift_off(g)
        return False
    called = False
    for i in range(4):
        step = g.believed[i] - g.past[0, i]
        g.answered[i] = max(g.answered[i], int(counted[i]))
        g.left[i] = g.left[i] + step if abs(step) < _reach(g, i, _LEAP) else 0.0
        called = called or (g.trust[i] == SOUND and abs(g.left[i]) > g.roll_call)
    called = called or _risen_unheard(g)
    found = False
    for i in range(4):
        if called and g.answered[i] == 0 and g.trust[i] != LOST and not _excused(g, i):
            g.trust[i], g.blamed[i], found = LOST, 1, True
    if found:
        observer.bound_disturbance(g, PHI)
        observer.bound_disturbance(g, THETA)
    return found


@borrowing
def _residual_since(g: GuardArrays, i: int) -> float:
    """What four believed gaps contradict each other by since an encoder's last count [m]."""
    return abs(gap_residual(g.believed) - g.residual_then[i]) if i < 4 and g.rigid else 0.0


@borrowing
def _unseen_limit(g: GuardArrays, i: int, doubted: Flags) -> float:
    """How far an encoder may be missed; if no gap tells otherwise, half as far [m].

    But not where nobody knows what the lower stop carries.
    """
    none = doubted[0] and doubted[1] and doubted[2] and doubted[3]
    known = g.rested or not observer.supported(g, Y)
    return float((0.5 if i < 4 and none and known else 1.0) * g.max_unseen[i])


@borrowing
def _denied(g: GuardArrays, doubted: Flags, share: float) -> bool:
    """Whether four gaps go on being those of a rigid platen that the motion in doubt would tilt.

    Were those stuck that are doubted and missed by more than a ``share`` of max_unseen, they would
    contradict the others by what they do not show. It is the model that is wrong then, as where a
    phase is dead.
    """
    missing = shown = 0.0
    for i in range(4):
        if g.rigid and doubted[i] and abs(g.unseen[i]) > share * _unseen_limit(g, i, doubted):
            missing += g.unseen[i] if i % 2 == 0 else -g.unseen[i]
            shown = max(shown, _residual_since(g, i))
    return bool(abs(missing) > _DENIED and shown < 0.5 * abs(missing))


@borrowing
def doubt(g: GuardArrays, flying: bool, doubted: Flags) -> int:
    """Which encoders stand still, ``doubted`` (6,), where others or the model say they should not.

    The model is believed against gap encoders when it agrees with the others, when three of them
    tell without it, or when it is certain, unless the others deny the motion; otherwise a residual
    says that some of those are wrong that do not count, where it can be one or two. Returns what it
    was: UNSEEN, CONTRADICTED or 0.
    """
    g.rigid = flying
    for i in range(4):
        g.rigid = g.rigid and g.trust[i] != LOST and g.probation[i] == 0
    unseen = contradicted = 0
    agreed, certain = True, False
    for i in range(6):
        believed = g.trust[i] != LOST and g.probation[i] == 0
        doubted[i] = believed and abs(g.unseen[i]) > _DOUBT
        if i < 4 and believed:
            unseen += int(doubted[i])
            certain = certain or abs(g.unseen[i]) > _CERTAIN * g.max_unseen[i]
            agreed = agreed and (doubted[i] or abs(g.believed[i] - g.length[i]) <= _AGREED)
            contradicted += int(_residual_since(g, i) > _DOUBTFUL_RESIDUAL)
    credible = agreed or certain or (unseen == 1 and g.rigid)
    if unseen > 0 and credible and not _denied(g, doubted, 0.0):
        return UNSEEN
    told = contradicted == 1 or contradicted == 2
    for i in range(4):
        doubted[i] = told and g.probation[i] == 0 and _residual_since(g, i) > _DOUBTFUL_RESIDUAL
    return CONTRADICTED if told else 0


@borrowing
def lose(g: GuardArrays, i: int) -> None:
    """Do without an encoder that stands still."""
    g.trust[i] = LOST
    if i >= 4:
        g.stood[i - 4], g.heard[i - 4] = 1, 0


@borrowing
def listen(g: GuardArrays) -> None:
    """Believe x or z again that was lost because it stood still, and counts after all.

    It was the motors that did not move it, as with a phase that is dead, and now they do.
    """
    g.returned = False
    for k in range(2):
        step, g.read[k] = g.believed[4 + k] - g.read[k], g.believed[4 + k]
        if g.trust[4 + k] != LOST or g.stood[k] == 0 or step == 0.0:
            continue
        way = 1 if step > 0.0 else -1
        if abs(step) > _reach(g, 4 + k, _FASTEST) or way * g.heard[k] < 0:
            g.heard[k] = 0
        g.heard[k] += way
        if abs(g.heard[k]) >= _HEARD:
            g.trust[4 + k], g.stood[k], g.returned = PUT_RIGHT, 0, True
            g.past[:, 4 + k] = g.read[k] - step
            observer.take_at_its_word(g, X + k, g.read[k] - step)


@borrowing
def find_stuck(g: GuardArrays, doubted: Flags, doubt: int) -> bool:
    """Do without the encoders that are doubted for too long; whether there are new ones.

    Several that stand still may all be stuck where the first of them alone cannot be: that is not
    done without before the others, and by then those may have counted. What contradicts by more
    than a platen moves since one counted is a leap of another, as of one that is noisy.
    """
    found = False
    denied = doubt == UNSEEN and _denied(g, doubted, 1.0)
    for i in range(6):
        gone = abs(g.unseen[i]) > _unseen_limit(g, i, doubted) and not (denied and i < 4)
        if i < 4 and doubt == CONTRADICTED:
            since = _residual_since(g, i)
            gone = 0.5 * g.max_unseen[i] < since <= g.still[i] * g.period * _LEAP
        if doubted[i] and gone:
            g.blamed[i], found = 1, True
    for i in range(6):
        if g.blamed[i] != 0 and doubted[i]:
            lose(g, i)
        if i >= 4 and g.trust[i] == LOST:
            observer.bound_disturbance(g, i - 3)
    if found:
        observer.bound_disturbance(g, PHI)
        observer.bound_disturbance(g, THETA)
    return found


@borrowing
def follow_model(g: GuardArrays, doubted: Flags, used: Flags) -> None:
    """What no encoder shows now, because it stands still, moves as the model alone says."""
    for axis in (X, Z):
        if doubted[3 + axis]:
            observer.alone(g, axis)
    doubtful = doubted[0] or doubted[1] or doubted[2] or doubted[3]
    if doubtful and not (used[0] or used[1] or used[2] or used[3]):
        for axis in (Y, PHI, THETA):
            observer.alone(g, axis)
