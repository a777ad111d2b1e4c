"""Parameters that only a node has: the library, which has none of them, leaves them in a file."""

from __future__ import annotations

from typing import Final

_EVERY: Final = (
    'effective_parameters',
    'processors',
    'qos_overrides',  # these two are ROS's own
    'start_type_description_service',
    'use_sim_time',
)
_LOOP: Final = (*_EVERY, 'mode', 'realtime_priority', 'watchers')
_STAGE: Final = (*_LOOP, 'answer_timeout', 'autostart', 'first_sequence')

NODE_ONLY: Final = {
    'plant': (*_STAGE, 'overrun_limit'),
    'hw_bridge': _STAGE,
    'controller': (*_LOOP, 'enabled', 'measurement_timeout', 'reference_timeout'),
    'reference': (*_LOOP, 'autostart', 'exit_at_end', 'lead', 'poll_period', 'timeout'),
}
"""By node: names, or the first part of names."""
