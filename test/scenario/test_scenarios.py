"""The scenario scripts as a user runs them: what they print, leave behind and end with."""

from __future__ import annotations

import base64
import contextlib
import html
import json
import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import zstandard
from bokeh.resources import Resources
from page_client import PageClient, heights
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from maglev_model.contract.phases import Phase
from maglev_monitor.bag.compare import compare
from maglev_monitor.bag.reader import Bag

ROOT = Path(__file__).resolve().parents[2]
MESSAGES = ROOT / 'src' / 'maglev_msgs' / 'msg'
MARK = 'MAGLEV_SCENARIO_TEST'
LEAD = 128
"""How far ahead of the stage a scenario publishes its reference, in samples."""


def command(scenario: str, out: Path, *options: str) -> list[str]:
    return [str(ROOT / 'scenarios' / f'{scenario}.sh'), '--out', str(out), *options]


def run(scenario: str, out: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Run a scenario to its end, as a shell would, and show what it said if it goes wrong."""
    done = subprocess.run(
        command(scenario, out, *options), capture_output=True, text=True, timeout=240
    )
    print(done.stdout, done.stderr)
    return done


def soon(folder: Path) -> str:
    """A parameter file with which what is measured begins early, and lands soon after.

    So soon, and in real time, the law need not be better than the paper's. Lift-off waits until
    who looks on is there, on a busy machine too.
    """
    chosen = folder / 'soon.yaml'
    mean = [57e-6, 94e-6, 93e-6, 150e-6, 150e-6]
    chosen.write_text(
        'reference: {ros__parameters: {run_in: 1.0, move_time: 0.4,'
        ' lift_off: {wait: 3.0, time: 0.5, settle: 0.0},'
        ' landing: {time: 0.5, crawl_distance: 1.0e-4}}}\n'
        f'monitor: {{ros__parameters: {{limits: {{max_mean_error: {mean},'
        f' max_error: [-1.0, -1.0, -1.0, -1.0, -1.0]}}}}}}\n'
    )
    return str(chosen)


def metrics(out: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((out / 'metrics.json').read_text())
    return found


def recorded(out: Path, topic: str, *fields: str) -> np.ndarray:
    """Rows of sequence and fields of a topic's messages, the last of each sequence."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for path in MESSAGES.glob('*.msg'):
        store.register(get_types_from_msg(path.read_text(), f'maglev_msgs/msg/{path.stem}'))
    rows: dict[int, list[float]] = {}
    with Reader(out / 'bag') as reader:
        connections = [c for c in reader.connections if c.topic == topic]
        if not connections:
            return np.empty((0, 1))
        for connection, _, data in reader.messages(connections=connections):
            message = store.deserialize_cdr(data, connection.msgtype)
            row = [float(message.sequence)]
            for field in fields:
                row.extend(np.atleast_1d(getattr(message, field)))
            rows[message.sequence] = row
    return np.array([rows[sequence] for sequence in sorted(rows)])


def played(page: str) -> dict[str, Any]:
    """What the page of a flight in 3D plays: times and messages, without their arrays."""
    encoded = page.partition('__VISER_EMBED_DATA__="')[2].partition('"')[0]
    data = zstandard.ZstdDecompressor().decompressobj().decompress(base64.b64decode(encoded)[8:])
    size = int.from_bytes(data[:8], 'little')
    found: dict[str, Any] = msgspec.msgpack.decode(data[8 : 8 + size])
    return found


def marked_processes(mark: str) -> list[str]:
    """Command lines of the processes that carry a mark in their environment."""
    found = []
    for entry in Path('/proc').glob('[0-9]*'):
        try:
            if f'{MARK}={mark}'.encode() in (entry / 'environ').read_bytes().split(b'\0'):
                found.append((entry / 'cmdline').read_bytes().replace(b'\0', b' ').decode())
        except OSError:
            continue
    return found


def look_and_kill(out: Path) -> None:
    """Look at the page of a flight, close it without a word, and kill what serves it."""
    log, words = out / 'log' / 'web.log', 'live view: '
    deadline = time.monotonic() + 120
    while not log.exists() or words not in log.read_text():
        assert time.monotonic() < deadline
        time.sleep(0.1)
    with PageClient(log.read_text().rpartition(words)[2].split()[0]) as page:
        page.wait(lambda: len(set(heights(page.messages))) > 3)
    for entry in Path('/proc').glob('[0-9]*'):
        with contextlib.suppress(OSError):
            if f'{out}/params/web.yaml'.encode() in (entry / 'cmdline').read_bytes():
                os.kill(int(entry.name), signal.SIGKILL)


@pytest.fixture(scope='module')
def alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run that nothing else disturbed, and that has passed."""
    folder = tmp_path_factory.mktemp('alone')
    done = run('ellipse_4dof', folder / 'run', '--duration', '1', '--params', soon(folder))
    assert done.returncode == 0
    assert 'verdict: pass' in done.stdout
    return folder / 'run'


def test_ellipse_leaves_a_run(alone: Path) -> None:
    figures = metrics(alone)
    assert figures['samples'] == 1000
    assert figures['missing_samples'] == 0
    assert figures['error_source'] == 'true'
    for axis in ('y', 'x', 'z'):
        assert figures['axes'][axis]['mean_abs_error'] < 4e-6
    assert figures['axes']['theta']['mean_abs_error'] < 12e-6
    for name in ('plant', 'controller', 'reference', 'monitor', 'recorder', 'view'):
        assert (alone / 'params' / f'{name}.yaml').stat().st_size > 0
    report = (alone / 'report.html').read_text()
    library = Resources(mode='inline', components=['bokeh']).render_js()
    assert library in report
    assert 'http' not in report.replace(library, ''), 'the report needs a network'
    assert "the paper's machine: mean |e|</th>" in html.unescape(report)
    assert '<td>123.9 µrad</td>' in report
    assert 'Flown by ellipse_4dof.sh --out' in report
    assert '<a href="replay.html">' in report


def test_a_flight_can_be_seen_again(alone: Path) -> None:
    page = (alone / 'replay.html').read_text()
    assert len(page) < 2_000_000
    recording = played(page)
    sequence, phase = recorded(alone, '/reference', 'phase').T
    flight = (min(sequence[phase == Phase.END]) - min(sequence[phase > Phase.REST])) * 1e-3
    assert recording['durationSeconds'] == pytest.approx(flight, rel=0.02)
    flown = heights(message for _, message in recording['messages'])
    assert flown[0] == pytest.approx(-0.031, abs=2e-5)
    assert max(flown) > -0.0215
    assert flown[-1] == pytest.approx(-0.031, abs=1e-4)


def test_in_lockstep_all_of_a_bag_is_in_stage_time(alone: Path) -> None:
    times: dict[str, list[int]] = {}
    with Reader(alone / 'bag') as reader:
        for connection, time_, _ in reader.messages():
            times.setdefault(connection.topic, []).append(time_)
    last = max(times['/stage/measurement'])
    assert {'/rosout', '/diagnostics'} < set(times)
    for topic, logged in times.items():
        assert max(logged) <= last + 1_000_000 * LEAD * (topic == '/reference'), topic


def test_two_stages_fly_on_one_domain_at_once_as_each_does_alone_and_unseen(
    alone: Path, tmp_path: Path
) -> None:
    options = ('--duration', '1', '--params', soon(tmp_path))
    strict = tmp_path / 'strict.yaml'
    limits = 'limits: {max_mean_error: [1.0e-9, -1.0, -1.0, -1.0, -1.0]}'
    strict.write_text(f'monitor: {{ros__parameters: {{{limits}}}}}')
    called = {
        ('stage1', 0): ('--view', *options),
        ('lab/stage2', 1): ('--no-view', *options, f'--params={strict}'),
    }
    with contextlib.ExitStack() as flights:
        together = [
            flights.enter_context(
                subprocess.Popen(
                    command('ellipse_4dof', tmp_path / namespace, '--namespace', namespace, *given),
                    stdout=subprocess.PIPE,
                    text=True,
                )
            )
            for (namespace, _), given in called.items()
        ]
        look_and_kill(tmp_path / 'stage1')
        for process, (_, code) in zip(together, called, strict=True):
            output, _ = process.communicate(timeout=300)
            assert process.returncode == code, output
            assert f'verdict: {("pass", "fail")[code]}' in output  # a limit is not kept
    assert metrics(tmp_path / 'lab' / 'stage2')['verdict'] == 'fail'
    assert (tmp_path / 'stage1' / 'params' / 'web.yaml').exists()
    assert not (tmp_path / 'lab' / 'stage2' / 'params' / 'view.yaml').exists()
    for namespace, _ in called:
        bags = Bag(tmp_path / namespace / 'bag'), Bag(alone / 'bag')
        found = compare(bags)
        assert all(topic.equal for topic in found.values()), found
        sampled = [
            topic for topic in bags[0].counts if topic not in ('/rosout', '/parameter_events')
        ]
        assert all(topic.startswith(f'/{namespace}/') for topic in sampled), sampled
        assert len(found) == 5
        assert (tmp_path / namespace / 'report.html').exists()
    for topic, fields in (
        ('/stage/true_state', ('state', 'direct_current', 'quadrature_current')),
        ('/stage/measurement', ('gap', 'x', 'z')),
        ('/stage/currents', ('direct_current', 'quadrature_current')),
        ('/reference', ('position', 'velocity', 'acceleration')),
    ):
        first = recorded(alone, topic, *fields)
        second = recorded(tmp_path / 'lab' / 'stage2', f'/lab/stage2{topic}', *fields)
        shared = min(len(first), len(second))
        assert shared > metrics(alone)['run_samples']
        assert np.array_equal(first[:shared, 0], np.arange(shared))
        assert np.array_equal(first[:shared], second[:shared]), f'{topic} differs'


@pytest.mark.long
def test_the_paper_on_its_own_model(tmp_path: Path) -> None:
    chosen = tmp_path / 'chosen.yaml'  # the other axes: test_closed_loop_figures.py
    chosen.write_text(
        'reference: {ros__parameters: {duration: 3.2, steps: {'
        "axis: ['y'], start: [0.02], target: [0.027]}}}\n"
        'monitor: {ros__parameters: {limits: {min_steps: 1}}}\n'
    )
    overlays = [f'--params={name}' for name in ('ideal', 'paper', str(chosen))]
    assert run('steps', tmp_path / 'run', *overlays).returncode == 0
    (lifted,) = metrics(tmp_path / 'run')['steps']
    assert lifted['overshoot_percent'] == pytest.approx(16.0, abs=1.0)
    assert lifted['settling_time'] == pytest.approx(2.0, abs=0.1)


@pytest.mark.alone
@pytest.mark.real_time
def test_real_time_with_everything_running(tmp_path: Path) -> None:
    options = ('--mode', 'realtime', '--duration', '3', '--params', soon(tmp_path))
    done = run('ellipse', tmp_path / 'run', *options)
    assert done.returncode == 0
    figures = metrics(tmp_path / 'run')
    assert figures['timing']['real_time_factor'] == pytest.approx(1.0, abs=0.02)
    assert figures['missing_samples'] == 0
    assert 'late_samples' in figures['timing']


def test_a_reference_out_of_range_is_refused_before_anything_moves(tmp_path: Path) -> None:
    wrong = tmp_path / 'wrong.yaml'
    wrong.write_text('reference: {ros__parameters: {sinusoids: {x: {offset: 0.03}}}}\n')
    done = run('ellipse', tmp_path / 'run', '--params', str(wrong))
    assert done.returncode == 1
    assert 'x is 0.05' in done.stderr
    assert not len(recorded(tmp_path / 'run', '/reference', 'position'))


@pytest.mark.parametrize(
    'number', [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long), signal.SIGKILL]
)
def test_however_it_is_ended_nothing_stays(tmp_path: Path, number: signal.Signals) -> None:
    out, mark = tmp_path / 'run', str(tmp_path)
    with (tmp_path / 'log').open('wb') as log:
        script = subprocess.Popen(
            command('ellipse', out, '--params', soon(tmp_path)),
            stdout=log,
            stderr=log,
            env={**os.environ, MARK: mark},
            start_new_session=True,
        )
    deadline = time.monotonic() + 60
    while 'TRACK' not in (tmp_path / 'log').read_text():
        assert script.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.1)
    script.send_signal(number)
    code = script.wait(60)
    if number != signal.SIGKILL:
        assert code == 128 + number
        assert metrics(out)['verdict'] == 'incomplete'
        states = recorded(out, '/stage/true_state', 'state')
        assert states[-1, 1] == pytest.approx(0.031, abs=2e-5), 'it did not land'
    deadline = time.monotonic() + 20
    while marked_processes(mark):
        assert time.monotonic() < deadline, marked_processes(mark)
        time.sleep(0.1)
    assert len(recorded(out, '/stage/measurement', 'x')) > 1500
