"""What is watched at every sample: whether the encoders can be believed and where the platen is.

The first encoder that fails can mostly be done without, long enough for a landing: a rigid platen's
gap follows from the other three, and what x or z jumped by is known. A second one cannot, nor x or
z that stands still in motion, nor gaps that contradict each other and none stands out.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.compiled import compiled
from maglev_model.machine import machine_constants, machine_from_array, machine_to_array
from maglev_model.motor import attraction_coefficients
from maglev_model.platen import outputs_from_gaps

FloatArray = NDArray[np.float64]

# What watch() returns.
FINE: Final = 0
JUMP: Final = 1
STUCK: Final = 2
RESIDUAL: Final = 3
GAP_RANGE: Final = 4
RANGE: Final = 5

# Indices into limits.
PERIOD: Final = 0  # [s]
RATE: Final = 1  # share of a new difference quotient in the rate
SLOW_RATE: Final = 2  # likewise in the rate that a stuck encoder is judged by
MAX_JUMP: Final = 3  # [m]
MAX_RESIDUAL: Final = 4
MAX_UNSEEN_GAP: Final = 5
MAX_UNSEEN: Final = 6
FRICTION: Final = 7  # [m/s²]
GAP_LOWER: Final = 8  # [m]
GAP_UPPER: Final = 9
X_STOP: Final = 10
Z_STOP: Final = 11
LOWER: Final = 12  # y, x, z, phi, theta
UPPER: Final = 17
LIMITS: Final = 22

# Indices into mended.
MENDED: Final = 0  # the encoder that is done without, -1: none
OFFSET: Final = 1  # what x or z reads too much [m]
JUST_NOW: Final = 2  # 1: since this sample

_AHEAD = 1e-3  # [s]
_SLOW_BANDWIDTH = 100.0  # [rad/s]
_RESIDUAL_SAMPLES = 2
_SLIP = 1e-4  # [m]
_STOP_MARGIN = 3e-4  # this near a horizontal stop a force need not move the platen [m]


class GuardArrays(NamedTuple):
    """What :func:`watch` takes."""

    machine: FloatArray  # (24,)
    limits: FloatArray  # (LIMITS,)
    believed: FloatArray  # (6,) lengths, put right where one encoder fails [m]
    mended: FloatArray  # (3,): see the indices above
    past: FloatArray  # (2, 6) believed lengths of the last sample and the one before [m]
    seen: FloatArray  # (2,): samples seen, samples in a row with too large a residual
    residual: FloatArray  # (1,): g1 + g3 - g2 - g4 as it is read [m]
    still: FloatArray  # (6,): gaps: what the others told at its last change; x, z: way unseen [m]
    slow: FloatArray  # (2,) rates of x, z that a stuck encoder is judged by [m/s]
    i_q: FloatArray  # (4,) put out last [A]
    position: FloatArray  # (5,) y, x, z, phi, theta [m, rad]
    rate: FloatArray  # (5,) [m/s, rad/s]
    gap_rate: FloatArray  # (4,) [m/s]


@compiled
def _others(length: FloatArray, i: int) -> float:
    """Gap ``i`` from the other three, which a rigid platen determines."""
    opposite = (i + 2) % 4
    return float(length[(i + 1) % 4] + length[(i + 3) % 4] - length[opposite])


@compiled
def _residual(length: FloatArray) -> float:
    return float(length[0] + length[2] - length[1] - length[3])


@compiled
def _stuck_gap(g: GuardArrays, length: FloatArray) -> int:
    """The gap encoder that stands still although the other three see it move, or -1.

    What one of the others slips in a single sample is no motion.
    """
    slip = _residual(length) - _residual(g.past[0])
    for i in range(4):
        others = _others(length, i)
        if abs(slip) > _SLIP:
            g.still[i] += others - _others(g.past[0], i)
        if g.seen[0] == 0.0 or length[i] != g.past[0, i]:
            g.still[i] = others
        elif abs(others - g.still[i]) > g.limits[MAX_UNSEEN_GAP]:
            return i
    return -1


@compiled
def _push(g: GuardArrays, length: FloatArray, axis: int) -> float:
    """Acceleration of x (0) or z (1) by the currents put out last, (1), (6) [m/s²]."""
    machine = machine_from_array(g.machine)
    force = 0.0
    for motor in range(1 - axis, 4, 2):
        gap = min(max(length[motor], g.limits[GAP_LOWER]), g.limits[GAP_UPPER])
        _, _, k_h = attraction_coefficients(machine, gap)
        force -= k_h * g.i_q[motor]
    return float(force / (machine.M_x if axis == 0 else machine.M_z))


@compiled
def _stuck_horizontal(g: GuardArrays, length: FloatArray, axis: int) -> bool:
    """Whether x (0) or z (1) stands still although speed and force should have moved it.

    The speed follows the force and, while the encoder counts, what it counts.
    """
    if g.seen[0] == 0.0:
        return False
    limits = g.limits
    i, period = 4 + axis, limits[PERIOD]
    step = length[i] - g.past[0, i]
    speed = g.slow[axis] + _push(g, length, axis) * period
    if step != 0.0 or abs(length[i]) > limits[X_STOP + axis] - _STOP_MARGIN:
        g.slow[axis] = speed + limits[SLOW_RATE] * (step / period - speed)
        g.still[i] = 0.0
        return False
    speed = math.copysign(max(abs(speed) - limits[FRICTION] * period, 0.0), speed)
    g.slow[axis] = speed
    g.still[i] += speed * period
    return bool(abs(g.still[i]) > limits[MAX_UNSEEN])


@compiled
def _believe(g: GuardArrays, length: FloatArray) -> None:
    """Fill in what is believed of the lengths (6,) that are read [m]."""
    g.believed[:] = length
    encoder = int(g.mended[MENDED])
    if encoder >= 4:
        g.believed[encoder] -= g.mended[OFFSET]
    elif encoder >= 0:
        g.believed[encoder] = _others(length, encoder)


@compiled
def _mend(g: GuardArrays, length: FloatArray, code: int, encoder: int) -> bool:
    """Do without an encoder from now on; whether that can be done."""
    if g.mended[MENDED] >= 0.0 or (code == STUCK and encoder >= 4):
        return False
    g.mended[MENDED], g.mended[JUST_NOW] = encoder, 1.0
    if encoder >= 4:
        g.mended[OFFSET] = length[encoder] - _foreseen(g, encoder)
    else:
        g.gap_rate[encoder] = _others(g.gap_rate, encoder)
    _believe(g, length)
    return True


@compiled
def _estimate(g: GuardArrays) -> None:
    """Update position and rate from the believed lengths."""
    machine = machine_from_array(g.machine)
    before = g.position.copy()
    outputs_from_gaps(machine, g.believed[:4], g.believed[4], g.believed[5], g.position)
    if g.seen[0] == 0.0:
        return
    share, period = g.limits[RATE], g.limits[PERIOD]
    for axis in range(5):
        g.rate[axis] += share * ((g.position[axis] - before[axis]) / period - g.rate[axis])
    for i in range(4):
        quotient = (g.believed[i] - g.past[0, i]) / period
        g.gap_rate[i] += share * (quotient - g.gap_rate[i])


@compiled
def _estimate_mended(g: GuardArrays) -> None:
    """Position and rate when one gap has just been found not to be what was read for a while."""
    machine = machine_from_array(g.machine)
    outputs_from_gaps(machine, g.believed[:4], g.believed[4], g.believed[5], g.position)
    ahead = g.position.copy()
    gaps = g.believed[:4] + _AHEAD * g.gap_rate
    outputs_from_gaps(machine, gaps, g.believed[4], g.believed[5], ahead)
    for axis in (0, 3, 4):
        g.rate[axis] = (ahead[axis] - g.position[axis]) / _AHEAD


@compiled
def _out_of_range(g: GuardArrays, length: FloatArray) -> tuple[int, int]:
    limits = g.limits
    for axis in range(5):
        if not limits[LOWER + axis] <= g.position[axis] <= limits[UPPER + axis]:
            return RANGE, axis
    for i in range(4):
        if not limits[GAP_LOWER] <= length[i] <= limits[GAP_UPPER]:
            return GAP_RANGE, i
    return FINE, 0


@compiled
def _foreseen(g: GuardArrays, i: int) -> float:
    """What the two samples before foretell of a length [m]."""
    return float(2.0 * g.past[0, i] - g.past[1, i])


@compiled
def _unbelievable(g: GuardArrays, length: FloatArray, flying: bool) -> tuple[int, int]:
    for i in range(6):
        if i < 4 and i == g.mended[MENDED]:
            continue
        if g.seen[0] >= 2.0 and abs(length[i] - _foreseen(g, i)) > g.limits[MAX_JUMP]:
            return JUMP, i
    stuck = _stuck_gap(g, length)
    for axis in range(2):
        if _stuck_horizontal(g, length, axis):
            stuck = 4 + axis
    if flying and stuck >= 0:
        return STUCK, stuck
    return FINE, 0


@compiled
def watch(g: GuardArrays, length: FloatArray, flying: bool) -> tuple[int, int]:
    """Judge one sample: ``length`` (6,), gaps 1..4, x, z [m]; updates position and rate.

    Returns a code and the encoder or axis it is about; ``mended`` tells whether the encoder is done
    without from now on. Range and stuck encoders count in flight.
    """
    g.residual[0] = _residual(length)
    g.mended[JUST_NOW] = 0.0
    _believe(g, length)
    code, index = _unbelievable(g, g.believed, flying)
    if code == STUCK and _mend(g, length, code, index):
        _estimate_mended(g)
    else:
        if code == JUMP:
            _mend(g, length, code, index)
        _estimate(g)
    g.seen[1] = g.seen[1] + 1.0 if abs(_residual(g.believed)) > g.limits[MAX_RESIDUAL] else 0.0
    if code == FINE and g.seen[1] >= _RESIDUAL_SAMPLES:
        code = RESIDUAL
    if code == FINE and flying:
        code, index = _out_of_range(g, g.believed)
    for i in range(6):
        g.past[1, i] = g.past[0, i] if g.seen[0] > 0.0 else g.believed[i]
        g.past[0, i] = g.believed[i]
    g.seen[0] += 1.0
    return code, index


class Guard:
    """Watches the encoders; :attr:`arrays` serve compiled code."""

    def __init__(self, parameters: BridgeParameters) -> None:
        fault, machine = parameters.fault, parameters.machine
        period = parameters.sample_time
        limits = np.zeros(LIMITS)
        limits[PERIOD] = period
        limits[RATE] = -math.expm1(-parameters.landing.rate_bandwidth * period)
        limits[SLOW_RATE] = -math.expm1(-_SLOW_BANDWIDTH * period)
        limits[MAX_JUMP] = fault.jump
        limits[MAX_RESIDUAL] = fault.residual
        limits[MAX_UNSEEN_GAP] = fault.stuck_gap
        limits[MAX_UNSEEN] = fault.stuck_horizontal
        limits[FRICTION] = fault.friction
        limits[GAP_LOWER], limits[GAP_UPPER] = fault.gap_lower, fault.gap_upper
        limits[X_STOP], limits[Z_STOP] = machine.x_max, machine.z_max
        limits[LOWER : LOWER + 5], limits[UPPER : UPPER + 5] = fault.lower, fault.upper
        self.arrays = GuardArrays(
            machine=machine_to_array(machine_constants(machine)),
            limits=limits,
            believed=np.zeros(6),
            mended=np.array([-1.0, 0.0, 0.0]),
            past=np.zeros((2, 6)),
            seen=np.zeros(2),
            residual=np.zeros(1),
            still=np.zeros(6),
            slow=np.zeros(2),
            i_q=np.zeros(4),
            position=np.zeros(5),
            rate=np.zeros(5),
            gap_rate=np.zeros(4),
        )

    def forget(self) -> None:
        """Begin anew: the next sample is the first."""
        a = self.arrays
        for array in (a.seen, a.slow, a.rate, a.gap_rate, a.i_q, a.still):
            array[:] = 0.0
        a.mended[:] = -1.0, 0.0, 0.0

    def watch(self, length: FloatArray, flying: bool) -> tuple[int, int]:
        """Judge one sample; see :func:`watch`."""
        return watch(self.arrays, length, flying)

    @property
    def residual(self) -> float:
        """``g1 + g3 - g2 - g4`` of the last sample, as it was read [m]."""
        return float(self.arrays.residual[0])

    @property
    def mended(self) -> bool:
        """Whether what the last sample found wrong with an encoder is put right from then on."""
        return bool(self.arrays.mended[JUST_NOW])
