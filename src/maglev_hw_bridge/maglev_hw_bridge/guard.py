"""What is watched at every sample: whether the encoders can be believed and where the platen is.

The first encoder that fails can mostly be done without, long enough for a landing: a rigid platen's
gap follows from the other three, and what x or z jumped by is known. A second one cannot, nor x or
z that stands still in motion, nor gaps that contradict each other and none stands out.
"""

from __future__ import annotations

import math
from typing import Annotated, Final

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.axes import FloatArray
from maglev_model.compiled import compiled
from maglev_model.machine import machine_constants
from maglev_model.machine_array import MachineArray, machine_from_array
from maglev_model.motor import attraction_coefficients
from maglev_model.platen import outputs_from_gaps
from maglev_model.records import Block, Record

# What watch() returns.
FINE: Final = 0
JUMP: Final = 1
STUCK: Final = 2
RESIDUAL: Final = 3
GAP_RANGE: Final = 4
RANGE: Final = 5

NONE: Final = -1
"""No encoder is done without."""

_AHEAD = 1e-3  # [s]
_SLOW_BANDWIDTH = 100.0  # [rad/s]
_RESIDUAL_SAMPLES = 2
_SLIP = 1e-4  # [m]
_STOP_MARGIN = 3e-4  # this near a horizontal stop a force need not move the platen [m]


class GuardArrays(Record):
    """What :func:`watch` takes: bounds, and what it has seen; lengths are gaps 1..4, x, z [m]."""

    machine: MachineArray
    period: float  # [s]
    rate_gain: float  # share of a new difference quotient in the rate
    slow_rate_gain: float  # likewise in the rate that a stuck encoder is judged by
    max_jump: float  # [m]
    max_residual: float  # [m]
    max_unseen_gap: float  # [m]
    max_unseen: float  # [m]
    friction: float  # [m/s²]
    gap_lower: float  # [m]
    gap_upper: float  # [m]
    horizontal_stop: Annotated[FloatArray, 2]  # of x, z [m]
    lower: Annotated[FloatArray, 5]  # y, x, z, phi, theta [m, rad]
    upper: Annotated[FloatArray, 5]

    believed: Annotated[FloatArray, 6]  # lengths, put right where one encoder fails
    mended: int  # the encoder that is done without, or NONE
    offset: float  # what x or z reads too much [m]
    just_mended: bool  # since this sample
    past: Annotated[FloatArray, 2, 6]  # believed lengths of the last sample and the one before
    samples: int  # seen
    contradictions: int  # samples in a row with too large a residual
    residual: float  # g1 + g3 - g2 - g4 as it is read [m]
    # Gaps: what the other three told at its last change; x, z: how far it should have moved since.
    still: Annotated[FloatArray, 6]
    slow_rate: Annotated[FloatArray, 2]  # of x, z, that a stuck encoder is judged by [m/s]
    i_q: Annotated[FloatArray, 4]  # put out last [A]
    position: Annotated[FloatArray, 5]  # y, x, z, phi, theta [m, rad]
    rate: Annotated[FloatArray, 5]  # [m/s, rad/s]
    gap_rate: Annotated[FloatArray, 4]  # [m/s]


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
        if g.samples == 0 or length[i] != g.past[0, i]:
            g.still[i] = others
        elif abs(others - g.still[i]) > g.max_unseen_gap:
            return i
    return -1


@compiled
def _push(g: GuardArrays, length: FloatArray, axis: int) -> float:
    """Acceleration of x (0) or z (1) by the currents put out last, (1), (6) [m/s²]."""
    machine = machine_from_array(g.machine)
    force = 0.0
    for motor in range(1 - axis, 4, 2):
        gap = min(max(length[motor], g.gap_lower), g.gap_upper)
        _, _, k_h = attraction_coefficients(machine, gap)
        force -= k_h * g.i_q[motor]
    return float(force / (machine.M_x if axis == 0 else machine.M_z))


@compiled
def _stuck_horizontal(g: GuardArrays, length: FloatArray, axis: int) -> bool:
    """Whether x (0) or z (1) stands still although speed and force should have moved it.

    The speed follows the force and, while the encoder counts, what it counts.
    """
    if g.samples == 0:
        return False
    i, period = 4 + axis, g.period
    step = length[i] - g.past[0, i]
    speed = g.slow_rate[axis] + _push(g, length, axis) * period
    if step != 0.0 or abs(length[i]) > g.horizontal_stop[axis] - _STOP_MARGIN:
        g.slow_rate[axis] = speed + g.slow_rate_gain * (step / period - speed)
        g.still[i] = 0.0
        return False
    speed = math.copysign(max(abs(speed) - g.friction * period, 0.0), speed)
    g.slow_rate[axis] = speed
    g.still[i] += speed * period
    return bool(abs(g.still[i]) > g.max_unseen)


