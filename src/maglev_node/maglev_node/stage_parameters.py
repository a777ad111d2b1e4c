"""What the nodes of stages take."""

from __future__ import annotations

import dataclasses

from maglev_model.parameters import parameter
from maglev_node.managed_node import ManagedParameters


@dataclasses.dataclass(frozen=True, kw_only=True)
class StageNodeParameters(ManagedParameters):
    """What every stage's node takes."""

    answer_timeout: float = parameter(
        8.0,
        'lockstep: longest wait for the currents of a sample, wall clock; longer than the'
        " controller's 'reference_timeout'",
        unit='s',
        within=(0.1, 600.0),
    )
    first_sequence: int = parameter(
        0,
        'number of the first sample, to go on where another stage has ended',
        within=(0, 2**62),
        read_only=True,
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class ClockedStageParameters(StageNodeParameters):
    """What the node of a stage takes that has no clock of its own."""

    overrun_limit: float = parameter(
        0.5, 'realtime: the stage gives up when it runs this late', unit='s', within=(0.005, 10.0)
    )
