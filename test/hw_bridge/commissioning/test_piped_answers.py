"""Answers through a pipe, as from a program, one or many at once."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import pytest

from maglev_hw_bridge.commissioning.commission import run
from maglev_hw_bridge.commissioning.operators import Act, Person

PARAMS = Path(__file__).resolve().parents[3] / 'params' / 'hw_bridge.yaml'
STEPS = 12  # more than commissioning asks for


@pytest.fixture
def piped(monkeypatch: pytest.MonkeyPatch) -> Iterator[IO[bytes]]:
    """Where answers go in; nobody closes it meanwhile."""
    reads, writes = os.pipe()
    with open(reads) as stdin, open(writes, 'wb', buffering=0) as answers:
        monkeypatch.setattr('sys.stdin', stdin)
        yield answers


def never() -> None:
    pytest.fail('waits for an answer that is there')


def test_answers_that_come_at_once_are_taken_one_by_one(piped: IO[bytes]) -> None:
    person = Person()
    piped.write('y\nY\n\nn\n maybe \nyes\nµ\n1.5\n'.encode())
    person.go_on('a step')
    assert person.sees_current(3, never)
    person.act(Act.PRESS)
    assert not person.sees_current(3, never)
    assert person.sees_enabled()
    assert person.reads_current(3, never) == 1.5


def test_half_an_answer_is_waited_for_while_current_is_seen_to(piped: IO[bytes]) -> None:
    rest = [b'e', b's\n']
    piped.write(b'y')
    assert Person().sees_current(3, lambda: piped.write(rest.pop(0)) and None)
    assert not rest


def test_where_no_answer_comes_any_more_nothing_is_agreed_to(piped: IO[bytes]) -> None:
    piped.write(b'y')
    piped.close()
    with pytest.raises(EOFError):
        Person().go_on('a step')


@pytest.mark.parametrize(('answers', 'code'), [(['y'] * STEPS, 0), (['y', 'y', '', 'y'], 130)])
def test_commissioning_by_piped_answers(
    piped: IO[bytes], capsys: pytest.CaptureFixture[str], answers: list[str], code: int
) -> None:
    piped.write('\n'.join([*answers, '']).encode())
    assert run(['--params', str(PARAMS)]) == code
    captured = capsys.readouterr()
    assert ('all is well' in captured.out) == (code == 0)
    assert ('stopped; no current flows' in captured.err) == (code == 130)
    assert captured.out.count('go on? [y/N]') <= STEPS
