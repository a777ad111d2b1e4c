"""Records: one memory for Python and compiled functions."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Annotated

import numpy as np
import pytest
from numpy.typing import NDArray

from maglev_model.compiled import compiled
from maglev_model.compiled.records import Block, Record


class Tank(Record):
    """What the compiled functions below take."""

    open: bool
    level: float
    turns: int
    past: Annotated[NDArray[np.float64], 2, 3]
    counts: Annotated[NDArray[np.int32], 5]
    flags: Annotated[NDArray[np.int8], 3]


@compiled
def _fill(tank: Tank, by: float) -> None:
    tank.level += by
    tank.past[1, 2] = tank.level


@compiled
def work(block: Block) -> float:
    tank: Tank = block[0]
    _fill(tank, 0.5)
    tank.turns += 1
    tank.counts[3] -= 2
    tank.flags[:] = 1
    tank.open = not tank.open
    return tank.level


def test_python_and_compiled_functions_share_numbers_and_arrays() -> None:
    tank = Tank(level=1.25, past=np.arange(6.0).reshape(2, 3), counts=7)
    past = tank.past
    assert (tank.open, tank.level, tank.turns) == (False, 1.25, 0)
    assert work(tank.block) == 1.75
    assert (tank.open, tank.level, tank.turns) == (True, 1.75, 1)
    assert past.tolist() == [[0.0, 1.0, 2.0], [3.0, 4.0, 1.75]]
    assert tank.counts.tolist() == [7, 7, 7, 5, 7]
    assert tank.counts.dtype == np.int32
    tank.level, tank.open = 3.0, False
    assert work(tank.block) == 3.5
    assert (tank.open, tank.turns, tank.flags.tolist()) == (True, 2, [1, 1, 1])
    assert [type(value) for value in (tank.open, tank.level, tank.turns)] == [bool, float, int]


class MarkedTank(Tank):
    """A tank with a field more."""

    mark: float


@compiled
def work_marked(block: Block) -> float:
    tank: MarkedTank = block[0]
    tank.level += tank.mark
    return tank.level


def test_a_record_has_the_fields_of_its_base_before_its_own() -> None:
    tank = MarkedTank(level=1.25, mark=0.5)
    assert work_marked(tank.block) == 1.75
    assert (tank.level, tank.mark) == (1.75, 0.5)
    assert MarkedTank.dtype.names == (*(Tank.dtype.names or ()), 'mark')


def test_records_are_apart_and_of_one_type() -> None:
    one, other = Tank(level=1.0), Tank(turns=5, flags=(1, 0, 1))
    work(one.block)
    assert (other.level, other.turns) == (0.0, 5)
    assert not other.past.any()
    work(other.block)
    assert len(work.signatures) == 1  # type: ignore[attr-defined]


def test_copies_of_a_block_bring_everything_back() -> None:
    tank = Tank(level=1.0, counts=3)
    saved = tank.block.copy()
    work(tank.block)
    tank.block[:] = saved
    assert (tank.level, tank.turns, tank.counts.tolist()) == (1.0, 0, [3] * 5)
    assert not tank.past.any()


@pytest.mark.parametrize('copied', [copy.deepcopy, lambda tank: pickle.loads(pickle.dumps(tank))])
def test_a_copy_has_one_memory_too_and_its_own(copied: Callable[[Tank], Tank]) -> None:
    tank = Tank(level=1.0, counts=3)
    twin = copied(tank)
    work(twin.block)
    assert (twin.level, twin.counts.tolist(), twin.past[1, 2]) == (1.5, [3, 3, 3, 1, 3], 1.5)
    assert (tank.level, tank.counts.tolist(), tank.past[1, 2]) == (1.0, [3] * 5, 0.0)


def test_what_is_no_field_is_refused() -> None:
    with pytest.raises(ValueError, match='depth'):
        Tank(depth=1.0)
    with pytest.raises(ValueError, match='broadcast'):
        Tank(counts=(1, 2))
    with pytest.raises(AttributeError):
        Tank().past = np.zeros((2, 3))
