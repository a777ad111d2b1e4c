"""The graph on two hosts: the stage on one, controller and reference on the other."""

from __future__ import annotations

import json
import re
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flight import LOWER_STOP
from graph import Nodes, Process
from two_hosts import TwoHosts, why_not

from maglev_monitor.bag.compare import compare
from maglev_monitor.bag.reader import Bag

PATIENCE = 90.0  # for processes that others hold up [s]
CALL = Path(__file__).resolve().parents[1] / 'support' / 'call.py'
WAY_BACK = (
    '/reference/lift_off',  # is refused
    '/controller/reset',  # where it is in a fault and has not landed by itself
    '/controller/enable=true',
    '/hw_bridge/reset',
    '/reference/lift_off',
)
REFERENCE = (
    *('run_in:=0.0', 'move_time:=0.4', 'lift_off.time:=0.5', 'lift_off.settle:=0.0'),
    *('landing.time:=0.5', 'landing.crawl_distance:=1.0e-4'),
)


@pytest.fixture
def hosts(nodes: Nodes) -> Iterator[TwoHosts]:
    """Two hosts, with nothing left on them at the end."""
    reason = why_not()
    if reason:
        pytest.skip(reason)
    made = TwoHosts()
    yield made
    for process in nodes.started:
        process.kill()
    made.close()


def fly(nodes: Nodes, bag: Path, *on: list[str]) -> dict[str, Any]:
    """A short flight, recorded; ``on`` the stage's host and the controller's. Its metrics."""
    near, far = on or ([], [])
    watched = 'watchers:=[recorder,monitor]'
    metrics = bag.with_suffix('.json')
    recorder = nodes.start('recorder', f'output:={bag}', on=far)
    monitor = nodes.start('monitor', f'output:={metrics}', on=near)
    nodes.start('plant', watched, params=('benchmark.yaml',), on=near)
    nodes.start('controller', watched, on=far)
    options = (watched, 'duration:=0.5', 'exit_at_end:=true', *REFERENCE)
    reference = nodes.start('reference', *options, params=('scenario_ellipse.yaml',), on=far)
    assert reference.wait(3 * PATIENCE) == 0, reference.output
    monitor.wait()
    recorder.signal(signal.SIGINT)
    assert recorder.wait() == 0, recorder.output
    for process in nodes.started:
        process.kill()
    found: dict[str, Any] = json.loads(metrics.read_text())
    return found


def test_in_lockstep_a_bad_cable_changes_nothing(
    nodes: Nodes, hosts: TwoHosts, tmp_path: Path
) -> None:
    bags = tmp_path / 'alone', tmp_path / 'split'
    fly(nodes, bags[0])
    hosts.lose(0.01, 0.0005)
    figures = fly(nodes, bags[1], hosts.on(0), hosts.on(1))
    assert hosts.close() > 20
    assert figures['missing_samples'] == 0
    assert figures['samples'] == 500
    found = compare((Bag(bags[0]), Bag(bags[1])))
    assert len(found) == 5
    for topic in found.values():
        assert topic.equal, topic
        assert topic.both > 2000


def sample(process: Process, words: str) -> int:
    """The sample of which a node has said something, once it has."""
    process.wait_for(words)
    (number,) = re.findall(rf'{words} (\d+)', process.output)
    return int(number)


@pytest.mark.alone
@pytest.mark.real_time
def test_in_real_time_a_cut_cable_lands_and_only_resets_fly_again(
    nodes: Nodes, hosts: TwoHosts, tmp_path: Path
) -> None:
    stage, law = hosts.on(0), hosts.on(1)

    def reference(*arguments: str) -> Process:
        return nodes.start(
            *(
                'reference',
                'mode:=realtime',
                'duration:=600.0',
                'timeout:=2.0',
                *REFERENCE,
                *arguments,
            ),
            params=('scenario_ellipse.yaml',),
            on=law,
        )

    recorder = nodes.start('recorder', f'output:={tmp_path / "bag"}', on=stage)
    bridge = nodes.start(
        *('hw_bridge', 'mode:=realtime', 'watchers:=[recorder]'),
        params=('hw_bridge.yaml',),
        on=stage,
    )
    controller = nodes.start('controller', 'mode:=realtime', on=law)
    first = reference()
    first.wait_for('TRACK at sample', PATIENCE, unless='left the run')
    hosts.cut()
    fault = sample(bridge, 'fault at sample')
    assert first.wait() == 1
    hosts.lose(0.0, 0.0)
    second = reference('autostart:=false')
    second.wait_for('resting until', PATIENCE)
    calls = nodes.run('call', [*law, sys.executable, str(CALL), *WAY_BACK])
    calls.wait(PATIENCE)
    answers = [line.split()[0] for line in calls.output.splitlines()]
    assert answers[:1] + answers[2:] == ['no', 'yes', 'yes', 'yes'], calls.output
    second.wait_for('TRACK at sample', PATIENCE, unless='left the run')
    _, again = map(int, re.findall(r'regulating at sample (\d+)', controller.output))
    recorder.signal(signal.SIGINT)
    assert recorder.wait() == 0

    batches = Bag(tmp_path / 'bag').batches()
    truth = np.concatenate(
        [batch.samples['plant'] for batch in batches if 'plant' in batch.samples]
    )
    grounded = truth[(truth['sequence'] > fault) & (truth['sequence'] < again)]
    gap, speed = grounded['state'][:, 0], grounded['state'][:, 1]
    assert gap[0] < 0.03  # it flew
    assert np.abs(speed[gap > LOWER_STOP - 1e-5]).max() < 0.05
    resting = grounded[-500:]
    assert resting['state'][:, 0].min() > LOWER_STOP - 1e-5
    assert not resting['direct_current'].any()
