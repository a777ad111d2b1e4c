"""What the stage makes of a sample and of currents, at the bounds; nothing flies."""

from __future__ import annotations

import numpy as np
import pytest
from bridge_flight import HOME
from made_up import LOWER_STOP, Calls, active, aloft, refusing, volts, watched
from wired import OFFSET, bridge

from maglev_hw_bridge import amplifiers
from maglev_hw_bridge.drivers import DriverError
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing import guard
from maglev_hw_bridge.stage import BridgeStage, Mode
from maglev_model.contract.stage import EncoderSample, Fault, StageError, Truth
from maglev_model.parameters import build

UP = np.full(4, 0.1)
ZERO = np.zeros(4)


@pytest.mark.parametrize(
    ('late', 'behind'), [(0.0, 0), (0.79e-3, 0), (0.81e-3, 1), (1.79e-3, 1), (2.81e-3, 3)]
)
def test_a_sample_is_as_many_behind_as_it_is_late(late: float, behind: int) -> None:
    stage, _ = active()
    stage.driver.late = late
    stage._keep_up()
    assert stage._behind == behind


@pytest.mark.parametrize(
    ('behind', 'flying', 'new'), [(0, True, True), (1, True, False), (1, False, True)]
)
def test_what_is_put_out_while_samples_are_caught_up_with_flows_after_the_last(
    behind: int, *, flying: bool, new: bool
) -> None:
    stage, _ = active()
    stage._behind, stage.flying = behind, flying
    stage.amplifiers.arrays.current[:] = 0.7
    stage._keep_up()
    assert stage._flowed.tolist() == [0.7 if new else 0.0] * 12


@pytest.mark.parametrize(
    ('late', 'flying', 'ticks', 'fault'),
    [
        (0.51e-3, True, 1, False),
        (5e-3, True, 1, False),
        (5.01e-3, True, 1, True),
        (5.01e-3, False, 1, False),
    ],
)
def test_a_late_sample_is_counted_and_a_very_late_one_a_fault_in_flight(
    late: float, ticks: int, *, flying: bool, fault: bool
) -> None:
    stage, _ = active(boards__overrun=5e-3)
    aloft(stage)
    stage.flying = flying
    stage.driver.late = late
    stage._late()
    assert stage.late == late
    assert stage.late_ticks == ticks
    assert (stage.fault is not None) == fault
    if stage.fault is not None:
        assert stage.fault.kind == 'overrun'
        assert stage.mode is Mode.LANDING


@pytest.mark.parametrize(('late', 'ticks'), [(0.5e-3, 0), (0.51e-3, 1)])
def test_half_a_sample_late_is_late(
    monkeypatch: pytest.MonkeyPatch, late: float, ticks: int
) -> None:
    stage, _ = active()
    read = stage.driver.read

    def read_late(counts: np.ndarray) -> None:
        read(counts)
        stage.driver.late = late

    monkeypatch.setattr(stage.driver, 'read', read_late)
    stage.read()
    assert stage.late_ticks == ticks


def test_a_sample_and_its_truth() -> None:
    stage = BridgeStage.ready(build(BridgeParameters, HOME))
    sample = stage.read()
    assert isinstance(sample, EncoderSample)
    assert sample.gap == pytest.approx([LOWER_STOP] * 4)
    assert (sample.x, sample.z) == (0.0, 0.0)
    kept = sample.gap.copy()
    stage.encoders.arrays.length[:] = 0.0
    assert np.array_equal(sample.gap, kept), 'it is not the next one'
    stage.amplifiers.arrays.load[:] = np.arange(12)
    truth = stage.truth()
    assert isinstance(truth, Truth)
    assert truth.thermal_load.tolist() == [2.0, 5.0, 8.0, 11.0]
    assert truth.direct_current.shape == truth.quadrature_current.shape == (4,)
    assert truth.state[0] == pytest.approx(LOWER_STOP)
    assert active()[0].truth() is None, 'real boards do not tell'


def test_the_truth_between_two_counts() -> None:
    stage = BridgeStage.ready(build(BridgeParameters, HOME))
    stage.driver.boards.rig.place(np.array([LOWER_STOP - 1.3e-5, 0.7e-5, -0.4e-5, 0.0, 0.0]))
    stage.read()
    truth = stage.truth()
    assert truth is not None
    gaps, across = [truth.state[0]] * 4, truth.state[[2, 4]].tolist()
    assert truth.own_length == pytest.approx([*gaps, *across], abs=1e-7)


@pytest.mark.parametrize('mode', [Mode.CLOSED, Mode.READY, Mode.LOST])
def test_without_active_boards_there_is_no_sample(mode: Mode) -> None:
    stage, boards = bridge()
    if mode is not Mode.CLOSED:
        stage.configure()
    if mode is Mode.LOST:
        boards.failing = True
        with pytest.raises(StageError):
            stage.activate()
    with pytest.raises(StageError, match=f'no sample: {mode.value}'):
        stage.read()


