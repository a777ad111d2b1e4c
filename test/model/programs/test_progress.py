"""How far a long piece of work is: a bar on a terminal, lines elsewhere, nothing if it is short."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable

import pytest

from maglev_model.programs.progress import Progress, add_output_options, talking


@pytest.fixture
def at(monkeypatch: pytest.MonkeyPatch) -> Callable[[float], None]:
    """Sets the clock, to seconds after the beginning."""
    now = [100.0]
    monkeypatch.setattr(time, 'monotonic', lambda: now[0])

    def move(seconds: float) -> None:
        now[0] = 100.0 + seconds

    return move


def test_what_takes_less_than_two_seconds_is_not_worth_a_bar(
    at: Callable[[float], None],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(sys.stdout, 'isatty', lambda: True)
    progress = Progress('compare', 'parts')
    for seconds, done in ((0.0, 0), (1.0, 5), (1.9, 10)):
        at(seconds)
        progress.tell(done, 10)
    progress.end()
    assert capsys.readouterr().out == ''


def test_lines_where_there_is_no_terminal(
    at: Callable[[float], None], capsys: pytest.CaptureFixture[str]
) -> None:
    progress = Progress('faults', 'runs')
    for seconds, done in ((0.0, 0), (2.5, 5), (3.0, 6), (10.0, 10)):
        at(seconds)
        progress.tell(done, 10, ', 1 broken')
    assert capsys.readouterr().out.splitlines() == [
        'faults: 5 of 10 runs, 1 broken, 2 s, about 2 s left',
        'faults: 10 of 10 runs, 1 broken, 10 s',
    ]


def test_a_bar_on_a_terminal(
    at: Callable[[float], None],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(sys.stdout, 'isatty', lambda: True)
    progress = Progress('export', '%', lines=False)
    for seconds, done in ((0.0, 0), (4.0, 3e6), (4.1, 4e6), (5.0, 6e6)):
        at(seconds)
        progress.tell(done, 12e6)
    drawn = capsys.readouterr().out
    assert drawn.startswith('\r\x1b[Kexport [######..................] 25 %, 4 s, about 12 s left')
    assert drawn.count('\r') == 2
    assert drawn.endswith('[############............] 50 %, 5 s, about 5 s left')
    progress.end()
    progress.end()
    assert capsys.readouterr().out == '\n'


def test_without_lines_it_is_silent_elsewhere(
    at: Callable[[float], None], capsys: pytest.CaptureFixture[str]
) -> None:
    progress = Progress('export', '%', lines=False)
    progress.tell(0, 2)
    at(9.0)
    progress.tell(2, 2)
    assert capsys.readouterr().out == ''


@pytest.mark.parametrize(
    ('options', 'out', 'err'),
    [([], 'words', ''), (['--quiet'], '', ''), (['--json'], '', 'words')],
)
def test_where_words_go(
    options: list[str], out: str, err: str, capsys: pytest.CaptureFixture[str]
) -> None:
    parser = argparse.ArgumentParser()
    add_output_options(parser)
    with talking(parser.parse_args(options)):
        print('words', end='')
    print('.')
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == (f'{out}.\n', err)
