"""Typed parameters: one frozen dataclass is the table of a node's parameters. No ROS here."""

from maglev_model.parameters.files import (
    DIFFERS,
    differing,
    from_yaml,
    read_argument,
    read_yaml,
    to_yaml,
)
from maglev_model.parameters.table import (
    SHARED_GROUPS,
    ParameterError,
    Spec,
    build,
    for_others,
    group,
    parameter,
    replace,
    specs,
    unknown_parameter,
    values,
)

__all__ = [
    'DIFFERS',
    'SHARED_GROUPS',
    'ParameterError',
    'Spec',
    'build',
    'differing',
    'for_others',
    'from_yaml',
    'group',
    'parameter',
    'read_argument',
    'read_yaml',
    'replace',
    'specs',
    'to_yaml',
    'unknown_parameter',
    'values',
]
