"""What outlasts the process: the load, a latched fault, and who has the boards."""

from __future__ import annotations

import dataclasses
import errno
import json
import os
from pathlib import Path

import numpy as np
import pytest
from wired import bridge

from maglev_hw_bridge.drivers import DriverError
from maglev_hw_bridge.memory import Memory, memory_file
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage, Mode
from maglev_model.contract.stage import Fault, StageError
from maglev_model.parameters import ParameterError, build, replace


def kept(path: Path, **overrides: object) -> BridgeStage:
    return bridge(boards__memory=str(path), **overrides)[0]


def cold(stage: BridgeStage) -> BridgeStage:
    stage._cooling_since -= 60.0
    return stage


def test_emulated_boards_keep_nothing_and_real_ones_a_file(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv('XDG_STATE_HOME', str(tmp_path))
    assert memory_file(BridgeParameters()) is None
    real = memory_file(build(BridgeParameters, {'driver': 'quanser'}))
    assert real == tmp_path / 'maglev-stage' / 'q8-0-1.json'
    monkeypatch.delenv('XDG_STATE_HOME')
    monkeypatch.setenv('HOME', str(tmp_path))
    named = {'driver': 'quanser', 'boards.identifier': ('usb/1', 'usb/2')}
    real = memory_file(build(BridgeParameters, named))
    assert real == tmp_path / '.local' / 'state' / 'maglev-stage' / 'q8-usb_1-usb_2.json'
    named['boards.identifier'] = ('usb/2', 'usb/1')
    assert memory_file(build(BridgeParameters, named)) == real  # the same boards


def test_what_is_another_file_in_every_folder_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ParameterError, match=r"'boards\.memory' is 'it\.json'.*its whole path"):
        memory_file(build(BridgeParameters, {'boards.memory': 'it.json'}))
    monkeypatch.setenv('XDG_STATE_HOME', 'state')
    with pytest.raises(ParameterError, match=r"makes 'state/maglev-stage/q8-0-1\.json'"):
        memory_file(build(BridgeParameters, {'driver': 'quanser'}))


def test_without_a_file_nothing_is_kept() -> None:
    memory = Memory(BridgeParameters())
    memory.claim()
    memory.keep(np.ones(12), Fault('stale', 'for a test', 'none', True), active=True)
    memory.record_proof(BridgeParameters())
    load, fault = memory.recall()
    assert not np.any(load)
    assert fault is None


def test_load_and_fault_outlast_the_process(tmp_path: Path) -> None:
    path = tmp_path / 'state' / 'boards.json'
    first = kept(path)
    first.configure()
    cold(first).activate()
    first.stop('for a reason')
    first.amplifiers.arrays.load[3] = 0.9
    first.close()
    second = kept(path)
    second.configure()
    assert second.fault == first.fault
    assert 0.5 < second.amplifiers.load < 0.9
    with pytest.raises(StageError, match='for a reason'):
        second.activate()
    cold(second)
    assert second.reset()[0]
    assert second.mode is Mode.READY
    second.memory.release()  # as the system does for a process that is killed, here inactive
    third = kept(path)
    third.configure()
    assert third.fault is None
    third.close()


@pytest.mark.parametrize('cut', [False, True])
def test_a_stop_since_the_fault_outlasts_the_process(tmp_path: Path, *, cut: bool) -> None:
    path = tmp_path / 'boards.json'
    first = kept(path)
    first.configure()
    first.fault = Fault('range', 'for a test', 'none', cut)
    first.stop('by somebody else')
    first.close()
    second = kept(path)
    second.configure()
    assert second.fault == Fault(
        'stop', 'for a test; then by somebody else', 'none; see to that', cut
    )
    assert 'by somebody else' in cold(second).reset()[1]
    second.close()
    third = kept(path)
    third.configure()
    assert third.fault is None
    third.close()


def test_what_is_killed_in_flight_is_a_fault_and_hot(tmp_path: Path) -> None:
    path = tmp_path / 'boards.json'
    first = kept(path)
    first.configure()
    cold(first).activate()
    first.memory.release()  # as the system does for a process that is killed
    second = kept(path)
    second.configure()
    assert second.fault is not None
    assert second.fault.kind == 'ended'
    assert second.fault.cut
    assert second.amplifiers.load == 1.0
    assert 'hot' in second.reset()[1]
    assert cold(second).reset()[0]
    second.activate()
    second.close()


