"""A law of one's own that answers as a test tells it to, in a module that is made up."""

from __future__ import annotations

import sys
import types
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from maglev_controller.foreign_law import Measurement, Reference
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.parameters import build

NAME = 'made_up_laws.mine'


class Made:
    """A law that answers as it is told to; by itself as the project's own linear feedback."""

    def __init__(self) -> None:
        self.answer: Callable[[Measurement, Reference], Any] = followed
        self.told: list[tuple[Measurement, Reference]] = []
        self.resets = 0

    def reset(self) -> None:
        self.resets += 1
        self.told.clear()

    def step(self, measurement: Measurement, reference: Reference) -> Any:
        self.told.append((measurement, reference))
        return self.answer(measurement, reference)


def followed(measurement: Measurement, reference: Reference) -> np.ndarray:
    """A double integrator's state feedback."""
    error = measurement.position - reference.position
    rate = measurement.velocity - reference.velocity
    return reference.acceleration - 1e4 * error - 150.0 * rate


@pytest.fixture
def law_module() -> Iterator[types.ModuleType]:
    """The module of the law; its ``make`` can be another one."""
    package, mine = types.ModuleType('made_up_laws'), types.ModuleType(NAME)
    package.__path__ = []
    mine.make = lambda _: Made()  # type: ignore[attr-defined]
    sys.modules |= {'made_up_laws': package, NAME: mine}
    yield mine
    del sys.modules[NAME], sys.modules['made_up_laws']


def parameters(**overrides: object) -> ControllerParameters:
    """Of the controller with this law; dots are written as ``__``."""
    named = {name.replace('__', '.'): value for name, value in overrides.items()}
    return build(ControllerParameters, {'law': NAME, **named})


def law_of(regulator: Regulator) -> Made:
    """The object that the regulator asks."""
    assert regulator.foreign is not None
    assert isinstance(regulator.foreign.law, Made)
    return regulator.foreign.law
