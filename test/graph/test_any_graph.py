"""The loop is at home on any graph: in namespaces, remapped, among strangers. Lockstep.

However it stands there, it flies bit for bit what it flies alone.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from flight import BRISK
from graph import Nodes, Observer, executable
from rosgraph_msgs.msg import Clock

from maglev_node.polling import PolledSubscription
from maglev_node.stamp import nanoseconds
from maglev_node.topics import (
    CLOCK,
    DIAGNOSTICS,
    MEASUREMENT,
    REFERENCE,
    SAMPLE_TOPICS,
    TRUE_STATE,
)

SAMPLES = 1500
ORDERS = int(os.environ.get('MAGLEV_START_ORDERS', '1'))
"""Orders of start that are tried. More than these few are for a machine that may be busy."""
PATIENCE = 90.0 if ORDERS < 3 else 600.0
"""Longest wait for a flight [s]."""

STRANGER = Path(__file__).resolve().parents[1] / 'support' / 'stranger.py'
SCENARIO = 'scenario_ellipse.yaml'


@pytest.fixture
def watching() -> Iterator[list[Observer]]:
    """Observers, which leave the graph at the end of the test."""
    observers: list[Observer] = []
    yield observers
    for observer in observers:
        observer.close()


def starts(nodes: Nodes, *rules: str, plant: str = '') -> list[Callable[[], object]]:
    """What starts each node of the loop, which waits for an observer."""
    watched = 'watchers:=[observer]'
    arguments = [plant] if plant else []
    return [
        partial(nodes.start, 'plant', watched, *arguments, params=('benchmark.yaml',), remap=rules),
        partial(nodes.start, 'controller', watched, remap=rules),
        partial(
            *(nodes.start, 'reference', watched, 'duration:=600.0', 'run_in:=1.0', *BRISK),
            params=(SCENARIO,),
            remap=rules,
        ),
    ]


def observe(watching: list[Observer], namespace: str = '', remap: tuple[str, ...] = ()) -> None:
    """Begin to observe all topics."""
    observer = Observer(namespace, remap)
    watching.append(observer)
    observer.watch(*SAMPLE_TOPICS)


def fly(
    nodes: Nodes, watching: list[Observer], *remap: str, namespace: str = '', plant: str = ''
) -> Observer:
    """Start the loop with an observer."""
    observe(watching, namespace, remap)
    rules = (*remap, f'__ns:={namespace}') if namespace else remap
    for start in starts(nodes, *rules, plant=plant):
        start()
    return watching[-1]


def flown(observer: Observer) -> np.ndarray:
    """The true states (SAMPLES, 18) from sample 0 on, with the currents that flow."""

    def done() -> bool:
        newest = observer.newest(TRUE_STATE)
        return newest is not None and newest.sequence > SAMPLES + 500

    observer.wait(done, timeout=PATIENCE)
    heard = observer.messages[TRUE_STATE]  # a sample that waits for its answer comes again
    numbers, first = np.unique(heard.every('sequence'), return_index=True)
    assert np.array_equal(numbers[:SAMPLES], np.arange(SAMPLES))
    fields = 'state', 'direct_current', 'quadrature_current'
    states = np.hstack([heard.every(field)[first[:SAMPLES]] for field in fields])
    assert np.min(states[:, 0]) < 0.026  # it flies
    return states


@pytest.fixture(scope='module')
def alone(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """What the loop flies alone."""
    nodes, watching = Nodes(tmp_path_factory.mktemp('alone')), list[Observer]()
    try:
        return flown(fly(nodes, watching))
    finally:
        watching[0].close()  # while there are others: Fast DDS may fall over what the killed leave
        for process in nodes.started:
            process.kill()


@pytest.mark.alone
@pytest.mark.parametrize('seed', range(ORDERS))
def test_any_order_of_start_with_up_to_five_strangers(
    seed: int, alone: np.ndarray, nodes: Nodes, watching: list[Observer]
) -> None:
    draw = random.Random(seed)
    stranger = partial(nodes.run, 'stranger', [sys.executable, str(STRANGER)])
    orders = [*starts(nodes), partial(observe, watching), *[stranger] * draw.randint(0, 5)]
    draw.shuffle(orders)
    for start in orders:
        start()
        time.sleep(draw.choice((0.0, 0.1, 1.0)))
    np.testing.assert_array_equal(flown(watching[0]), alone)


def taken(subscription: PolledSubscription) -> list[int]:
    """Stamps of what has come on the clock [ns]."""
    return [nanoseconds(message.clock) for message, _ in subscription.take()]


def test_strangers_change_nothing_and_all_tell_stage_time(
    alone: np.ndarray, nodes: Nodes, watching: list[Observer]
) -> None:
    stranger = nodes.run('stranger', [sys.executable, str(STRANGER)])
    stranger.wait_for('listening')
    observer = fly(nodes, watching, plant='use_sim_time:=true')
    clock = observer.node.poll(CLOCK, Clock)
    diagnostics = observer.node.poll(DIAGNOSTICS, DiagnosticArray)
    np.testing.assert_array_equal(flown(observer), alone)
    for topic in (*SAMPLE_TOPICS, CLOCK):
        stranger.wait_for(f'hears {topic}')

    begin = nanoseconds(observer.messages[MEASUREMENT][0].header.stamp)
    for topic, messages in observer.messages.items():
        since = [nanoseconds(message.header.stamp) - begin for message in messages]
        assert since == [1_000_000 * message.sequence for message in messages], topic
    assert all(message.lockstep for message in observer.messages[MEASUREMENT])
    said = [0]  # before it has heard the clock

    def heard() -> int:
        said.extend(
            nanoseconds(message.header.stamp)
            for message, _ in diagnostics.take()
            if message.status[0].name == 'plant'
        )
        return said[-1]

    observer.wait(lambda: heard() > 0)
    told: list[int] = []

    def was_told() -> bool:
        told.extend(taken(clock))
        return said[-1] in told

    observer.wait(was_told)
    steps = np.unique(told)
    assert steps[0] == begin
    assert set(np.diff(steps)) == {10_000_000}


@pytest.mark.long
def test_two_stages_at_once_one_of_them_remapped(
    alone: np.ndarray, nodes: Nodes, watching: list[Observer]
) -> None:
    moved = '/elsewhere/reference'
    both = [
        fly(nodes, watching, namespace='/stage1'),
        fly(nodes, watching, f'reference:={moved}', namespace='/stage2'),
    ]
    for observer in both:
        np.testing.assert_array_equal(flown(observer), alone)
    topics = {name for name, _ in both[0].node.get_topic_names_and_types()}
    for topic in (*SAMPLE_TOPICS, CLOCK, DIAGNOSTICS):
        second = moved if topic == REFERENCE else f'/stage2/{topic}'
        assert {f'/stage1/{topic}', second} <= topics
        assert f'/{topic}' not in topics
    assert '/stage2/reference' not in topics
    plant = nodes.started[0]
    other = nodes.start('plant', remap=('__ns:=/stage1',))
    assert other.wait() == 1
    assert "/stage1/stage/measurement is already published by '/stage1/plant'" in other.output
    plant.signal(signal.SIGINT)
    assert plant.wait() == 0, plant.output


def test_a_processor_that_is_not_there_is_refused_in_one_line() -> None:
    command = [executable('maglev_plant', 'plant'), '--ros-args', '-p', 'processors:=[0, 4000]']
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=60)
    may = sorted(os.sched_getaffinity(0))
    assert done.returncode == 1
    assert done.stdout == ''
    assert done.stderr == (
        "plant: error: parameter 'processors' is [0, 4000], it must be of those this process may"
        f' run on: {may}\n'
    )


NODES = ('plant', 'hw_bridge', 'controller', 'reference', 'monitor', 'recorder', 'watchers')


@pytest.mark.parametrize('name', NODES)
def test_help(name: str) -> None:
    of_monitor = name in ('recorder', 'watchers')
    package = 'maglev_monitor' if of_monitor else f'maglev_{name}'
    done = subprocess.run(
        [executable(package, name), '--help'], capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, '')
    assert f'usage: {name} ' in done.stdout
    assert 'effective_parameters: string' in done.stdout
    assert 'diagnostics' in done.stdout
    if name == 'watchers':
        assert '-p NODE:NAME:=VALUE' in done.stdout
        for parameter in ('compress: bool', 'start_timeout: double'):  # of either
            assert parameter in done.stdout
    if name == 'plant':
        assert "mode: string, default 'lockstep', one of lockstep, realtime" in done.stdout
        assert 'answer_timeout: double [s], default 8.0, [0.1, 600] s' in done.stdout
        assert 'stage/true_state' in done.stdout


@pytest.mark.parametrize(
    ('package', 'name'), [('maglev_plant', 'plant'), ('maglev_monitor', 'compare_bags')]
)
def test_help_that_nobody_reads_to_its_end(package: str, name: str) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [executable(package, name), '--help'], stdout=writing, stderr=subprocess.PIPE, timeout=60
    )
    os.close(writing)
    assert done.stderr == b''
    assert done.returncode in (0, 128 + signal.SIGPIPE)  # argparse itself is content


def test_a_module_is_the_node_itself() -> None:
    command = [sys.executable, '-m', 'maglev_plant.executables', '-h']
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, '')
    assert 'usage: plant ' in done.stdout
