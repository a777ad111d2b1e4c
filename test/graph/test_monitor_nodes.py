"""Monitor and recorder as real nodes, fed with a made-up run over real DDS."""

from __future__ import annotations

import contextlib
import json
import signal
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_player import decoded, information, play
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from graph import Nodes, Observer, Process, executable
from made_up_run import TOPICS, Encoder, Run, make_run
from rclpy.duration import Duration
from rosbags.rosbag2 import Reader

from maglev_model.contract.wire import HARDWARE_ID
from maglev_monitor.bag.analysis import analyse
from maglev_monitor.bag.errors import BagError
from maglev_monitor.bag.reader import Bag
from maglev_node.stamp import set_stamp
from maglev_node.topics import SAMPLE_TOPICS, sample_qos

SAMPLES = 1500


@pytest.fixture(scope='module')
def run() -> Run:
    return make_run(SAMPLES)


@pytest.fixture(scope='module')
def messages(run: Run) -> dict[str, list[bytes]]:
    encoder = Encoder()
    return {key: [encoder.message(run, key, n) for n in range(SAMPLES)] for key in TOPICS}


class Feeder:
    """Publishes the made-up run in the place of stage, controller and reference."""

    def __init__(self, node: Any, messages: dict[str, list[bytes]]) -> None:
        self._node = node
        self._messages = messages
        self._publishers = {
            key: node.create_publisher(SAMPLE_TOPICS[topic[1:]], topic, sample_qos(4096))
            for key, (topic, _) in TOPICS.items()
        }

    def wait_for(self, listeners: int) -> None:
        """Wait until so many nodes listen on every topic."""
        deadline = time.monotonic() + 20.0
        publishers = self._publishers.values()
        while min(publisher.get_subscription_count() for publisher in publishers) < listeners:
            assert time.monotonic() < deadline, 'nobody listens'
            time.sleep(0.02)
        time.sleep(0.5)  # until they know of it as well

    def feed(self, first: int = 0, last: int = SAMPLES) -> None:
        """Publish samples, about five times as fast as real time."""
        for n in range(first, last):
            for key, publisher in self._publishers.items():
                publisher.publish(self._messages[key][n])
            if n % 5 == 0:
                time.sleep(0.001)

    def delivered(self, seconds: float) -> bool:
        """Whether every reader says within this time that it has everything."""
        return all(
            publisher.wait_for_all_acked(Duration(seconds=seconds))
            for publisher in self._publishers.values()
        )

    def leave(self) -> None:
        """Publish no more, so that another may."""
        for publisher in self._publishers.values():
            self._node.destroy_publisher(publisher)

    def diagnose(
        self,
        level: bytes,
        name: str,
        text: str,
        namespace: str = '',
        hardware: str = HARDWARE_ID,
    ) -> None:
        """Publish one status on diagnostics, once somebody listens."""
        publisher = self._node.create_publisher(DiagnosticArray, f'{namespace}/diagnostics', 10)
        while publisher.get_subscription_count() == 0:
            time.sleep(0.02)
        status = DiagnosticStatus(level=level, name=name, message=text, hardware_id=hardware)
        array = DiagnosticArray(status=[status])
        set_stamp(array.header.stamp, time.time_ns())
        publisher.publish(array)


@pytest.fixture
def feeder(observer: Observer, messages: dict[str, list[bytes]]) -> Feeder:
    return Feeder(observer.node, messages)


def start_monitor(nodes: Nodes, *arguments: str) -> Process:
    output = nodes.folder / 'metrics.json'
    return nodes.start('monitor', f'output:={output}', *arguments, params=('monitor.yaml',))


def metrics(nodes: Nodes) -> Any:
    return json.loads((nodes.folder / 'metrics.json').read_text())


def recorded(path: Path) -> dict[str, int]:
    """Samples in a bag by topic key."""
    counts: dict[str, int] = dict.fromkeys(TOPICS, 0)
    with contextlib.suppress(BagError):  # nothing yet
        for batch in Bag(path).batches():
            for key, records in batch.samples.items():
                counts[key] += len(records)
    return counts


def test_bag_and_live_run_give_the_same_figures(nodes: Nodes, feeder: Feeder) -> None:
    bag = nodes.folder / 'bag'
    recorder = nodes.start('recorder', f'output:={bag}', params=('monitor.yaml',))
    monitor = start_monitor(nodes, 'scenario:=made_up', 'limits.max_overshoot:=99.0')
    feeder.wait_for(2)
    time.sleep(1.2)  # the monitor has told the recorder what is measured
    feeder.feed()
    assert monitor.wait() == 0, monitor.output
    assert 'verdict: pass' in monitor.output
    assert feeder.delivered(5.0)
    recorder.signal(signal.SIGINT)
    assert recorder.wait() == 0
    assert recorded(bag) == dict.fromkeys(TOPICS, SAMPLES)
    assert analyse(bag).result == metrics(nodes)
    assert metrics(nodes)['scenario'] == 'made_up'
    assert metrics(nodes)['missing_samples'] == 0
    with Reader(bag) as reader:
        sampled: list[Any] = [c.ext for c in reader.connections if c.topic[1:] in SAMPLE_TOPICS]
        assert all(e.offered_qos_profiles[0].reliability.name == 'RELIABLE' for e in sampled)


