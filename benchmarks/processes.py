#!/usr/bin/env python3
"""Real processes over real DDS, killed, stopped and signalled at any moment of a flight.

    python benchmarks/processes.py [--runs N] [--seed S] [--out FILE]

Bridge on emulated boards, controller, reference and recorder, each a process of its own, at 1 kHz
by the clock and with the limits of real boards: currents 5 ms old, a sample 5 ms late, a watchdog
of 20 ms. At some instant between rest and rest one of them gets what its seed says. Looked at are
the platen's true speed where it meets a stop, that no current stays, that all that live end in
order when asked to, and that the next run starts. Runs in which the machine itself was late, by a
thread of the highest priority, are counted apart. Exits with 1 when another broke a rule.

Where the bridge is killed, frozen or stopped for longer than its watchdog the boards cut, and the
emulated machine, which is its own, tells no more: of these only the ends and starts are looked at.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / 'test' / 'support'))
from flight import BRISK, LOWER_STOP
from graph import Nodes, Observer, Process
from witness import Witness

from maglev_node.topics import MEASUREMENT, REFERENCE, SAMPLE_TOPICS, TRUE_STATE

UPPER_STOP = 0.018
DEGRADED = 0.05  # landings by the bridge, at most [m/s]
TOUCHING = 1e-5  # [m]
FLIGHT = 6.0  # from the first reference to the last of a flight left to itself, about [s]
LONGEST = 20.0  # until nothing moves, and until a process has ended [s]
TARGETS = ('hw_bridge', 'controller', 'reference', 'recorder')
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
WATCHDOG = 0.02  # of the boards [s]


class Run(NamedTuple):
    """What happens to whom, and when after the first reference [s]."""

    seed: int
    target: str
    what: str  # kill, freeze, stop, or names of signals
    instant: float
    length: float  # of a stop, or between two signals [s]

    @property
    def cut(self) -> bool:
        """Whether the boards are left alone for so long that they cut the current."""
        stopped = self.what == 'stop' and self.length > 0.8 * WATCHDOG
        return self.target == 'hw_bridge' and (self.what in ('kill', 'freeze') or stopped)


def draw(seed: int) -> Run:
    """The run of a seed; targets and happenings come in turn."""
    chance = random.Random(seed)
    target = TARGETS[seed % len(TARGETS)]
    kind = ('kill', 'freeze', 'stop', 'stop', 'once', 'twice')[seed // len(TARGETS) % 6]
    instant, length = chance.uniform(0.0, FLIGHT), chance.uniform(0.0, 0.1)
    if kind == 'stop':
        length = 10 ** chance.uniform(-3.0, np.log10(0.05))
    if kind in ('once', 'twice'):
        kind = ' '.join(chance.choice(SIGNALS).name for _ in range(1 + (kind == 'twice')))
    return Run(seed, target, kind, instant, length)


def happen(run: Run, process: Process) -> None:
    """Do to a process what the run says."""
    if run.what == 'kill':
        process.signal(signal.SIGKILL)
    elif run.what in ('freeze', 'stop'):
        process.signal(signal.SIGSTOP)
        if run.what == 'stop':
            time.sleep(run.length)
            process.signal(signal.SIGCONT)
    else:
        first, *second = run.what.split()
        process.signal(signal.Signals[first])
        for name in second:
            time.sleep(run.length)
            process.signal(signal.Signals[name])


def start(nodes: Nodes, folder: Path) -> dict[str, Process]:
    """All processes of a flight."""
    common = 'mode:=realtime', 'watchers:=[observer]'
    limits = 'emulation.patience:=0.0', *common
    reference = 'duration:=2.0', 'run_in:=0.5', *BRISK, *common
    return {
        'hw_bridge': nodes.start('hw_bridge', *limits, params=('hw_bridge.yaml',)),
        'controller': nodes.start('controller', *common),
        'recorder': nodes.start('recorder', f'output:={folder / "run"}'),
        'reference': nodes.start('reference', *reference, params=('scenario_ellipse_4dof.yaml',)),
    }


def impact(observer: Observer) -> float:
    """Greatest speed in the sample before the platen was at a vertical stop [m/s]."""
    state = np.array([message.state for message in observer.look()[TRUE_STATE]])
    if len(state) < 2:
        return 0.0
    touches = (state[:, 0] > LOWER_STOP - TOUCHING) | (state[:, 0] < UPPER_STOP + TOUCHING)
    arrived = touches[1:] & ~touches[:-1]
    return float(np.max(np.abs(state[:-1, 1][arrived]), initial=0.0))


def at_rest(observer: Observer) -> bool:
    """Whether the platen has lain on its stop without current for 300 samples."""
    held = observer.look()[TRUE_STATE]
    return len(held) > 300 and all(
        abs(message.state[0] - LOWER_STOP) < TOUCHING
        and not np.any(np.abs([message.direct_current, message.quadrature_current]) > 1e-3)
        for message in (held[-1], held[-150], held[-300])
    )


def settle(run: Run, observer: Observer, graph: dict[str, Process], over: float) -> bool:
    """Wait until the flight would be ``over`` and nothing moves; False where that takes long."""
    heard, count = time.monotonic(), 0
    while time.monotonic() < over + LONGEST:
        observer.serve(0.05)
        total = len(observer.look()[MEASUREMENT])
        if total > count:
            heard, count = time.monotonic(), total
        silent = time.monotonic() - heard > 1.0
        if silent and (not graph['hw_bridge'].running or run.cut):
            return True
        if time.monotonic() > over and at_rest(observer):
            return True
    return False


def end(run: Run, graph: dict[str, Process]) -> list[str]:
    """End what lives, as a user does; what did not end in order."""
    wrong = []
    for name, process in graph.items():
        gone = name == run.target and run.what in ('kill', 'freeze')
        if gone:
            process.kill()
            continue
        process.signal(signal.SIGTERM)
        deadline = time.monotonic() + LONGEST
        while process.running and time.monotonic() < deadline:
            time.sleep(0.02)
        if process.running:
            wrong.append(f'{name} did not end')
        elif process.wait() != 0:
            wrong.append(f'{name} ended with {process.wait()}')
    return wrong


def fly(run: Run) -> dict[str, Any]:
    """One run; what came of it, by name."""
    with tempfile.TemporaryDirectory() as folder, Witness() as witness:
        nodes, observer = Nodes(Path(folder)), Observer()
        observer.watch(*SAMPLE_TOPICS)
        try:
            graph = start(nodes, Path(folder))
            observer.wait(lambda: observer.newest(REFERENCE) is not None, 30.0)
            over = time.monotonic() + FLIGHT
            time.sleep(run.instant)
            before = observer.newest(TRUE_STATE)
            happen(run, graph[run.target])
            wrong = (
                [] if settle(run, observer, graph, over) else ['current stays, or it never rests']
            )
            wrong += end(run, graph)
            speed = impact(observer)
        except AssertionError as error:
            wrong, speed, before = [str(error).strip().splitlines()[0]], 0.0, None
        finally:
            observer.close()
            for process in nodes.started:
                process.kill()
        if speed > DEGRADED and not run.cut:
            wrong.append(f'met a stop at {speed:.3f} m/s')
        said = {process.log.stem: process.output[-2000:] for process in nodes.started}
    return {
        **run._asdict(),
        'gap': None if before is None else float(before.state[0]),
        'speed': speed,
        'late': witness.worst,
        'disturbed': witness.disturbed,
        'wrong': wrong,
        'said': said if wrong else {},
    }


def main() -> int:
    """Fly them, and tell."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--runs', type=int, default=300)
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--out', type=Path, help='all outcomes, a line of JSON each')
    asked = parser.parse_args()
    os.environ.setdefault('ROS_DOMAIN_ID', '77')
    outcomes, begun = [], time.monotonic()
    for seed in range(asked.seed, asked.seed + asked.runs):
        one = fly(draw(seed))
        outcomes.append(one)
        if asked.out:
            with asked.out.open('a', encoding='utf-8') as file:
                file.write(json.dumps(one) + '\n')
        if one['wrong']:
            late = ', on a machine that was late' * bool(one['disturbed'])
            told = f'{one["target"]}, {one["what"]} after {one["instant"]:.2f} s'
            print(f'seed {seed}: {told}: {"; ".join(one["wrong"])}{late}', flush=True)
    tell(outcomes, time.monotonic() - begun)
    return int(any(one['wrong'] and not one['disturbed'] for one in outcomes))


def tell(outcomes: list[dict[str, Any]], took: float) -> None:
    """Runs, broken ones and speeds, by process and what happened to it."""

    def kind(one: dict[str, Any]) -> tuple[str, str]:
        what = str(one['what'])
        return str(one['target']), what if what in ('kill', 'freeze', 'stop') else 'signals'

    print(f'{len(outcomes)} runs in {took / 60:.0f} min')
    for (target, what), runs in sorted(Counter(map(kind, outcomes)).items()):
        these = [one for one in outcomes if kind(one) == (target, what)]
        quiet = [one for one in these if not one['disturbed']]
        broken = sum(bool(one['wrong']) for one in quiet)
        speed = max((float(one['speed']) for one in quiet), default=0.0)
        disturbed = len(these) - len(quiet)
        print(
            f'{target:10} {what:8} {runs:4} runs, {disturbed:3} on a machine that was late; '
            f'of the others {broken} broken, at a stop at most {speed:.3f} m/s'
        )


if __name__ == '__main__':
    sys.exit(main())
