"""From the boards' 32-bit counts to lengths, and homing."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge.parameters import BEYOND_STOPS, BridgeParameters
from maglev_hw_bridge.signal_parameters import ENCODER_NAMES
from maglev_model.axes import FloatArray
from maglev_model.compiled import borrowing
from maglev_model.compiled.records import Block, Record

CountArray = NDArray[np.int32]

_HALF = 2**31
_NEAR_ZERO = 2e-3  # counters that start anew are so near 0, though the platen was pushed [m]
_ELSEWHERE = 1e-4  # farther from there than noise and a platen that settles [m]


class HomingError(RuntimeError):
    """Homing was refused; the message says why and what to do."""


class EncoderArrays(Record):
    """What :func:`decode` takes; six encoders: the gaps of motors 1..4, x, z."""

    scale: Annotated[FloatArray, 6]  # [m/count], with the direction's sign
    zero: Annotated[FloatArray, 6]  # length at total 0 [m]
    last: Annotated[CountArray, 6]  # the counts decoded last
    total: Annotated[NDArray[np.int64], 6]  # counts without roll-over
    length: Annotated[FloatArray, 6]  # [m], the result


@borrowing
def decode(block: Block, counts: CountArray) -> None:
    """Follow ``counts`` (6,) over roll-overs of the 32-bit counters and write ``length`` [m]."""
    encoder: EncoderArrays = block[0]
    for i in range(6):
        step = np.int64(counts[i]) - np.int64(encoder.last[i])
        if step >= _HALF:
            step -= 2 * _HALF
        elif step < -_HALF:
            step += 2 * _HALF
        encoder.last[i] = counts[i]
        encoder.total[i] += step
        encoder.length[i] = encoder.zero[i] + encoder.scale[i] * encoder.total[i]


class Encoders:
    """Six incremental encoders; :attr:`arrays` serve compiled code."""

    def __init__(self, parameters: BridgeParameters) -> None:
        encoder, machine, fault = parameters.encoder, parameters.machine, parameters.fault
        self._lower = np.array([fault.gap_lower] * 4 + [-machine.x_max, -machine.z_max])
        self._upper = np.array([fault.gap_upper] * 4 + [machine.x_max, machine.z_max])
        self._homing = parameters.homing
        self._board = np.array(encoder.board)
        self._rest = machine.gap_max
        self.homed = False
        self.arrays = EncoderArrays(
            scale=np.array(encoder.resolution) * np.array(encoder.direction),
            zero=encoder.zero,
        )

    def start(self, counts: CountArray) -> None:
        """Take ``counts`` (6,) as they are for the totals; call before the first decoding."""
        self.arrays.last[:] = counts
        self.arrays.total[:] = counts
        decode(self.arrays.block, counts)

    def decode(self, counts: CountArray) -> FloatArray:
        """Lengths [m] of gaps 1..4, x, z, shape (6,); the same array at each call."""
        decode(self.arrays.block, counts)
        return self.arrays.length

    def beyond_stops(self) -> str:
        """Which encoder reads what the stops do not let the platen be; empty: none."""
        length = self.arrays.length
        wrong = np.flatnonzero(
            (length < self._lower - BEYOND_STOPS) | (length > self._upper + BEYOND_STOPS)
        )
        if not len(wrong):
            return ''
        name, value = ENCODER_NAMES[wrong[0]], length[wrong[0]]
        return f'encoder {name} reads {value * 1e3:.2f} mm, beyond the stops'

    def home(self, readings: NDArray[np.int32]) -> FloatArray:
        """Define the zeros from readings (n, 6) of a platen at rest in its home position.

        The four gaps are then at the lower stop, x and z where ``homing`` says. Returns by how
        much each zero moved [m], shape (6,). Raises :class:`HomingError`, and changes nothing, when
        the platen is not at rest or when an earlier homing was elsewhere.
        """
        turns = readings.astype(np.int64) - readings[0].astype(np.int64)
        turns = (turns + _HALF) % (2 * _HALF) - _HALF
        spread = np.ptp(turns, axis=0) * np.abs(self.arrays.scale)
        worst = int(np.argmax(spread))
        if spread[worst] > self._homing.spread:
            raise HomingError(
                f'the platen is not at rest: encoder {ENCODER_NAMES[worst]} moves by '
                f'{spread[worst] * 1e6:.0f} um; let it settle, then home again'
            )
        home = np.array([self._rest] * 4 + [self._homing.x, self._homing.z])
        total = readings[-1].astype(np.int64)
        zero = home - self.arrays.scale * total
        here = self.arrays.zero + self.arrays.scale * self._total_at(readings[-1])
        shift = home - here
        worst = int(np.argmax(np.abs(shift)))
        if self.homed and abs(shift[worst]) > self._homing.shift:
            raise HomingError(
                f'encoder {ENCODER_NAMES[worst]} reads {here[worst] * 1e3:.3f} mm where home is '
                f'{home[worst] * 1e3:.3f} mm: put the platen on its lower stop at x = '
                f'{self._homing.x * 1e3:g} mm, z = {self._homing.z * 1e3:g} mm; if it is there, '
                'the encoder lost counts: check its cable, then configure anew'
            )
        self.arrays.zero[:] = zero
        self.homed = True
        self.start(readings[-1])
        return shift

    def doubt_home(self, counts: CountArray) -> None:
        """Be no longer homed if these ``counts`` (6,) of boards that came back have started anew.

        Counters of a board that are near 0, and were elsewhere, have lost where they were. Near it,
        for somebody may have moved the platen since the board had power again.
        """
        after, before = counts.astype(np.int64), self.arrays.total
        resolution = np.abs(self.arrays.scale)
        near = np.abs(after) * resolution < _NEAR_ZERO
        moved = np.abs(after - before) * resolution > _ELSEWHERE
        moved |= (after == 0) & (before != 0)
        for board in set(self._board):
            its = self._board == board
            if near[its].all() and moved[its].any():
                self.homed = False

    def _total_at(self, counts: CountArray) -> NDArray[np.int64]:
        step = counts.astype(np.int64) - self.arrays.last.astype(np.int64)
        total: NDArray[np.int64] = self.arrays.total + (step + _HALF) % (2 * _HALF) - _HALF
        return total
