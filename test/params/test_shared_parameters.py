"""What is given once under ``/**``: each node takes its part and leaves the rest."""

from pathlib import Path

import pytest

from maglev_controller.parameters import ControllerParameters
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import from_yaml, read_yaml
from maglev_plant.parameters import PlantParameters
from maglev_reference.parameters import ReferenceParameters

PARAMS = Path(__file__).resolve().parents[2] / 'params'
TABLES = {
    'plant': PlantParameters,
    'hw_bridge': BridgeParameters,
    'controller': ControllerParameters,
    'reference': ReferenceParameters,
}


@pytest.mark.parametrize('node', TABLES)
def test_every_node_knows_the_same_machine(node):
    assert from_yaml(TABLES[node], node, PARAMS / 'machine.yaml') == TABLES[node]()
    built = from_yaml(TABLES[node], node, PARAMS / 'machine.yaml', PARAMS / 'single_motor.yaml')
    assert (built.machine.motors, built.machine.mass_y, built.machine.mass_x) == (1, 1.725, 5.3)
    guide = {'hw_bridge': lambda: built.emulation.guide, 'controller': lambda: None}
    found = guide.get(node, lambda: built.guide)()
    assert found is None or found.locked == (False, False, True, True, True)


@pytest.mark.parametrize('name', ['circle', 'helix', 'lissajous', 'square', 'waypoints'])
def test_controller_and_reference_have_the_same_internal_models(name):
    path = PARAMS / f'matched_{name}.yaml'
    reference, controller = (from_yaml(TABLES[n], n, path) for n in ('reference', 'controller'))
    assert reference.internal_model.fundamental == controller.internal_model.fundamental
    assert (
        reference.internal_model.fundamental == read_yaml(path, 'any')['internal_model.fundamental']
    )
    for loop, axis in zip(reference.loops, controller.axes, strict=True):
        assert loop.multiples == axis.multiples
    for node in ('plant', 'hw_bridge'):
        assert from_yaml(TABLES[node], node, path) == TABLES[node]()
