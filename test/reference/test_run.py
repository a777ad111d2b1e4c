"""A reference in use: what is due at a measurement, and what another stage changes."""

import numpy as np
import pytest

from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import Phase
from maglev_model.parameters import build
from maglev_reference.check import UnreachableError
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.run import ReferenceRun
from maglev_reference.timeline import Timeline

REST = np.array([0.031, 0.0, 0.0, 0.0, 0.0])
PARAMETERS = build(
    ReferenceParameters,
    {
        'trajectory': 'hold',
        'duration': 0.3,
        'run_in': 0.0,
        'move_time': 0.3,
        'lift_off.time': 0.5,
        'lift_off.settle': 0.1,
        'landing.time': 0.5,
    },
)


def run_at(sequence, autostart=True, lead=64):
    run = ReferenceRun(PARAMETERS, lead, autostart)
    assert run.observe(sequence)
    assert run.due() is None
    run.start(run.plan(REST))
    run.observe_controller(Mode.WAITING, sequence)
    return run


def test_it_begins_at_the_newest_sample_and_stays_ahead():
    run = run_at(1000)
    first, block = run.due()
    assert (first, len(block.phase), run.ahead) == (1000, 64, 63)
    assert run.due() is None
    assert run.observe(1003)
    first, block = run.due()
    assert (first, len(block.phase), run.ahead) == (1064, 3, 63)
    wanted = Timeline(PARAMETERS, REST).block(64, 3)
    for values, expected in zip(block, wanted, strict=True):
        np.testing.assert_array_equal(values, expected)


@pytest.mark.parametrize(('answered', 'due'), [(1063, 63), (1005, 5), (1064, 0), (9, 0)])
def test_an_answered_sample_counts_though_its_measurement_was_not_seen(answered, due):
    """Beyond what was published none can be answered: that is another stage's."""
    run = run_at(1000)
    run.due()
    run.observe_controller(Mode.REGULATING, answered)
    block = run.due()
    assert (0 if block is None else len(block[1].phase)) == due
    assert run.newest == 1000


def test_what_is_answered_later_shows_that_the_stage_runs():
    run = run_at(1000)
    answers = [1000, 1001, 1002, 1002, 17, 18]  # the last two of a stage that began anew
    told = [run.observe_controller(Mode.REGULATING, sequence) for sequence in answers]
    assert told == [False, True, True, False, False, False]


def flying_at(sequence):
    """Its lift-off is published, and the stage has got there."""
    run = run_at(sequence)
    rest = round(PARAMETERS.lift_off.wait / PARAMETERS.sample_time)
    for newest in range(sequence, sequence + rest + 1, 10):
        run.observe(newest)
        run.due()
    run.enter_phase()
    assert run.phase == Phase.LIFT_OFF
    return run


def test_after_a_gap_it_catches_up_in_bursts():
    run = flying_at(0)
    run.observe(run.newest + 300)
    counts = [len(run.due()[1].phase) for _ in range(3)]
    assert counts == [128, 128, 44]
    assert run.due() is None


@pytest.mark.parametrize('published', [False, True], ids=['at once', 'then'])
def test_held_up_before_lift_off_it_rests_on(published):
    """As by a busy machine: a controller cannot follow a lift-off that lies behind it."""
    run = run_at(747)
    if published:
        assert run.due()[0] == 747
    next_one = run.newest + run.ahead + 1
    run.observe(1063)
    run.observe_controller(Mode.WAITING, 1060)
    assert run.give_way() == ''
    first, block = run.due()
    assert first == 1063
    assert len(block.phase) == 64
    assert (block.phase == Phase.REST).all()
    entered = []
    for newest in range(1064, 1400):
        run.observe(newest)
        run.observe_controller(Mode.WAITING, newest - 1)
        run.due()
        if run.enter_phase():
            entered.append(newest)
            break
    rest = round(PARAMETERS.lift_off.wait / PARAMETERS.sample_time)
    assert entered == [747 + rest + 1063 - next_one]
    assert run.phase == Phase.LIFT_OFF


def test_what_has_come_in_time_shifts_nothing():
    run = run_at(747)
    run.due()
    rest = round(PARAMETERS.lift_off.wait / PARAMETERS.sample_time)
    for newest in range(747 + 64, 747 + rest, 64):  # the first that is not published, each time
        run.observe(newest)
        assert run.due()[0] == newest
    for newest, phase in ((747 + rest - 1, Phase.REST), (747 + rest, Phase.LIFT_OFF)):
        run.observe(newest)
        run.enter_phase()
        assert run.phase == phase


def test_where_a_lift_off_was_published_nothing_rests_on():
    run = run_at(747)
    rest = round(PARAMETERS.lift_off.wait / PARAMETERS.sample_time)
    for newest in range(747, 747 + rest - 50, 10):
        run.observe(newest)
        run.due()
    assert run.newest + run.ahead >= 747 + rest
    run.observe(5000)
    run.observe_controller(Mode.WAITING, 747 + rest)
    assert run.give_way() == 'the controller does not follow'


def test_phases_are_those_of_the_stages_sample():
    run = run_at(50)
    entered = []
    end = Timeline(PARAMETERS, REST).end
    for sequence in range(50, 50 + end + 2):
        assert not run.over
        run.observe(sequence)
        run.due()
        if run.enter_phase():
            entered.append(run.phase)
    whole = [Phase.LIFT_OFF, Phase.HOLD, Phase.TRACK, Phase.LAND, Phase.END]
    assert entered == whole
    assert run.over
    assert run.grounded


