"""What the stage decides by, tried at its bounds: what it watches is made up, nothing flies."""

from __future__ import annotations

import numpy as np
import pytest
from bridge_flight import HOME
from wired import OFFSET, bridge

from maglev_hw_bridge import amplifiers, guard
from maglev_hw_bridge import stage as module
from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.guard_arrays import LOST, PUT_RIGHT
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage, Mode
from maglev_model.parameters import build
from maglev_model.stage import EncoderSample, Fault, StageError, Truth

LOWER_STOP, RADIUS = 0.031, 0.1
UP = np.full(4, 0.1)
ZERO = np.zeros(4)


def active(**overrides: object) -> tuple[BridgeStage, EmulatedBoards]:
    stage, boards = bridge(**overrides)
    stage.configure()
    stage.activate()
    return stage, boards


def watched(stage: BridgeStage, y: float = 0.025, rate: float = 0.0, **more: object) -> None:
    """Have the observer say so, with all gaps at ``y`` unless told otherwise."""
    state = stage.guard.arrays
    state.samples = 200
    state.position[:] = state.rate[:] = state.disturbance[:] = 0.0
    state.position[0], state.rate[0] = y, rate
    state.believed[:4] = state.length[:4] = y
    for name, value in more.items():
        getattr(state, name)[:] = value


def aloft(stage: BridgeStage) -> None:
    """In flight, as far as the bridge knows."""
    watched(stage)
    stage.flying = True


def volts(boards: EmulatedBoards) -> list[float]:
    out: list[float] = boards.volts[[0] * 6 + [1] * 6, [*range(6), *range(6)]].tolist()
    return out


# -- at rest ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('above', 'rate', 'rests'),
    [
        (0.9e-5, 0.0, True),
        (1.1e-5, 0.0, False),
        (0.0, 0.99e-2, True),
        (0.0, -0.99e-2, True),
        (0.0, 1.01e-2, False),
        (0.0, -1.01e-2, False),
    ],
)
def test_nearer_than_ten_um_and_slower_than_a_count_in_a_sample_it_rests(
    above: float, rate: float, *, rests: bool
) -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP - above, rate)
    assert stage._touches() == stage._on_the_stop() == rests
    watched(stage, LOWER_STOP - 1e-3, rate, believed=LOWER_STOP)
    stage.guard.arrays.believed[2] = LOWER_STOP - above
    assert not stage._touches()
    assert stage._on_the_stop() == rests, 'all four have to be there'


@pytest.mark.parametrize(('above', 'near'), [(1.99e-4, True), (2.01e-4, False)])
def test_where_it_has_not_moved_for_a_tenth_of_a_second_near_its_stop_it_rests(
    above: float, *, near: bool
) -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP - above)
    stage._still_at = LOWER_STOP - above + 0.9e-5
    for sample in range(1, 101):
        stage._look_for_rest()
        assert stage._still_samples == (sample if near else 0)
        assert stage._on_the_stop() == (near and sample >= 100)


@pytest.mark.parametrize(('step', 'moved'), [(0.99e-5, False), (1.01e-5, True)])
def test_what_moves_by_more_than_ten_um_does_not_stand_still(step: float, *, moved: bool) -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP - 1e-4)
    stage._look_for_rest()
    for sample in range(50):
        stage._look_for_rest()
        assert stage._still_samples == sample + 1
    for _ in range(2):  # from where it stood, not from a sample ago
        stage.guard.arrays.position[0] -= 0.5 * step
        stage._look_for_rest()
    assert stage._still_samples == (0 if moved else 52)


@pytest.mark.parametrize('samples', [1, 2])
def test_it_has_rested_only_in_this_life(samples: int) -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    stage.guard.arrays.samples = samples
    stage._look_for_rest()
    assert stage._rests == (samples > 1)


def test_what_flew_has_to_rest_anew() -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    stage._look_for_rest()
    assert stage._rests
    stage.flying = True
    stage._look_for_rest()
    assert not stage._rests


@pytest.mark.parametrize(
    ('corner', 'y_rate', 'tilt_rate', 'left'),
    [
        (2.99e-4, 0.0, 0.0, False),
        (3.01e-4, 0.0, 0.0, True),
        (2.99e-4, 0.1, 0.0, False),  # down, it will not lift
        (0.0, -1.49e-2, 0.0, False),
        (0.0, -1.51e-2, 0.0, True),
        (0.0, 0.0, 0.149, False),
        (0.0, 0.0, -0.149, False),
        (0.0, 0.0, 0.151, True),
        (0.0, 0.0, -0.151, True),
        (1.0e-4, -0.99e-2, 0.0, False),
        (1.0e-4, -1.01e-2, 0.0, True),
    ],
)
@pytest.mark.parametrize('axis', [3, 4])
def test_a_corner_that_is_or_will_soon_be_0_3_mm_off_has_left(
    axis: int, corner: float, y_rate: float, tilt_rate: float, *, left: bool
) -> None:
    stage, _ = active()
    scale = 0.1 / stage.parameters.machine.radius
    for gap in range(4):
        watched(stage, LOWER_STOP, y_rate)
        stage.guard.arrays.rate[axis] = scale * tilt_rate
        stage.guard.arrays.length[gap] = LOWER_STOP - corner
        if tilt_rate and corner:
            continue
        assert stage._leaves() == left


def test_only_an_active_stage_is_left_unbidden() -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    stage._look_for_rest()
    stage.land('for a test')
    assert stage.mode is Mode.DISABLED
    watched(stage, LOWER_STOP - 1e-3)
    stage._look_for_rest()
    assert stage.fault is None
    stage.resume()
    stage._look_for_rest()
    assert stage.fault is not None
    assert stage.fault.kind == 'current'


