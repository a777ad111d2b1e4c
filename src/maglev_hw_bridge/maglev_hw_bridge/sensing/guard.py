"""What is watched at every sample: which encoders can be believed, and where the platen is.

The observer foretells what each encoder reads next. A reading that leaps away from that slipped: it
is put right by as much and goes on being believed, until it leaps again. One that stands still
while the platen moves is stuck, and done without. At lift-off the gap encoders are called by roll.
With one gap in doubt the other three show how the platen moves; with more, the model must agree
with those that are left.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing import observer
from maglev_hw_bridge.sensing.guard_arrays import LOST, SOUND, GuardArrays, gap_residual
from maglev_hw_bridge.sensing.leaps import PROBATION, find_leaps
from maglev_hw_bridge.sensing.observer import Flags
from maglev_hw_bridge.sensing.standing_still import (
    SETTLING,
    await_lift_off,
    call_the_roll,
    doubt,
    find_stuck,
    follow_model,
    listen,
    look,
    lose,
)
from maglev_model.axes import PHI, THETA, FloatArray, Y
from maglev_model.compiled import borrowing, compiled
from maglev_model.compiled.arrays import copy_to
from maglev_model.compiled.records import Block

# What watch() returns.
FINE: Final = 0
JUMP: Final = 1
STUCK: Final = 2
RESIDUAL: Final = 3
GAP_RANGE: Final = 4
RANGE: Final = 5
MOTORS: Final = 6

_RESIDUAL_SAMPLES = 2
_UNEXPLAINED = 0.01  # [s]
_BEGUN = 2  # samples for position and rate
_LEAPT = 2.5e-4  # more than this while the boards start is no motion of what rests [m]
_IMPOSSIBLE = 0.01  # so far beyond its stop, tilts and all, an encoder reads no place [m]


@borrowing
def _out_of_range(g: GuardArrays) -> tuple[int, int]:
    for axis in range(5):
        if not g.soft_lower[axis] <= g.position[axis] <= g.soft_upper[axis]:
            return RANGE, axis
    for i in range(4):
        if not g.gap_lower <= g.believed[i] <= g.gap_upper:
            return GAP_RANGE, i
    return FINE, 0


@borrowing
def _contradiction(g: GuardArrays) -> bool:
    """Whether four gaps that are believed cannot be those of a rigid platen."""
    for i in range(4):
        if g.trust[i] == LOST or g.probation[i] > 0:
            return False
    g.contradictions = g.contradictions + 1 if abs(gap_residual(g.believed)) > g.max_residual else 0
    return bool(g.contradictions >= _RESIDUAL_SAMPLES)


@borrowing
def _unexplained(g: GuardArrays) -> int:
    """The axis that sound encoders show to move otherwise than commanded, or -1."""
    seen = not observer.supported(g, Y) and g.samples >= g.settling
    for i in range(6):
        seen = seen and g.trust[i] == SOUND
    for axis in range(5):
        large = seen and abs(g.disturbance[axis]) > g.max_unexplained[axis]
        g.unexplained[axis] = g.unexplained[axis] + 1 if large else 0
        if g.unexplained[axis] >= g.unexplainable:
            return axis
    return -1


@borrowing
def _lose_impossible(g: GuardArrays) -> bool:
    """Do without what reads where no platen can be, or can have come to; whether there is some."""
    found = False
    for i in range(6):
        axis = Y if i < 4 else i - 3
        room = max(g.lower[axis] - g.believed[i], g.believed[i] - g.upper[axis])
        leapt = abs(g.believed[i] + g.offset[i] - g.expected[i]) > _LEAPT
        if g.trust[i] != LOST and (room > _IMPOSSIBLE or leapt):
            g.trust[i], g.blamed[i], found = LOST, 1, True
        g.expected[i] = math.nan
    return found


@compiled
def _begin(g: GuardArrays) -> int:
    """Take the first samples for the platen's position and rate; returns a code.

    What rests on the lower stop does not move: noise would look like speed, a slip like a jerk.
    """
    if g.samples == 0:
        lost = _lose_impossible(g)
        observer.start(g, g.believed)
        copy_to(g.believed, g.past[0])
        g.residual_then[:] = gap_residual(g.believed)
        await_lift_off(g)
        return JUMP if lost else FINE
    before = g.position.copy()
    if observer.supported(g, Y):
        g.step[:] = 0.0
        found = find_leaps(g)
        observer.start(g, g.believed)
        return JUMP if found else FINE
    observer.start(g, g.believed)
    for axis in range(5):
        g.rate[axis] = g.model_rate[axis] = (g.position[axis] - before[axis]) / g.period
    return FINE


@compiled
def _judge(g: GuardArrays, current: FloatArray, flying: bool) -> int:
    """Predict, find what is wrong with the encoders, correct; returns a code."""
    counted, doubted, used = np.empty(6, np.bool_), np.empty(6, np.bool_), np.empty(6, np.bool_)
    observer.predict(g, current)
    code = JUMP if find_leaps(g) else FINE
    look(g, flying, counted)
    missing = call_the_roll(g, flying, counted)
    against = doubt(g, flying, doubted)
    if (find_stuck(g, doubted, against) or missing) and code == FINE:
        code = STUCK
    for i in range(6):
        used[i] = g.trust[i] != LOST and g.probation[i] == 0 and not doubted[i]
    follow_model(g, doubted, used)
    observer.correct(g, g.believed, used, counted)
    for i in range(6):
        if g.trust[i] == LOST:
            g.believed[i] = g.length[i]
    if _contradiction(g) and code == FINE:
        code = RESIDUAL
    return code


@compiled
def watch(
    block: Block, length: FloatArray, current: FloatArray, flying: bool, behind: int
) -> tuple[int, int]:
    """Judge one sample: ``length`` (6,), gaps 1..4, x, z [m], after ``current`` (12,) flowed [A].

    Returns a code and the first encoder, or the axis, it is about; ``blamed`` has all encoders.
    Updates position, rate and what is believed. Range and stuck encoders count in flight. So many
    samples ``behind`` its tick, an encoder that is read at once has moved on by as many steps.
    """
    g: GuardArrays = block[0]
    g.residual = gap_residual(length)
    for i in range(6):
        g.blamed[i] = 0
        g.believed[i] = length[i] - g.offset[i]
        if behind > 0 and g.samples >= _BEGUN:
            g.believed[i] -= behind * g.at_once[i] * g.step[i]
    listen(g)
    index = 0
    code = _begin(g) if g.samples < _BEGUN else _judge(g, current, flying)
    for i in range(5, -1, -1):
        if g.blamed[i] != 0:
            index = i
    if code == FINE and flying:
        axis = _unexplained(g)
        if axis >= 0:
            code, index = MOTORS, axis
        else:
            code, index = _out_of_range(g)
    copy_to(g.past[0], g.past[1])
    copy_to(g.believed, g.past[0])
    g.samples = g.samples + 1 if math.isfinite(np.sum(g.position)) else 0
    return code, index


@borrowing
def _lose(block: Block, encoder: int) -> None:
    """See :meth:`Guard.lose`."""
    g: GuardArrays = block[0]
    lose(g, encoder)
    g.blamed[encoder] = 1
    if encoder < 4:
        observer.bound_disturbance(g, PHI)
        observer.bound_disturbance(g, THETA)
        return
    g.position[encoder - 3] = g.believed[encoder]
    g.rate[encoder - 3] = g.disturbance[encoder - 3] = 0.0


class Guard:
    """Watches the encoders; :attr:`arrays` serve compiled code."""

    def __init__(self, parameters: BridgeParameters) -> None:
        fault = parameters.fault

        def samples(time: float) -> int:
            return max(round(time / parameters.sample_time), 2)  # one alone may be noise

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
            max_unexplained=fault.unexplained,
            settling=samples(SETTLING),
            on_probation=samples(PROBATION),
            unexplainable=samples(_UNEXPLAINED),
            at_once=[float(board != 0) for board in parameters.encoder.board],
            expected=(math.nan,) * 6,
        )

    def forget(self, length: FloatArray | None = None) -> None:
        """Begin anew with the next sample; what an encoder lost it has lost until :meth:`trust`.

        One that reads ``length`` (6,) [m] right before it, by much other than in it, is lost.
        """
        g = self.arrays
        g.expected[:] = math.nan if length is None else length
        g.samples = g.contradictions = 0
        g.unseen[:] = g.step[:] = g.rate[:] = 0.0
        g.silent[:] = 0

    def settle(self) -> None:
        """Find the disturbance anew: no encoder is judged to be stuck for the next samples."""
        self.arrays.samples = min(self.arrays.samples, _BEGUN)

    def trust(self) -> None:
        """Believe every encoder again: they have just been homed."""
        self.forget()
        self.arrays.rises_at = math.nan
        self.arrays.trust[:] = SOUND
        self.arrays.stood[:] = 0
        self.arrays.probation[:] = 0
        self.arrays.offset[:] = 0.0

    def watch(
        self, length: FloatArray, current: FloatArray, flying: bool, behind: int = 0
    ) -> tuple[int, int]:
        """Judge one sample; see :func:`watch`."""
        return watch(self.arrays.block, length, current, flying, behind)

    def lose(self, *encoders: int) -> None:
        """Do without these from now on; x (4) and z (5) rest where they were read."""
        self.arrays.blamed[:] = 0
        for encoder in encoders:
            _lose(self.arrays.block, encoder)

    @property
    def returned(self) -> bool:
        """Whether x or z, thought to be stuck, is believed again since the last sample."""
        return self.arrays.returned

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
