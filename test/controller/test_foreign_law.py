"""Laws that are objects of one's own: what they are told, what becomes of their answers."""

from __future__ import annotations

import math
import types
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from made_up_law import NAME, Made, followed, law_of, parameters

from maglev_controller.foreign_law import Measurement, Reference
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.currents import exact_currents
from maglev_model.inverse import CURRENT, CurrentLimits
from maglev_model.machine import machine_constants
from maglev_model.parameters import ParameterError

HOVER = np.array([0.025, 0.0, 0.0, 0.0, 0.0])

pytestmark = pytest.mark.usefixtures('law_module')


def step(
    regulator: Regulator, position: np.ndarray, reference: np.ndarray = HOVER
) -> tuple[int, np.ndarray]:
    """What limits, and the currents (2, 4), for a level platen."""
    currents, zero = np.zeros((2, 4)), np.zeros(5)
    gap, x, z = np.full(4, position[0]), float(position[1]), float(position[2])
    code = regulator.step(gap, x, z, reference, zero, zero, currents[0], currents[1])
    return code, currents


# -- what it answers -------------------------------------------------------------------------------


def test_accelerations_become_currents_by_the_inverse() -> None:
    regulator = Regulator(parameters())
    wanted = np.array([0.5, -0.4, 0.3, 0.2, -0.1])
    law_of(regulator).answer = lambda *_: wanted
    code, found = step(regulator, HOVER)
    limits = CurrentLimits(7.0, 1.0, 0.1, 0.5)
    machine = machine_constants(regulator.parameters.machine)
    direct, quadrature, possible = exact_currents(machine, HOVER[None], wanted[None], limits)
    assert code == 0
    assert possible.all()
    np.testing.assert_array_equal(found, [direct[0], quadrature[0]])
    np.testing.assert_array_equal(regulator.virtual_input, wanted)


def test_currents_are_taken_as_they_are_within_their_amplitude(
    law_module: types.ModuleType,
) -> None:
    asked = np.array([[1.0, -2.0, 6.0, 9.0], [0.5, 1.0, 6.0, 1.0]])
    law_module.make = lambda _: made_to(lambda *_: asked)
    code, found = step(Regulator(parameters()), HOVER)
    left = math.sqrt(7.0**2 - 6.0**2)
    assert code == CURRENT
    np.testing.assert_allclose(found, [[1.0, -2.0, 6.0, 7.0], [0.5, 1.0, left, 0.0]], atol=1e-12)
    asked *= 0.5
    code, found = step(Regulator(parameters()), HOVER)
    assert code == 0
    np.testing.assert_array_equal(found, asked)


def made_to(answer: Callable[..., Any]) -> Made:
    """A law with an answer of its own."""
    law = Made()
    law.answer = answer
    return law


def test_what_it_is_told() -> None:
    regulator = Regulator(parameters(foreign__time=4e-4))
    velocity = np.array([-0.002, 0.003, 0.0, 0.0, 0.0])
    law_of(regulator).answer = lambda *_: np.zeros(5)
    for k in range(400):
        step(regulator, HOVER + 1e-3 * k * velocity, HOVER)
    measurement, reference = law_of(regulator).told[-1]
    position = HOVER + 0.399 * velocity
    np.testing.assert_allclose(measurement.gap, position[0])
    assert (measurement.x, measurement.z) == (position[1], 0.0)
    np.testing.assert_allclose(measurement.position, position)
    np.testing.assert_allclose(measurement.velocity, velocity, atol=1e-9)
    assert (measurement.time, measurement.late) == (4e-4, 0.0)
    np.testing.assert_allclose(reference.position, HOVER)
    assert not np.any(reference.velocity)
    step(regulator, position, HOVER + 0.002)  # a raw step, which is rounded off
    jumped = law_of(regulator).told[-1][1]
    np.testing.assert_allclose(jumped.position, HOVER, atol=1e-6)
    for _ in range(100):
        step(regulator, position, HOVER + 0.002)
    halfway = law_of(regulator).told[-1][1]
    np.testing.assert_allclose(halfway.position, HOVER + 0.001, atol=1e-6)
    assert np.all(halfway.velocity > 0.01)


def test_what_it_is_told_is_its_own_to_change() -> None:
    spoilt, kept = Regulator(parameters()), Regulator(parameters())

    def spoil(measurement: Measurement, reference: Reference) -> np.ndarray:
        answer = followed(measurement, reference)
        for array in (measurement.gap, measurement.position, measurement.velocity, *reference):
            array[:] = math.nan
        return answer

    law_of(spoilt).answer = spoil
    for k in range(5):
        position = HOVER + 1e-5 * k
        np.testing.assert_array_equal(step(spoilt, position)[1], step(kept, position)[1])


# -- what is refused before anything moves ---------------------------------------------------------


@pytest.mark.parametrize(
    ('answer', 'why'),
    [
        (lambda *_: np.zeros(4), r'of shape \(4,\): it must be \(2, 4\), currents'),
        (lambda *_: None, r'of shape \(\)'),
        (
            lambda *_: 1.0 / 0.0,
            r'at rest .* raised ZeroDivisionError: .*test_foreign_law\.py, line',
        ),
        (lambda *_: 'nothing', r'raised ValueError'),
    ],
)
def test_an_answer_that_is_none(law_module: types.ModuleType, answer: Any, why: str) -> None:
    law_module.make = lambda _: made_to(answer)
    with pytest.raises(ParameterError, match=why):
        Regulator(parameters())


def test_a_law_that_cannot_be_made(law_module: types.ModuleType) -> None:
    law_module.make = lambda _: [][0]
    with pytest.raises(ParameterError, match=rf"'law' is '{NAME}', whose 'make' raised IndexErr"):
        Regulator(parameters())


def test_choices_that_contradict_it(law_module: types.ModuleType) -> None:
    with pytest.raises(ParameterError, match=r"'foreign\.time' is 0\.002 s, .*0\.001 s"):
        Regulator(parameters(foreign__time=2e-3))
    with pytest.raises(ParameterError, match=r"'inverse' is 'equilibrium', .* lands by itself"):
        Regulator(parameters(inverse='equilibrium'))

    def check(_: ControllerParameters) -> None:
        raise ParameterError('not on a Sunday')

    law_module.check = check
    with pytest.raises(ParameterError, match='not on a Sunday'):
        Regulator(parameters())


# -- what becomes of one that fails ----------------------------------------------------------------


def test_control_c_is_not_a_mistake() -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    regulator = Regulator(parameters())
    law_of(regulator).answer = interrupt
    with pytest.raises(KeyboardInterrupt):
        step(regulator, HOVER)