def start_watchers(nodes: Nodes, *arguments: str) -> Process:
    return nodes.start(
        'watchers',
        f'recorder:output:={nodes.folder / "bag"}',
        f'monitor:output:={nodes.folder / "metrics.json"}',
        'monitor:exit_at_end:=false',
        *arguments,
        params=('monitor.yaml',),
    )


@pytest.mark.parametrize('redirection', ['>/dev/full', '>&- 2>&-'])
def test_what_cannot_be_printed_costs_no_bag(
    redirection: str, nodes: Nodes, feeder: Feeder
) -> None:
    bag, output = nodes.folder / 'bag', nodes.folder / 'metrics.json'
    given = f'recorder:output:={bag}', f'monitor:output:={output}', 'monitor:exit_at_end:=false'
    arguments = [word for each in given for word in ('-p', each)]
    shell = ['bash', '-c', f'exec "$0" "$@" {redirection}']
    command = [*shell, executable('maglev_monitor', 'watchers'), '--ros-args', *arguments]
    watchers = nodes.run('watchers', command)
    feeder.wait_for(2)
    feeder.feed()
    assert feeder.delivered(20.0)
    watchers.signal(signal.SIGINT)
    assert watchers.wait() == 0, watchers.output
    assert recorded(bag) == dict.fromkeys(TOPICS, SAMPLES)
    assert metrics(nodes)['missing_samples'] == 0
    said = 'cannot write to the standard output any more: No space left on device'
    assert watchers.output.count(said) == ('full' in redirection)


def test_in_one_process_recorder_and_monitor_do_as_they_do_apart(
    nodes: Nodes, feeder: Feeder, observer: Observer
) -> None:
    watchers = start_watchers(nodes, 'monitor:limits.max_overshoot:=99.0')
    feeder.wait_for(2)
    time.sleep(1.2)  # the monitor has told the recorder what is measured
    feeder.feed()
    observer.wait((nodes.folder / 'metrics.json').is_file)
    assert watchers.running  # who records until all have ended
    assert feeder.delivered(5.0)
    watchers.signal(signal.SIGINT)
    assert watchers.wait() == 0, watchers.output
    assert recorded(nodes.folder / 'bag') == dict.fromkeys(TOPICS, SAMPLES)
    assert analyse(nodes.folder / 'bag').result == metrics(nodes)
    assert metrics(nodes)['verdict'] == 'pass'


def test_in_one_process_the_one_that_fails_ends_both(nodes: Nodes) -> None:
    (nodes.folder / 'bag').mkdir()
    watchers = start_watchers(nodes)
    assert watchers.wait() == 1
    assert 'exists already' in watchers.output
    unwritable = nodes.folder / 'file'
    unwritable.touch()
    watchers = start_watchers(
        nodes, f'recorder:output:={nodes.folder / "other"}', f'monitor:output:={unwritable}/m.json'
    )
    assert watchers.wait() == 1
    assert 'cannot write' in watchers.output
    assert (nodes.folder / 'other' / 'metadata.yaml').is_file()  # its bag is finished


def test_in_one_process_the_one_is_no_sign_that_the_other_sees_the_graph(nodes: Nodes) -> None:
    watchers = start_watchers(nodes, 'monitor:start_timeout:=6.0')
    watchers.wait_for('no node of the run is seen')
    watchers.wait_for('no run has begun within 6 s: no node of the run is seen')


def test_others_read_and_play_a_bag(
    nodes: Nodes, observer: Observer, feeder: Feeder, run: Run
) -> None:
    bag = nodes.folder / 'bag'
    recorder = nodes.start('recorder', f'output:={bag}', params=('monitor.yaml',))
    feeder.wait_for(1)
    feeder.feed()
    assert feeder.delivered(5.0)
    observer.wait(lambda: sum(recorded(bag).values()) == 5 * SAMPLES)
    recorder.signal(signal.SIGTERM)
    assert recorder.wait() == 0

    topics = {
        topic['topic_metadata']['name']: topic
        for topic in information(bag)['topics_with_message_count']
    }
    messages = decoded(bag)
    for topic, message_type in TOPICS.values():
        assert topics[topic]['topic_metadata']['type'] == message_type
        assert topics[topic]['message_count'] == len(messages[topic]) == SAMPLES
    assert any('recording to' in log.msg for log in messages['/rosout'])
    with Reader(bag) as reader:
        connections = [c for c in reader.connections if c.topic == '/stage/currents']
        times = [time for _, time, _ in reader.messages(connections=connections)]
    np.testing.assert_array_equal(times, run.stage_time)
    states = np.array([message.state for message in messages['/stage/true_state']])
    np.testing.assert_array_equal(states[:, ::2], run.position)

    feeder.leave()
    monitor = start_monitor(nodes)
    play(bag, observer.node)
    assert monitor.wait() == 0, monitor.output
    played = metrics(nodes)
    assert played == analyse(bag).result | {'limits': played['limits']}


