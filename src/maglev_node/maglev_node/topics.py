"""Topic names, message types and quality of service: what the nodes agree on.

The names are relative: a node's namespace and remappings say where they are on the graph.
"""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from maglev_model.contract.wire import KEPT, KEY_OF_MESSAGE_TYPE, PROGRESS_SUFFIX
from maglev_msgs.msg import ControllerState, Currents, Measurement, PlantState, Reference

MEASUREMENT = 'stage/measurement'
CURRENTS = 'stage/currents'
REFERENCE = 'reference'
CONTROLLER_STATE = 'controller/state'
TRUE_STATE = 'stage/true_state'
STAGE_PROGRESS = f'stage{PROGRESS_SUFFIX}'
CONTROLLER_PROGRESS = f'controller{PROGRESS_SUFFIX}'
DIAGNOSTICS = 'diagnostics'
CLOCK = 'clock'

SAMPLE_TOPICS: dict[str, type] = {
    MEASUREMENT: Measurement,
    CURRENTS: Currents,
    REFERENCE: Reference,
    CONTROLLER_STATE: ControllerState,
    TRUE_STATE: PlantState,
}
"""The topics that carry one message a sample, with their types."""

KEYS = {
    topic: KEY_OF_MESSAGE_TYPE[f'maglev_msgs/msg/{message_type.__name__}']
    for topic, message_type in SAMPLE_TOPICS.items()
}
"""Their keys in :data:`maglev_model.contract.wire.TOPIC_TYPES`."""

PROGRESS = {STAGE_PROGRESS: MEASUREMENT, CONTROLLER_PROGRESS: CONTROLLER_STATE}
"""The topics for whoever need not hear of every sample, with those they are taken from."""


def progress_of(watcher: str) -> str:
    """The topic on which a node that watches tells the newest measurement it has taken."""
    return f'{watcher}{PROGRESS_SUFFIX}'


PROGRESS_PERIOD = 16
"""Samples from one message on them to the next, in flight."""

SILENCE = {'lockstep': 2.0, 'realtime': 0.5}
"""So long without a measurement, and the stage is taken for stopped [s]."""


def sampled(topic: str) -> str:
    """The sample topic whose messages are on a topic: itself, but for those of progress."""
    if topic.endswith(PROGRESS_SUFFIX):
        return PROGRESS.get(topic, MEASUREMENT)
    return topic


def sample_qos(depth: int = KEPT['lockstep']) -> QoSProfile:
    """Reliable, in order, nothing kept for late joiners: no sample may be lost or come twice.

    ``depth`` samples are kept for a reader that is busy.
    """
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.VOLATILE,
    )


def reference_qos(depth: int = KEPT['lockstep']) -> QoSProfile:
    """As :func:`sample_qos`, but the last ``depth`` samples are kept for a controller to come.

    The reference may see the controller before that sees the reference.
    """
    profile = sample_qos(depth)
    profile.durability = DurabilityPolicy.TRANSIENT_LOCAL
    return profile
