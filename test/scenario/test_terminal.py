"""What a run shows of what its nodes write."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest
from stand_ins import Tree

from runner import logs, process


@pytest.mark.parametrize(
    ('log', 'words'),
    [
        ('[INFO] up\nFATAL: no encoder\nit ends\n\n', 'FATAL: no encoder'),
        ('[INFO] up\nlast\n', 'last'),
        (
            '\033[37;1m12:00 [\033[31;1mRTPS Error\033[m] no port\033[m\n',
            '12:00 [RTPS Error] no port',
        ),
        ('\n', ''),
    ],
)
def test_last_words(tmp_path: Path, log: str, words: str) -> None:
    (tmp_path / 'log').write_text(log)
    assert process.last_words(tmp_path / 'log') == words
    assert process.last_words(tmp_path / 'none') == ''


def test_a_bus_error_is_of_full_shared_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process, 'SHARED_MEMORY', '/proc')  # which has no free page either
    assert process.why_killed(128 + signal.SIGBUS).startswith('/proc is full: remove')
    assert process.why_killed(128 + signal.SIGSEGV) == ''
    for other in ('/', '/nowhere'):
        monkeypatch.setattr(process, 'SHARED_MEMORY', other)
        assert process.why_killed(128 + signal.SIGBUS) == ''


def test_warnings_of_every_node_are_shown_once(tree: Tree) -> None:
    tree.behave('controller', 'warn')
    tree.behave('plant', 'warn')
    code, output = tree.run()
    assert code == 0, output
    for node in ('controller', 'stage'):
        for words in ('warning: the belt slips', 'error: the belt: broke', 'error: no end'):
            assert output.count(f'ellipse: {node}: {words}\n') == 1, output
    assert 'all is well' not in output


def test_the_reason_of_an_early_end_is_said_once(tree: Tree) -> None:
    tree.behave('watchers', 'run')
    tree.behave('controller', 'fail')
    code, output = tree.run()
    assert code == 1
    assert output.count('the belt broke') == 1, output
    assert 'ellipse: controller: error: the belt broke\n' in output
    assert 'ellipse: failed: controller ended early with exit code 1\n' in output


def test_a_node_that_warns_without_end_does_not_flood_the_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / 'controller.log'
    log.write_text(''.join(f'WARN 1.{n} late at sample {n}\n' for n in range(100)))
    shown = logs.NodeLog('ellipse: controller', log)
    shown.show()
    lines = capsys.readouterr().err.splitlines()
    assert lines[:20] == [f'ellipse: controller: warning: late at sample {n}' for n in range(20)]
    assert lines[20:] == [f'ellipse: controller: more warnings and errors are in {log}']


def test_what_the_monitor_logs_is_shown_like_that_of_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / 'log'
    log.write_text('y 3.0 um\nINFO 1.0 recording\nWARN 1.0 no node of the run is seen\ny 3.0 um\n')
    logs.NodeLog('ellipse: watchers', log, everything=True).show()
    captured = capsys.readouterr()
    assert captured.out == 'y 3.0 um\ny 3.0 um\n'
    assert captured.err == 'ellipse: watchers: warning: no node of the run is seen\n'


def test_progress_is_shown_in_whole_lines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / 'log'
    progress = logs.NodeLog('ellipse: watchers', log, everything=True)
    progress.show()
    shown = []
    for text in ('y 3.0', ' um\nx', ' 4\n', 'last'):
        with log.open('a') as file:
            file.write(text)
        progress.show()
        shown.append(capsys.readouterr().out)
    progress.show(rest=True)
    assert [*shown, capsys.readouterr().out] == ['', 'y 3.0 um\n', 'x 4\n', '', 'last\n']
