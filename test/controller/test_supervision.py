"""When the regulator acts: enabling, landing, and every call in every state."""

from __future__ import annotations

import copy
import functools

import numpy as np
import pytest
from supervised import HOVER, QUICK, STANDING, STOP, Flight

from maglev_controller.bumpless_transfer import model_maps
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_controller.supervision import Supervisor
from maglev_model.contract.controller_watch import Status
from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import Phase
from maglev_model.parameters import ParameterError, build


@pytest.fixture
def supervisor() -> Supervisor:
    return Supervisor(build(ControllerParameters, STANDING))


def test_an_enable_waits_for_the_next_lift_off(supervisor: Supervisor) -> None:
    flight = Flight(supervisor)
    flight.step(Phase.REST, STOP, 0.031)
    assert flight.step(Phase.TRACK, HOVER, 0.031) == Mode.REGULATING
    supervisor.give_up('a defect')
    assert flight.step(Phase.TRACK, HOVER, 0.031) == Mode.FAULT
    assert supervisor.reset_fault()[0]
    assert supervisor.enable()[0]
    for _ in range(3):
        assert flight.step(Phase.TRACK, HOVER, 0.031) == Mode.WAITING
        assert not supervisor.direct_current.any()
    assert flight.step(Phase.END, STOP, 0.031) == Mode.WAITING
    assert flight.step(Phase.LIFT_OFF, STOP, 0.031) == Mode.REGULATING


@pytest.mark.parametrize(
    ('resting', 'unseen', 'mode'),
    [(0, 15, Mode.REGULATING), (15, 15, Mode.REGULATING), (0, 25, Mode.WAITING)],
)
def test_a_lift_off_may_begin_unseen_but_is_not_followed_from_its_middle(
    resting: int, unseen: int, mode: Mode
) -> None:
    """References that come late: some of the rest, then as many of the lift-off."""
    supervisor = waiting()
    flight = Flight(supervisor)
    flight.step(Phase.REST, STOP, 0.031)
    for phase in [Phase.REST] * resting + [Phase.LIFT_OFF] * unseen:
        flight.sequence += 1
        supervisor.step(-1, np.full(4, 0.031), 0.0, 0.0)
        supervisor.references.store(flight.sequence, phase, 0, STOP, np.zeros(5), np.zeros(5))
    assert flight.step(Phase.LIFT_OFF, STOP, 0.031) == mode
    flight.step(Phase.END, STOP, 0.031)
    assert flight.step(Phase.LIFT_OFF, STOP, 0.031) == Mode.REGULATING


def test_another_reference_in_flight_is_not_followed_either(supervisor: Supervisor) -> None:
    """One that comes when the first, which rested, is long gone."""
    flight = Flight(supervisor)
    flight.step(Phase.REST, STOP, 0.031)
    for _ in range(500):
        supervisor.step(-1, np.full(4, 0.031), 0.0, 0.0)
    flight.sequence += 500
    for _ in range(3):
        assert flight.step(Phase.TRACK, HOVER, 0.031) == Mode.WAITING


def test_a_flight_that_is_not_followed_is_looked_into_once(
    supervisor: Supervisor, monkeypatch: pytest.MonkeyPatch
) -> None:
    flight, looked = Flight(supervisor), []
    flight.step(Phase.REST, STOP, 0.031)
    flight.sequence += 500
    flight.step(Phase.TRACK, HOVER, 0.031)
    find = supervisor.references.find
    monkeypatch.setattr(supervisor.references, 'find', lambda n: looked.append(n) or find(n))
    for _ in range(3):
        assert flight.step(Phase.TRACK, HOVER, 0.031) == Mode.WAITING
    assert len(looked) == 3  # the samples' own
    flight.step(Phase.REST, STOP, 0.031)
    assert flight.step(Phase.LIFT_OFF, STOP, 0.031) == Mode.REGULATING


def test_a_landing_cannot_be_called_off(supervisor: Supervisor) -> None:
    flight = Flight(supervisor)
    flight.step(Phase.REST, STOP, 0.031)
    flight.step(Phase.TRACK, HOVER, 0.025)
    assert supervisor.disable()[0]
    assert not supervisor.enable()[0]
    assert flight.step(Phase.TRACK, HOVER, 0.025) == Mode.LANDING


# -- every call in every state ---------------------------------------------------------------------


LANDING_SAMPLES = 160


@functools.cache
def _made() -> Supervisor:
    return Supervisor(build(ControllerParameters, QUICK))


def waiting() -> Supervisor:
    return copy.deepcopy(_made())


def regulating() -> Supervisor:
    supervisor = waiting()
    flight = Flight(supervisor)
    flight.step(Phase.REST, STOP, 0.031)
    assert flight.step(Phase.TRACK, HOVER, 0.025) == Mode.REGULATING
    return supervisor


