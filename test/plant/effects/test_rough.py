"""All effects together, and none."""

from __future__ import annotations

import numpy as np
import pytest
from rough import PARAMS, ideal_stage, states

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import build, from_yaml, replace, specs, values
from maglev_plant.effects.parameters import EffectParameters
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage

FILES = [PARAMS / name for name in ('machine.yaml', 'plant.yaml', 'rough.yaml')]
MOVING = {
    'initial.position': (0.025, 0.01, -0.005, 0.001, 0.003),
    'initial.velocity': (0.01, 0.02, 0.0, 0.0, 0.01),
}
CURRENTS = ([-0.3, -0.2, -0.3, -0.25], [0.5, 0.2, -0.1, 0.3])


def _flown(parameters: PlantParameters, samples: int, forced: bool = False) -> np.ndarray:
    stage = SimulatedStage(parameters)
    if forced:
        stage.arrays.effects.moving = stage.arrays.effects.sensor.on = True
    rows = []
    for _ in range(samples):
        sample = stage.read()
        rows.append([*stage.state, *sample.gap, sample.x, sample.z])
        stage.write(*CURRENTS)
    return np.array(rows)


def test_with_every_effect_off_the_rough_path_is_the_plain_one() -> None:
    noisy = {'encoder.gap_noise': 3e-6, 'disturbance.amplitude': (1.0, 2.0, 3.0, 0.1, 0.2)}
    plain = build(PlantParameters, {**MOVING, **noisy})
    assert _flown(plain, 50, forced=True) == pytest.approx(_flown(plain, 50), abs=1e-13)


def test_a_machine_with_one_motor_is_the_plain_one_too() -> None:
    single = from_yaml(PlantParameters, 'plant', PARAMS / 'single_motor.yaml')
    single = replace(single, {'initial.position': (0.026, 0.01, 0.0, 0.0, 0.0)})
    assert _flown(single, 30, forced=True) == pytest.approx(_flown(single, 30), abs=1e-13)


def test_by_default_nothing_is_on() -> None:
    effects = ideal_stage().arrays.effects
    assert not effects.moving
    assert not effects.sensor.on


@pytest.mark.parametrize(
    'name',
    [name for name, spec in specs(PlantParameters).items() if name.startswith('effects.')],
)
def test_switching_on_any_effect_leaves_the_plain_path(name: str) -> None:
    """Sizes that change nothing while their effect is off need not."""
    sizes = ('dac_range', 'cycle', 'resistance', 'inductance', 'reach', 'time', 'model')
    sizes = (*sizes, 'frequency', 'axis', 'modes.damping')
    if name.endswith(sizes):
        return
    spec = specs(PlantParameters)[name]
    value = {float: 0.01, int: 12, bool: True, str: 'floor'}[spec.kind]
    if name.startswith('effects.sensor') and spec.kind is float:
        value = 1e-5
    if name.endswith(('magnet', 'winding', 'gain', 'static_ratio')):
        value = 1.1
    given = (value,) * len(spec.default) if spec.array else value
    stage = ideal_stage(**{name.replace('.', '__'): given})
    assert stage.arrays.effects.moving or stage.arrays.effects.sensor.on


def test_rough_switches_on_the_same_for_both_stages() -> None:
    plant = from_yaml(PlantParameters, 'plant', *FILES)
    bridge = from_yaml(BridgeParameters, 'hw_bridge', *FILES)
    assert plant.effects == bridge.effects
    assert plant.encoder == bridge.emulation.encoder
    off = EffectParameters()
    for group in values(off):
        name = group.split('.')[0]
        assert getattr(plant.effects, name) != getattr(off, name), name


def test_a_rough_run_repeats_bit_by_bit_and_another_seed_is_another_machine() -> None:
    rough = replace(from_yaml(PlantParameters, 'plant', *FILES), MOVING)
    first, again = _flown(rough, 40), _flown(rough, 40)
    assert np.array_equal(first, again)
    assert not np.array_equal(first, _flown(replace(rough, {'seed': 1}), 40))
    stage = SimulatedStage(rough)
    states(stage, 5)
    stage.configure()
    assert np.array_equal(states(stage, 1)[0], first[0, :10])


def test_finer_steps_of_the_rough_plant_change_little() -> None:
    rough = replace(from_yaml(PlantParameters, 'plant', *FILES), MOVING)
    coarse, fine = (_flown(replace(rough, {'substeps': n}), 30) for n in (10, 80))
    moved = np.abs(fine[:, :10:2] - fine[0, :10:2]).max(axis=0)
    assert np.all(np.abs(coarse - fine)[:, :10:2].max(axis=0) < 2e-3 * moved + 1e-8)