def test_another_stage_is_waited_for_anew_but_not_while_the_platen_flies():
    run = flying_at(5000)
    newest = run.newest
    assert not run.observe(3)
    assert (run.newest, run.started) == (newest, True)
    assert run.land()
    run.observe(9999)
    run.enter_phase()
    assert run.phase == Phase.END
    assert run.observe(3)
    assert (run.newest, run.started, run.autostart, run.phase) == (3, False, False, Phase.REST)
    assert not run.lift_off(REST)
    assert not run.land()
    run.start(run.plan(REST))
    first, block = run.due()
    assert first == 3
    assert (block.phase == Phase.REST).all()
    assert run.lift_off(REST)
    assert not run.lift_off(REST)


def test_a_stage_that_stopped_in_flight_is_followed_by_another():
    run = flying_at(5000)
    assert run.observe(3, silent=True)
    assert (run.newest, run.started, run.autostart, run.phase) == (3, False, False, Phase.REST)
    assert run.left == 'the stage began anew in flight'
    assert run.over
    run.start(run.plan(REST))
    assert not run.over
    assert run.lift_off(REST)
    assert run.left == ''


def test_a_start_from_elsewhere_is_refused_and_may_be_tried_again():
    run = ReferenceRun(PARAMETERS, 64, True)
    run.observe(7)
    with pytest.raises(UnreachableError, match='lower stop'):
        run.plan(np.array([0.025, 0.0, 0.0, 0.0, 0.0]))
    assert not run.started
    run.start(run.plan(REST))
    assert run.started


def test_nothing_beyond_rest_before_a_controller_was_seen():
    run = ReferenceRun(PARAMETERS, 400, True)
    run.observe(10)
    run.start(run.plan(REST))
    published = np.concatenate([run.due()[1].phase for _ in range(2)])
    rest = round(PARAMETERS.lift_off.wait / PARAMETERS.sample_time)
    assert len(published) == rest
    assert (published == Phase.REST).all()
    assert run.due() is None
    assert run.obstacle()[0]
    run.observe_controller(Mode.WAITING, 10)
    first, block = run.due()
    assert first == 10 + rest
    assert (block.phase == Phase.LIFT_OFF).all()
    wanted = Timeline(PARAMETERS, REST).block(rest, len(block.phase))
    np.testing.assert_array_equal(block.position, wanted.position)


@pytest.mark.parametrize('mode', [Mode.DISABLED, Mode.FAULT, Mode.LANDING])
def test_at_rest_it_goes_on_resting_until_lift_off(mode):
    run = run_at(0)
    run.observe_controller(mode, 0)
    assert run.give_way()
    assert not run.give_way()
    assert run.obstacle()[1][-1] == 'enable'
    run.observe(50)
    assert (run.due()[1].phase == Phase.REST).all()
    run.observe_controller(Mode.WAITING, run.newest)
    assert not run.give_way()
    assert run.idle
    assert run.obstacle() == ('', ())
    assert run.lift_off(REST)
    assert not run.idle


@pytest.mark.parametrize('mode', [Mode.DISABLED, Mode.FAULT, Mode.LANDING, Mode.WAITING])
def test_in_flight_it_leaves_its_run_for_good(mode):
    run = run_at(100)
    while run.due():
        run.observe(run.newest + 40)
        run.enter_phase()
        if run.phase == Phase.HOLD:
            break
        run.observe_controller(Mode.REGULATING, run.newest)
        assert not run.give_way()
    published = run.newest + run.ahead
    run.observe_controller(mode, run.newest)
    assert run.give_way()
    run.observe(run.newest + 200)
    first, block = run.due()
    assert first == published + 1
    assert (block.phase == Phase.END).all()
    assert (block.position == REST).all()
    run.enter_phase()
    assert run.over
    assert run.left
    assert not run.idle  # the platen may still be falling
    run.observe(run.newest + 1000)
    while run.due():
        pass
    assert run.idle
    run.observe_controller(Mode.WAITING, run.newest)
    assert not run.give_way()
    moved = np.array([0.0309, 1e-4, 0.0, 0.0, 0.0])
    assert run.lift_off(moved)
    assert not run.left
    run.observe(run.newest + 64)
    assert (run.due()[1].position == moved).all()


def test_after_a_landing_it_lifts_off_only_from_the_lower_stop():
    run = run_at(0)
    assert run.land()
    run.observe(10)
    with pytest.raises(UnreachableError, match='not on its lower stop'):
        run.lift_off(np.array([0.018, 0.0, 0.0, 0.0, 0.0]))
    run.observe(1000)
    assert (run.due()[1].phase == Phase.END).all()
    assert run.lift_off(REST)


def test_a_state_of_another_stage_says_nothing_of_this_one():
    run = run_at(0)
    run.observe(3)
    run.observe_controller(Mode.WAITING, 900)  # in its flight, of which sample 3 is before
    assert not run.give_way()


def test_slowly_is_what_the_newest_sample_waits_for():
    run = run_at(0)
    first, block = run.due(slowly=True)
    assert (first, len(block.phase)) == (0, 1)
    assert run.due(slowly=True) is None
    assert len(run.due()[1].phase) == 63


def test_the_stage_goes_on_while_the_timeline_is_made():
    run = ReferenceRun(PARAMETERS, 64, True)
    run.observe(0)
    timeline = run.plan(REST)
    run.observe(1000)
    run.start(timeline)
    run.observe_controller(Mode.WAITING, 1000)
    assert run.give_way() == ''
    first, block = run.due()
    assert first == 1000
    assert (block.phase == Phase.REST).all()
