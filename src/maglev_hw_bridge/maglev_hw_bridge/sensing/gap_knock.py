"""Asks gap encoders that have not counted for a while in flight whether they count at all.

Where a platen hovers, some gap or other goes to and fro over the edge of a count. If two or more
are stuck the controller leaves the platen where they do not show, and within friction neither the
others nor the model can tell. So all gaps at once are knocked, by a push along y to and fro, softly
back over the edges that they passed last, then ever harder, until at most one of them has not
answered: what follows that one goes astray where the others and the model show it. Sound ones may
be silent together too, most of all where guides stick: each time they have answered, they are given
twice as long.

Of a machine with a single motor, which guides keep level, every gap shows y. There the controller
goes astray only by all of them, so all must be silent, and one that answers is enough.
"""

from __future__ import annotations

import numpy as np

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing.guard_arrays import LOST, GuardArrays
from maglev_hw_bridge.sensing.knock import Edges, Pushes, hardest_push, samples_to_push
from maglev_model.axes import FloatArray, Y
from maglev_model.compiled import compiled
from maglev_model.machine import Machine, machine_constants
from maglev_model.platen import output_accelerations

# Soft ones cost no time while friction holds; once loose a platen that nobody sees does not stay.
_KNOCKS = (1 / 16, 1 / 11, 1 / 8, 1 / 4, 1 / 2, 1.0)  # of the hardest push
_OPPOSITE = 2.0  # times the patience with others: two gaps of one tilt are silent together for long
_MOST_PATIENT = 128.0  # times that of the beginning, however often they have answered


@compiled
def _lift(machine: Machine, position: FloatArray, i_d: FloatArray, i_q: FloatArray) -> float:
    """Acceleration along y by 1 A of i_d more in every motor [m/s²/A]."""
    y, phi, theta = position[0], position[3], position[4]
    more = output_accelerations(machine, y, phi, theta, i_d + 0.5, i_q)
    less = output_accelerations(machine, y, phi, theta, i_d - 0.5, i_q)
    return float(more[0] - less[0])


class GapKnock:
    """All gaps: :meth:`look` once a sample, then :meth:`added` to what is commanded."""

    def __init__(self, parameters: BridgeParameters) -> None:
        self._patience = round(parameters.fault.gap_silence / parameters.sample_time)
        self._limit = parameters.fault.largest_amplitude
        self._machine = machine_constants(parameters.machine)
        self._one_is_enough = parameters.machine.motors == 1  # that answers, for all gaps show y
        count = max(parameters.encoder.resolution[:4])
        hardest = hardest_push(parameters, Y, count)
        duration = samples_to_push(parameters.sample_time)
        self._pushes = Pushes(hardest, duration, _KNOCKS)
        self._edges = Edges(4)
        self._asked: tuple[int, ...] = ()
        self._samples = 0  # since they are
        self._opposite = False  # whether these are two gaps of one tilt
        self._answered = [0, 0]  # how often, by that
        anywhere = np.full(5, parameters.machine.gap_max)
        _lift(self._machine, anywhere, anywhere, anywhere)  # compiled, or loaded, before it is due

    def look(self, watched: GuardArrays, flying: bool) -> tuple[int, ...]:
        """One sample; which have not counted while all were knocked. Ends with the flight."""
        self._edges.follow(watched.believed[:4])
        if not flying or self._patience == 0:
            self._pushes.under_way = False
            self._answered[:] = 0, 0
            return ()
        if not self._pushes.under_way:
            self._ask(watched)
            return ()
        self._samples += 1
        silent = self._silent(watched, self._samples, self._asked)
        enough = 1 if self._one_is_enough else len(self._asked) - 1
        if self._pushes.go_on(len(self._asked) - len(silent) >= enough):
            return self._silent(watched, self._samples)
        if not self._pushes.under_way:
            self._answered[self._opposite] += 1
        return ()

    @staticmethod
    def _silent(
        watched: GuardArrays, samples: int, gaps: tuple[int, ...] = (0, 1, 2, 3)
    ) -> tuple[int, ...]:
        """Which have not counted for so many samples, though they are believed."""
        silent, trust = watched.silent, watched.trust
        return tuple(i for i in gaps if silent[i] >= samples and trust[i] != LOST)

    def _ask(self, watched: GuardArrays) -> None:
        """Begin to knock where two or more, or all, have been silent for too long."""
        if sorted(watched.silent[:4].tolist())[0 if self._one_is_enough else 2] < self._patience:
            return
        for opposite in (False, True):
            silent = self._silent(watched, self.patience(opposite))
            if len(silent) >= 2 and opposite == (silent in ((0, 2), (1, 3))):
                self._asked, self._opposite, self._samples = silent, opposite, 0
                passed = sum(self._edges.passed[i] for i in silent)
                self._pushes.begin(-1.0 if passed > 0.0 else 1.0)
                return

    def patience(self, opposite: bool) -> int:
        """With two gaps of one tilt, or with others [samples]."""
        longer = min(2.0 ** self._answered[opposite], _MOST_PATIENT)
        return round((_OPPOSITE if opposite else 1.0) * longer * self._patience)

    def added(self, watched: GuardArrays, i_d: FloatArray, i_q: FloatArray) -> FloatArray:
        """``i_d`` (4,) [A] with what knocks: nothing while the motors have nothing left for it."""
        if not self._pushes.under_way:
            return i_d
        lift = _lift(self._machine, watched.position, i_d, i_q)
        pushed: FloatArray = i_d + self._pushes.acceleration / lift
        if np.max(np.hypot(pushed, i_q)) <= self._limit:
            return pushed
        self._pushes.under_way = False
        return i_d
