"""What a parameter file is refused for is said by the parameter's full name, value and bound."""

from __future__ import annotations

import pytest

from maglev_controller.parameters import ControllerParameters
from maglev_hw_bridge.emulation.rig import Rig
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import ParameterError, build
from maglev_plant.parameters import PlantParameters


@pytest.mark.parametrize(
    ('table', 'name', 'value', 'said'),
    [
        (
            PlantParameters,
            'machine.motors',
            2,
            "parameter 'machine.motors' is 2, it must be 1 or 4",
        ),
        (
            ControllerParameters,
            'machine.gap_min',
            0.04,
            "parameter 'machine.gap_min' is 0.04 m, it must be less than 'machine.gap_max'"
            ' (0.031 m)',
        ),
        (
            PlantParameters,
            'amplifier.continuous_current',
            9.0,
            "parameter 'amplifier.continuous_current' is 9 A, it must not exceed"
            " 'amplifier.peak_current' (7 A)",
        ),
        (
            PlantParameters,
            'effects.modes.gain',
            [0.1, 0.1],
            "parameters 'effects.modes.axis', 'frequency', 'damping' and 'gain' have 1, 1, 1 and 2"
            ' elements, they must have as many, at most 16',
        ),
        (
            ControllerParameters,
            'modes.gain',
            [0.1, 0.1],
            "parameters 'modes.axis', 'frequency', 'damping' and 'gain' have 1, 1, 1 and 2"
            ' elements, they must have as many',
        ),
        (
            BridgeParameters,
            'fault.gap_lower',
            0.04,
            "parameter 'fault.gap_lower' is 0.04 m, it must be less than 'fault.gap_upper'"
            ' (0.032 m)',
        ),
    ],
)
def test_what_a_group_refuses(table: type, name: str, value: object, said: str) -> None:
    with pytest.raises(ParameterError) as refusal:
        build(table, {name: value})
    assert str(refusal.value) == said


@pytest.mark.parametrize(
    ('name', 'value', 'said'),
    [
        (
            'emulation.wiring.phase_channel',
            [0] * 12,
            "parameter 'emulation.wiring.phase_channel' puts elements 0 and 1 on board 0, channel",
        ),
        (
            'emulation.initial.position',
            [0.04, 0.0, 0.0, 0.0, 0.0],
            "of the emulated machine ('emulation.*'): parameter 'initial.position' puts y at 0.04,",
        ),
    ],
)
def test_what_the_emulated_machine_refuses(name: str, value: object, said: str) -> None:
    parameters = build(BridgeParameters, {name: value})
    with pytest.raises(ParameterError) as refusal:
        Rig(parameters)
    assert str(refusal.value).startswith(said)