def disabled() -> Supervisor:
    supervisor = waiting()
    supervisor.disable()
    return supervisor


def landing() -> Supervisor:
    supervisor = regulating()
    supervisor.disable()
    return supervisor


def stopping() -> Supervisor:
    supervisor = regulating()
    supervisor.stop('stopped')
    return supervisor


def stopped() -> Supervisor:
    supervisor = waiting()
    supervisor.stop('stopped')
    return supervisor


def given_up() -> Supervisor:
    supervisor = regulating()
    supervisor.give_up('given up')
    return supervisor


STATES = {
    f.__name__: f for f in (waiting, regulating, disabled, landing, stopping, stopped, given_up)
}
MODES = {
    'waiting': Mode.WAITING,
    'regulating': Mode.REGULATING,
    'disabled': Mode.DISABLED,
    'landing': Mode.LANDING,
    'stopping': Mode.LANDING,
    'stopped': Mode.FAULT,
    'given_up': Mode.FAULT,
}
# What each call makes of each state: success, the mode at once, and the mode it comes to rest in.
D, W, R, L, F = Mode.DISABLED, Mode.WAITING, Mode.REGULATING, Mode.LANDING, Mode.FAULT
TABLE: dict[str, dict[str, tuple[bool, Mode, Mode]]] = {
    'enable': {
        'waiting': (True, W, W),
        'regulating': (True, R, R),
        'disabled': (True, W, W),
        'landing': (False, L, D),
        'stopping': (False, L, F),
        'stopped': (False, F, F),
        'given_up': (False, F, F),
    },
    'disable': {
        'waiting': (True, D, D),
        'regulating': (True, L, D),
        'disabled': (True, D, D),
        'landing': (True, L, D),
        'stopping': (True, L, F),
        'stopped': (True, F, F),
        'given_up': (True, F, F),
    },
    'stop': {
        'waiting': (True, F, F),
        'regulating': (True, L, F),
        'disabled': (True, F, F),
        'landing': (True, L, F),
        'stopping': (True, L, F),
        'stopped': (True, F, F),
        'given_up': (True, F, F),
    },
    'reset_fault': {
        'waiting': (False, W, W),
        'regulating': (False, R, R),
        'disabled': (False, D, D),
        'landing': (False, L, D),
        'stopping': (False, L, F),
        'stopped': (True, D, D),
        'given_up': (True, D, D),
    },
}


@pytest.mark.parametrize('state', STATES)
@pytest.mark.parametrize('call', TABLE)
def test_every_call_in_every_state(call: str, state: str) -> None:
    supervisor = STATES[state]()
    assert supervisor.mode == MODES[state]
    arguments = ('the test',) if call == 'stop' else ()
    success, at_once, at_last = TABLE[call][state]
    assert getattr(supervisor, call)(*arguments)[0] == success
    assert supervisor.mode == at_once
    flight = Flight(supervisor)
    flight.sequence = 10
    for _ in range(LANDING_SAMPLES + 5):
        flight.step(Phase.TRACK, HOVER, 0.025)
        flew = supervisor.flying
        assert flew == bool(np.any(supervisor.direct_current))
        expected = Status.FLYING if flew else Status.RESTING
        if state == 'given_up' and call != 'reset_fault':
            expected = Status.GAVE_UP
        assert supervisor.status == expected
        if not flew:
            break
    assert supervisor.mode == at_last


@pytest.mark.parametrize('state', STATES)
def test_a_controller_that_gives_up_says_so_where_it_flew(state: str) -> None:
    supervisor = STATES[state]()
    flew = supervisor.flying or state == 'given_up'
    supervisor.give_up('for a reason')
    assert (supervisor.mode, supervisor.reason) == (Mode.FAULT, 'for a reason')
    assert not np.any(supervisor.direct_current)
    assert supervisor.status == (Status.GAVE_UP if flew else Status.RESTING)
    assert supervisor.reset_fault()[0]
    assert supervisor.status == Status.RESTING


@pytest.mark.parametrize(
    ('state', 'mode'),
    [
        ('waiting', W),
        ('regulating', W),
        ('disabled', D),
        ('landing', D),
        ('stopping', F),
        ('stopped', F),
        ('given_up', F),
    ],
)
def test_a_stage_that_begins_anew_ends_flights_but_no_faults(state: str, mode: Mode) -> None:
    supervisor = STATES[state]()
    supervisor.restart()
    assert supervisor.mode == mode
    assert not np.any(supervisor.direct_current)
    flight = Flight(supervisor)
    if mode == W:
        assert flight.step(Phase.TRACK, HOVER, 0.031) == W  # not from the middle of a flight
        assert flight.step(Phase.REST, STOP, 0.031) == W
        assert flight.step(Phase.TRACK, HOVER, 0.031) == R


