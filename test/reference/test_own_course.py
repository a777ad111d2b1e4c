"""Trajectories from outside the package: what is none of one is refused with its parameter."""

from __future__ import annotations

import math
import sys
import types
from typing import Any

import numpy as np
import pytest

from maglev_model.parameters import ParameterError, build
from maglev_reference.motion import Kinematics, Stand
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.timeline import Timeline
from maglev_reference.trajectories import Course

NAME = 'somebody.path'
HOME = np.array([0.025, 0.0, 0.0, 0.0, 0.0])


class Answering:
    """A motion that answers by what it is made with."""

    def __init__(self, answer: Any) -> None:
        self.evaluate = answer


def planned(monkeypatch: pytest.MonkeyPatch, made: Any) -> Timeline:
    module = types.ModuleType(NAME)
    module.course = lambda _: made  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, 'somebody', types.ModuleType('somebody'))
    monkeypatch.setitem(sys.modules, NAME, module)
    return Timeline(build(ReferenceParameters, {'trajectory': NAME, 'duration': 1.0}))


def still(time: np.ndarray) -> list[list[list[float]]]:
    return [[list(HOME)] * len(time), [[0.0] * 5] * len(time), [[0.0] * 5] * len(time)]


@pytest.mark.parametrize('motion', [Stand(HOME), Answering(still)])
def test_a_course_is_taken(monkeypatch: pytest.MonkeyPatch, motion: Any) -> None:
    planned(monkeypatch, Course(motion, period=2))


@pytest.mark.parametrize(
    ('answer', 'why'),
    [
        (lambda _: 1.0 / 0.0, r'raised ZeroDivisionError: .* \(test_own_course\.py, line'),
        (lambda _: np.zeros((4, 5)), 'raised TypeError'),
        (
            lambda time: Kinematics(*np.zeros((3, 5, len(time)))),
            r'gives a position of shape \(5, 1\) .* it must be \(1, 5\)',
        ),
        (lambda time: [*still(time)[:2], [['0'] * 5] * len(time)], 'an? acceleration .* of floats'),
    ],
)
def test_a_motion_that_is_none(monkeypatch: pytest.MonkeyPatch, answer: Any, why: str) -> None:
    with pytest.raises(ParameterError, match=f"'trajectory' is '{NAME}', whose motion .*{why}"):
        planned(monkeypatch, Course(Answering(answer)))


@pytest.mark.parametrize('made', [None, Stand(HOME), (Stand(HOME), 2.0)])
def test_what_is_no_course(monkeypatch: pytest.MonkeyPatch, made: Any) -> None:
    with pytest.raises(ParameterError, match=f"'{NAME}', whose 'course' returned .* be Course"):
        planned(monkeypatch, made)


@pytest.mark.parametrize('name', ['period', 'length'])
@pytest.mark.parametrize('time', [-2.0, 0.0, math.nan, '2'])
def test_a_time_that_is_none(monkeypatch: pytest.MonkeyPatch, name: str, time: Any) -> None:
    with pytest.raises(ParameterError, match=f"'{NAME}', whose {name} is {time!r}: it must be "):
        planned(monkeypatch, Course(Stand(HOME))._replace(**{name: time}))
