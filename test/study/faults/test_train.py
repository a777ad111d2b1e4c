"""Flights of the campaign before anything has failed."""

from __future__ import annotations

import pytest

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import replace
from maglev_study.faults import train
from maglev_study.faults.fly import Scenario
from maglev_study.faults.kinds import Fault
from maglev_study.faults.machines import machine


@pytest.mark.parametrize(
    ('phase', 'said'), [('hover', 'is stuck'), ('after a fault', 'are not believed')]
)
def test_a_false_alarm_breaks_a_rule(
    monkeypatch: pytest.MonkeyPatch, phase: str, said: str
) -> None:
    """In flight it is a fault; while the bridge lands for another reason nobody would see it."""

    def suspicious(number: int) -> BridgeParameters:
        doubting = {'fault.friction': (0.0,) * 5, 'fault.stuck_gap': 3e-5}
        return replace(machine(number), doubting)

    monkeypatch.setattr(train, 'machine', suspicious)
    ((_, verdict),) = train.fly_all([Scenario(1, phase, 0.5, (Fault('none'),), 1)])
    ((rule, text),) = verdict.violations
    assert rule == 5
    assert 'though nothing had failed' in text
    assert said in text or phase != 'hover'
