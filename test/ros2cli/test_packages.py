"""Packages, executables and interfaces; ``ros2 run``."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from ros2_command import COMMAND, Ros2


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The package ``made_up`` with the executable ``tool``; returns its prefix."""
    (tmp_path / 'share' / 'ament_index' / 'resource_index' / 'packages').mkdir(parents=True)
    (tmp_path / 'share' / 'ament_index' / 'resource_index' / 'packages' / 'made_up').touch()
    folder = tmp_path / 'lib' / 'made_up'
    folder.mkdir(parents=True)
    (folder / 'no_tool').touch()
    tool = folder / 'tool'
    tool.write_text('#!/bin/sh\necho "$$ $GIVEN $*"\nexit 7\n')
    tool.chmod(0o755)
    before = os.environ['AMENT_PREFIX_PATH']
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{tmp_path}:{before}')
    return tmp_path


def test_packages(ros2: Ros2, package: Path) -> None:
    names = ros2('pkg', 'list').out.splitlines()
    assert names == sorted(names)
    assert {'made_up', 'rclpy', 'std_msgs'} <= set(names)
    assert ros2('pkg', 'prefix', 'made_up') == (0, f'{package}\n', '')
    assert ros2('pkg', 'prefix', '--share', 'made_up').out == f'{package}/share/made_up\n'
    assert ros2('pkg', 'prefix', 'none') == (1, '', 'Package not found\n')


def test_executables(ros2: Ros2, package: Path) -> None:
    assert ros2('pkg', 'executables', 'made_up') == (0, 'made_up tool\n', '')
    full = ros2('pkg', 'executables', '--full-path', 'made_up').out
    assert full == f'{package}/lib/made_up/tool\n'
    assert 'made_up tool\n' in ros2('pkg', 'executables').out
    assert ros2('pkg', 'executables', 'none') == (1, '', "Package 'none' not found\n")


def test_run_becomes_the_executable(package: Path) -> None:
    words = ['run', '--prefix', 'env "GIVEN=a b"', 'made_up', 'tool', '--ros-args', '-p', 'x:=1']
    with subprocess.Popen([*COMMAND, *words], stdout=subprocess.PIPE, text=True) as process:
        out, _ = process.communicate(timeout=30)
    assert out == f'{process.pid} a b --ros-args -p x:=1\n'
    assert process.returncode == 7


def test_run_finds_nothing(ros2: Ros2, package: Path) -> None:
    assert ros2('run', 'made_up', 'nothing') == (1, '', 'No executable found\n')
    assert ros2('run', 'none', 'nothing') == (1, '', "Package 'none' not found\n")
    again = package / 'lib' / 'made_up' / 'deeper'
    again.mkdir()
    (again / 'tool').symlink_to('../tool')
    code, _, err = ros2('run', 'made_up', 'tool')
    assert code == 1
    assert err.startswith(f'Multiple executables found:\n- {package}/lib/made_up/tool\n- ')


def test_interface_list(ros2: Ros2) -> None:
    messages = ros2('interface', 'list', '-m').out.splitlines()
    assert messages[0] == 'Messages:'
    assert messages[1:] == sorted(messages[1:])
    assert '    maglev_msgs/msg/Measurement' in messages
    everything = ros2('interface', 'list').out
    assert 'Services:\n' in everything
    assert '    std_srvs/srv/Trigger\n' in everything
    assert '_Request' not in everything


def test_interface_show(ros2: Ros2) -> None:
    code, out, _ = ros2('interface', 'show', 'maglev_msgs/msg/Measurement')
    assert code == 0
    assert out.startswith("# What the stage's six encoders read, one message a sample.\n")
    assert (
        'std_msgs/Header header\n'
        '\tbuiltin_interfaces/Time stamp\n'
        '\t\tint32 sec\n'
        '\t\tuint32 nanosec\n'
        '\tstring frame_id\n'
        'uint64 sequence          # sample number, from 0\n'
    ) in out


def test_interface_show_of_a_service(ros2: Ros2) -> None:
    assert ros2('interface', 'show', 'std_srvs/srv/Trigger').out == (
        '---\n'
        'bool success   # indicate successful run of triggered service\n'
        'string message # informational, e.g. for error messages\n'
    )


def test_interface_show_with_more_and_with_fewer_comments(ros2: Ros2) -> None:
    bare = ros2('interface', 'show', '--no-comments', 'maglev_msgs/msg/Measurement').out
    assert '#' not in bare
    assert bare.startswith('std_msgs/Header header\n\tbuiltin_interfaces/Time stamp\n')
    full = ros2('interface', 'show', '--all-comments', 'maglev_msgs/msg/Measurement').out
    assert '\t# ' in full


def test_interface_show_of_a_sequence_in_the_same_package(ros2: Ros2) -> None:
    out = ros2('interface', 'show', 'diagnostic_msgs/msg/DiagnosticArray').out
    assert 'DiagnosticStatus[] status' in out
    assert '\n\tbyte OK=0\n' in out
    assert '\n\tKeyValue[] values\n\t\tstring key\n' in out


def test_interface_unknown(ros2: Ros2) -> None:
    code, out, err = ros2('interface', 'show', 'maglev_msgs/msg/Nothing')
    assert (code, out) == (1, '')
    assert err.startswith("Could not find the interface '")
    assert err.endswith("/share/maglev_msgs/msg/Nothing.idl'\n")
    assert ros2('interface', 'show', 'none/msg/Nothing').err == "Unknown package 'none'\n"
    assert 'Expected three parts' in ros2('interface', 'show', 'Nothing').err
