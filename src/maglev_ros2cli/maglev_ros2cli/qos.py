"""Quality of service from the command line, or from those who publish."""

from __future__ import annotations

import copy
from typing import Any

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSPresetProfiles,
    QoSProfile,
    ReliabilityPolicy,
)

from maglev_model.programs.arguments import count, not_negative
from maglev_ros2cli.parser import Parser

POLICIES: dict[str, Any] = {
    'history': HistoryPolicy,
    'reliability': ReliabilityPolicy,
    'durability': DurabilityPolicy,
    'liveliness': LivelinessPolicy,
}
_STRENGTHS: tuple[tuple[str, Any, Any], ...] = (
    ('reliability', ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT),
    ('durability', DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE),
)


def add_arguments(parser: Parser, default: str) -> None:
    """The options ``--qos-*``; ``default`` is the profile that they change."""
    parser.add_argument(
        '--qos-profile',
        choices=[key for key in QoSPresetProfiles.short_keys() if key != 'unknown'],
        help=f'Quality of service preset profile (default: {default})',
    )
    parser.add_argument('--qos-depth', metavar='N', type=count, help='Queue size setting')
    for name, policy in POLICIES.items():
        keys = [key for key in policy.short_keys() if key != 'unknown']
        parser.add_argument(
            f'--qos-{name}', choices=keys, help=f'Quality of service {name} setting'
        )
    parser.add_argument(
        '--qos-liveliness-lease-duration-seconds',
        metavar='SECONDS',
        type=not_negative,
        help='Quality of service liveliness lease duration setting',
    )
    parser.set_defaults(qos_default=default)


def asked(arguments: Any) -> QoSProfile:
    """The profile that the options ask for."""
    preset = QoSPresetProfiles.get_from_short_key(arguments.qos_profile or arguments.qos_default)
    profile = copy.copy(preset)
    for name, policy in POLICIES.items():
        key = getattr(arguments, f'qos_{name}')
        if key is not None:
            setattr(profile, name, policy.get_from_short_key(key))
    if arguments.qos_depth is not None:
        profile.depth = arguments.qos_depth
    lease = arguments.qos_liveliness_lease_duration_seconds
    if lease is not None:
        profile.liveliness_lease_duration = Duration(seconds=lease)
    return profile


def to_hear(node: Node, topic: str, arguments: Any, depth: int) -> QoSProfile:
    """The profile that the options ask for; without any, one that hears every publisher.

    :param depth: how many messages may come between two looks, unless the options say.
    """
    profile = asked(arguments)
    options = [*POLICIES, 'profile', 'depth', 'liveliness_lease_duration_seconds']
    if all(getattr(arguments, f'qos_{name}') is None for name in options):
        profile = matching(node, topic, profile)
    if arguments.qos_depth is None:
        profile.depth = depth
    return profile


def matching(node: Node, topic: str, profile: QoSProfile) -> QoSProfile:
    """A profile with the reliability and durability that all publishers of a topic offer.

    Where they differ that is said, and taken what hears them all.
    """
    offers = [info.qos_profile for info in node.get_publishers_info_by_topic(topic)]
    profile = copy.copy(profile)
    for name, strong, weak in _STRENGTHS if offers else ():
        offered = [getattr(offer, name) for offer in offers]
        setattr(profile, name, strong if all(each == strong for each in offered) else weak)
        if strong in offered and getattr(profile, name) == weak:
            kind = type(strong).__name__
            print(
                f'Some, but not all, publishers are offering {kind}.{strong.name}. Falling back to'
                f' {kind}.{weak.name} as it will connect to all publishers'
            )
    return profile
