"""The file of a campaign: one campaign at a time writes it."""

from __future__ import annotations

import multiprocessing
from pathlib import Path

import pytest

from maglev_model.parameters import ParameterError
from maglev_study.journal import Journal

HEAD = {'seed': 0}


def journal(path: Path) -> Journal[int]:
    return Journal(path, HEAD, int, int)


def refusal(path: Path) -> str:
    """Why another process may not go on with a campaign, empty where it may."""
    try:
        with journal(path):
            return ''
    except ParameterError as error:
        return str(error)


def test_two_campaigns_do_not_write_one_file(tmp_path: Path) -> None:
    path = tmp_path / 'flown.jsonl'
    with multiprocessing.get_context('fork').Pool(1) as another:
        with journal(path) as one:
            one.add([1, 2])
            said = f"'{path}' is being written by another campaign: choose another --out"
            assert another.apply(refusal, (path,)) == said
            one.add([3])
        assert another.apply(refusal, (path,)) == ''
    with journal(path) as one:
        assert one.flown == [1, 2, 3]
    with pytest.raises(ParameterError, match='whose seed is 0'):
        Journal(path, {'seed': 1}, int, int)
