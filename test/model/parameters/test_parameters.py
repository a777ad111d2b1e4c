"""The parameter table: what it takes, what it refuses, and that YAML carries it unchanged."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maglev_model import parameters
from maglev_model.parameters import ParameterError, group, parameter


@dataclass(frozen=True, kw_only=True)
class Magnet:
    height: float = parameter(0.005, 'height', unit='m', within=(0.001, 0.1))
    grade: str = parameter('N35', 'grade', choices=('N35', 'N52'))


@dataclass(frozen=True, kw_only=True)
class Table:
    magnet: Magnet = group(Magnet)
    pairs: int = parameter(3, 'pole pairs', within=(1, 10))
    gains: tuple[float, ...] = parameter((1.0, 2.0), 'gains', within=(-9.0, 9.0))
    fixed: tuple[float, ...] = parameter((0.0,) * 3, 'three numbers', length=3)
    names: tuple[str, ...] = parameter(('y',), 'axes')
    on: bool = parameter(True, 'a switch')


def test_defaults_and_overrides() -> None:
    table = parameters.build(Table, {'magnet.height': 0.01, 'gains': [3, 4.5, -1]})
    assert table.magnet.height == 0.01
    assert table.gains == (3.0, 4.5, -1.0)
    assert all(type(gain) is float for gain in table.gains)
    assert table.magnet.grade == 'N35'


@pytest.mark.parametrize(
    ('name', 'value', 'said'),
    [
        ('magnet.hieght', 0.01, "'magnet.hieght'.*did you mean 'magnet.height'"),
        ('magnet.height', 5.0, r"'magnet.height' is 5.*\[0.001, 0.1\] m"),
        ('magnet.height', math.nan, "'magnet.height' is nan.*finite"),
        ('magnet.height', math.inf, "'magnet.height' is inf.*finite"),
        ('magnet.height', '5 mm', "'magnet.height' is '5 mm' .str.*double"),
        ('magnet.height', True, "'magnet.height' is True .bool.*double"),
        ('magnet.grade', 'N36', "'magnet.grade' is 'N36'.*one of N35, N52"),
        ('pairs', 3.0, "'pairs' is 3.0 .float.*integer"),
        ('pairs', 11, r"'pairs' is 11.*\[1, 10\]"),
        ('gains', [1.0, 10.0], r"'gains\[1\]' is 10"),
        ('gains', 1.0, r"'gains' is 1.0.*double\[\]"),
        ('gains', 'ab', r"'gains' is 'ab'.*double\[\]"),
        ('fixed', [1.0], "'fixed' has 1 elements, it takes 3"),
        ('on', 1, "'on' is 1 .int.*bool"),
    ],
)
def test_what_is_refused_is_named(name: str, value: object, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        parameters.build(Table, {name: value})


@pytest.mark.parametrize('name', ['magnet.height', 'pairs', 'on', 'gains', 'names'])
def test_a_whole_number_that_no_double_holds(name: str) -> None:
    value = -(10**400)
    with pytest.raises(ParameterError, match=rf"'{name}.*' is a whole number that no double"):
        parameters.build(Table, {name: [value] if name in ('gains', 'names') else value})


def test_a_required_parameter_must_be_given() -> None:
    @dataclass(frozen=True, kw_only=True)
    class Required:
        mass: float = parameter(description='mass', unit='kg')

    with pytest.raises(ParameterError, match="'mass' has no default"):
        parameters.build(Required)


def test_a_field_that_is_no_parameter_is_a_defect() -> None:
    @dataclass(frozen=True, kw_only=True)
    class Broken:
        mass: float = field(default=1.0)

    with pytest.raises(TypeError, match='neither a parameter nor a group'):
        parameters.specs(Broken)


@given(
    height=st.floats(0.001, 0.1),
    pairs=st.integers(1, 10),
    gains=st.lists(st.floats(-9.0, 9.0), max_size=5),
    fixed=st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 3),
    names=st.lists(st.sampled_from(['y', 'n', 'on', 'x', '1e3', '0x1f']), max_size=4),
    on=st.booleans(),
)
def test_yaml_carries_every_value_unchanged(
    tmp_path_factory: pytest.TempPathFactory, **overrides: object
) -> None:
    overrides['magnet.height'] = overrides.pop('height')
    table = parameters.build(Table, overrides)
    path = tmp_path_factory.mktemp('yaml') / 'table.yaml'
    path.write_text(parameters.to_yaml(table, 'plant'))
    assert parameters.from_yaml(Table, 'plant', path) == table


def test_yaml_names_first_what_is_not_as_by_default() -> None:
    changed = parameters.build(Table, {'magnet.height': 0.05})
    default = parameters.specs(Table)['magnet.height'].default
    assert parameters.differing(Table()) == {}
    assert parameters.differing(changed) == {'magnet.height': (0.05, default)}
    assert parameters.DIFFERS not in parameters.to_yaml(Table(), 'plant')
    first = parameters.to_yaml(changed, 'plant').splitlines()[0]
    assert first == f'{parameters.DIFFERS}magnet.height: 0.05 (by default {default!r})'


def test_yaml_has_no_empty_list_by_default_as_ros_cannot_read_one() -> None:
    @dataclass(frozen=True, kw_only=True)
    class Poles:
        real: tuple[float, ...] = parameter((), 'poles')
        others: tuple[float, ...] = parameter((1.0,), 'others')

    assert 'real' not in parameters.to_yaml(Poles(), 'controller')
    assert 'real: [2.0]' in parameters.to_yaml(Poles(real=(2.0,)), 'controller')
    assert 'others: []' in parameters.to_yaml(Poles(others=()), 'controller')


def test_files_apply_to_their_node_and_the_later_wins(tmp_path: Path) -> None:
    first, second = tmp_path / 'a.yaml', tmp_path / 'b.yaml'
    first.write_text(
        'plant: {ros__parameters: {pairs: 2, magnet: {height: 0.01}}}\n'
        'other: {ros__parameters: {pairs: 9}}\n'
    )
    second.write_text('/**: {ros__parameters: {pairs: 4}}\n')
    table = parameters.from_yaml(Table, 'plant', first, second)
    assert (table.pairs, table.magnet.height) == (4, 0.01)


@pytest.mark.parametrize(
    ('section', 'applies'),
    [
        *((name, True) for name in ('plant', '/plant', '/lab/plant', '/**', '/*/plant', 'lab/*')),
        ('/**/plant', True),
        ('/lab/**', True),
        *((name, False) for name in ('other', '/lab', '/*/*/plant', '/lab/plants', '/lab/pl')),
    ],
)
def test_sections_of_a_node_in_a_namespace(tmp_path: Path, section: str, applies: bool) -> None:
    path = tmp_path / 'a.yaml'
    path.write_text(f'{section}: {{ros__parameters: {{magnet: {{height: 1e-2}}}}}}\n')
    found = parameters.read_yaml(path, 'plant', '/lab/plant')
    assert found == ({'magnet.height': 0.01} if applies else {})


@pytest.mark.parametrize(
    ('text', 'value'),
    [
        *(('1e-3', 1e-3), ('-1.5E+2', -150.0), ('3.', 3.0), ('.5', 0.5), ('-.inf', -math.inf)),
        *(('12', 12), ('-7', -7), ('0x1f', 31), ('0', 0), ('010', 8), ('true', True)),
        *((text, text) for text in ('2026-01-31', '12:30', '1_000', '09', 'e3', '1.2.3', '.')),
    ],
)
def test_values_are_read_as_ros_does(text: str, value: object) -> None:
    found = parameters.read_argument(f'name:={text}', 'plant')['name']
    assert found == value
    assert type(found) is type(value)


def test_arguments_are_for_all_nodes_or_one() -> None:
    assert parameters.read_argument('magnet.height:=1e-2', 'plant') == {'magnet.height': 0.01}
    assert parameters.read_argument('plant:names:=[x, y]', 'plant') == {'names': ['x', 'y']}
    assert parameters.read_argument('other:pairs:=2', 'plant', '/lab/plant') == {}
    with pytest.raises(ParameterError, match='pairs'):
        parameters.read_argument('pairs:=[', 'plant')


@pytest.mark.parametrize(
    'text',
    [
        *('pairs: 3', '- 1', 'plant: {pairs: 3}', 'plant: {ros__parameters: ['),
        *(f'plant: {{ros__parameters: {{{{{key}}}}}}}' for key in ('x', 'x: 1')),
        *(f'plant: {{ros__parameters: {value}}}' for value in ('5', '0', '[1]', '[]', 'text')),
        f'plant: {{ros__parameters: {{pairs: {10**4000}{10**4000}}}}}',
        *(f'plant: {{ros__parameters: &a {{a: {value}}}}}' for value in ('*a', '[*a]')),
        'plant: &a {ros__parameters: *a}',
        '[' * 3000,
        'plant: {ros__parameters: {magnet.height: 0.01, magnet: {height: 0.02}}}',
        'plant: {ros__parameters: {pairs: 2}}\n/plant: {ros__parameters: {pairs: 4}}',
    ],
)
def test_files_that_are_no_parameter_files(tmp_path: Path, text: str) -> None:
    path = tmp_path / 'bad.yaml'
    path.write_text(text)
    with pytest.raises(ParameterError, match=r'bad\.yaml'):
        parameters.from_yaml(Table, 'plant', path)


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match='cannot read parameter file'):
        parameters.from_yaml(Table, 'plant', tmp_path / 'none.yaml')


@given(st.floats(allow_nan=True, allow_infinity=True))
def test_only_values_within_bounds_pass(value: float) -> None:
    spec = parameters.specs(Table)['magnet.height']
    if 0.001 <= value <= 0.1:
        assert spec.check(value) == value
    else:
        with pytest.raises(ParameterError):
            spec.check(value)
