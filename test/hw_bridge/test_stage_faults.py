"""Which fault is latched, and how a landing begins and ends; nothing flies."""

from __future__ import annotations

import numpy as np
import pytest
from made_up import LOWER_STOP, Calls, active, aloft, watched

from maglev_hw_bridge import amplifiers
from maglev_hw_bridge import stage as module
from maglev_hw_bridge.sensing import guard
from maglev_hw_bridge.sensing.guard_arrays import LOST, PUT_RIGHT
from maglev_hw_bridge.stage import BridgeStage, Mode
from maglev_model.contract.stage import Fault


def test_what_lands_is_not_begun_anew_by_who_asks_for_it() -> None:
    stage, _ = active()
    aloft(stage)
    stage.land('for a test')
    assert (stage.mode, stage.why, stage.fault) == (Mode.LANDING, 'for a test', None)
    stage.landing.arrays.elapsed = 0.17
    stage.land('for another')
    assert (stage.landing.arrays.elapsed, stage.why) == (0.17, 'for a test')


def test_a_stop_says_what_it_is() -> None:
    stage, _ = active()
    stage.stop()
    assert stage.fault == Fault('stop', 'emergency stop', 'see to what made it necessary', False)
    assert stage.why == 'stop'
    stage, _ = active()
    stage.stop('why', 'command', 'what to do')
    assert stage.fault == Fault('command', 'why', 'what to do', False)
    stage.stop('again', 'command')
    assert stage.reset()[0], 'only an emergency stop outlasts a reset'


def test_the_first_fault_stays_unless_a_landing_is_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module.faults, 'consequence_of_cut', lambda *_: '; it falls')
    stage, boards = active()
    aloft(stage)
    stage._raise_fault('encoder', 'first', 'one')
    first = stage.fault
    stage._raise_fault('current', 'second', 'two')
    assert stage.fault is first
    assert first is not None
    assert not first.cut
    stage._raise_fault('current', 'third', 'three', cut=True)
    both = Fault('encoder', 'first; then third; it falls', 'one; three', True)
    assert stage.fault == both
    assert stage.why == 'encoder'
    assert stage.mode is Mode.DISABLED
    assert not boards.lines.enabled
    stage._raise_fault('current', 'fourth', 'four', cut=True)
    assert stage.fault == both, 'nothing lands any more'


def test_what_is_cut_is_of_the_kind_that_cuts_it_unless_an_encoder_failed_before() -> None:
    stage, _ = active()
    aloft(stage)
    stage._raise_fault('stop', 'first', 'one')
    stage._raise_fault('current', 'second', 'two', cut=True)
    assert stage.fault is not None
    assert stage.fault.kind == stage.why == 'current'


def test_a_cut_at_rest_foretells_no_fall() -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    stage._raise_fault('encoder', 'first', 'one', cut=True)
    assert stage.fault == Fault('encoder', 'first', 'one', True)


@pytest.mark.parametrize(
    ('y', 'rate', 'blind', 'mode'),
    [
        (LOWER_STOP, 0.0, False, Mode.DISABLED),
        (LOWER_STOP - 3e-4, 0.0, True, Mode.DISABLED),
        (LOWER_STOP - 3e-4, 0.0, False, Mode.LANDING),
        (LOWER_STOP - 3e-4, -0.06, True, Mode.LANDING),
        (0.025, 0.0, True, Mode.LANDING),
        (0.025, 0.0, False, Mode.LANDING),
    ],
)
def test_half_blind_and_near_the_stop_it_is_let_go(
    y: float, rate: float, mode: Mode, *, blind: bool
) -> None:
    stage, _ = active()
    watched(stage, y, rate)
    stage.flying = True
    if blind:
        stage.guard.arrays.trust[[0, 1]] = LOST  # no tilt is seen
    stage._begin_landing()
    assert stage.mode is mode