@pytest.mark.parametrize(
    ('parked', 'away', 'slides'),
    [(98, 3.5e-4, False), (99, 3.5e-4, True), (99, 2.99e-4, False), (150, 3.01e-4, True)],
)
@pytest.mark.parametrize('axis', [1, 2])
@pytest.mark.parametrize('way', [-1.0, 1.0])
def test_what_was_parked_for_a_tenth_of_a_second_and_is_0_3_mm_off_slides(
    way: float, axis: int, parked: int, away: float, *, slides: bool
) -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    for _ in range(parked):
        assert not stage._slides()
    found = []
    steps = 5  # none is a leap, and after the first of them it still is parked
    for k in range(1, steps + 1):
        stage.guard.arrays.position[axis] = way * away * k / steps
        found.append(stage._slides())
    assert any(found) == slides
    assert found[-1] == slides


@pytest.mark.parametrize(('step', 'leaps'), [(0.99e-4, False), (1.01e-4, True)])
def test_what_leaps_in_a_sample_has_not_slid(step: float, *, leaps: bool) -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    for _ in range(120):
        stage._slides()
    found = []
    for k in range(1, 5):
        stage.guard.arrays.position[1] = step * k
        found.append(stage._slides())
    assert any(found) == (not leaps)


@pytest.mark.parametrize(('away', 'stays'), [(0.99e-4, True), (1.01e-4, False)])
def test_before_it_is_parked_it_may_not_move_by_a_tenth_of_a_millimetre(
    away: float, *, stays: bool
) -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    for _ in range(60):
        stage._slides()
    for k in range(1, 4):
        stage.guard.arrays.position[2] = away * k / 3
        stage._slides()
    assert stage._parked_samples == (63 if stays else 0)


def test_what_flies_is_not_parked() -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    for _ in range(120):
        stage._slides()
    stage.flying = True
    assert not stage._slides()
    assert stage._parked_samples == 0


# -- samples ---------------------------------------------------------------------------------------


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
        (0.5e-3, True, 0, False),
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
    if late > 0.5e-3:
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
    assert truth.state[0] == pytest.approx(LOWER_STOP)
    assert active()[0].truth() is None, 'real boards do not tell'


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


# -- currents --------------------------------------------------------------------------------------


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


# -- faults ----------------------------------------------------------------------------------------


def test_what_lands_is_not_begun_anew_by_who_asks_for_it() -> None:
    stage, _ = active()
    aloft(stage)
    stage.land('for a test')
    assert (stage.mode, stage.why, stage.fault) == (Mode.LANDING, 'for a test', None)
    stage._landing_samples = 17
    stage.land('for another')
    assert (stage._landing_samples, stage.why) == (17, 'for a test')


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


@pytest.mark.parametrize(('kind', 'ends'), [('stop', True), ('encoder', False)])
def test_only_a_landing_for_a_stop_has_a_longest_time(kind: str, *, ends: bool) -> None:
    stage, _ = active(boards__stop_time=1.5)
    aloft(stage)
    stage.stop('for a test', kind)
    for _ in range(1500):
        watched(stage)
        stage.landing.begin(stage.guard.arrays.position, np.zeros(5))
        stage._descend()
    assert stage.mode is Mode.LANDING
    stage.landing.begin(stage.guard.arrays.position, np.zeros(5))
    stage._descend()
    assert stage.mode is (Mode.DISABLED if ends else Mode.LANDING)


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


@pytest.mark.parametrize(
    ('code', 'goes_on'),
    [(amplifiers.FINE, True), (amplifiers.SPENT, True), (amplifiers.OVER_CURRENT, False)],
)
def test_currents_of_a_landing_that_are_refused_end_it(
    monkeypatch: pytest.MonkeyPatch, code: int, *, goes_on: bool
) -> None:
    stage, _ = active()
    aloft(stage)
    stage.land('for a test')
    monkeypatch.setattr(stage, '_drive', lambda *_: (code, 0))
    stage._descend()
    assert stage.mode is (Mode.LANDING if goes_on else Mode.DISABLED)


# -- sensing ---------------------------------------------------------------------------------------


@pytest.mark.parametrize('code', [guard.RANGE, guard.GAP_RANGE])
def test_out_of_range_is_a_fault_but_for_what_lands(code: int) -> None:
    stage, _ = active()
    aloft(stage)
    stage._sensing_fault(code, 0)
    assert stage.fault is not None
    assert stage.fault.kind == 'range'
    assert stage.mode is Mode.LANDING
    latched = stage.fault
    stage._sensing_fault(code, 1)
    assert stage.fault is latched


@pytest.mark.parametrize('lost', [(0,), (0, 1, 2, 3)])
def test_without_any_gap_there_is_no_landing(lost: tuple[int, ...]) -> None:
    stage, _ = active()
    aloft(stage)
    stage.guard.arrays.trust[list(lost)] = LOST
    stage.guard.arrays.blamed[list(lost)] = 1
    stage._sensing_fault(guard.STUCK, 0)
    assert stage.fault is not None
    assert stage.fault.cut == (len(lost) == 4)
    assert stage.mode is (Mode.DISABLED if len(lost) == 4 else Mode.LANDING)


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
    stage._landing_samples = 17
    blamed(stage, 0, trust=trust)
    if trust == LOST:
        stage.guard.arrays.trust[1] = LOST
    stage._sensing_fault(code, 0)
    assert stage.mode is Mode.LANDING
    assert stage._landing_samples == (0 if anew else 17)
