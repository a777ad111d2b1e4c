"""The parameter table on a ROS node: declared with descriptors, checked, nothing unknown let in."""

from __future__ import annotations

import sys
from typing import TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from maglev_model import parameters as table
from maglev_model.parameters import Spec, for_others, unknown_parameter

T = TypeVar('T')

_ROS_OWN = ('use_sim_time', 'start_type_description_service', 'qos_overrides')


def is_ros_own(name: str) -> bool:
    """Whether a parameter is one that ROS itself gives every node."""
    return name.split('.')[0] in _ROS_OWN


def declare(node: Node, parameter_table: type[T]) -> T:
    """Declare every parameter of a table on a node and return the table as configured.

    The node was made with ``automatically_declare_parameters_from_overrides``: so it holds whatever
    files and command line gave, and a name that is no parameter is seen and refused.
    Raises ParameterError.
    """
    specs = table.specs(parameter_table)
    given = {
        name: parameter.value
        for name, parameter in node.get_parameters_by_prefix('').items()
        if not is_ros_own(name)
    }
    ours = {name: value for name, value in given.items() if not for_others(name, specs)}
    for name in ours:
        if name not in specs:
            raise unknown_parameter(name, specs)
    built = table.build(parameter_table, ours)
    for name in given:
        node.undeclare_parameter(name)
    for name, value in table.values(built).items():
        value = list(value) if isinstance(value, tuple) else value
        node.declare_parameter(name, value, descriptor(specs[name]), ignore_override=True)
    return built


def descriptor(spec: Spec) -> ParameterDescriptor:
    """The ROS description of one parameter, with its unit and bounds."""
    text = spec.description + (f' [{spec.unit}]' if spec.unit else '')
    result = ParameterDescriptor(
        name=spec.name,
        description=text,
        read_only=spec.read_only,
        additional_constraints=spec.bounds_text,
        dynamic_typing=spec.array,
    )
    if spec.array or (spec.lower is None and spec.upper is None):
        return result
    if spec.kind is float:
        lower = -sys.float_info.max if spec.lower is None else spec.lower
        upper = sys.float_info.max if spec.upper is None else spec.upper
        result.floating_point_range = [FloatingPointRange(from_value=lower, to_value=upper)]
    elif spec.kind is int:
        lower = -(2**63) if spec.lower is None else int(spec.lower)
        upper = 2**63 - 1 if spec.upper is None else int(spec.upper)
        result.integer_range = [IntegerRange(from_value=lower, to_value=upper)]
    return result
