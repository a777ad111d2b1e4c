"""The parameter table on a ROS node: declared with descriptors, checked, nothing unknown let in."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Container, Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any, TypeVar

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy import parameter_service
from rclpy.node import Node
from rclpy.parameter import Parameter

from maglev_model import parameters as table
from maglev_model.parameters import ParameterError, Spec, for_others, unknown_parameter

T = TypeVar('T')

_ROS_OWN = ('use_sim_time', 'start_type_description_service', 'qos_overrides')


def is_ros_own(name: str) -> bool:
    """Whether a parameter is one that ROS itself gives every node."""
    return name.split('.')[0] in _ROS_OWN


class ParameterService(parameter_service.ParameterService):
    """As rclpy's, but what is to be set is looked at by the table: refused in the same words as
    what a node is started with, and a whole number is one of a double.

    rclpy names neither the parameter nor the value of a wrong type, and a value of a type that
    there is not ends a node.
    """

    def __init__(self, node: Node, parameter_table: type[Any]) -> None:
        super().__init__(node)
        self._specs = table.specs(parameter_table)

    def _set_parameters_callback(self, request: Any, response: Any) -> Any:
        response.results = [self._set([each]) for each in request.parameters]
        return response

    def _set_parameters_atomically_callback(self, request: Any, response: Any) -> Any:
        response.result = self._set(request.parameters)
        return response

    def _set(self, given: Iterable[Any]) -> SetParametersResult:
        node = self._get_node()
        try:
            return node.set_parameters_atomically([self._checked(node, each) for each in given])
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))

    def _checked(self, node: Node, given: Any) -> Parameter:
        """What is given, as the node holds it. Raises ParameterError."""
        name, spec = given.name, self._specs.get(given.name)
        if spec is None and not node.has_parameter(name):
            # No look for the nearest name, which takes 2 to 13 ms, as many samples.
            raise ParameterError(f"there is no parameter '{name}'")
        if node.describe_parameter(name).read_only:
            raise ParameterError(f"parameter '{name}' is read-only: it is given at the start")
        try:
            parameter = Parameter.from_parameter_msg(given)
        except ValueError as error:
            raise ParameterError(f"parameter '{name}' has a value of no type") from error
        if spec is None:
            return parameter
        value = spec.check(_numbers(parameter.value) if spec.kind is float else parameter.value)
        return Parameter(name, _type(spec), list(value) if spec.array else value)


def _numbers(given: Any) -> Any:
    """``1e-05`` is a number in parameter files, but to ``ros2 param set`` and ``load`` a text."""
    if isinstance(given, list):
        return [_numbers(each) for each in given]
    with suppress(ValueError):
        return float(given) if isinstance(given, str) else given
    return given


def _type(spec: Spec) -> Parameter.Type:
    name = spec.type_name.removesuffix('[]').upper()
    return Parameter.Type[f'{name}_ARRAY' if spec.array else name]


def declare(node: Node, name: str, parameter_table: type[T], changeable: Container[str] = ()) -> T:
    """Declare every parameter of a table on a node and return the table as configured.

    Read-only are all but what is ``changeable`` while the node runs.

    It is given what the command line holds for ``name``, its name by itself, and for the name it
    has on the graph: files in their order, then single values. (ROS would not give a node in a
    namespace what is for its name by itself, and would let a file's section for a node win over
    single values when another file had one for all nodes.) A name that is no parameter is refused.
    Raises ParameterError.
    """
    specs = table.specs(parameter_table)
    given = _given(sys.argv, name, node.get_fully_qualified_name())
    if 'use_sim_time' in given:
        node.set_parameters([Parameter('use_sim_time', value=given['use_sim_time'])])
    built = table.build(parameter_table, _ours(given, specs))
    for key, value in table.values(built).items():
        value = list(value) if isinstance(value, tuple) else value
        described = descriptor(specs[key])
        described.read_only |= key not in changeable
        node.declare_parameter(key, value, described, ignore_override=True)
    return built


def _ours(given: Mapping[str, object], specs: Mapping[str, Spec]) -> dict[str, object]:
    """What is given of a table, without what is for others. Raises ParameterError."""
    ours = {
        key: value
        for key, value in given.items()
        if not is_ros_own(key) and not for_others(key, specs)
    }
    for key in ours:
        if key not in specs:
            raise unknown_parameter(key, specs)
    return ours


def _given(arguments: Sequence[str], *names: str) -> dict[str, object]:
    """What a command line gives a node that has these names."""
    files: dict[str, object] = {}
    single: dict[str, object] = {}
    is_ros = False
    for option, value in itertools.pairwise([*arguments, '']):
        if option == '--ros-args':
            is_ros = True
        elif option == '--':
            is_ros = False
        elif is_ros and option == '--params-file':
            files.update(table.read_yaml(value, *names))
        elif is_ros and option in ('-p', '--param'):
            single.update(table.read_argument(value, *names))
    return {**files, **single}


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
