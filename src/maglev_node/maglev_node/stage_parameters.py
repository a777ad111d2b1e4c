"""What the nodes of stages take."""

from __future__ import annotations

import dataclasses

from maglev_model.parameters import parameter
from maglev_node.managed_node import ManagedParameters


@dataclasses.dataclass(frozen=True, kw_only=True)
class StageNodeParameters(ManagedParameters):
    """What every stage's node takes."""

    answer_timeout: float = parameter(
        5.0,
        unit='s',
        lower=0.1,
        upper=600.0,
        description='lockstep: longest wait for the currents of a sample, wall clock',
    )
    first_sequence: int = parameter(
        0,
        lower=0,
        upper=2**62,
        description='number of the first sample, to go on where another stage has ended',
        read_only=True,
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class ClockedStageParameters(StageNodeParameters):
    """What the node of a stage takes that has no clock of its own."""

    overrun_limit: float = parameter(
        0.5,
        unit='s',
        lower=0.005,
        upper=10.0,
        description='realtime: the stage gives up when it runs this late',
    )
