"""What becomes of a platen that does not follow its reference."""

from __future__ import annotations

import numpy as np
import pytest
from supervised import HOVER, STOP, Flight

from maglev_controller.bumpless_transfer import model_maps
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_controller.supervision import Supervisor
from maglev_model.contract.controller_watch import Status
from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import Phase
from maglev_model.parameters import build


def drifting(supervisor: Supervisor, axis: int, speed: float, samples: int) -> int:
    """Hover at rest while the reference moves off; after how many samples it is given up."""
    flight = Flight(supervisor)
    flight.step(Phase.REST, STOP, 0.031)
    velocity = speed * (np.arange(5) == axis)
    references = supervisor.references
    for n in range(1, samples + 1):
        place = HOVER + 1e-3 * n * velocity
        references.store(n, Phase.TRACK, 0, place, velocity, np.zeros(5))
        supervisor.step(references.find(n), np.full(4, HOVER[0]), 0.0, 0.0)
        if not supervisor.flying:
            return n
    return 0


@pytest.mark.parametrize(('axis', 'most'), enumerate((1e-3, 2e-3, 2e-3, 3e-3, 3e-3)))
def test_a_platen_that_does_not_follow_is_given_up_when_its_error_is_too_large(
    axis: int, most: float
) -> None:
    supervisor = Supervisor(ControllerParameters())
    given_up = drifting(supervisor, axis, 0.05, 100)
    assert given_up == pytest.approx(most / 5e-5 + 1, abs=1)
    assert supervisor.mode == Mode.FAULT
    assert supervisor.status == Status.GAVE_UP
    assert not supervisor.direct_current.any()
    assert f'{["y", "x", "z", "phi", "theta"][axis]} is 0.00' in supervisor.reason
    assert "'following.error'" in supervisor.reason


def hovering(**overrides: object) -> tuple[Supervisor, Flight]:
    """One that regulates, and follows."""
    supervisor = Supervisor(build(ControllerParameters, overrides))
    flight = Flight(supervisor)
    flight.step(Phase.REST, STOP, 0.031)
    for _ in range(10):
        flight.step(Phase.TRACK, HOVER, HOVER[0])
    return supervisor, flight


def test_an_axis_that_nobody_controls_need_not_follow() -> None:
    supervisor = Supervisor(build(ControllerParameters, {'theta.controlled': False}))
    assert drifting(supervisor, 4, 0.05, 100) == 0


def test_a_landing_that_does_not_follow_is_given_up_too() -> None:
    supervisor, flight = hovering()
    supervisor.disable()
    modes = [flight.step(Phase.TRACK, HOVER, HOVER[0]) for _ in range(1500)]
    assert set(modes) == {Mode.LANDING, Mode.FAULT}
    assert supervisor.status == Status.GAVE_UP
    assert 'y is 0.00' in supervisor.reason


def retune(supervisor: Supervisor, **overrides: object) -> None:
    regulator = Regulator(build(ControllerParameters, {'observer.bandwidth': 840.0} | overrides))
    supervisor.adopt(regulator, model_maps(supervisor.regulator.arrays, regulator.arrays))


def test_retuning_again_and_again_does_not_hide_that_the_platen_does_not_follow() -> None:
    supervisor, flight = hovering(**{'following.time': 0.01})
    for _ in range(5):
        retune(supervisor, **{'following.time': 0.01})
        for _ in range(4):
            flight.step(Phase.TRACK, HOVER, HOVER[0] + 0.0015)
    assert supervisor.status == Status.GAVE_UP


def test_after_a_retuning_what_jumped_may_still_overshoot() -> None:
    supervisor, flight = hovering()
    jumped = HOVER + 0.02 * (np.arange(5) == 1)
    for x in (0.0, 0.01, 0.02):
        flight.step(Phase.TRACK, jumped, HOVER[0], x)
    retune(supervisor)
    flight.step(Phase.TRACK, jumped, HOVER[0], 0.02)
    assert flight.step(Phase.TRACK, jumped, HOVER[0], 0.025) == Mode.REGULATING


def test_a_landing_keeps_its_time_to_catch_up_through_a_retuning() -> None:
    supervisor, flight = hovering()
    supervisor.disable()
    flight.step(Phase.TRACK, HOVER, HOVER[0])
    retune(supervisor)
    flight.step(Phase.TRACK, HOVER, HOVER[0])
    modes = [flight.step(Phase.TRACK, HOVER, HOVER[0] + 0.0015) for _ in range(100)]
    assert set(modes) == {Mode.LANDING}
