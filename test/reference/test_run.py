"""A reference in use: what is due at a measurement, and what another stage changes."""

import numpy as np
import pytest

from maglev_model.parameters import build
from maglev_model.phases import Phase
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
    run.start(REST)
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


def test_after_a_gap_it_catches_up_in_bursts():
    run = run_at(0)
    run.due()
    run.observe(300)
    counts = [len(run.due()[1].phase) for _ in range(3)]
    assert counts == [128, 128, 44]
    assert run.due() is None


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
    run = run_at(5000)
    run.observe(5400)
    run.enter_phase()
    assert run.phase == Phase.LIFT_OFF
    assert not run.observe(3)
    assert (run.newest, run.started) == (5400, True)
    assert run.land()
    run.observe(9999)
    run.enter_phase()
    assert run.phase == Phase.END
    assert run.observe(3)
    assert (run.newest, run.started, run.autostart, run.phase) == (3, False, False, Phase.REST)
    assert not run.lift_off()
    assert not run.land()
    run.start(REST)
    first, block = run.due()
    assert first == 3
    assert (block.phase == Phase.REST).all()
    assert run.lift_off()
    assert not run.lift_off()


def test_a_start_from_elsewhere_is_refused_and_may_be_tried_again():
    run = ReferenceRun(PARAMETERS, 64, True)
    run.observe(7)
    with pytest.raises(UnreachableError, match='lower stop'):
        run.start(np.array([0.025, 0.0, 0.0, 0.0, 0.0]))
    assert not run.started
    run.start(REST)
    assert run.started
