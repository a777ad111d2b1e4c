"""``ros2 param``: the parameters of nodes."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import yaml
from rcl_interfaces.msg import Parameter, ParameterDescriptor, ParameterType, SetParametersResult
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.parameter import (
    get_parameter_value,
    parameter_dict_from_yaml_file,
    parameter_value_to_python,
)

from maglev_node.polling import PollingNode
from maglev_ros2cli.graph import add_node_verb, ask, graph, graph_with, nodes, services
from maglev_ros2cli.parser import CommandError, Parser, Verbs, complete

_TYPES = {
    ParameterType.PARAMETER_NOT_SET: ('not set', 'Parameter not set.'),
    ParameterType.PARAMETER_BOOL: ('boolean', 'Boolean value is:'),
    ParameterType.PARAMETER_INTEGER: ('integer', 'Integer value is:'),
    ParameterType.PARAMETER_DOUBLE: ('double', 'Double value is:'),
    ParameterType.PARAMETER_STRING: ('string', 'String value is:'),
    ParameterType.PARAMETER_BYTE_ARRAY: ('byte array', 'Byte values are:'),
    ParameterType.PARAMETER_BOOL_ARRAY: ('boolean array', 'Boolean values are:'),
    ParameterType.PARAMETER_INTEGER_ARRAY: ('integer array', 'Integer values are:'),
    ParameterType.PARAMETER_DOUBLE_ARRAY: ('double array', 'Double values are:'),
    ParameterType.PARAMETER_STRING_ARRAY: ('string array', 'String values are:'),
}
"""What types are called, and how a value of one is introduced."""


def add(parser: Parser) -> None:
    verbs = Verbs(parser)
    verb = add_node_verb(
        verbs, 'describe', describe, 'Show descriptive information about parameters'
    )
    _add_parameter_name(verb, 'parameter_names', nargs='+')
    add_node_verb(verbs, 'dump', dump, 'Show all of the parameters of a node in a YAML file format')
    verb = add_node_verb(verbs, 'get', get, 'Get parameter')
    _add_parameter_name(verb, 'parameter_name')
    verb.flag('--hide-type', help='Hide the type information')
    verb = add_node_verb(verbs, 'list', list_, 'Output a list of available parameters', nargs='?')
    verb.add_argument(
        '--param-prefixes', nargs='+', default=[], help='Only parameters with these prefixes'
    )
    verb.flag('--param-type', help='Also print the types')
    verb = add_node_verb(verbs, 'load', load, 'Load parameter file for a node')
    verb.add_argument('parameter_file', type=Path, help='Parameter file')
    verb.flag('--no-use-wildcard', help="Leave out what is given for '/**'")
    verb = add_node_verb(verbs, 'set', set_, 'Set parameter')
    _add_parameter_name(verb, 'parameter_name')
    verb.add_argument('value', help='Value of the parameter')


def _add_parameter_name(verb: Parser, name: str, **options: Any) -> None:
    argument = verb.add_argument(name, help='Name of the parameter', **options)

    def known(given: Any) -> list[str]:
        with graph_with(given) as (own, full):
            return _names(own, full)

    complete(argument, known)


def list_(arguments: Any) -> None:
    if arguments.node_name:
        with graph_with(arguments) as (own, full):
            _print_names(own, full, arguments)
        return
    with graph(arguments) as own:
        there = services(own)
        for name in nodes(own, hidden=arguments.include_hidden_nodes):
            if f'{name.full}/list_parameters' in there:
                print(f'{name.full}:')
                _print_names(own, name.full, arguments)


def _print_names(own: PollingNode, full: str, arguments: Any) -> None:
    names = _names(own, full, arguments.param_prefixes)
    types = _types(own, full, names) if arguments.param_type else {}
    for name in names:
        print(f'  {name} (type: {types[name]})' if types else f'  {name}')


def get(arguments: Any) -> None:
    with graph_with(arguments) as (own, full):
        values = _values(own, full, [arguments.parameter_name])
    if not values:
        raise CommandError('Parameter not set')
    label = _TYPES[values[0].type][1]
    value = parameter_value_to_python(values[0])
    if arguments.hide_type:
        print(value)
    else:
        print(label) if value is None else print(label, value)


def set_(arguments: Any) -> None:
    """One value; what the node refuses is said on stderr, with exit code 0 as in ros2cli."""
    parameter = Parameter(name=arguments.parameter_name, value=get_parameter_value(arguments.value))
    with graph_with(arguments) as (own, full):
        (result,) = _set(own, full, [parameter])
    _tell(result, 'Set parameter successful', 'Setting parameter failed')


def load(arguments: Any) -> None:
    with graph_with(arguments) as (own, full):
        try:
            given = parameter_dict_from_yaml_file(
                str(arguments.parameter_file), not arguments.no_use_wildcard, [full]
            )
        except (OSError, RuntimeError, yaml.YAMLError) as error:
            raise CommandError(str(error)) from error
        except (AttributeError, TypeError) as error:  # what its reader makes of any other YAML
            raise CommandError(f"'{arguments.parameter_file}' is no parameter file") from error
        parameters = list(given.values())
        results = _set(own, full, parameters)
    for parameter, result in zip(parameters, results, strict=True):
        name = parameter.name
        _tell(result, f'Set parameter {name} successful', f'Set parameter {name} failed')


def describe(arguments: Any) -> None:
    with graph_with(arguments) as (own, full):
        descriptors = _descriptors(own, full, arguments.parameter_names)
    for descriptor in descriptors:
        print('\n'.join(_description(descriptor)))


def dump(arguments: Any) -> None:
    with graph_with(arguments) as (own, full):
        names = _names(own, full)
        values = _values(own, full, names)
    tree: dict[str, Any] = {}
    for name, value in zip(names, values, strict=True):
        *groups, last = name.split('.')
        branch = tree
        for group in groups:
            branch = branch.setdefault(group, {})
        plain = parameter_value_to_python(value)
        branch[last] = list(plain) if value.type >= ParameterType.PARAMETER_BYTE_ARRAY else plain
    print(yaml.dump({full: {'ros__parameters': tree}}, default_flow_style=False))


# -- services --------------------------------------------------------------------------------------


def _names(own: PollingNode, full: str, prefixes: tuple[str, ...] = ()) -> list[str]:
    request = ListParameters.Request(prefixes=list(prefixes))
    response = ask(own, ListParameters, f'{full}/list_parameters', request)
    return sorted(response.result.names)


def _values(own: PollingNode, full: str, names: list[str]) -> list[Any]:
    request = GetParameters.Request(names=names)
    return list(ask(own, GetParameters, f'{full}/get_parameters', request).values)


def _set(own: PollingNode, full: str, parameters: list[Parameter]) -> list[SetParametersResult]:
    request = SetParameters.Request(parameters=parameters)
    return list(ask(own, SetParameters, f'{full}/set_parameters', request).results)


def _descriptors(own: PollingNode, full: str, names: list[str]) -> list[ParameterDescriptor]:
    request = DescribeParameters.Request(names=names)
    return list(ask(own, DescribeParameters, f'{full}/describe_parameters', request).descriptors)


def _types(own: PollingNode, full: str, names: list[str]) -> dict[str, str]:
    return {each.name: _TYPES[each.type][0] for each in _descriptors(own, full, names)}


# -- output ----------------------------------------------------------------------------------------


def _tell(result: SetParametersResult, success: str, failure: str) -> None:
    text = success if result.successful else failure
    reason = f': {result.reason}' if result.reason else ''
    print(text + reason, file=sys.stdout if result.successful else sys.stderr)


def _description(descriptor: ParameterDescriptor) -> list[str]:
    lines = [f'Parameter name: {descriptor.name}', f'  Type: {_TYPES[descriptor.type][0]}']
    if descriptor.description:
        lines.append(f'  Description: {descriptor.description}')
    lines.append('  Constraints:')
    if descriptor.read_only:
        lines.append('    Read only: true')
    for bounds in [*descriptor.floating_point_range, *descriptor.integer_range][:1]:
        lines += [f'    Min value: {bounds.from_value}', f'    Max value: {bounds.to_value}']
        if bounds.step:
            lines.append(f'    Step: {bounds.step}')
    if descriptor.additional_constraints:
        lines.append(f'    Additional constraints: {descriptor.additional_constraints}')
    return lines
