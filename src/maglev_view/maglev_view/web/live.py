"""What is known of a run at this moment. No ROS here."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from maglev_model.axes import AXES, FloatArray
from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import phase_name
from maglev_model.geometry import outputs_of_gaps
from maglev_monitor.metrics.decoding import Records
from maglev_view.frames import Vector, platen_pose
from maglev_view.parameters import WebParameters
from maglev_view.track import Track
from maglev_view.web.history import History

ERROR_LEVEL = 2
"""Diagnostic level from which on a node has a fault (REP-107: ERROR)."""

REMEDIES = {
    'FAULT': 'press Reset, then Enable, then Lift off',
    'DISABLED': 'press Enable, then Lift off',
}
"""Of a controller, by its mode; a stage says its own."""

_FORGOTTEN = 1.0  # what was said of samples so much older than the newest [s]
_PACE_TIME = 1.0  # over which the real-time factor is taken, wall clock [s]


class NodeState(NamedTuple):
    """What a node said of itself last: its level, and what to do where that is an error."""

    level: int
    text: str
    remedy: str = ''


class Live:
    """Takes blocks of samples as they come and keeps what a page shows of them."""

    def __init__(self, parameters: WebParameters) -> None:
        self._parameters = parameters
        width = max(1, round(parameters.window / parameters.bins / parameters.sample_time))
        self.errors = History(len(AXES), parameters.bins, width)
        """Of the last seconds, as measured [m, rad]."""
        self.outputs: FloatArray | None = None
        self.reference: FloatArray | None = None
        """Where the platen is and shall be: y, x, z, phi, theta [m, rad]."""
        self.currents: FloatArray | None = None
        """Amplitudes of the motors' phase currents [A], where somebody commands any."""
        self.load: FloatArray | None = None
        """Used share of each motor amplifier's thermal budget, where that is known."""
        self.phase = self.mode = ''
        self.sequence = -1
        self.late_samples = 0
        self.pace = math.nan
        """Stage time over wall clock."""
        self.nodes: dict[str, NodeState] = {}
        points, step = parameters.path_points, parameters.path_step
        self.flown: Track[Vector] = Track(points, step)
        self.planned: Track[Vector] = Track(points, step)
        self._mark: tuple[int, int] | None = None
        self._heard = -math.inf
        self._told_of: dict[str, int] = {}  # number of the last sample, by topic key

    def take(self, key: str, rows: Records) -> None:
        """Take decoded samples of one topic, by its key."""
        if not len(rows):
            return
        last = rows[-1]
        self._told_of[key] = int(last['sequence'])
        if key == 'measurement':
            self._measured(last)
        elif key == 'controller':
            self._controlled(rows)
        elif key == 'currents':
            self.currents = np.hypot(last['direct_current'], last['quadrature_current'])
        elif key == 'plant':
            self.load = last['thermal_load'].copy()
        elif key == 'reference':
            self.phase = phase_name(int(last['phase']))

    def told(self, node: str, level: int, text: str, values: Mapping[str, str]) -> None:
        """Take what a node says of itself."""
        remedy = values.get('remedy') or REMEDIES.get(values.get('mode', ''), '')
        self.nodes[node] = NodeState(level, text, remedy)
        if 'i2t_load' in values:
            self.load = np.full(4, float(values['i2t_load']))

    @property
    def stage_time(self) -> float:
        """Stage time since sample 0 [s]."""
        return max(0, self.sequence) * self._parameters.sample_time

    @property
    def silence(self) -> float:
        """For how long no sample has come, by the wall clock [s]."""
        return time.monotonic() - self._heard

    def faults(self) -> dict[str, NodeState]:
        """The nodes that have one."""
        return {name: state for name, state in self.nodes.items() if state.level >= ERROR_LEVEL}

    def _measured(self, last: np.void) -> None:
        self._heard = time.monotonic()
        self.sequence, self.late_samples = int(last['sequence']), int(last['late_samples'])
        radius = self._parameters.machine.radius
        outputs = outputs_of_gaps(last['gap'], float(last['x']), float(last['z']), radius)
        if np.isfinite(outputs).all():
            self.outputs = outputs
            where, _ = platen_pose(outputs)
            self.flown.add(where, lambda: where)
        self._keep_pace(self.sequence, int(last['wall_time']))
        self._forget()

    def _forget(self) -> None:
        """What nobody says any more, as of a controller that is gone."""
        oldest = self.sequence - round(_FORGOTTEN / self._parameters.sample_time)
        gone = {key for key, told_of in self._told_of.items() if told_of < oldest}
        if 'controller' in gone:
            self.mode, self.reference = '', None
        if 'currents' in gone:
            self.currents = None
        if 'reference' in gone:
            self.phase = ''

    def _controlled(self, rows: Records) -> None:
        last = rows[-1]
        mode = int(last['mode'])
        self.mode = Mode(mode).name if mode <= max(Mode) else str(mode)
        self.errors.add(rows['sequence'].astype(np.int64), rows['error'])
        reference = last['position'] - last['error']
        if np.isfinite(reference).all():
            self.reference = reference
            where, _ = platen_pose(reference)
            self.planned.add(where, lambda: where)

    def _keep_pace(self, sequence: int, wall_time: int) -> None:
        mark = self._mark
        if mark is None or sequence < mark[0]:
            self._mark = (sequence, wall_time)
            return
        passed = 1e-9 * (wall_time - mark[1])
        if passed > _PACE_TIME:
            self.pace = (sequence - mark[0]) * self._parameters.sample_time / passed
            self._mark = (sequence, wall_time)
