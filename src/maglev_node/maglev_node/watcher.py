"""A node that takes every sample: behind the loop in lockstep, before other work in real time."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, TypeVar

from maglev_model.contract.wire import DecodeError, Incoming
from maglev_model.parameters import parameter
from maglev_node import realtime
from maglev_node.node import MaglevNode, NodeParameters
from maglev_node.topics import KEYS, MEASUREMENT, SAMPLE_TOPICS, progress_of, sample_qos

PROGRESS_TOLD = 'published in lockstep: the newest measurement it has taken'
"""What is on the topic of its progress, for ``--help``."""

_NICENESS = 5


@dataclasses.dataclass(frozen=True, kw_only=True)
class WatcherParameters(NodeParameters):
    """What every node takes that watches."""

    realtime_priority: int = parameter(
        10,
        'realtime: SCHED_FIFO priority of the process, where permitted, below those of the loop;'
        ' 0: none',
        within=(0, 98),
        read_only=True,
    )


P = TypeVar('P', bound=WatcherParameters)


class WatcherNode(MaglevNode[P]):
    """Tells from the first measurement it takes how its process stands to the loop's.

    In lockstep the process yields to the loop, and tells it how far it is, for it to wait. In real
    time it must keep up on a machine that works: what a reader has not got is sent to it again, at
    the priority and in the time of the loop.
    """

    def __init__(self, name: str, parameter_table: type[P], **node_options: Any) -> None:
        super().__init__(name, parameter_table, **node_options)
        self._adapted = False
        self._progress: Any = None  # publisher, in lockstep

    def acknowledge(self, taken: Sequence[bytes]) -> None:
        """Tell the stage the last of the serialized measurements that were ``taken``, if any.

        The first that can be read tells the mode of the stage, to which the process adapts.
        """
        if not self._adapted:
            self._adapted = any(map(self._adapt, taken))
        if self._progress is not None and taken:
            self._progress.publish(taken[-1])

    def _adapt(self, message: bytes) -> bool:
        try:
            measured: Any = Incoming(KEYS[MEASUREMENT]).read(message)
        except DecodeError:
            return False
        if measured.lockstep:
            realtime.take_niceness(_NICENESS)
            topic = progress_of(self.get_name())
            self._progress = self.create_publisher(SAMPLE_TOPICS[MEASUREMENT], topic, sample_qos(1))
        elif self.parameters.realtime_priority > 0:
            realtime.take_priority(self.parameters.realtime_priority)
        return True

    def close(self) -> None:
        """From here on there is time."""
        realtime.give_priority_back()
