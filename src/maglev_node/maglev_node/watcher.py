"""A node that takes every sample: behind the loop in lockstep, before other work in real time."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from contextlib import suppress
from typing import Any, TypeVar

from maglev_model.contract.wire import DecodeError, Incoming
from maglev_model.parameters import parameter
from maglev_node import realtime
from maglev_node.node import MaglevNode, NodeParameters
from maglev_node.topics import KEYS, MEASUREMENT

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

    In lockstep the loop waits for nobody that watches, and the process yields to it. In real time
    it must keep up on a machine that works: what a reader has not got is sent to it again, at the
    priority and in the time of the loop.
    """

    def __init__(self, name: str, parameter_table: type[P], **node_options: Any) -> None:
        super().__init__(name, parameter_table, **node_options)
        self._adapted = False

    def adapt_priority(self, measurements: Iterable[bytes]) -> None:
        """Adapt to the mode of the stage once one of the serialized ``measurements`` tells it."""
        for message in measurements:
            if self._adapted:
                return
            with suppress(DecodeError):
                measured: Any = Incoming(KEYS[MEASUREMENT]).read(message)
                self._adapted = True
                if measured.lockstep:
                    realtime.take_niceness(_NICENESS)
                elif self.parameters.realtime_priority > 0:
                    realtime.take_priority(self.parameters.realtime_priority)

    def close(self) -> None:
        """From here on there is time."""
        realtime.give_priority_back()