@pytest.mark.parametrize(
    ('impacts', 'softly'),
    [
        ({'lower': 0.0499}, True),
        ({'lower': 0.05}, False),
        ({'upper': 0.01}, False),
        ({'lower': 0.01, 'upper': 0.01}, False),
    ],
)
def test_it_falls_softly_on_the_lower_stop_alone(
    monkeypatch: pytest.MonkeyPatch, impacts: dict[str, float], *, softly: bool
) -> None:
    stage, _ = active()
    watched(stage, 0.0305, -0.02)
    ask = Calls(impacts)
    monkeypatch.setattr(module, 'impacts_of_cut', ask)
    assert stage._falls_softly() == softly
    assert ask.given == [(stage.parameters, 0.0305, -0.02)]


def test_what_does_not_fly_is_not_landed() -> None:
    stage, _ = active()
    watched(stage, 0.025)
    stage._begin_landing()
    assert stage.mode is Mode.DISABLED


def test_a_landing_begins_where_the_platen_is_when_all_samples_are_caught_up_with() -> None:
    stage, _ = active()
    aloft(stage)
    stage._behind = 2
    stage.land('for a test')
    begun: list[float] = []
    begin = stage.landing.begin

    def look(position: np.ndarray, *rest: np.ndarray) -> None:
        begun.append(float(position[0]))
        begin(position, *rest)

    stage.landing.begin = look  # type: ignore[method-assign]
    for y in (0.0251, 0.0252, 0.0253):
        watched(stage, y)
        stage._descend()
    assert begun == [0.0251, 0.0252]


def test_a_landing_goes_on_with_every_sample_and_drives_what_it_answers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stage, _ = active()
    aloft(stage)
    stage.read()
    watched(stage)
    stage.stop()
    drive = Calls((amplifiers.FINE, 0))
    monkeypatch.setattr(stage, '_drive', drive)
    stage.hold()
    assert stage.landing.arrays.elapsed == pytest.approx(1e-3)
    ((i_d, i_q),) = drive.given
    assert i_d is stage.landing.direct_current
    assert i_q is stage.landing.quadrature_current
    assert np.any(i_d)


def test_a_platen_that_leaves_its_way_down_is_cut() -> None:
    stage, _ = active()
    aloft(stage)
    stage.land('for a test')
    stage._descend()
    watched(stage, 0.0265)
    stage._descend()
    assert stage.mode is Mode.DISABLED
    assert stage.fault is not None
    assert (stage.fault.kind, stage.fault.cut) == ('current', True)


@pytest.mark.parametrize('code', [guard.RANGE, guard.GAP_RANGE])
def test_out_of_range_is_a_fault_but_for_what_lands(code: int) -> None:
    stage, _ = active()
    aloft(stage)
    stage._sensing_fault(code, 0)
    assert stage.fault is not None
    assert stage.fault.kind == 'range'
    assert stage.mode is Mode.LANDING
    assert 'outside its soft range' in stage.fault.reason
    assert ('y is 25.000 mm' if code == guard.RANGE else 'gap 1 is') in stage.fault.reason
    latched = stage.fault
    stage._sensing_fault(code, 1)
    assert stage.fault is latched
    stage, _ = active()
    aloft(stage)
    stage.land('for a test')
    stage._sensing_fault(code, 0)
    assert stage.fault is None


@pytest.mark.parametrize('y', [0.025, 0.0305])
@pytest.mark.parametrize('lost', [(0,), (0, 1, 2, 3)])
def test_without_any_gap_only_what_falls_down_by_itself_is_cut(
    lost: tuple[int, ...], y: float
) -> None:
    stage, _ = active()
    aloft(stage)
    stage.guard.arrays.position[0] = y
    stage.guard.arrays.trust[list(lost)] = LOST
    stage.guard.arrays.blamed[list(lost)] = 1
    stage._sensing_fault(guard.STUCK, 0)
    assert stage.fault is not None
    falls = len(lost) == 4 and y > 0.03
    assert stage.fault.cut == falls
    assert stage.mode is (Mode.DISABLED if falls else Mode.LANDING)
    assert ('pushed down unseen' in stage.fault.reason) == (len(lost) == 4 and not falls)
    assert ('strikes the lower stop at about' in stage.fault.reason) == (len(lost) == 4)


