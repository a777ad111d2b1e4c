"""What is watched at every sample: which encoders can be believed, and where the platen is.

The observer foretells what each encoder reads next. A reading that leaps away from that slipped: it
is put right by as much and goes on being believed, until it leaps again. One that stands still
while the platen moves is stuck, and done without. At lift-off the gap encoders are called by roll.
With one gap in doubt the other three show how the platen moves; with more, the model must agree
with those that are left.
"""

from __future__ import annotations

import math
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge import observer
from maglev_hw_bridge.observer import Flags, ObserverArrays
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.axes import PHI, THETA, FloatArray, X, Y, Z
from maglev_model.compiled import compiled
from maglev_model.machine_array import machine_from_array
from maglev_model.records import Block

# What watch() returns.
FINE: Final = 0
JUMP: Final = 1
STUCK: Final = 2
RESIDUAL: Final = 3
GAP_RANGE: Final = 4
RANGE: Final = 5

# What speaks against encoders that stand still.
UNSEEN: Final = 1
CONTRADICTED: Final = 2

# What an encoder is.
SOUND: Final = 0
PUT_RIGHT: Final = 1  # after a slip
LOST: Final = 2
NOISY: Final = 3  # x and z that both leap again and again: better than nothing

_RESIDUAL_SAMPLES = 2
_PROBATION = 20  # samples after a slip in which noise would leap again
_BEGUN, _SETTLING = 2, 100  # samples for position and rate, until the disturbance is found
_DOUBT = 2.5e-5  # an encoder that should have moved this far is not followed [m]
_CERTAIN = 1.5  # as many times max_unseen it is stuck whatever the others read
_DOUBTFUL_RESIDUAL = 6e-5  # [m]
_GROUND = 1e-3  # this near the lower stop no gap is at stake any more [m]
_LEAP = 3.5e-5  # in a sample no platen leaves it that fast [m]
_AGREED = 2e-5  # how near the others must read to what is foretold then [m]
_TAMED = 0.2  # how much of what is noisy is believed
_FAR_OFF = 1.5e-3  # what a noisy one says farther off than this is no news [m]


class GuardArrays(ObserverArrays):
    """What :func:`watch` takes: bounds, and what it has seen; lengths are gaps 1..4, x, z [m]."""

    max_jump: float  # [m]
    max_residual: float  # [m]
    max_unseen: Annotated[FloatArray, 6]  # [m]
    roll_call: float  # [m]
    gap_lower: float  # [m]
    gap_upper: float  # [m]
    soft_lower: Annotated[FloatArray, 5]  # y, x, z, phi, theta [m, rad]
    soft_upper: Annotated[FloatArray, 5]

    trust: Annotated[NDArray[np.int8], 6]  # SOUND, PUT_RIGHT, LOST or NOISY
    probation: Annotated[NDArray[np.int8], 6]  # samples that a slip is not followed yet
    offset: Annotated[FloatArray, 6]  # what an encoder reads too much [m]
    blamed: Annotated[NDArray[np.int8], 6]  # found wrong in this sample
    samples: int  # seen
    contradictions: int  # samples in a row with too large a residual
    residual: float  # g1 + g3 - g2 - g4 as it is read [m]
    believed: Annotated[FloatArray, 6]  # lengths, put right or by the observer
    past: Annotated[FloatArray, 2, 6]  # believed lengths of the last sample and the one before
    slip: Annotated[FloatArray, 6]  # what was put right last [m]
    rigid: bool  # whether four believed gaps must be those of a rigid platen
    residual_then: Annotated[FloatArray, 4]  # when a gap encoder counted last [m]
    unseen: Annotated[FloatArray, 6]  # how far it should have moved at least since its last count
    silent: Annotated[NDArray[np.int64], 2]  # samples in flight in which x, z have not counted
    answered: Annotated[NDArray[np.int8], 4]  # gaps that have counted since the platen rested
    left: Annotated[FloatArray, 4]  # and by how much, leaps aside [m]


@compiled
def _residual(length: FloatArray) -> float:
    return float(length[0] + length[2] - length[1] - length[3])


@compiled
def _least_step(g: GuardArrays, i: int) -> float:
    """How far an encoder should at least move in this sample by the model alone [m]."""
    rate = g.least_rate
    if i >= 4:
        return float(g.period * rate[i - 3])
    tilt = machine_from_array(g.machine).r * (rate[PHI] if i % 2 == 0 else -rate[THETA])
    return float(g.period * (rate[Y] + (tilt if i >= 2 else -tilt)))


