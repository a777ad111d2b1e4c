"""The campaign with other samples than those of a millisecond: its rules are about times."""

from __future__ import annotations

import pytest

from maglev_model.parameters import replace
from maglev_study.faults.fly import Scenario
from maglev_study.faults.judge import Verdict
from maglev_study.faults.kinds import Fault
from maglev_study.faults.machines import PLAIN, Believed
from maglev_study.faults.train import fly_all


def believed(period: float) -> Believed:
    return Believed(*(replace(table, {'sample_time': period}) for table in PLAIN))


@pytest.fixture(params=[5e-4, 2e-3], scope='module')
def verdicts(request: pytest.FixtureRequest) -> list[Verdict]:
    """Of a controller that dies, of calls that hang, and of a gap that is stuck."""
    faults = (
        Fault('controller: killed'),
        Fault('call: hang', (0,), 12.0, 'write_analog'),
        Fault('call: hang', (0,), 30.0, 'write_analog'),
        Fault('stuck: a gap', (1,)),
    )
    runs = [Scenario(0, 'lift-off', 0.9, (fault,), 1) for fault in faults]
    flown = {run.faults: verdict for run, verdict in fly_all(runs, believed(request.param))}
    return [flown[fault,] for fault in faults]


def test_a_controller_that_dies_is_found_out_within_its_time(verdicts: list[Verdict]) -> None:
    assert verdicts[0].violations == ()
    assert verdicts[0].ended == 'landed'
    assert verdicts[0].detection == pytest.approx(0.006, abs=0.0021)


def test_a_call_may_hang_for_some_milliseconds(verdicts: list[Verdict]) -> None:
    assert [verdict.violations for verdict in verdicts[1:3]] == [(), ()]
    assert [verdict.ended for verdict in verdicts[1:3]] == ['landed', 'cut']


def test_an_encoder_that_is_stuck_is_found_out(verdicts: list[Verdict]) -> None:
    assert verdicts[3].violations == ()
    assert verdicts[3].ended == 'landed'
