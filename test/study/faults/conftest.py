"""What all tests of the campaign share."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from maglev_study.faults.fly import Scenario, fly
from maglev_study.faults.judge import Verdict
from maglev_study.faults.kinds import Fault
from maglev_study.faults.train import fly_all


@pytest.fixture
def flown() -> Callable[..., Verdict]:
    """Fly one fault on the nominal machine, while resting unless said otherwise."""

    def run(fault: Fault, phase: str = 'rest', instant: float = 0.5, seed: int = 1) -> Verdict:
        ((_, verdict),) = fly_all([Scenario(0, phase, instant, (fault,), seed)], work=fly)
        return verdict

    return run