@compiled
def _at_rest(g: GuardArrays, i: int) -> bool:
    """Whether friction, or the lower stop, may hold an encoder where it is."""
    if i >= 4:
        return bool(g.least_rate[i - 3] == 0.0)
    if not g.rigid and g.position[Y] > g.upper[Y] - _GROUND:
        return True
    return bool(g.least_rate[Y] == 0.0 and g.least_rate[PHI if i % 2 == 0 else THETA] == 0.0)


@compiled
def _drift(g: GuardArrays, i: int) -> float:
    """How far friction may carry what an encoder should read off the model in probation [m]."""
    if i >= 4:
        held = g.friction[i - 3]
    else:
        held = (
            g.friction[Y]
            + machine_from_array(g.machine).r * g.friction[PHI if i % 2 == 0 else THETA]
        )
    return float(0.5 * held * (_PROBATION * g.period) ** 2)


@compiled
def _tame(g: GuardArrays, i: int, error: float) -> None:
    """Believe a little of what is noisy, and nothing where it is far off."""
    g.believed[i] -= (1.0 - _TAMED) * error if abs(error) < _FAR_OFF else error


@compiled
def _leap(g: GuardArrays, i: int, error: float, step: float) -> None:
    """Put an encoder right that leapt; where it leaps again, do without it.

    But where x and z both leap again and again, and count, they are followed slowly: unseen, the
    platen would be pushed along by motors out of phase, faster than it lands.
    """
    if g.trust[i] == SOUND:
        g.trust[i], g.probation[i], g.slip[i] = PUT_RIGHT, _PROBATION, error
        g.offset[i] += error
        g.believed[i] -= error
    elif i >= 4 and g.trust[9 - i] != SOUND and step != 0.0:
        g.trust[i], g.probation[i] = NOISY, 0
        g.offset[i] -= g.slip[i]
        g.believed[i] -= error
    else:
        g.trust[i] = LOST


@compiled
def _slips(g: GuardArrays) -> bool:
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


@compiled
def _look(g: GuardArrays, flying: bool, counted: Flags) -> None:
    """Which encoders counted, and how far each of the others should have moved since it did."""
    residual = _residual(g.believed)
    for i in range(6):
        counted[i] = g.trust[i] != LOST and g.believed[i] != g.past[0, i]
        if i >= 4 and counted[i] and abs(g.unseen[i]) > _DOUBT:
            observer.take_at_its_word(g, i - 3, g.believed[i])
        if counted[i] or not flying or g.samples < _SETTLING or _at_rest(g, i):
            g.unseen[i] = 0.0
        else:
            g.unseen[i] += _least_step(g, i)
        if i < 4 and (counted[i] or not g.rigid):
            g.residual_then[i] = residual
        if i >= 4:
            asked = flying and g.samples >= _SETTLING and g.trust[i] != LOST
            asked = asked and not (counted[i] or observer.supported(g, Y))
            g.silent[i - 4] = g.silent[i - 4] + 1 if asked else 0
        g.probation[i] = max(g.probation[i] - 1, 0)


@compiled
def _await_lift_off(g: GuardArrays) -> None:
    g.answered[:], g.left[:] = int(not observer.supported(g, Y)), 0.0


@compiled
def _roll_call(g: GuardArrays, flying: bool, counted: Flags) -> bool:
    """Do without gap encoders that do not answer when the platen lifts off; whether there are some.

    Two that are stuck look like a tilt, which the controller undoes by one that nobody sees: soon
    neither the others nor, with the stop's support unknown, the model could tell.
    """
    if not flying:
        _await_lift_off(g)
        return False
    called = False
    for i in range(4):
        step = g.believed[i] - g.past[0, i]
        g.answered[i] = max(g.answered[i], int(counted[i]))
        g.left[i] = g.left[i] + step if abs(step) < _LEAP else 0.0
        called = called or (g.trust[i] == SOUND and abs(g.left[i]) > g.roll_call)
    found = False
    for i in range(4):
        if called and g.answered[i] == 0 and g.trust[i] != LOST:
            g.trust[i], g.blamed[i], found = LOST, 1, True
    if found:
        observer.bound_disturbance(g, PHI)
        observer.bound_disturbance(g, THETA)
    return found


