"""Views of a flight: which are started, and that the flight goes its way without them.

The nodes are stand-ins.
"""

from __future__ import annotations

import pytest
from stand_ins import STAND_IN, Tree


@pytest.mark.parametrize(
    ('options', 'expected'),
    [
        ((), {'view'}),
        (('--no-view',), set()),
        (('--view',), {'view', 'web'}),
        (('--view', '--no-view'), {'web'}),
    ],
)
def test_what_is_started(tree: Tree, options: tuple[str, ...], expected: set[str]) -> None:
    tree.executable('maglev_view', 'web', STAND_IN)
    code, output = tree.run(*options, '--namespace', 'lab')
    assert code == 0, output
    assert set(tree.started()) & {'view', 'web'} == expected
    for view in expected:
        words = tree.arguments(view)
        assert f'effective_parameters:="{tree.out}/params/{view}.yaml"' in words
        assert '__ns:=/lab' in words
    assert "watchers:=['monitor','recorder']" in tree.arguments('plant')
    assert tree.alive() == []


@pytest.mark.parametrize('how', ['die', 'fail'])
def test_a_view_that_dies_is_told_and_the_flight_goes_on(tree: Tree, how: str) -> None:
    tree.behave('watchers', 'wait')
    tree.behave('view', how)
    process = tree.start('--out', str(tree.out))
    said = ''
    assert process.stdout is not None
    while 'view ended with exit code' not in said:
        said += process.stdout.readline()
        assert process.poll() is None, said
    (tree.path / 'enough').touch()
    rest, _ = process.communicate(timeout=30)
    assert process.returncode == 0, said + rest
    assert 'the belt broke' in said
    assert 'view ended' not in rest


def test_a_view_that_will_not_end_fails_nothing(tree: Tree) -> None:
    module = tree.path / 'scenarios' / 'runner' / 'process.py'
    long = 'SIGTERM: 8.0, signal.SIGINT: 3.0'
    module.write_text(module.read_text().replace(long, 'SIGTERM: 1, signal.SIGINT: 1'))
    tree.behave('view', 'stubborn')
    code, output = tree.run()
    assert code == 0, output
    assert tree.alive() == []


@pytest.mark.parametrize(('options', 'expected'), [((), ''), (('--view',), 'view')])
def test_what_the_page_needs_is_installed_when_it_is_wanted(
    tree: Tree, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...], expected: str
) -> None:
    monkeypatch.delenv('MAGLEV_SETUP', raising=False)
    (tree.path / 'setup.sh').write_text('echo "set-up: $MAGLEV_SETUP"\nexit 70\n')
    assert tree.run(*options) == (70, f'set-up: {expected}\n')


def test_a_view_that_cannot_be_started_fails_before_the_start(tree: Tree) -> None:
    (tree.path / 'prefix' / 'lib' / 'maglev_view' / 'view').unlink()
    code, output = tree.run()
    assert code == 2
    assert "no executable 'view' of package 'maglev_view'" in output
    assert tree.run('--no-view')[0] == 0