@pytest.mark.parametrize(
    'content',
    ['', '{', '[]', '{"active": false}', '{"active": false, "load": [1], "time": 0, "fault": null}',
     '{"active": false, "load": "hot", "time": 0, "fault": 3}', b'\xff\xfe',
     '{"active": false, "load": [NaN,0,0,0,0,0,0,0,0,0,0,0], "time": 0, "fault": null}',
     '{"active": false, "load": [0,0,0,0,0,0,0,0,0,0,0,0], "time": NaN, "fault": null}',
     '{"active": false, "load": [0,0,0,0,0,0,0,0,0,0,0,0], "time": 1%s}' % ('0' * 400),
     '[' * 100_000],
)  # fmt: skip
def test_a_damaged_file_is_a_fault_and_hot(tmp_path: Path, content: str | bytes) -> None:
    path = tmp_path / 'boards.json'
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    stage = kept(path)
    stage.configure()
    assert stage.fault is not None
    assert 'damaged' in stage.fault.reason
    assert stage.fault.cut
    assert stage.amplifiers.load == 1.0
    assert cold(stage).reset()[0]
    stage.close()
    assert json.loads(path.read_text())['fault'] is None


def test_without_a_file_the_amplifiers_count_as_hot(tmp_path: Path) -> None:
    stage = kept(tmp_path / 'boards.json')
    stage.configure()
    assert stage.fault is None
    with pytest.raises(StageError, match=r'hot.*for 0\.\d s'):
        stage.activate()
    cold(stage).activate()
    stage.close()


def test_a_fault_is_kept_as_it_was(tmp_path: Path) -> None:
    memory = Memory(build(BridgeParameters, {'boards.memory': str(tmp_path / 'boards.json')}))
    fault = Fault('board', 'a "reason"\n', 'µ', True)
    memory.keep(np.zeros(12), fault, active=False)
    assert memory.recall().fault == fault
    assert [path.name for path in tmp_path.iterdir()] == ['boards.json']


def kept_in(path: Path) -> Memory:
    return Memory(build(BridgeParameters, {'boards.memory': str(path)}))


def test_the_boards_are_claimed_once_and_given_back(tmp_path: Path) -> None:
    path = tmp_path / 'a' / 'b' / 'boards.json'
    one, other = kept_in(path), kept_in(path)
    one.claim()
    one.claim()
    with pytest.raises(StageError, match='in use'):
        other.claim()
    one.release()
    other.claim()
    with pytest.raises(StageError, match='in use'):
        one.claim()
    other.release()


def test_on_a_full_disk_what_was_kept_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    memory = kept_in(tmp_path / 'boards.json')
    memory.keep(np.full(12, 0.5), None, active=False)

    def full(descriptor: int) -> None:
        assert os.fstat(descriptor).st_size > 0  # all of it has left the process
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, 'fsync', full)
    with pytest.raises(StageError, match='No space left'):
        memory.keep(np.zeros(12), None, active=True)
    assert memory.recall().load == pytest.approx(np.full(12, 0.5), abs=0.01)
    assert [path.name for path in tmp_path.iterdir()] == ['boards.json']


def with_lines(path: Path) -> BridgeParameters:
    lines = {'boards.stop_input': 0, 'boards.enable_output': 1}
    return build(BridgeParameters, {**lines, 'boards.memory': str(path)})


@pytest.mark.parametrize(
    'of',
    [
        *('type', 'watchdog', 'stop_input', 'stop_level', 'enable_output', 'enable_level'),
        *('open_level', 'digital_expiry', 'analog_expiry'),
    ],
)
def test_the_proof_is_recorded_and_holds_for_what_was_proven(tmp_path: Path, of: str) -> None:
    parameters = with_lines(tmp_path / 'boards.json')
    memory = Memory(parameters)
    assert not memory.proven(parameters)
    memory.record_proof(parameters)
    assert memory.proven(parameters)
    [recorded] = tmp_path.iterdir()
    assert recorded.name == 'boards-proven.json'
    content = json.loads(recorded.read_text())
    assert content[of] == getattr(parameters.boards, of)
    recorded.write_text(json.dumps({**content, of: 'another'}))
    assert not memory.proven(parameters)


def test_what_was_proven_with_another_driver_or_first_board_is_not(tmp_path: Path) -> None:
    rehearsed = with_lines(tmp_path / 'boards.json')
    memory = Memory(rehearsed)
    memory.record_proof(rehearsed)
    assert not memory.proven(dataclasses.replace(rehearsed, driver='quanser'))
    assert not memory.proven(replace(rehearsed, {'boards.identifier': ('1', '0')}))