@compiled
def _residual_since(g: GuardArrays, i: int) -> float:
    """What four believed gaps contradict each other by since an encoder's last count [m]."""
    return abs(_residual(g.believed) - g.residual_then[i]) if i < 4 and g.rigid else 0.0


@compiled
def _doubt(g: GuardArrays, flying: bool, doubted: Flags) -> int:
    """Which encoders stand still, ``doubted`` (6,), where others or the model say they should not.

    The model is believed against gap encoders when it agrees with the others, or when three of them
    tell without it; otherwise a residual says that some of those are wrong that do not count, where
    it can be one or two. Returns what it was: UNSEEN, CONTRADICTED or 0.
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
    if unseen > 0 and (agreed or certain or (unseen == 1 and g.rigid)):
        return UNSEEN
    told = contradicted == 1 or contradicted == 2
    for i in range(4):
        doubted[i] = told and g.probation[i] == 0 and _residual_since(g, i) > _DOUBTFUL_RESIDUAL
    return CONTRADICTED if told else 0


@compiled
def _stick(g: GuardArrays, doubted: Flags, doubt: int) -> bool:
    """Do without the encoders that are doubted for too long; whether there are new ones."""
    found = False
    for i in range(6):
        gone = abs(g.unseen[i]) > g.max_unseen[i]
        if i < 4 and doubt == CONTRADICTED:
            gone = _residual_since(g, i) > 0.5 * g.max_unseen[i]
        if doubted[i] and gone:
            g.blamed[i], found = 1, True
    for i in range(6):
        if g.blamed[i] != 0 and doubted[i]:
            g.trust[i] = LOST
        if i >= 4 and g.trust[i] == LOST:
            observer.bound_disturbance(g, i - 3)
    if found:
        observer.bound_disturbance(g, PHI)
        observer.bound_disturbance(g, THETA)
    return found


@compiled
def _follow_model(g: GuardArrays, doubted: Flags, used: Flags) -> None:
    """What no encoder shows now, because it stands still, moves as the model alone says."""
    for axis in (X, Z):
        if doubted[3 + axis]:
            observer.alone(g, axis)
    doubtful = doubted[0] or doubted[1] or doubted[2] or doubted[3]
    if doubtful and not (used[0] or used[1] or used[2] or used[3]):
        for axis in (Y, PHI, THETA):
            observer.alone(g, axis)


@compiled
def _out_of_range(g: GuardArrays) -> tuple[int, int]:
    for axis in range(5):
        if not g.soft_lower[axis] <= g.position[axis] <= g.soft_upper[axis]:
            return RANGE, axis
    for i in range(4):
        if not g.gap_lower <= g.believed[i] <= g.gap_upper:
            return GAP_RANGE, i
    return FINE, 0


@compiled
def _contradiction(g: GuardArrays) -> bool:
    """Whether four gaps that are believed cannot be those of a rigid platen."""
    for i in range(4):
        if g.trust[i] == LOST or g.probation[i] > 0:
            return False
    g.contradictions = g.contradictions + 1 if abs(_residual(g.believed)) > g.max_residual else 0
    return bool(g.contradictions >= _RESIDUAL_SAMPLES)


@compiled
def _begin(g: GuardArrays) -> None:
    """Take the first samples for the platen's position and rate."""
    if g.samples == 0:
        observer.start(g, g.believed)
        g.past[0] = g.believed
        g.residual_then[:] = _residual(g.believed)
        _await_lift_off(g)
    else:
        before = g.position.copy()
        observer.start(g, g.believed)
        for axis in range(5):
            g.rate[axis] = g.model_rate[axis] = (g.position[axis] - before[axis]) / g.period


@compiled
def _judge(g: GuardArrays, current: FloatArray, flying: bool) -> int:
    """Predict, find what is wrong with the encoders, correct; returns a code."""
    counted, doubted, used = np.empty(6, np.bool_), np.empty(6, np.bool_), np.empty(6, np.bool_)
    observer.predict(g, current)
    code = JUMP if _slips(g) else FINE
    _look(g, flying, counted)
    missing = _roll_call(g, flying, counted)
    doubt = _doubt(g, flying, doubted)
    if (_stick(g, doubted, doubt) or missing) and code == FINE:
        code = STUCK
    for i in range(6):
        used[i] = g.trust[i] != LOST and g.probation[i] == 0 and not doubted[i]
    _follow_model(g, doubted, used)
    observer.correct(g, g.believed, used, counted)
    for i in range(6):
        if g.trust[i] == LOST:
            g.believed[i] = g.length[i]
    if _contradiction(g) and code == FINE:
        code = RESIDUAL
    return code


