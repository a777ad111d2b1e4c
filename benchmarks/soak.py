#!/usr/bin/env python3
"""The ellipse in real time behind the emulated bridge for half an hour, on a machine that works.

    python benchmarks/soak.py [--minutes M] [--stage hw_bridge|plant] [--idle] [--apart] [--out DIR]

Beside it, unless ``--idle``: a busy process for each core, one that fills and frees 400 MB over and
over, two strangers on every topic of the stage, and 20 MB a second of somebody else's messages. One
of the strangers is stopped for some seconds once, early: what publishers keep for a reader that
lags, at most, they have from then on, and what grows afterwards is something else.

With ``--apart`` the stage has the first processor for its own among the nodes, and all others of
the loop share the rest; the load is wherever the kernel puts it.

Prints memory of each node at the beginning and the end, how it and the open files grew, late
samples and errors, and beside them how late the machine itself was: what keeps a bare thread of the
highest priority waiting, no node can do without. Where the kernel grants real-time threads a part
of each processor only, it takes the rest in one piece, 50 ms of a second by default. Errors are
held to 1 mm and 1 mrad only. Exits with 1 when the run did not pass, lost a message, or a node
grew.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1] / 'test' / 'support'))
from witness import SHORT, Witness

ROOT = Path(__file__).resolve().parents[1]
SUPPORT = ROOT / 'test' / 'support'
BUSY = 'while True: pass'
FILLING = 'import time\nwhile True: b"x" * 400_000_000; time.sleep(0.05)'
TALKING = """
import rclpy
from std_msgs.msg import ByteMultiArray
rclpy.init()
node = rclpy.create_node('talker')
to = node.create_publisher(ByteMultiArray, 'somebody_elses', 10)
node.create_subscription(ByteMultiArray, 'somebody_elses', lambda message: None, 10)
message = ByteMultiArray(data=[b'a'] * 200_000)
node.create_timer(0.01, lambda: to.publish(message))
rclpy.spin(node)
"""
LIMITS = """
monitor:
  ros__parameters:
    limits:
      max_mean_error: [1.0e-3, 1.0e-3, 1.0e-3, 1.0e-3, 1.0e-3]
      max_error: [1.0e-3, 1.0e-3, 1.0e-3, 1.0e-3, 1.0e-3]
"""
SETTLED = 120.0  # after which a node has all it needs [s]
GROWTH = 5.0  # of a node's memory, from then on [MB an hour]
SLACK = 2.0  # by which two looks at the same may differ [MB]
PERIOD = 5.0  # between two looks [s]
ENDING = 60.0  # for a scenario that is interrupted [s]
STOPPED = 60.0, 68.0  # when a stranger is, longer than publishers keep samples for a reader [s]


class Look(NamedTuple):
    """What a process holds."""

    time: float  # [s]
    memory: float  # resident [MB]
    files: int
    threads: int


def look(pid: int) -> Look | None:
    """At a process; None when it is gone."""
    with contextlib.suppress(OSError):
        lines = Path(f'/proc/{pid}/status').read_text().splitlines()
        status = dict(line.split(':', 1) for line in lines)
        files = len(os.listdir(f'/proc/{pid}/fd'))
        memory = int(status['VmRSS'].split()[0]) / 1024
        return Look(time.monotonic(), memory, files, int(status['Threads']))
    return None


def nodes(scenario: int) -> dict[str, int]:
    """Nodes that a scenario has started, by name."""
    found: dict[str, int] = {}
    for entry in Path('/proc').glob('[0-9]*'):
        with contextlib.suppress(OSError, ValueError, IndexError):
            if int((entry / 'stat').read_text().rpartition(')')[2].split()[1]) != scenario:
                continue
            words = (entry / 'cmdline').read_bytes().decode().split('\0')
            for word in words[:3]:
                if '/lib/maglev_' in word and '--ros-args' in words:  # a tool is none
                    found[Path(word).name] = int(entry.name)
    return found


@contextlib.contextmanager
def load(*, idle: bool) -> Iterator[list[subprocess.Popen[bytes]]]:
    """Others at work, unless the machine is to be idle; those on the stage's topics."""
    if idle:
        yield []
        return
    scripts = [BUSY] * len(os.sched_getaffinity(0)) + [FILLING, TALKING]
    commands = [[sys.executable, '-c', script] for script in scripts]
    strangers = 2
    commands += [[sys.executable, str(SUPPORT / 'stranger.py')]] * strangers
    started = [subprocess.Popen(words, stdout=subprocess.DEVNULL) for words in commands]
    try:
        yield started[-strangers:]
    finally:
        for process in started:
            process.kill()
            process.wait()


def apart(stage: str) -> str:
    """Parameters with which the stage runs on another processor than the rest of the graph."""
    first, *others = sorted(os.sched_getaffinity(0))
    return ''.join(
        f'{nodes}:\n  ros__parameters:\n    processors: {where}\n'
        for nodes, where in (('/**', others or [first]), (stage, [first]))
    )


