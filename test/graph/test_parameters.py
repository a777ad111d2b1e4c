"""Parameters of a node that runs, set by whoever can reach it."""

from __future__ import annotations

import math
from typing import Any

import pytest
from graph import Nodes, Observer
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    SetParameters,
    SetParametersAtomically,
)


def of(name: str, **value: Any) -> Parameter:
    """A parameter message, with one field of its value, whose type is told by the name."""
    (field,) = value
    kind = getattr(ParameterType, f'PARAMETER_{field.removesuffix("_value").upper()}')
    return Parameter(name=name, value=ParameterValue(type=kind, **value))


REFUSED = (
    (of('answer_timeout', string_value='soon'), "'answer_timeout' is 'soon' (str), its type is"),
    (of('answer_timeout', double_value=math.nan), "'answer_timeout' is nan, it must be finite"),
    (of('answer_timeout', double_value=0.0), "'answer_timeout' is 0, it must lie in [0.1, 600] s"),
    (of('answer_timout', double_value=1.0), "there is no parameter 'answer_timout'"),
    (of('machine.mass_y', double_value=7.0), "'machine.mass_y' is read-only"),
    (of('mode', string_value='realtime'), "'mode' is read-only"),
    (
        Parameter(name='watchdog', value=ParameterValue(type=77)),
        "'watchdog' has a value of no type",
    ),
    (Parameter(name='watchdog'), "'watchdog' is None"),
)


@pytest.fixture
def plant(nodes: Nodes, observer: Observer) -> Any:
    """Asks a plant's parameter services."""
    nodes.start('plant', 'autostart:=false', params=('benchmark.yaml',))

    def ask(kind: Any, service: str, **request: Any) -> Any:
        client = observer._client(kind, f'/plant/{service}')
        return observer.ask(client, kind.Request(**request))

    return ask


def test_what_is_refused_is_named_and_stays_as_it_was(plant: Any) -> None:
    names = ['answer_timeout', 'watchdog', 'machine.mass_y', 'mode']
    before = plant(GetParameters, 'get_parameters', names=names).values
    given = [parameter for parameter, _ in REFUSED]
    results = plant(SetParameters, 'set_parameters', parameters=given).results
    for (_, said), result in zip(REFUSED, results, strict=True):
        assert not result.successful
        assert said in result.reason
    sound = of('answer_timeout', double_value=9.0)
    for parameter, said in REFUSED:  # of several, all or none
        together = [sound, parameter]
        result = plant(
            SetParametersAtomically, 'set_parameters_atomically', parameters=together
        ).result
        assert not result.successful
        assert said in result.reason
    assert plant(GetParameters, 'get_parameters', names=names).values == before


@pytest.mark.parametrize('given', [{'integer_value': 9}, {'string_value': '9e0'}])
def test_a_double_is_taken_as_in_a_file(plant: Any, given: dict[str, Any]) -> None:
    parameters = [of('answer_timeout', **given)]
    (result,) = plant(SetParameters, 'set_parameters', parameters=parameters).results
    assert result.successful
    (value,) = plant(GetParameters, 'get_parameters', names=['answer_timeout']).values
    assert value == of('answer_timeout', double_value=9.0).value


def test_read_only_is_what_cannot_change(plant: Any) -> None:
    names = ['answer_timeout', 'watchdog', 'machine.mass_y', 'mode']
    told = plant(DescribeParameters, 'describe_parameters', names=names).descriptors
    assert [each.read_only for each in told] == [False, False, True, True]


def test_no_time_of_the_loop_goes_into_a_hint_at_the_right_name(plant: Any) -> None:
    unknown = [of('answer_timout', double_value=1.0)]
    (result,) = plant(SetParameters, 'set_parameters', parameters=unknown).results
    assert result.reason == "there is no parameter 'answer_timout'"