@compiled
def watch(block: Block, length: FloatArray, current: FloatArray, flying: bool) -> tuple[int, int]:
    """Judge one sample: ``length`` (6,), gaps 1..4, x, z [m], after ``current`` (12,) flowed [A].

    Returns a code and the first encoder, or the axis, it is about; ``blamed`` has all encoders.
    Updates position, rate and what is believed. Range and stuck encoders count in flight.
    """
    g: GuardArrays = block[0]
    g.residual = _residual(length)
    for i in range(6):
        g.blamed[i] = 0
        g.believed[i] = length[i] - g.offset[i]
    code, index = FINE, 0
    if g.samples < _BEGUN:
        _begin(g)
    else:
        code = _judge(g, current, flying)
        for i in range(5, -1, -1):
            if g.blamed[i] != 0:
                index = i
    if code == FINE and flying:
        code, index = _out_of_range(g)
    g.past[1], g.past[0] = g.past[0], g.believed
    g.samples = g.samples + 1 if math.isfinite(np.sum(g.position)) else 0
    return code, index


@compiled
def lose(block: Block, encoder: int) -> None:
    """See :meth:`Guard.lose`."""
    g: GuardArrays = block[0]
    g.trust[encoder] = LOST
    for i in range(6):
        g.blamed[i] = 1 if i == encoder else 0
    g.position[encoder - 3] = g.believed[encoder]
    g.rate[encoder - 3] = g.disturbance[encoder - 3] = 0.0


class Guard:
    """Watches the encoders; :attr:`arrays` serve compiled code."""

    def __init__(self, parameters: BridgeParameters) -> None:
        fault = parameters.fault
        self.arrays = GuardArrays(
            **observer.observer_fields(parameters),
            max_jump=fault.jump,
            max_residual=fault.residual,
            max_unseen=(fault.stuck_gap,) * 4 + (fault.stuck_horizontal,) * 2,
            roll_call=fault.roll_call,
            gap_lower=fault.gap_lower,
            gap_upper=fault.gap_upper,
            soft_lower=fault.lower,
            soft_upper=fault.upper,
        )

    def forget(self) -> None:
        """Begin anew with the next sample; what an encoder lost it has lost until :meth:`trust`."""
        g = self.arrays
        g.samples = g.contradictions = 0
        g.unseen[:] = g.rate[:] = 0.0
        g.silent[:] = 0

    def settle(self) -> None:
        """Find the disturbance anew: no encoder is judged to be stuck for the next samples."""
        self.arrays.samples = min(self.arrays.samples, _BEGUN)

    def trust(self) -> None:
        """Believe every encoder again: they have just been homed."""
        self.forget()
        self.arrays.trust[:] = SOUND
        self.arrays.probation[:] = 0
        self.arrays.offset[:] = 0.0

    def watch(self, length: FloatArray, current: FloatArray, flying: bool) -> tuple[int, int]:
        """Judge one sample; see :func:`watch`."""
        return watch(self.arrays.block, length, current, flying)

    def lose(self, encoder: int) -> None:
        """Do without an encoder, x (4) or z (5), from now on; its axis rests where it was read."""
        lose(self.arrays.block, encoder)

    @property
    def residual(self) -> float:
        """``g1 + g3 - g2 - g4`` of the last sample, as it was read [m]."""
        return self.arrays.residual

    @property
    def blamed(self) -> list[int]:
        """The encoders that were found wrong in the last sample."""
        return [int(i) for i in np.flatnonzero(self.arrays.blamed)]

    @property
    def failed(self) -> list[int]:
        """The encoders whose zero is lost: they slipped or stood still."""
        return [int(i) for i in np.flatnonzero(self.arrays.trust)]

    @property
    def blind(self) -> Flags:
        """The axes y, x, z, phi, theta (5,) that no encoder shows for sure.

        What slipped once along x or z is believed, but not relied on.
        """
        lost = self.arrays.trust == LOST
        along_z, along_x = 2 - np.count_nonzero(lost[:4:2]), 2 - np.count_nonzero(lost[1:4:2])
        return np.array(
            [
                along_z + along_x == 0,
                self.arrays.trust[4] != SOUND,
                self.arrays.trust[5] != SOUND,
                along_z == 0 or (along_z == 1 and along_x != 2),
                along_x == 0 or (along_x == 1 and along_z == 0),
            ]
        )
