"""The single-motor machine of refs. [10], [11] and its flights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.contract.phases import Phase
from maglev_model.machine import MachineParameters
from maglev_model.parameters import ParameterError, build, from_yaml, replace
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.timeline import Timeline
from maglev_study.closed_loop import run
from maglev_study.references import References

PARAMS = Path(__file__).resolve().parents[2] / 'params'


def test_a_single_motor_needs_its_guides_locked() -> None:
    """What it cannot move must not be free."""
    with pytest.raises(ParameterError, match=r"'guide.locked' leaves z, phi or theta free"):
        build(PlantParameters, {'machine.motors': 1})
    with pytest.raises(ParameterError, match=r"'machine.motors' is 2, it must be 1 or 4"):
        MachineParameters(motors=2)


@pytest.mark.parametrize('scenario', ['steps', 'sinusoids'])
def test_its_scenario_flies(scenario: str) -> None:
    """From the stop through the shortened scenario: at the encoders' resolution, one motor only."""
    single = PARAMS / 'single_motor.yaml'
    reference = from_yaml(
        ReferenceParameters, 'reference', single, PARAMS / f'scenario_single_motor_{scenario}.yaml'
    )
    short = {'duration': 1.0 if scenario == 'steps' else 4.0, 'steps.settle': 1.0}
    timeline = Timeline(replace(reference, short))
    assert timeline.end is not None
    block = timeline.block(0, timeline.end)
    stage = SimulatedStage(from_yaml(PlantParameters, 'plant', PARAMS / 'benchmark.yaml', single))
    regulator = Regulator(from_yaml(ControllerParameters, 'controller', single))
    assert stage.parameters.machine == regulator.parameters.machine == reference.machine
    outcome = run(regulator, stage, References(block.position, block.velocity, block.acceleration))
    assert not outcome.direct_current[:, [0, 2, 3]].any()
    error = 1e6 * np.abs(outcome.output - block.position)
    assert not error[:, 2:].any()
    if scenario == 'sinusoids':
        tracked = block.phase == Phase.TRACK
        assert np.all(error[tracked, :2].mean(axis=0) < 4.0)
        return
    for segment in np.unique(block.segment[block.phase == Phase.STEP]):
        assert np.all(error[block.segment == segment, :2][-500:].max(axis=0) < 10.0)
