"""Deviations where the reference comes to rest: against all of them at once."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from maglev_model.axes import X
from maglev_monitor.metrics.arrivals import Arrivals
from maglev_monitor.metrics.derived import SOURCES
from maglev_monitor.metrics.repeatability import repeatability

REST, MOVE = 600, 70  # samples
TARGETS = (-0.01, 0.0, 0.005)


def course(rounds: int, rest: int = REST) -> NDArray[np.float64]:
    """x through the targets to and fro, each met from both sides, from beyond them."""
    there = [-0.02, *TARGETS, 0.02, *TARGETS[::-1]]
    parts = [np.full(rest, there[0])]
    for start, end in zip(there * rounds, (there * rounds)[1:], strict=False):
        parts += [np.linspace(start, end, MOVE + 1)[1:], np.full(rest, end)]
    return np.concatenate(parts)


def run(x: NDArray[np.float64], seed: int = 0) -> tuple[Any, Any, Any]:
    """Numbers, references and positions with deviations that vary from rest to rest."""
    random, n = np.random.default_rng(seed), len(x)
    wanted = np.zeros((n, 5))
    wanted[:, X] = x
    offset = np.repeat(1e-6 * random.standard_normal(n // (REST + MOVE) + 2), REST + MOVE)[:n]
    position = np.repeat(wanted[:, None], len(SOURCES), axis=1)
    position[:, 0, X] += offset
    position[:, 1:, X] += 2.0 * offset[:, None]
    return 7 + np.arange(n), wanted, position


@pytest.mark.parametrize('block', [1, 173, 500, 10**6])
def test_they_are_iso_230_2_s(block: int) -> None:
    sequence, wanted, position = run(course(3))
    arrivals = Arrivals(1e-3)
    for first in range(0, len(sequence), block):
        part = slice(first, first + block)
        arrivals.add(sequence[part], wanted[part], position[part])
    found = arrivals.result()
    error = position[:, 0, X] - wanted[:, X]
    ends = np.arange(REST + MOVE, len(error), REST + MOVE)  # where each rest but the first begins
    rests = np.array([error[k + 400 : k + 500].mean() for k in ends])
    rests = np.append(np.nan, rests)[: 3 * 8].reshape(3, 8)
    wanted_figures = repeatability(rests[:, 1:4].T, rests[:, :4:-1].T)
    for source, factor in (('true', 1.0), ('measured', 2.0), ('own', 2.0)):
        assert set(found[source]) == {'x'}  # the others never move
        figures = found[source]['x']
        assert (figures['targets'], figures['approaches']) == (3, 3)
        for name, value in wanted_figures._asdict().items():
            assert figures[name] == pytest.approx(factor * value, rel=1e-6)


def figures(kept: slice | NDArray[np.bool_], rest: int = REST) -> Any:
    """What is found in some of the samples."""
    arrivals = Arrivals(1e-3)
    arrivals.add(*(values[kept] for values in run(course(2, rest))))
    return arrivals.result()


def test_a_short_rest_and_one_with_a_gap_do_not_count() -> None:
    assert figures(slice(None), rest=501)
    assert not figures(slice(None), rest=499)
    number = np.arange(len(course(2)))
    assert not figures(number % (REST + MOVE) != 450)


def test_unknown_positions_have_no_figures() -> None:
    sequence, wanted, position = run(course(2))
    position[:, SOURCES.index('true')] = np.nan
    arrivals = Arrivals(1e-3)
    arrivals.add(sequence, wanted, position)
    assert set(arrivals.result()) == {'measured', 'own'}