@compiled
def _believe(g: GuardArrays, length: FloatArray) -> None:
    """Fill in what is believed of the lengths (6,) that are read [m]."""
    g.believed[:] = length
    if g.mended >= 4:
        g.believed[g.mended] -= g.offset
    elif g.mended != NONE:
        g.believed[g.mended] = _others(length, g.mended)


@compiled
def _mend(g: GuardArrays, length: FloatArray, code: int, encoder: int) -> bool:
    """Do without an encoder from now on; whether that can be done."""
    if g.mended != NONE or (code == STUCK and encoder >= 4):
        return False
    g.mended, g.just_mended = encoder, True
    if encoder >= 4:
        g.offset = length[encoder] - _foreseen(g, encoder)
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
    if g.samples == 0:
        return
    gain, period = g.rate_gain, g.period
    for axis in range(5):
        g.rate[axis] += gain * ((g.position[axis] - before[axis]) / period - g.rate[axis])
    for i in range(4):
        quotient = (g.believed[i] - g.past[0, i]) / period
        g.gap_rate[i] += gain * (quotient - g.gap_rate[i])


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
    for axis in range(5):
        if not g.lower[axis] <= g.position[axis] <= g.upper[axis]:
            return RANGE, axis
    for i in range(4):
        if not g.gap_lower <= length[i] <= g.gap_upper:
            return GAP_RANGE, i
    return FINE, 0


@compiled
def _foreseen(g: GuardArrays, i: int) -> float:
    """What the two samples before foretell of a length [m]."""
    return float(2.0 * g.past[0, i] - g.past[1, i])


@compiled
def _unbelievable(g: GuardArrays, length: FloatArray, flying: bool) -> tuple[int, int]:
    for i in range(6):
        if i < 4 and i == g.mended:
            continue
        if g.samples >= 2 and abs(length[i] - _foreseen(g, i)) > g.max_jump:
            return JUMP, i
    stuck = _stuck_gap(g, length)
    for axis in range(2):
        if _stuck_horizontal(g, length, axis):
            stuck = 4 + axis
    if flying and stuck >= 0:
        return STUCK, stuck
    return FINE, 0


@compiled
def watch(block: Block, length: FloatArray, flying: bool) -> tuple[int, int]:
    """Judge one sample: ``length`` (6,), gaps 1..4, x, z [m]; updates position and rate.

    Returns a code and the encoder or axis it is about; ``mended`` tells whether the encoder is done
    without from now on. Range and stuck encoders count in flight.
    """
    g: GuardArrays = block[0]
    g.residual = _residual(length)
    g.just_mended = False
    _believe(g, length)
    code, index = _unbelievable(g, g.believed, flying)
    if code == STUCK and _mend(g, length, code, index):
        _estimate_mended(g)
    else:
        if code == JUMP:
            _mend(g, length, code, index)
        _estimate(g)
    contradicting = abs(_residual(g.believed)) > g.max_residual
    g.contradictions = g.contradictions + 1 if contradicting else 0
    if code == FINE and g.contradictions >= _RESIDUAL_SAMPLES:
        code = RESIDUAL
    if code == FINE and flying:
        code, index = _out_of_range(g, g.believed)
    for i in range(6):
        g.past[1, i] = g.past[0, i] if g.samples > 0 else g.believed[i]
        g.past[0, i] = g.believed[i]
    g.samples += 1
    return code, index


class Guard:
    """Watches the encoders; :attr:`arrays` serve compiled code."""

    def __init__(self, parameters: BridgeParameters) -> None:
        fault, machine = parameters.fault, parameters.machine
        period = parameters.sample_time
        self.arrays = GuardArrays(
            machine=machine_constants(machine),
            period=period,
            rate_gain=-math.expm1(-parameters.landing.rate_bandwidth * period),
            slow_rate_gain=-math.expm1(-_SLOW_BANDWIDTH * period),
            max_jump=fault.jump,
            max_residual=fault.residual,
            max_unseen_gap=fault.stuck_gap,
            max_unseen=fault.stuck_horizontal,
            friction=fault.friction,
            gap_lower=fault.gap_lower,
            gap_upper=fault.gap_upper,
            horizontal_stop=(machine.x_max, machine.z_max),
            lower=fault.lower,
            upper=fault.upper,
            mended=NONE,
        )

    def forget(self) -> None:
        """Begin anew: the next sample is the first."""
        g = self.arrays
        g.samples = g.contradictions = 0
        g.mended, g.offset, g.just_mended = NONE, 0.0, False
        for array in (g.slow_rate, g.rate, g.gap_rate, g.i_q, g.still):
            array[:] = 0.0

    def watch(self, length: FloatArray, flying: bool) -> tuple[int, int]:
        """Judge one sample; see :func:`watch`."""
        return watch(self.arrays.block, length, flying)

    @property
    def residual(self) -> float:
        """``g1 + g3 - g2 - g4`` of the last sample, as it was read [m]."""
        return self.arrays.residual

    @property
    def mended(self) -> bool:
        """Whether what the last sample found wrong with an encoder is put right from then on."""
        return self.arrays.just_mended