@pytest.mark.parametrize('code', [guard.FINE, guard.JUMP, guard.MOTORS])
def test_what_the_guard_finds_is_a_fault(monkeypatch: pytest.MonkeyPatch, code: int) -> None:
    stage, _ = active()
    watch, fault = Calls((code, 5)), Calls()
    monkeypatch.setattr(stage.guard, 'watch', watch)
    monkeypatch.setattr(stage, '_sensing_fault', fault)
    stage.flying = True
    stage.amplifiers.arrays.current[:] = 0.7
    stage.read()
    ((length, flowed, flying, behind),) = watch.given
    assert length is stage.encoders.arrays.length
    assert flowed.tolist() == [0.7] * 12
    assert (flying, behind) == (True, 0)
    assert fault.given == ([] if code == guard.FINE else [(code, 5)])


@pytest.mark.parametrize('mode', [Mode.FOLLOWING, Mode.LANDING])
@pytest.mark.parametrize('returned', [True, False])
def test_an_encoder_that_is_believed_again_changes_the_landing(
    monkeypatch: pytest.MonkeyPatch, mode: Mode, *, returned: bool
) -> None:
    stage, _ = active()
    begin = Calls()
    monkeypatch.setattr(stage.guard, 'watch', Calls((guard.FINE, 0)))
    monkeypatch.setattr(stage, '_begin_landing', begin)
    stage.guard.arrays.returned = returned
    stage.mode = mode
    stage.read()
    assert len(begin.given) == int(returned and mode is Mode.LANDING)


@pytest.mark.parametrize('silent', [None, 4, 5])
def test_who_is_asked_in_vain_is_stuck(monkeypatch: pytest.MonkeyPatch, silent: int | None) -> None:
    stage, _ = active()
    fault = Calls()
    monkeypatch.setattr(stage._knock, 'look', Calls(silent))
    monkeypatch.setattr(stage, '_sensing_fault', fault)
    stage.read()
    assert fault.given == ([] if silent is None else [(guard.STUCK, silent)])
    assert stage.guard.failed == ([] if silent is None else [silent])


@pytest.mark.parametrize('mode', [Mode.FOLLOWING, Mode.LANDING])
@pytest.mark.parametrize('flying', [True, False])
@pytest.mark.parametrize('lifting', [True, False])
@pytest.mark.parametrize('silent', [(), (1, 2), (0, 1, 2, 3)])
def test_gaps_are_asked_while_a_controller_is_followed_and_are_stuck_together(
    monkeypatch: pytest.MonkeyPatch,
    silent: tuple[int, ...],
    mode: Mode,
    *,
    lifting: bool,
    flying: bool,
) -> None:
    stage, _ = active()
    fault, look = Calls(), Calls(silent)
    monkeypatch.setattr(stage._gap_knock, 'look', look)
    monkeypatch.setattr(stage, '_sensing_fault', fault)
    stage.mode, stage.flying, stage._lifting = mode, flying, lifting
    stage.read()
    hovers = flying and mode is Mode.FOLLOWING and not lifting
    assert look.given == [(stage.guard.arrays, hovers)]
    assert fault.given == ([(guard.STUCK, silent[0])] if silent else [])
    assert stage.guard.failed == list(silent)
    assert stage.guard.blamed == list(silent)


def test_the_stop_is_looked_at_with_every_sample() -> None:
    stage, boards = active()
    boards.stop_pressed = True
    stage.read()
    assert stage.fault == Fault('stop', 'the emergency stop is pressed', 'release it', False)


def test_whether_it_rests_is_looked_at_with_every_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    stage, _ = active()
    look = Calls()
    monkeypatch.setattr(stage, '_look_for_rest', look)
    stage.read()
    stage.read()
    assert len(look.given) == 2


def test_x_and_z_are_told_apart() -> None:
    stage, boards = active()
    boards.rig.place(np.array([LOWER_STOP, 0.01, -0.02, 0.0, 0.0]))
    sample = stage.read()
    assert (sample.x, sample.z) == pytest.approx((0.01, -0.02), abs=1e-5)


@pytest.mark.parametrize(('fails', 'call'), [('read', 'read'), ('write', 'hold')])
def test_boards_that_fail_in_a_sample_are_lost(
    monkeypatch: pytest.MonkeyPatch, fails: str, call: str
) -> None:
    stage, _ = active()
    stage.read()
    monkeypatch.setattr(stage.driver, fails, refusing(DriverError('for a test')))
    with pytest.raises(StageError, match='for a test'):
        getattr(stage, call)()
    assert stage.mode is Mode.LOST


