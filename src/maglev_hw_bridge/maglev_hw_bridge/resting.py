"""The platen on its lower stop: whether it rests there, and what moves it where nothing should."""

from __future__ import annotations

import abc

import numpy as np

from maglev_hw_bridge import faults
from maglev_hw_bridge.drivers import Driver
from maglev_hw_bridge.life_cycle import StageLife
from maglev_hw_bridge.mode import Mode
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing.guard_arrays import LOST

_ON_THE_STOP, _AT_REST = 1.8e-5, 1e-2  # nearer the lower stop and slower it rests [m], [m/s]
_NEAR, _STILL, _REST_TIME = 2e-4, 2e-5, 0.1  # so it does where it moves no more there [m, m, s]
_PARKED = 1e-4  # so far at most it moves along x and z in that time where it stands [m]
_CREPT = 0.5  # what it moves in longer it crept, as under the pull of a cable [s]
_SLIDING = 0.1  # faster it is moved, or homed [m/s]
_CORNERS = np.array([[-1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, -1.0]])  # (5): gaps by phi, theta
_HUNG = 2.5e-5  # a gap that far off the lower stop does not touch it [m]
_LEFT, _SOON = 3e-4, 0.02  # what rested and is, or soon will be, farther off has left it [m], [s]


class RestingStage(StageLife):
    """What becomes of a platen to which no current flows; :meth:`_look_for_rest` once a sample."""

    def __init__(self, parameters: BridgeParameters, realtime: bool, driver: Driver | None) -> None:
        """Raises StageError, ParameterError."""
        super().__init__(parameters, realtime, driver)
        self._lower_stop = self.parameters.machine.gap_max
        self._one_count = 1.5 * max(self.parameters.encoder.resolution[4:])  # of x or z [m]
        self._still_samples = 0  # that the platen has stood still near its lower stop,
        self._still_at = 0.0  # and where [m]
        self._rests = False  # has rested there since current flowed last
        self._parked_samples = 0  # that it has stood still along x and z,
        self._parked_at = np.zeros(2)  # and where [m]
        self._was_at = np.zeros(2)  # a sample ago

    @abc.abstractmethod
    def _raise_fault(self, kind: str, reason: str, remedy: str, cut: bool = False) -> None:
        """Latch a fault."""

    def _look_for_rest(self) -> None:
        """Watch a platen that rests: only current, of which there is to be none, moves it away."""
        y = self.guard.arrays.position[0]
        above = self._lower_stop - y
        if above < _NEAR and abs(y - self._still_at) < _STILL:
            self._still_samples += 1
        else:
            self._still_samples, self._still_at = 0, y
        begun = self.guard.arrays.samples > 1  # what rested in a life before may have been moved
        self._rests = begun and not self.flying and (self._rests or self._on_the_stop())
        slides = self._slides()
        if self.mode is not Mode.FOLLOWING or not self._rests:
            return
        if self._leaves():
            self._raise_fault('current', *faults.astray_fault(self.guard))
        elif slides:
            self._raise_fault('current', *faults.slide_fault())

    def _leaves(self) -> bool:
        """Whether a corner of a platen that rested is off the lower stop, or soon will be."""
        state = self.guard.arrays
        tilting = self.parameters.machine.radius * state.rate[3:] @ _CORNERS
        above = self._lower_stop - state.length[:4]
        return bool(np.max(above - _SOON * np.minimum(state.rate[0] + tilting, 0.0)) > _LEFT)

    def _slides(self) -> bool:
        """Whether a platen that stood still for a while is off that place along x or z.

        Who leaps from sample to sample was moved, or homed, while nobody looked.
        """
        if self.flying:
            self._parked_samples = 0
            return False
        place = self.guard.arrays.position[1:3]
        away = float(np.max(np.abs(place - self._parked_at)))
        most = max(_SLIDING * self.sample_time, self._one_count)
        if self.guard.arrays.samples <= 1:
            most = _PARKED
        leapt = float(np.max(np.abs(place - self._was_at))) > most
        parked = self._parked_samples * self.sample_time >= _REST_TIME
        slid = parked and not leapt and away > _LEFT
        if leapt or slid or (away >= _PARKED and not parked):
            self._parked_samples = 0
            self._parked_at[:] = place
        else:
            self._parked_samples += 1
        if self._parked_samples * self.sample_time >= _CREPT:
            self._parked_samples = round(_REST_TIME / self.sample_time)
            self._parked_at[:] = place
        self._was_at[:] = place
        return slid

    def _touches(self) -> bool:
        """Whether the platen is on its lower stop as the observer has it."""
        return self._rests_at(self.guard.arrays.position[0])

    def _rests_at(self, y: float) -> bool:
        slow = abs(self.guard.arrays.rate[0]) < _AT_REST
        return bool(slow and y > self._lower_stop - _ON_THE_STOP)

    def _on_the_stop(self) -> bool:
        """Whether it may well rest there, though the observer has it a little above.

        That one takes no account of what the stop carries, and lags behind the counts where the
        platen has come to rest a moment ago.
        """
        still = self._still_samples * self.sample_time >= _REST_TIME
        return still or self._touches() or self._rests_at(np.min(self.guard.arrays.believed[:4]))

    def _hung(self) -> list[int]:
        """Gap encoders that hang above the lower stop, still for a while, with another one on it.

        Where a controller wants no current any more, which lands by its own clock, the platen is
        down and these are stuck; a landing by them would throw it up again.
        """
        state = self.guard.arrays
        above, believed = self._lower_stop - state.believed[:4], state.trust[:4] != LOST
        hung = believed & (above > _HUNG) & (self.sample_time * state.still >= _REST_TIME)
        seated = believed & (above < _ON_THE_STOP)
        near = self._lower_stop - state.position[0] < _NEAR
        if near and seated.any() and np.all(hung | seated | ~believed):
            return [int(i) for i in np.flatnonzero(hung)]
        return []