@pytest.mark.parametrize('call', ['disable', 'stop'])
def test_a_landing_goes_on_whoever_asks_for_another(call: str) -> None:
    plain, asked = landing(), landing()
    arguments = ('the test',) if call == 'stop' else ()
    for n in range(120):
        if n == 60:
            getattr(asked, call)(*arguments)
        for supervisor in (plain, asked):
            supervisor.step(-1, np.full(4, 0.025), 0.0, 0.0)
    assert np.array_equal(asked.direct_current, plain.direct_current)


def test_a_measurement_that_cannot_be_believed_is_given_up() -> None:
    for state in (regulating, landing, stopping):
        supervisor = state()
        flight = Flight(supervisor)
        flight.sequence = 10
        assert flight.step(Phase.TRACK, HOVER, float('nan')) == Mode.FAULT
        assert supervisor.status == Status.GAVE_UP
        assert 'not finite' in supervisor.reason


@pytest.mark.parametrize('restart', [False, True])
def test_models_begin_anew_at_a_step_where_that_is_wanted(restart: bool) -> None:
    parameters = build(ControllerParameters, {'internal_model.restart_at_step': restart})
    supervisor = Supervisor(parameters)
    flight = Flight(supervisor)
    flight.step(Phase.REST, STOP, 0.031)
    for _ in range(50):
        flight.step(Phase.TRACK, HOVER, 0.0252)
    learned = np.abs(supervisor.regulator.internal_model[0])
    flight.step(Phase.STEP, HOVER, 0.0252, segment=1)
    now = np.abs(supervisor.regulator.internal_model[0])
    assert learned > 0.0
    assert (now == 0.0) == restart
    for _ in range(50):
        flight.step(Phase.STEP, HOVER, 0.0252, segment=1)
    flight.step(Phase.TRACK, HOVER, 0.0252, segment=2)  # which is no step
    assert np.abs(supervisor.regulator.internal_model[0]) > 0.0


def test_the_end_of_a_reference_off_the_stop_is_a_landing() -> None:
    for gap, mode in ((0.0306, Mode.WAITING), (0.0304, Mode.LANDING)):
        flight = Flight(regulating())
        flight.sequence = 10
        assert flight.step(Phase.END, STOP, gap) == mode
    flight = Flight(regulating())
    flight.supervisor.step(-1, np.full(4, 0.031), 0.0, 0.0)
    assert flight.supervisor.mode == Mode.LANDING  # a reference that is lost


def test_a_second_retuning_during_the_first_ones_fade_makes_no_jump() -> None:
    supervisor = regulating()
    flight = Flight(supervisor)
    flight.sequence = 10
    for _ in range(20):
        flight.step(Phase.TRACK, HOVER, 0.0251)
    for bandwidth in (180.0, 240.0):
        before = supervisor.regulator.virtual_input.copy()
        changed = build(ControllerParameters, {**QUICK, 'y.bandwidth': bandwidth})
        regulator = Regulator(changed)
        supervisor.adopt(regulator, model_maps(supervisor.regulator.arrays, regulator.arrays))
        flight.step(Phase.TRACK, HOVER, 0.0251)
        step = abs(supervisor.regulator.virtual_input[0] - before[0])
        assert step < 0.05 * abs(before[0])


def test_what_cannot_change_in_flight_is_refused_also_when_it_took_off_meanwhile() -> None:
    supervisor = waiting()
    heavier = Regulator(build(ControllerParameters, {**QUICK, 'machine.mass_y': 7.5}))
    maps = model_maps(supervisor.regulator.arrays, heavier.arrays)
    flying = regulating()
    with pytest.raises(ParameterError, match='mass_y'):
        flying.adopt(heavier, maps)
    assert flying.parameters == _made().parameters
    supervisor.adopt(heavier, maps)
    assert supervisor.parameters.machine.mass_y == 7.5


def test_why_it_does_not_regulate_is_told_from_the_beginning() -> None:
    assert Supervisor(ControllerParameters(), enabled=False).reason == 'not enabled'
    assert Supervisor(ControllerParameters()).reason == ''


def test_the_law_has_answered_once_before_the_first_sample(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its compiling is not left to the first sample in flight; nothing is left of that answer."""
    asked = []
    step = Regulator.step

    def counted(regulator: Regulator, *given: np.ndarray) -> int:
        asked.append(given[0].copy())
        return step(regulator, *given)

    monkeypatch.setattr(Regulator, 'step', counted)
    supervisor = Supervisor(ControllerParameters())
    np.testing.assert_array_equal(asked, [np.full(4, 0.031)])
    assert not supervisor.direct_current.any()
    assert not supervisor.regulator.error.any()
