"""What the supervisor tells regulator, learning and references, and when no current is left."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from supervised import HOVER, QUICK, STANDING, STOP, lead

from maglev_controller.bumpless_transfer import model_maps
from maglev_controller.learning import iterative_learning
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_controller.supervision import Supervisor
from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import Phase
from maglev_model.parameters import ParameterError, build

ASIDE = np.array([0.025, 0.01, 0.0, 0.0, 0.0])


class Recorder:
    """Stands where learning does, and keeps what it is told."""

    def __init__(self) -> None:
        self.told: list[Any] = []

    def rest(self) -> None:
        self.told.append('rest')

    def look_ahead(self, arrays: Any, measured: bool, position: Any, velocity: Any) -> None:
        self.told.append(('look', arrays, measured, [*position], [*velocity]))

    def learn(self, arrays: Any) -> None:
        self.told.append(('learn', arrays))

    def redesigned(self, parameters: ControllerParameters) -> Recorder:
        self.told.append(parameters)
        return self


def flying(sequence: int = 0, **overrides: Any) -> Supervisor:
    """Regulates since the sample with that sequence number."""
    supervisor = Supervisor(build(ControllerParameters, QUICK | overrides))
    lead(supervisor, sequence - 1 if sequence else 0, Phase.REST, STOP, 0.031)
    assert lead(supervisor, sequence or 1, Phase.TRACK, HOVER, 0.025) == Mode.REGULATING
    return supervisor


def test_it_begins_without_current_limits_or_faults() -> None:
    supervisor = Supervisor(ControllerParameters())
    assert (supervisor.limited_by, supervisor.mode) == (0, Mode.WAITING)
    assert supervisor.direct_current.tolist() == supervisor.quadrature_current.tolist() == [0.0] * 4
    assert supervisor.reset_fault() == (False, 'there is no fault')


def test_the_references_ring_may_begin_anew_in_flight() -> None:
    """The sample in its first row is one like any other."""
    supervisor = flying(sequence=1022)
    for sequence in (1023, 1024, 1025):
        assert lead(supervisor, sequence, Phase.TRACK, HOVER, 0.025) == Mode.REGULATING


@pytest.mark.parametrize('end', ['given up', 'waiting', 'restarted', 'landed'])
def test_however_it_ends_no_current_is_left(end: str) -> None:
    supervisor = flying()
    for sequence in range(2, 50):
        lead(supervisor, sequence, Phase.TRACK, HOVER if sequence < 40 else ASIDE, 0.025)
    assert supervisor.direct_current.all()
    assert supervisor.quadrature_current[[1, 3]].all()
    supervisor.limited_by = 3
    if end == 'given up':
        supervisor.give_up('a defect')
    if end == 'waiting':
        lead(supervisor, 51, Phase.END, STOP, 0.031)
    if end == 'restarted':
        supervisor.restart()
    if end == 'landed':
        supervisor.disable()
        for sequence in range(51, 1000):
            if lead(supervisor, sequence, Phase.TRACK, HOVER, 0.0252) != Mode.LANDING:
                break
        assert supervisor.mode == Mode.DISABLED
    assert not supervisor.direct_current.any()
    assert not supervisor.quadrature_current.any()
    assert supervisor.limited_by == 0


def test_a_stage_that_begins_anew_begins_with_references_of_its_own() -> None:
    supervisor = flying()
    supervisor.restart()
    assert supervisor.references.newest == -1
    assert supervisor.reason == ''
    lead(supervisor, 0, Phase.REST, STOP, 0.031)
    lead(supervisor, 1, Phase.REST, STOP, 0.031)
    supervisor.references.store(0, Phase.REST, 0, STOP, np.zeros(5), np.zeros(5))  # of the next run
    supervisor.restart()
    assert supervisor.references.newest == 0
    supervisor.step(0, np.full(4, 0.031), 0.0, 0.0)
    assert not supervisor.references.renewed
    supervisor.restart()
    assert supervisor.references.newest == -1


def test_a_landing_that_ends_with_the_stage_ends_as_it_was_to_and_for_the_same_reason() -> None:
    disabled, stopped = flying(), flying()
    disabled.disable()
    stopped.stop('a stop')
    for supervisor in (disabled, stopped):
        supervisor.restart()
    assert (disabled.mode, disabled.reason) == (Mode.DISABLED, 'disabled')
    assert (stopped.mode, stopped.reason) == (Mode.FAULT, 'a stop')


def test_a_landing_into_a_fault_is_not_reset_and_says_what_it_waits_for() -> None:
    supervisor = flying()
    supervisor.disable()
    assert supervisor.reset_fault() == (False, 'there is no fault')
    supervisor.stop('a stop')
    assert supervisor.reset_fault() == (False, 'a stop: still landing')
    assert supervisor.mode == Mode.LANDING


def test_after_a_fault_that_was_landed_there_is_none_left_but_itself() -> None:
    supervisor = flying()
    supervisor.stop('a stop')
    while (
        lead(supervisor, supervisor.references.newest + 1, Phase.TRACK, HOVER, 0.025)
        == Mode.LANDING
    ):
        pass
    assert supervisor.mode == Mode.FAULT
    assert supervisor.reset_fault()[0]
    assert supervisor.reset_fault() == (False, 'there is no fault')


def test_regulator_and_learning_begin_each_flight_anew() -> None:
    supervisor = flying()
    for sequence in range(2, 60):
        lead(supervisor, sequence, Phase.TRACK, HOVER, 0.0252)
    assert supervisor.regulator.internal_model[0] != 0.0
    lead(supervisor, 60, Phase.END, STOP, 0.031)
    learning = Recorder()
    supervisor.learning = learning  # type: ignore[assignment]
    lead(supervisor, 61, Phase.REST, STOP, 0.031)
    assert learning.told == []
    fresh = flying()
    lead(supervisor, 62, Phase.TRACK, HOVER, 0.025)
    assert learning.told[0] == 'rest'
    np.testing.assert_array_equal(
        supervisor.regulator.internal_model, fresh.regulator.internal_model
    )


@pytest.mark.parametrize('phase', [Phase.TRACK, Phase.STEP])
def test_learning_looks_ahead_and_learns_in_each_sample_where_it_repeats(phase: Phase) -> None:
    supervisor, learning = flying(), Recorder()
    supervisor.learning = learning  # type: ignore[assignment]
    lead(supervisor, 2, phase, HOVER, 0.025)
    arrays = supervisor.regulator.arrays
    wanted = ([*HOVER], [0.0] * 5)
    assert learning.told == [('look', arrays, phase == Phase.TRACK, *wanted), ('learn', arrays)]
    learning.told.clear()
    supervisor.disable()
    lead(supervisor, 3, phase, HOVER, 0.025)
    assert [each[:3] for each in learning.told] == [('look', arrays, False), ('learn', arrays)]


def test_only_a_new_step_begins_the_models_anew() -> None:
    supervisor = flying(**{'internal_model.restart_at_step': True})
    learned = []
    for sequence in range(2, 40):
        lead(supervisor, sequence, Phase.STEP, HOVER, 0.0252, segment=0)
        learned.append(abs(supervisor.regulator.internal_model[0]))
    before = learned[-1]
    assert before > 5.0 * learned[2]  # as within a step it goes on
    lead(supervisor, 40, Phase.STEP, HOVER, 0.0252, segment=1)
    assert supervisor.regulator.internal_model[0] == 0.0
    for sequence in range(41, 79):
        lead(supervisor, sequence, Phase.STEP, HOVER, 0.0252, segment=1)
    assert abs(supervisor.regulator.internal_model[0]) == pytest.approx(before, rel=0.2)


def test_what_the_regulator_cannot_go_on_with_is_a_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    supervisor = flying()
    monkeypatch.setattr(Regulator, 'fault', property(lambda _: 'a law that is late'))
    lead(supervisor, 2, Phase.TRACK, HOVER, 0.025)
    assert (supervisor.mode, supervisor.reason) == (Mode.LANDING, 'a law that is late')
    lead(supervisor, 3, Phase.TRACK, HOVER, 0.025)
    assert supervisor.mode == Mode.LANDING


def test_from_where_it_was_led_last_it_lands() -> None:
    supervisor = flying()
    lead(supervisor, 2, Phase.TRACK, ASIDE, 0.025)
    supervisor.disable()
    assert supervisor._landing is not None
    position, _, _ = supervisor._landing.step()
    assert position == pytest.approx(ASIDE)


# -- another regulator -----------------------------------------------------------------------------


def test_what_cannot_change_in_flight_is_refused_before_it_is_designed() -> None:
    heavier = build(ControllerParameters, QUICK | {'machine.mass_y': 7.5})
    with pytest.raises(ParameterError, match='mass_y'):
        flying().redesign(heavier)


def test_on_the_ground_learning_is_designed_anew_with_the_regulator() -> None:
    supervisor, learning = Supervisor(build(ControllerParameters, QUICK)), Recorder()
    supervisor.learning = learning  # type: ignore[assignment]
    changed = build(ControllerParameters, QUICK | {'machine.mass_y': 7.5})
    regulator = Regulator(changed)
    supervisor.adopt(regulator, model_maps(supervisor.regulator.arrays, regulator.arrays))
    assert learning.told == [changed]
    supervisor.learning = None
    supervisor.adopt(regulator, model_maps(supervisor.regulator.arrays, regulator.arrays))
    assert supervisor.learning is None


def test_a_new_regulator_is_watched_by_its_own_bounds_and_lands_on_its_own_stop() -> None:
    supervisor = Supervisor(build(ControllerParameters, STANDING))
    higher = build(ControllerParameters, {'machine.gap_max': 0.0305})
    regulator = Regulator(higher)
    supervisor.adopt(regulator, model_maps(supervisor.regulator.arrays, regulator.arrays))
    stop = np.array([0.0305, 0.0, 0.0, 0.0, 0.0])
    lead(supervisor, 0, Phase.REST, stop, 0.0305)
    lead(supervisor, 1, Phase.TRACK, HOVER, 0.025)
    assert lead(supervisor, 2, Phase.END, stop, 0.0301) == Mode.WAITING
    lead(supervisor, 3, Phase.REST, stop, 0.0305)
    lead(supervisor, 4, Phase.TRACK, HOVER, 0.025)
    for sequence in range(5, 60):
        lead(supervisor, sequence, Phase.TRACK, HOVER, 0.028)
    assert supervisor.mode == Mode.FAULT  # 3 mm off its way, which the bounds before allowed


def test_nothing_learns_by_default() -> None:
    assert iterative_learning(ControllerParameters()) is None
