"""Nodes fly with what set-up compiled ahead, and call it as it was called there."""

from __future__ import annotations

import json
import signal
import sys
from pathlib import Path
from typing import Any

import pytest
from flight import BRISK, ELLIPSE
from graph import PARAMS, ROOT, Nodes, Process, executable

from maglev_model.compiled import ahead

SUPPORT = ROOT / 'test' / 'support'
STAGES = {
    'plant': ['--params-file', str(PARAMS / 'benchmark.yaml')],
    'hw_bridge': ['--params-file', str(PARAMS / 'hw_bridge.yaml'), '-p', 'mode:=lockstep'],
}
REFERENCE = ['--params-file', str(PARAMS / ELLIPSE)]
for setting in (*BRISK, 'run_in:=0.1', 'duration:=0.2'):
    REFERENCE += ['-p', setting]


def told_ahead() -> dict[str, Any]:
    """By function, how it was called when it was compiled."""
    folder = ahead.folder()
    assert folder is not None
    files = [json.loads(path.read_text()) for path in folder.glob('*.json')]
    assert len(files) == 2
    return {name: kinds for one in files for name, kinds in one.items()}


def start(nodes: Nodes, stage: str, command: dict[str, list[str]]) -> dict[str, Process]:
    """Start a flight of that stage; what begins the command of each node is given."""
    arguments = {stage: STAGES[stage], 'controller': [], 'reference': REFERENCE}
    return {
        name: nodes.run(name, [*command[name], '--ros-args', *given])
        for name, given in arguments.items()
    }


@pytest.mark.parametrize('stage', STAGES)
def test_nodes_call_only_what_was_compiled_ahead_as_it_was_called_there(
    nodes: Nodes, tmp_path: Path, stage: str
) -> None:
    recorded = [sys.executable, str(SUPPORT / 'recorded_node.py')]
    flight = start(
        nodes,
        stage,
        {
            name: [*recorded, str(tmp_path / name), f'maglev_{name}.executables:{name}']
            for name in (stage, 'controller', 'reference')
        },
    )
    flight['reference'].wait_for('END at', 90.0)
    for process in flight.values():
        process.signal(signal.SIGINT)
    for process in flight.values():
        process.wait()
    ahead_of = told_ahead()
    for name in flight:
        called = json.loads((tmp_path / name).read_text())
        assert called, name
        assert called == {function: ahead_of.get(function) for function in called}


@pytest.mark.parametrize('stage', STAGES)
def test_no_node_loads_numba(nodes: Nodes, stage: str) -> None:
    flight = start(
        nodes,
        stage,
        {name: [executable(f'maglev_{name}', name)] for name in (stage, 'controller', 'reference')},
    )
    flight['view'] = nodes.run('view', [executable('maglev_view', 'view')])
    flight['reference'].wait_for('TRACK at')
    for name, process in flight.items():
        assert process.running, process.output
        maps = Path(f'/proc/{process.pid}/maps').read_text()
        assert 'llvmlite' not in maps, name
        assert name == 'view' or '_ahead.' in maps, name