def fly(asked: argparse.Namespace, out: Path, limits: Path) -> dict[str, list[Look]]:
    """The scenario, and what its nodes held all along."""
    limits.write_text(LIMITS + (apart(asked.stage) if asked.apart else ''), encoding='utf-8')
    command = [str(ROOT / 'scenarios' / 'ellipse.sh'), '--mode', 'realtime']
    command += ['--stage', asked.stage, '--duration', str(60.0 * asked.minutes)]
    command += ['--params', str(limits), '--quiet', '--out', str(out)]
    held: dict[str, list[Look]] = {}
    with load(idle=asked.idle) as strangers:
        scenario = subprocess.Popen(command, start_new_session=True)
        begin = time.monotonic()
        try:
            while scenario.poll() is None:
                stopped = STOPPED[0] <= time.monotonic() - begin < STOPPED[1]
                for stranger in strangers[:1]:
                    stranger.send_signal(signal.SIGSTOP if stopped else signal.SIGCONT)
                for name, pid in nodes(scenario.pid).items():
                    if seen := look(pid):
                        held.setdefault(name, []).append(seen)
                time.sleep(PERIOD)
        finally:
            land(scenario)
    return held


def land(scenario: subprocess.Popen[bytes]) -> None:
    """Land a scenario that still flies, and leave nothing of it."""
    scenario.send_signal(signal.SIGINT)
    with contextlib.suppress(subprocess.TimeoutExpired):
        scenario.wait(ENDING)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(scenario.pid, signal.SIGKILL)
    scenario.wait()


def growth(held: list[Look]) -> tuple[float, int]:
    """Memory [MB] and open files that a process has more at the end than once it had settled."""
    settled = [one for one in held if one.time > held[0].time + SETTLED] or held
    tenth = max(len(settled) // 10, 1)
    begin, end = settled[:tenth], settled[-tenth:]
    memory = min(one.memory for one in end) - min(one.memory for one in begin)
    return memory, min(one.files for one in end) - min(one.files for one in begin)


def granted() -> str:
    """How much of a processor the kernel leaves to real-time threads."""
    try:
        runtime, period = (
            int(Path(f'/proc/sys/kernel/sched_rt_{name}_us').read_text())
            for name in ('runtime', 'period')
        )
    except OSError:
        return 'an unknown part of each processor'
    return 'all of each processor' if runtime < 0 else f'{runtime / period:.0%} of each processor'


def wrong_with(held: dict[str, list[Look]], metrics: dict[str, Any], hours: float) -> list[str]:
    """What is not as it shall be."""
    wrong = [] if metrics['verdict'] == 'pass' else [f'the run says: {metrics["reasons"]}']
    if metrics['missing_samples']:
        wrong.append(f'{metrics["missing_samples"]} samples are missing')
    for name, looks in held.items():
        memory, files = growth(looks)
        if memory > SLACK + GROWTH * hours:
            wrong.append(f'{name} grew by {memory:.1f} MB')
        if files > 0:
            wrong.append(f'{name} holds {files} files more')
    return wrong


def lateness(metrics: dict[str, Any], witness: Witness) -> str:
    """Of the samples, and of the machine."""
    late = metrics['timing']['late_samples'] / max(metrics['run_samples'], 1)
    ratio = f'{late / witness.share:.1f} times that' if witness.share else 'none was'
    return (
        f'{late:.4%} of the samples were late; a bare thread of the highest priority was late by'
        f' more than {1e3 * SHORT} ms in {witness.share:.4%} of its looks, {ratio}, and by'
        f' {1e3 * witness.worst:.1f} ms at most'
    )


def main() -> int:
    """Fly, look and tell."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--minutes', type=float, default=30.0)
    parser.add_argument('--stage', choices=('hw_bridge', 'plant'), default='hw_bridge')
    parser.add_argument('--idle', action='store_true', help='nothing else at work')
    parser.add_argument('--apart', action='store_true', help='the stage has its own processor')
    parser.add_argument('--out', type=Path, help='where the run is left; forgotten otherwise')
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        out = asked.out or Path(folder) / 'run'
        with Witness() as witness:
            held = fly(asked, out, Path(folder) / 'limits.yaml')
        try:
            metrics = json.loads((out / 'metrics.json').read_text(encoding='utf-8'))
        except FileNotFoundError:
            print('the run left no figures')
            return 1
    for name, looks in sorted(held.items()):
        memory, files = growth(looks)
        print(
            f'{name:12} {looks[0].memory:6.1f} to {looks[-1].memory:6.1f} MB, at most '
            f'{max(one.memory for one in looks):.1f}; settled it grew by {memory:+.1f} MB and '
            f'{files:+d} files; {looks[-1].threads} threads'
        )
    print(lateness(metrics, witness))
    print(f'the kernel grants real-time threads {granted()}')
    print('timing', json.dumps(metrics['timing']), 'missing', metrics['missing_samples'])
    print('errors', json.dumps(metrics['own_axes']))
    wrong = wrong_with(held, metrics, asked.minutes / 60)
    print('\n'.join(wrong) or 'nothing lost, nothing grew')
    return int(bool(wrong))


if __name__ == '__main__':
    sys.exit(main())
