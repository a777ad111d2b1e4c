"""Parameter files as the nodes take them serve the library too, which is no node."""

from __future__ import annotations

from pathlib import Path

import pytest

from maglev_controller.node import ControllerNodeParameters
from maglev_controller.parameters import ControllerParameters
from maglev_hw_bridge.node import BridgeNodeParameters
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import ParameterError, from_yaml, specs, to_yaml
from maglev_model.parameters.node_only import NODE_ONLY
from maglev_monitor.bag.recorder import RecorderParameters
from maglev_monitor.metrics.run_parameters import RunParameters
from maglev_plant.node import PlantNodeParameters
from maglev_plant.parameters import PlantParameters
from maglev_reference.node import ReferenceNodeParameters
from maglev_reference.parameters import ReferenceParameters
from maglev_view.parameters import ViewParameters, WebParameters

TABLES = {
    'plant': (PlantNodeParameters, PlantParameters),
    'controller': (ControllerNodeParameters, ControllerParameters),
    'reference': (ReferenceNodeParameters, ReferenceParameters),
    'hw_bridge': (BridgeNodeParameters, BridgeParameters),
}
OF_ROS = {'qos_overrides', 'start_type_description_service', 'use_sim_time'}


@pytest.mark.parametrize('node', TABLES)
def test_a_nodes_file_serves_the_library(node: str, tmp_path: Path) -> None:
    own, pure = TABLES[node]
    assert set(NODE_ONLY[node]) - OF_ROS == set(specs(own)) - set(specs(pure))
    dumped = tmp_path / 'dumped.yaml'
    dumped.write_text(to_yaml(own(), node) + '    use_sim_time: false\n')
    assert from_yaml(pure, node, dumped) == pure()


def test_a_sample_time_for_all_is_every_tables_that_has_one(tmp_path: Path) -> None:
    """The recorder and the view have none."""
    shared = tmp_path / 'shared.yaml'
    shared.write_text('/**: {ros__parameters: {sample_time: 0.00125}}\n')
    tables = {**{name: pure for name, (_, pure) in TABLES.items()}, 'monitor': RunParameters}
    for node, table in tables.items():
        assert from_yaml(table, node, shared).sample_time == 1.25e-3
    assert from_yaml(WebParameters, 'web', shared).sample_time == 1.25e-3
    for node, without in (('recorder', RecorderParameters), ('view', ViewParameters)):
        assert from_yaml(without, node, shared) == without()


def test_names_of_another_node_and_groups_of_the_own_are_refused(tmp_path: Path) -> None:
    file = tmp_path / 'wrong.yaml'
    for text in ('lead: 3', 'limits: {mode: 1.0}'):
        file.write_text(f'controller: {{ros__parameters: {{{text}}}}}\n')
        with pytest.raises(ParameterError, match='there is no parameter'):
            from_yaml(ControllerParameters, 'controller', file)
