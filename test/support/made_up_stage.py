"""A made-up stage whose samples are taken, on a node that only notes what it is asked."""

from __future__ import annotations

from typing import Any

import numpy as np
from made_up_node import MadeUpNode

from maglev_model.contract.stage import EncoderSample, Fault, StageError, Truth
from maglev_msgs.msg import Currents
from maglev_node.sampling import Sampling

ZERO = np.zeros(4)
_TRUTH = Truth(np.arange(10.0), ZERO + 1.0, ZERO + 2.0, ZERO + 3.0, np.full(6, 4.0))


class MadeUpStage:
    """Notes its calls; flies from currents until it has been held ``endurance`` times."""

    sample_time = 1e-3
    late = 0.0

    def __init__(self, *, real: bool = False, truth: bool = False) -> None:
        self.paced = self.restartable = real
        self.fault: Fault | None = None
        self.flying = False
        self.calls: list[str] = []
        self.written: list[float] = []
        self.ages: list[int] = []
        self.failing = False
        self.endurance = 3
        self._truth = _TRUTH if truth else None

    def _call(self, name: str) -> None:
        self.calls.append(name)
        if self.failing:
            raise StageError('it is gone')

    def configure(self) -> None:
        self._call('configure')

    def activate(self) -> None:
        self._call('activate')

    def read(self) -> EncoderSample:
        self._call('read')
        return EncoderSample(np.full(4, 0.031), 0.001, 0.002)

    def write(self, direct_current: Any, quadrature_current: Any, age: int = 0) -> None:
        self._call('write')
        if not np.all(np.isfinite(direct_current)):
            raise ValueError('a current is nan')
        self.written.append(float(direct_current[0]))
        self.ages.append(age)
        self.flying = bool(np.any(direct_current)) and self.fault is None

    def hold(self) -> None:
        self._call('hold')
        self.endurance -= 1
        self.flying = self.flying and self.endurance > 0

    def land(self, why: str) -> None:
        self.calls.append(f'land: {why}')

    def stop(self, why: str = 'emergency stop', kind: str = 'stop', remedy: str = '') -> None:
        if self.fault is None:
            self.fault = Fault(kind, why, remedy, not self.restartable)
        self.flying = self.flying and self.restartable  # as the bridge, which lands

    def reset(self) -> tuple[bool, str]:
        cleared, self.fault = self.fault is not None or self.failing, None
        self.failing = False
        return cleared, 'cleared'

    def deactivate(self) -> None:
        self.calls.append('deactivate')

    def close(self) -> None:
        self._call('close')

    def truth(self) -> Truth | None:
        return self._truth


def currents(sequence: int, current: float = 0.0, session: int = 1) -> Currents:
    """What a controller sends for a sample, but for the stamp."""
    status = Currents.FLYING if current else Currents.RESTING
    return Currents(sequence=sequence, direct_current=[current] * 4, session=session, status=status)


def start(stage: MadeUpStage, **parameters: Any) -> tuple[Any, MadeUpNode]:
    node: Any = MadeUpNode(**parameters)
    sampling = Sampling(node, stage)
    sampling.start()
    return sampling, node


def start_realtime(stage: MadeUpStage, **parameters: Any) -> tuple[Any, MadeUpNode]:
    return start(stage, mode='realtime', **parameters)
