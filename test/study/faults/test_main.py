"""The command: what it refuses, what it leaves, how it ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

from maglev_study.command import INTERRUPTED, WRONG_USE
from maglev_study.faults.draw import MOST_SEED, from_json, scenario, to_json
from maglev_study.faults.fly import Scenario
from maglev_study.faults.kinds import Fault
from maglev_study.faults.main import BROKEN, PASS, run


@pytest.mark.parametrize(
    'arguments',
    [
        ['--runs', '0'],
        ['--runs', '1.5'],
        ['--runs', '-3'],
        ['--jobs', '0'],
        ['--jobs', 'many'],
        ['--seed', '-1'],
        ['--unknown'],
        ['hover'],
    ],
)
def test_bad_arguments_are_refused(
    arguments: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        run([*arguments, '--out', str(tmp_path)])
    assert end.value.code == WRONG_USE
    assert arguments[0] in capsys.readouterr().err


@pytest.mark.parametrize('text', ['{}', '[]', 'no JSON', '{"machine": "x"}'])
def test_a_file_without_a_run_is_refused(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / 'run.json'
    path.write_text(text, encoding='utf-8')
    assert run(['--replay', str(path), '--out', str(tmp_path)]) == WRONG_USE
    assert str(path) in capsys.readouterr().err
    assert run(['--replay', str(tmp_path / 'none'), '--out', str(tmp_path)]) == WRONG_USE


@pytest.mark.parametrize('option', ['--replay', '--seed'])
def test_a_seed_of_no_run_is_refused(
    option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([option, str(MOST_SEED + 1), '--out', str(tmp_path)]) == WRONG_USE
    said = f'there is no run of seed {MOST_SEED + 1}: seeds go from 0 to {MOST_SEED}'
    assert capsys.readouterr().err == f'faults: error: {said}\n'


@pytest.mark.parametrize(
    ('given', 'named'),
    [
        ('sample_time: 0.0005', "'sample_time' of the bridge is 0.0005"),
        ('machine: {gap_max: 0.030}', "'machine.gap_max' is 0.03"),
        (
            'emulation: {guide: {locked: [false, false, true, false, false]}}',
            "'emulation.guide.locked' locks z, which the programme that is flown moves",
        ),
        ('machine: {mass_y: -7.0}', "'machine.mass_y' is -7"),
        ('fault: {jmup: 1.0}', "'fault.jmup'"),
        ('encoder: {resolution: [1e-5, 1e-5, 1e-5, 2e-5, 1e-5, 1e-5]}', "'encoder.resolution'"),
    ],
)
def test_a_machine_that_cannot_fly_the_programme_is_refused(
    given: str, named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / 'mine.yaml'
    path.write_text(f'hw_bridge:\n  ros__parameters:\n    {given}\n', encoding='utf-8')
    options = ['--runs', '1', '--overlay', str(path), '--out', str(tmp_path)]
    assert run(options) == WRONG_USE
    assert named in capsys.readouterr().err


def test_the_emulated_machine_is_wired_as_a_bridge_of_ones_own_has_it(tmp_path: Path) -> None:
    mine = """
    /**: {ros__parameters: {machine: {mass_y: 7.2}}}
    hw_bridge:
      ros__parameters:
        driver: quanser
        homing: {at_start: false, x: 0.01, z: -0.01}
        boards: {identifier: ['1', '0'], stop_input: 3, memory: %s/memory.json}
        encoder:
          channel: [5, 4, 3, 2, 1, 0]
          direction: [-1, 1, 1, 1, 1, -1]
          resolution: [1.0e-6, 1.0e-6, 1.0e-6, 1.0e-6, 5.0e-6, 5.0e-6]
        amplifier:
          channel: [5, 4, 3, 2, 1, 0, 0, 1, 2, 3, 4, 5]
          gain: [2.0, 2.0, 2.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]
          sign: [1, 1, -1, 1, 1, 1, 1, 1, 1, 1, 1, 1]
        commutation: {offset: [0.5, 0.0, 0.0, -1.0]}
    """
    path = tmp_path / 'mine.yaml'
    path.write_text(textwrap.dedent(mine) % tmp_path, encoding='utf-8')
    faults = [('none', 'ellipse'), ('controller: killed', 'hover')]
    for kind, phase in faults:
        run_ = to_json(Scenario(1, phase, 0.5, (Fault(kind),), 1))
        (tmp_path / 'run.json').write_text(json.dumps(run_), encoding='utf-8')
        options = ['--replay', str(tmp_path / 'run.json'), '--overlay', str(path)]
        assert run([*options, '--out', str(tmp_path / 'out')]) == PASS
    assert not (tmp_path / 'memory.json').exists()


def test_a_folder_that_cannot_be_is_refused(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('', encoding='utf-8')
    assert run(['--runs', '1', '--out', str(tmp_path / 'file')]) == WRONG_USE


def test_a_run_is_the_same_by_its_seed_and_from_a_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    seed = next(seed for seed in range(60) if scenario(seed).phase == 'rest')
    path = tmp_path / 'run.json'
    path.write_text(json.dumps([to_json(scenario(seed))]), encoding='utf-8')
    said = []
    for which in (str(seed), str(path)):
        code = run(['--replay', which, '--json', '--out', str(tmp_path)])
        captured = capsys.readouterr()
        said.append(captured.err)
        outcome = json.loads(captured.out)
        assert code == (PASS if outcome['passed'] else BROKEN)
        assert outcome['seed'] == seed
        assert bool(outcome['broken']) != outcome['passed']
    assert said[0] == said[1]
    assert 'ms after the beginning' in said[0]
    page = (tmp_path / f'run-{seed}.html').read_text(encoding='utf-8')
    assert 'data:image/png' in page
    assert 'What happened' in page


def test_a_run_that_hangs_has_a_page_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr('maglev_study.faults.train._PATIENCE', 0.0)
    assert run(['--replay', '50', '--out', str(tmp_path)]) == BROKEN
    assert 'the run hangs' in capsys.readouterr().out
    assert 'the run hangs' in (tmp_path / 'run-50.html').read_text(encoding='utf-8')


def test_it_leaves_a_page_and_says_by_its_code_whether_rules_were_broken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = run(['--runs', '3', '--jobs', '1', '--out', str(tmp_path)])
    text = capsys.readouterr().out
    failures = json.loads((tmp_path / 'failures.json').read_text(encoding='utf-8'))
    assert code == (BROKEN if failures else PASS)
    assert f'{3} of 3 runs' in text
    assert 'the rarest cell' in text
    assert all(from_json(plain) for plain in failures)
    assert 'Faults by phase' in (tmp_path / 'faults.html').read_text(encoding='utf-8')


def test_ctrl_c_ends_in_order_with_what_was_done(tmp_path: Path) -> None:
    call = [sys.executable, '-m', 'maglev_study.faults.main', '--runs=5000', '--jobs=1']
    process = subprocess.Popen(
        [*call, '--seed=58', '--out', str(tmp_path)],  # the first machine has two runs left
        stdout=subprocess.PIPE,
        start_new_session=True,
    )
    assert process.stdout is not None
    assert b' of 5000 runs' in process.stdout.readline()
    os.killpg(process.pid, signal.SIGINT)
    started = time.monotonic()
    process.communicate(timeout=60.0)
    assert process.returncode == INTERRUPTED
    assert time.monotonic() - started < 30.0
    assert ' of 5000 runs' in (tmp_path / 'faults.html').read_text(encoding='utf-8')


def group_lives(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def test_what_was_flown_before_a_kill_is_kept_and_the_same_call_goes_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    call = [sys.executable, '-m', 'maglev_study.faults.main', '--runs=4', '--jobs=1', '--seed=58']
    process = subprocess.Popen([*call, '--out', str(tmp_path)], start_new_session=True)
    journal = tmp_path / 'flown.jsonl'
    while process.poll() is None and (not journal.is_file() or journal.read_text().count('\n') < 2):
        time.sleep(0.01)  # the first machine has two runs left
    process.kill()
    process.wait()
    deadline = time.monotonic() + 20.0
    while group_lives(process.pid):
        assert time.monotonic() < deadline, 'what it has started flies on'
        time.sleep(0.05)
    kept = journal.read_text(encoding='utf-8')
    again = ['--runs=4', '--jobs=1', '--seed=58', '--json', '--out']
    codes, outcomes = [], []
    for folder in (tmp_path, tmp_path / 'whole'):
        codes.append(run([*again, str(folder)]))
        outcomes.append({**json.loads(capsys.readouterr().out), 'out': '', 'page': ''})
    assert codes[0] == codes[1]
    assert outcomes[0] == outcomes[1]
    assert outcomes[0]['runs'] == 4
    assert journal.read_text(encoding='utf-8').startswith(kept)
    assert journal.read_text() == (tmp_path / 'whole' / 'flown.jsonl').read_text()
    assert run([*again, str(tmp_path), '--double']) == WRONG_USE
    assert 'whose double is False' in capsys.readouterr().err
