"""Which of the parameters on a command line a node is given, wherever it stands on the graph."""

from __future__ import annotations

import dataclasses
import os
import sys
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.node import Node

from maglev_model.parameters import ParameterError, parameter
from maglev_node import ros_parameters
from maglev_node.node import MaglevNode, NodeParameters


@dataclasses.dataclass(frozen=True, kw_only=True)
class Table:
    first: float = parameter(1.0, 'a number')
    second: float = parameter(1.0, 'another')
    names: tuple[str, ...] = parameter((), 'some names')


FILE = """
/**: {ros__parameters: {first: 2.0, second: 2.0, machine: {mass_y: 5.0}}}
plant: {ros__parameters: {second: 3.0, use_sim_time: true}}
/lab/plant: {ros__parameters: {names: [a, b]}}
other: {ros__parameters: {first: 9.0}}
"""


def declared(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> tuple[Any, bool]:
    """The table of a node ``plant`` with these ROS arguments, and whether it uses stage time."""
    command = ['plant', 'first:=7.0', '--ros-args', *arguments]
    monkeypatch.setattr(sys, 'argv', command)
    context = rclpy.Context()
    rclpy.init(args=command, context=context)
    node = Node('plant', context=context)
    try:
        table = ros_parameters.declare(node, 'plant', Table)
        sim_time = node.get_parameter('use_sim_time').value
        assert node.get_parameter('second').value == table.second
        return table, sim_time
    finally:
        node.destroy_node()
        context.shutdown()


def started(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> NodeParameters:
    """The parameters of a node of the project that is started with these ROS arguments."""
    command = ['plant', '--ros-args', *arguments]
    monkeypatch.setattr(sys, 'argv', command)
    context = rclpy.Context()
    rclpy.init(args=command, context=context)
    node = MaglevNode('plant', NodeParameters, context=context)
    try:
        return node.parameters
    finally:
        node.destroy_node()
        context.shutdown()


@pytest.mark.parametrize(
    ('where', 'names'),
    [
        ((), ()),
        (('-r', '__ns:=/lab'), ('a', 'b')),
        (('-r', '__node:=north'), ()),
        (('-r', '__ns:=/lab', '-r', '__node:=north'), ()),
    ],
)
def test_its_own_section_applies_wherever_it_is(
    where: tuple[str, ...], names: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / 'params.yaml'
    file.write_text(FILE)
    files = '--params-file', str(file)
    table, sim_time = declared(monkeypatch, *where, *files)
    assert (table, sim_time) == (Table(first=2.0, second=3.0, names=names), True)
    with pytest.raises(ParameterError, match="did you mean 'first'"):
        declared(monkeypatch, *where, '-p', 'frist:=4.0')


@pytest.mark.parametrize('where', [(), ('-r', '__ns:=/lab')])
def test_single_values_win(
    where: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / 'params.yaml'
    file.write_text(FILE)
    files = '--params-file', str(file)
    single = '-p', 'first:=4', '-p', 'elsewhere:second:=5.0', '--param', 'plant:names:=[c]'
    for arguments in ((*files, *single), (*single, *files)):
        table, _ = declared(monkeypatch, *where, *arguments, '--', '-p', 'second:=6.0')
        assert table == Table(first=4.0, second=3.0, names=('c',))


def test_a_run_s_parameters_fly_another_one_and_stay_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / 'plant.yaml'
    processor = min(os.sched_getaffinity(0))
    started(monkeypatch, '-p', f'effective_parameters:={file}', '-p', f'processors:=[{processor}]')
    effective = file.read_text()
    again = started(monkeypatch, '--params-file', str(file), '-p', 'processors:=[]')
    assert started(monkeypatch, '--params-file', str(file)).processors == (processor,)
    assert again.processors == ()
    assert file.read_text() == effective