def test_what_is_to_knock_goes_with_the_currents(monkeypatch: pytest.MonkeyPatch) -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    added, drive = Calls(3.0 * UP), Calls((amplifiers.FINE, 0))
    monkeypatch.setattr(stage._knock, 'added', added)
    monkeypatch.setattr(stage.amplifiers, 'drive', drive)
    stage._drive(UP, ZERO)
    ((state, i_d, i_q),) = added.given
    assert state is stage.guard.arrays
    assert i_d is UP
    assert i_q is ZERO
    ((i_d, i_q, *_),) = drive.given
    assert (i_d.tolist(), i_q.tolist()) == (UP.tolist(), (3.0 * UP).tolist())


def test_a_stage_can_wait_for_its_boards_and_begin_anew() -> None:
    assert BridgeStage.paced
    assert BridgeStage.restartable


def test_currents_are_put_out_as_they_are_asked_for_and_held() -> None:
    stage, boards = active()
    watched(stage, LOWER_STOP)
    stage.guard.arrays.believed[4:] = 3e-3, -5e-3
    motors = amplifiers.Amplifiers(stage.parameters)
    i_d, i_q = np.array([0.1, 0.2, 0.3, 0.4]), np.array([-0.2, 0.3, 0.1, -0.1])
    motors.drive(i_d, i_q, 3e-3, -5e-3)
    stage.write(i_d, i_q)
    assert volts(boards) == motors.volts.tolist()
    motors.drive(i_d, i_q, 3e-3, -5e-3)
    boards.volts[:] = 0.0
    stage.hold()
    assert volts(boards) == motors.volts.tolist()


@pytest.mark.parametrize('flying', [True, False])
@pytest.mark.parametrize('age', [4, 5])
def test_currents_of_five_samples_ago_are_stale_where_they_flow(age: int, *, flying: bool) -> None:
    stage, _ = active(fault__stale=5e-3)
    aloft(stage)
    stage.flying = flying
    stage.write(UP, ZERO, age)
    assert (stage.fault is not None) == (age >= 5)
    if stage.fault is not None:
        assert stage.fault.kind == 'stale'
        assert not np.any(stage._direct)
    else:
        assert stage.flying
        stage.hold()
        assert stage.fault is not None
        assert '5 ms' in stage.fault.reason


def test_no_currents_are_never_stale_on_the_stop() -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    stage.write(ZERO, ZERO, 100)
    assert stage.fault is None
    assert not stage.flying


def test_no_currents_in_flight_are_a_fault_and_on_the_stop_its_end() -> None:
    stage, _ = active()
    aloft(stage)
    stage.write(ZERO, ZERO)
    assert stage.fault is not None
    assert stage.fault.kind == 'controller'
    stage, _ = active()
    watched(stage, LOWER_STOP)
    stage.flying = True
    stage.write(ZERO, ZERO)
    assert stage.fault is None
    assert not stage.flying


@pytest.mark.parametrize('part', [0, 1])
def test_what_is_refused_does_not_become_the_currents_to_hold(part: int) -> None:
    stage, _ = active()
    aloft(stage)
    stage.write(UP, 2.0 * UP)
    bad = [UP.copy(), UP.copy()]
    bad[part][1] = np.nan
    with pytest.raises(ValueError, match='motor 2'):
        stage.write(*bad)
    assert stage._direct.tolist() == UP.tolist()
    assert stage._quadrature.tolist() == (2.0 * UP).tolist()
    assert stage.fault is not None
    assert stage.fault.kind == 'current'


def test_a_spent_budget_is_followed_and_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    stage, _ = active()
    aloft(stage)
    monkeypatch.setattr(stage, '_drive', lambda *_: (amplifiers.SPENT, 3))
    stage.mode = Mode.FOLLOWING
    assert stage._follow(UP, ZERO) == ''
    assert stage._direct.tolist() == UP.tolist()
    assert stage.fault is not None
    assert 'I2t' in stage.fault.reason


@pytest.mark.parametrize('mode', [Mode.DISABLED, Mode.READY, Mode.LANDING])
@pytest.mark.parametrize('part', [0, 1])
def test_what_is_not_finite_is_refused_in_every_mode(mode: Mode, part: int) -> None:
    stage, boards = active()
    if mode is Mode.DISABLED:
        stage.stop()
    elif mode is Mode.READY:
        stage.deactivate()
    else:
        aloft(stage)
        stage.stop()
    assert stage.mode is mode
    stage.write(UP, UP)  # not followed, and no offence
    if mode is not Mode.LANDING:
        assert volts(boards) == OFFSET
    bad = [UP.copy(), UP.copy()]
    bad[part][3] = np.inf
    with pytest.raises(ValueError, match='must be finite'):
        stage.write(*bad)


def test_a_disabled_stage_goes_on_putting_out_no_current() -> None:
    stage, boards = active()
    stage.stop()
    stage.amplifiers.arrays.volts[:] = 3.0
    stage.read()
    stage.hold()
    assert volts(boards) == OFFSET
