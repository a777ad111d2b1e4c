"""Modules of anybody's that parameters name."""

from __future__ import annotations

from pathlib import Path

import pytest

from maglev_model.parameters import ParameterError
from maglev_model.parameters.plugins import plugin_function

TEXT = """
from maglev_model.parameters import ParameterError


def three():
    return 3


def lost(where):
    return {}[where]


def refuses():
    raise ParameterError('not on a Sunday')
"""


@pytest.fixture(autouse=True)
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    folder = tmp_path / f'own_{tmp_path.name}'
    folder.mkdir()
    (folder / 'parts.py').write_text(TEXT)
    monkeypatch.syspath_prepend(str(tmp_path))
    return f'{folder.name}.parts'


def test_what_it_gives_is_taken(module: str) -> None:
    assert plugin_function('law', module, 'three', gives=int)() == 3


@pytest.mark.parametrize(
    ('function', 'given', 'why'),
    [
        ('lost', ('here',), r"raised KeyError: 'here' \(parts\.py, line 10\)$"),
        ('lost', (), r"raised TypeError: lost\(\) missing 1 required .* 'where'$"),
        ('three', (), 'returned int: it must be str$'),
    ],
)
def test_a_mistake_is_told_with_the_parameter_that_names_it(
    module: str, function: str, given: tuple[str, ...], why: str
) -> None:
    with pytest.raises(ParameterError, match=f"'law' is '{module}', whose '{function}' {why}"):
        plugin_function('law', module, function, gives=str)(*given)


def test_what_it_refuses_it_refuses_in_its_own_words(module: str) -> None:
    with pytest.raises(ParameterError, match=r'^not on a Sunday$'):
        plugin_function('law', module, 'refuses')()