def test_a_proof_that_cannot_be_read_proves_nothing(tmp_path: Path) -> None:
    parameters = with_lines(tmp_path / 'boards.json')
    memory = Memory(parameters)
    for content in ('', '[' * 100_000):
        memory.record_proof(parameters)
        (tmp_path / 'boards-proven.json').write_text(content)
        assert not memory.proven(parameters)


def test_a_proof_is_forgotten_once_it_is_tried_anew(tmp_path: Path) -> None:
    parameters = with_lines(tmp_path / 'boards.json')
    memory = Memory(parameters)
    memory.forget_proof()
    memory.record_proof(parameters)
    memory.forget_proof()
    assert not memory.proven(parameters)


def test_what_is_kept_outlasts_a_loss_of_power(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file before it gets its name, the folder afterwards."""
    path, order = tmp_path / 'boards.json', []
    fsync = os.fsync

    def noted(descriptor: int) -> None:
        order.append((Path(os.readlink(f'/proc/self/fd/{descriptor}')), path.exists()))
        fsync(descriptor)

    monkeypatch.setattr(os, 'fsync', noted)
    kept_in(path).keep(np.zeros(12), None, active=True)
    assert order == [(tmp_path / 'boards.json.new', False), (tmp_path, True)]


@pytest.mark.parametrize('named', ['~nobody-of-this-name/boards.json', ''])
def test_a_home_that_nobody_knows_is_said(named: str, monkeypatch: pytest.MonkeyPatch) -> None:
    given = {'driver': 'quanser', 'boards.memory': named}

    def unknown() -> Path:
        raise RuntimeError('Could not determine home directory.')

    monkeypatch.delenv('XDG_STATE_HOME', raising=False)
    monkeypatch.setattr(Path, 'home', unknown)
    with pytest.raises(
        ParameterError, match=r"'boards\.memory' is '.*home directory\. Name a file"
    ):
        memory_file(build(BridgeParameters, given))


def test_a_proof_that_cannot_be_recorded_is_said(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('')
    parameters = with_lines(tmp_path / 'file' / 'boards.json')
    with pytest.raises(StageError, match=r"parameter 'boards\.memory'"):
        Memory(parameters).record_proof(parameters)


def test_two_bridges_cannot_have_the_same_boards(tmp_path: Path) -> None:
    path = tmp_path / 'boards.json'
    first, second = kept(path), kept(path)
    first.configure()
    with pytest.raises(StageError, match='in use'):
        second.configure()
    assert not second.driver._boards[0].card  # type: ignore[attr-defined]
    first.close()
    second.configure()
    second.close()


def test_a_place_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('')
    stage = kept(tmp_path / 'file' / 'boards.json')
    with pytest.raises(StageError, match=r"parameter 'boards\.memory'"):
        stage.configure()
    assert stage.mode is Mode.CLOSED


@pytest.mark.parametrize('call', ['open', 'counts'])
@pytest.mark.parametrize('error', [DriverError('no boards'), OSError('something else')])
def test_whatever_opening_raises_gives_everything_back(
    tmp_path: Path, error: Exception, call: str
) -> None:
    stage = kept(tmp_path / 'boards.json')
    closed: list[bool] = []

    def fails(*_: object) -> None:
        raise error

    closes = stage.driver.close
    setattr(stage.driver, call, fails)
    stage.driver.close = lambda: closed.append(True) or closes()  # type: ignore[method-assign]
    with pytest.raises(StageError, match=str(error)):
        stage.configure()
    assert closed
    assert stage.mode is Mode.CLOSED
    again = kept(tmp_path / 'boards.json')
    again.configure()  # nobody holds them
    again.close()


@pytest.mark.parametrize('active', [False, True])
def test_what_is_latched_after_a_restart_can_be_cleared_and_the_stage_homed(
    tmp_path: Path, active: bool
) -> None:
    first = kept(tmp_path / 'boards.json', homing__at_start=False)
    first.configure()
    first.memory.keep(np.zeros(12), Fault('stale', 'for a test', 'none', False), active=active)
    first.memory.release()  # as the system does for a process that is killed
    again = kept(tmp_path / 'boards.json', homing__at_start=False)
    again.configure()
    assert again.fault is not None
    if active:  # its amplifiers count as hot
        again.amplifiers.arrays.load[:] = 0.0
    assert again.reset()[0]
    assert again.mode is Mode.READY
    with pytest.raises(StageError, match='not homed'):
        again.activate()
    again.home()
    again.activate()
    assert again.mode is Mode.FOLLOWING
    again.close()