def test_without_any_gap_what_does_not_fly_is_not_pushed() -> None:
    stage, _ = active()
    stage.guard.arrays.position[0] = 0.025
    blamed(stage, 0, 1, 2, 3)
    stage._sensing_fault(guard.JUMP, 0)
    assert stage.fault is not None
    assert stage.fault.cut
    assert stage.fault.reason.endswith('jumped')
    assert stage.mode is Mode.DISABLED


def test_what_fails_while_it_is_pushed_down_ends_no_current() -> None:
    """The model, which has it on its stop by now, may be wrong."""
    stage, _ = active()
    aloft(stage)
    blamed(stage, 0, 1, 2, 3)
    stage._sensing_fault(guard.STUCK, 0)
    assert stage.mode is Mode.LANDING
    stage.guard.arrays.position[0] = stage.parameters.machine.gap_max
    stage.guard.arrays.rate[0] = 0.0
    stage.guard.arrays.trust[4], stage.guard.arrays.blamed[4] = LOST, 1
    stage._begin_landing()
    assert stage.mode is Mode.LANDING
    assert stage.landing.arrays.unseen


def blamed(stage: BridgeStage, *encoders: int, trust: int = LOST) -> None:
    stage.guard.arrays.blamed[:] = 0
    stage.guard.arrays.blamed[list(encoders)] = 1
    stage.guard.arrays.trust[list(encoders)] = trust


def test_what_is_found_out_while_it_lands_is_named_once() -> None:
    stage, _ = active()
    aloft(stage)
    stage.stop('for a test')
    for encoder in (4, 4, 5):
        blamed(stage, encoder)
        stage._sensing_fault(guard.STUCK, encoder)
    assert stage.fault is not None
    said = stage.fault.reason
    assert said.startswith('for a test; then encoder x is stuck')
    assert said.count('encoder x') == said.count('encoder z') == 1
    assert stage.fault.remedy.count('check its cable') == 2
    stage._sensing_fault(guard.MOTORS, 2)
    stage._sensing_fault(guard.MOTORS, 2)
    assert stage.fault.reason.count('do not explain') == 1
    assert (stage.fault.kind, stage.fault.cut) == ('stop', False)


def test_what_was_named_for_one_fault_is_named_for_the_next() -> None:
    stage, _ = active()
    for _ in range(2):
        aloft(stage)
        stage.stop('for a test')
        blamed(stage, 4)
        stage._sensing_fault(guard.STUCK, 4)
        assert stage.fault is not None
        assert 'encoder x' in stage.fault.reason
        stage._disable()
        stage.guard.trust()
        stage.read()
        assert stage.reset()[0]


def test_a_fault_of_its_own_is_not_named_beside_itself() -> None:
    stage, _ = active()
    aloft(stage)
    blamed(stage, 4)
    stage._sensing_fault(guard.STUCK, 4)
    stage._sensing_fault(guard.STUCK, 4)
    assert stage.fault is not None
    assert stage.fault.reason.count('encoder x') == 1
    stage, _ = active()
    aloft(stage)
    stage._sensing_fault(guard.MOTORS, 3)
    stage._sensing_fault(guard.MOTORS, 3)
    assert stage.fault is not None
    assert stage.fault.kind == 'current'
    assert stage.fault.reason.count('do not explain') == 1


@pytest.mark.parametrize(
    ('code', 'trust', 'anew'),
    [(guard.STUCK, LOST, True), (guard.JUMP, PUT_RIGHT, False), (guard.RESIDUAL, LOST, False)],
)
def test_a_landing_begins_anew_where_it_sees_less_than_before(
    code: int, trust: int, *, anew: bool
) -> None:
    stage, _ = active()
    aloft(stage)
    stage.stop('for a test')
    stage.landing.arrays.elapsed = 0.17
    blamed(stage, 0, trust=trust)
    if trust == LOST:
        stage.guard.arrays.trust[1] = LOST
    stage._sensing_fault(code, 0)
    assert stage.mode is Mode.LANDING
    assert stage.landing.arrays.elapsed == (0.0 if anew else 0.17)