def test_a_run_that_is_broken_off_leaves_what_there_was(
    nodes: Nodes, observer: Observer, feeder: Feeder
) -> None:
    bag = nodes.folder / 'bag'
    recorder = nodes.start('recorder', f'output:={bag}', 'flush_period:=0.1')
    monitor = start_monitor(nodes)
    feeder.wait_for(2)
    feeder.feed(0, 1000)
    complete = dict.fromkeys(TOPICS, 1000)
    observer.wait(lambda: recorded(bag) == complete)  # on the disk, while the recorder runs
    recorder.signal(signal.SIGKILL)
    monitor.signal(signal.SIGTERM)
    assert monitor.wait() == 0
    assert metrics(nodes)['verdict'] == 'incomplete'
    assert metrics(nodes)['run_samples'] > 900
    assert recorder.wait() == 137
    assert recorded(bag) == complete
    assert 'recovered' in analyse(bag).notes[0]


def test_silence_ends_the_watch(nodes: Nodes, feeder: Feeder) -> None:
    monitor = start_monitor(nodes, 'timeout:=1.0')
    feeder.wait_for(1)
    feeder.feed(0, 1000)
    assert monitor.wait() == 1
    assert 'the run has stopped: ' in monitor.output
    assert 'silent for' in monitor.output
    assert metrics(nodes)['verdict'] == 'incomplete'


def test_a_fault_fails_the_run(nodes: Nodes, feeder: Feeder) -> None:
    monitor = start_monitor(nodes, 'fault_grace:=0.2')
    feeder.wait_for(1)
    feeder.feed(0, 1000)
    feeder.diagnose(DiagnosticStatus.WARN, 'controller', 'saturated')
    feeder.diagnose(DiagnosticStatus.ERROR, 'camera', 'no picture', hardware='a camera')
    feeder.diagnose(DiagnosticStatus.ERROR, 'plant', 'amplifier 3 is spent')
    assert monitor.wait() == 1
    assert 'fault in plant: amplifier 3 is spent' in monitor.output
    assert metrics(nodes)['verdict'] == 'fail'
    assert metrics(nodes)['faults'] == ['plant: amplifier 3 is spent']


def test_a_fault_of_another_stage_is_none_of_this_run(nodes: Nodes, feeder: Feeder) -> None:
    started = {}
    for namespace in ('/stage1', '/stage2'):
        output = f'output:={nodes.folder}{namespace}.json'
        command = [executable('maglev_monitor', 'monitor'), '--ros-args', '-p', output]
        command += [
            '-p',
            'fault_grace:=0.2',
            '-p',
            'start_timeout:=2.5',
            '-r',
            f'__ns:={namespace}',
        ]
        started[namespace] = nodes.run('monitor', command)
    feeder.diagnose(DiagnosticStatus.ERROR, 'plant', 'amplifier 3 is spent', '/stage2')
    for namespace, faults in (('/stage1', []), ('/stage2', ['plant: amplifier 3 is spent'])):
        assert started[namespace].wait() == 1
        found = json.loads(Path(f'{nodes.folder}{namespace}.json').read_text())
        assert found['faults'] == faults


def test_a_monitor_alone_claims_nothing_of_others_and_says_what_to_look_at(nodes: Nodes) -> None:
    monitor = start_monitor(nodes, 'start_timeout:=5.0')
    monitor.wait_for('no node of the run is seen on domain')
    assert '[WARN]' in monitor.output  # before it gives up
    for words in ('ROS_AUTOMATIC_DISCOVERY_RANGE', 'loopback', 'VPN', 'firewall'):
        assert words in monitor.output
    assert monitor.wait() == 1
    assert 'no run has begun within' in monitor.output
    assert 'not running' not in monitor.output
    assert metrics(nodes)['verdict'] == 'incomplete'


def test_who_is_missing_is_said(nodes: Nodes, observer: Observer) -> None:
    monitor = start_monitor(nodes, 'start_timeout:=1.0')
    assert monitor.wait() == 1
    said = 'the stage and the controller and the reference are not running'
    assert said in monitor.output
    assert metrics(nodes)['verdict'] == 'incomplete'


def test_two_stages_are_noticed(
    nodes: Nodes, feeder: Feeder, observer: Observer, messages: dict[str, list[bytes]]
) -> None:
    second = Feeder(observer.node, messages)
    monitor = start_monitor(nodes)
    second.wait_for(1)
    assert monitor.wait() == 1
    assert '2 nodes publish /' in monitor.output
    assert 'stop all but one' in monitor.output


def test_places_that_cannot_be_written_are_refused(nodes: Nodes) -> None:
    (nodes.folder / 'file').write_text('')
    recorder = nodes.start('recorder', f'output:={nodes.folder / "file" / "bag"}')
    existing = nodes.start('recorder', f'output:={nodes.folder}')
    monitor = nodes.start('monitor', f'output:={nodes.folder / "file" / "metrics.json"}')
    for process, text in ((recorder, 'cannot write'), (existing, 'exists already'), (monitor, '')):
        assert process.wait() == 1
        assert text in process.output
        assert 'error: ' in process.output
        assert len(process.output.splitlines()) == 1, process.output
