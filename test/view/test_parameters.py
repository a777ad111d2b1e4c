"""The parameter files of view and web say what the nodes do without them."""

from __future__ import annotations

from pathlib import Path

import pytest

from maglev_model.parameters import ParameterError, build, from_yaml
from maglev_view.parameters import ViewParameters, WebParameters

PARAMS = Path(__file__).resolve().parents[2] / 'params'
TABLES: dict[str, type] = {'view': ViewParameters, 'web': WebParameters}


@pytest.mark.parametrize('node', TABLES)
def test_the_file_has_the_defaults_and_the_machine_is_heard(node: str) -> None:
    table = TABLES[node]
    assert from_yaml(table, node, PARAMS / 'machine.yaml', PARAMS / f'{node}.yaml') == table()
    single = from_yaml(table, node, PARAMS / 'machine.yaml', PARAMS / 'single_motor.yaml')
    assert (single.machine.motors, single.machine.mass_y) == (1, 1.725)


def test_the_page_is_for_this_machine_unless_told_otherwise() -> None:
    assert WebParameters().host == '127.0.0.1'


@pytest.mark.parametrize(
    ('node', 'given', 'said'),
    [
        ('view', {'rate': 0.0}, "'rate' is 0"),
        ('view', {'force_scale': 2.0}, "'force_scale' is 2"),
        ('web', {'port': 65536}, "'port' is 65536"),
        ('web', {'bins': 49}, "'bins' is 49"),
    ],
)
def test_what_is_out_of_bounds_is_refused(node: str, given: dict[str, float], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        build(TABLES[node], given)
