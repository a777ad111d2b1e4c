"""One run of the graph, from its folder to its report."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from runner.console import GREEN, complain, quiet, say, write
from runner.folder import make_folder, say_where, why_unwritable
from runner.graph import START_ORDER, STOP_ORDER, Flight
from runner.logs import NodeLog
from runner.options import WrongUseError
from runner.overlays import check_overlay
from runner.process import Process, last_words, program, run_to_end, why_killed
from runner.signals import Signals

NO_VISER = 3
"""The exit code of ``replay`` where what it needs is no part of the set-up."""
TALKERS = ('watchers', 'web')
"""Nodes of which the terminal shows everything."""


def fly(flight: Flight, signals: Signals) -> int:
    """Fly and leave the run in its folder.

    Returns 0 when it passed, 1 when not, 128 + N when signal N ended it. Raises WrongUseError
    before anything is started.
    """
    for path in flight.overlays:
        check_overlay(path, flight.namespace)
    if os.environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE') == 'OFF':
        raise WrongUseError('with ROS_AUTOMATIC_DISCOVERY_RANGE=OFF no node sees another: unset it')
    domain = os.environ.get('ROS_DOMAIN_ID', '')
    if not re.fullmatch('0[xX][0-9a-fA-F]+|[0-9]*', domain):  # ROS takes -1 for 0, and 5a for 5
        raise WrongUseError(f"ROS_DOMAIN_ID is '{domain}', it must be a whole number, as 42")
    commands = {node: flight.program(node) for node in (*START_ORDER, *flight.views)}
    analyze = program('maglev_monitor', 'analyze')
    replay = program('maglev_view', 'replay') if 'view' in flight.views else None
    flight = flight._replace(out=make_folder(flight.out))
    name = flight.scenario.name
    where = f' in {flight.namespace}' if flight.namespace else ''
    say(f'{name}: {flight.stage}, {flight.mode}{where}, into {flight.out}')
    offer = flight.scenario.offer
    if offer and all(Path(path).name != offer for path in flight.overlays):
        say(f'{name}: internal models that match it: --params {offer.removesuffix(".yaml")}')
    run = Run(flight, signals)
    try:
        passed = run.measure(commands) and not signals.code and run.judge(analyze, replay)
    except OSError as error:
        complain(f'{name}: failed: {error}')
        passed = False
    if signals.code:
        complain(f'{name}: interrupted; what was recorded is kept in {flight.out}')
    elif passed:
        say(f'{name}: passed', GREEN)
    else:
        if why := why_unwritable(flight.out):
            complain(f'{name}: {why}')
        complain(f'{name}: FAILED, see {flight.out}')
    say_where(flight.out)
    if flight.as_json:
        write(json.dumps(outcome(flight, passed)))
    return signals.code or int(not passed)


def outcome(flight: Flight, passed: bool) -> dict[str, object]:
    """What came of a flight, with the content of its metrics.json."""
    facts = {'scenario': flight.scenario.name, 'stage': flight.stage, 'mode': flight.mode}
    return {**facts, 'out': str(flight.out), 'passed': passed, 'metrics': figures(flight) or None}


def figures(flight: Flight) -> dict[str, Any]:
    """The content of a flight's metrics.json, empty where there is none."""
    try:
        found: dict[str, Any] = json.loads((flight.out / 'metrics.json').read_text('utf-8'))
    except (OSError, ValueError):
        return {}
    return found


class Run:
    """The nodes of one run while they live."""

    def __init__(self, flight: Flight, signals: Signals) -> None:
        self._flight = flight
        self._name, self._out = flight.scenario.name, flight.out
        self._signals = signals
        self._nodes: dict[str, Process] = {}
        self._gone: set[str] = set()
        self._logs = {
            node: NodeLog(f'{self._name}: {node}', self._log(node), everything=node in TALKERS)
            for node in (*START_ORDER, *flight.views)
        }

    def measure(self, commands: Mapping[str, Sequence[str]]) -> bool:
        """Whether the nodes lived until the monitor had its figures, and no signal came before.

        Raises OSError when one cannot be started. However it goes, none lives on.
        """
        try:
            for node in commands:
                if self._signals.code:
                    return False
                command = [*commands[node], *self._flight.arguments(node)]
                self._nodes[node] = Process(command, self._log(node))
            return self._watch()
        finally:
            for node in (*STOP_ORDER, *self._flight.views):
                if node in self._nodes:
                    self._nodes[node].stop(self._pause)
            self._show(rest=True)

    def judge(self, analyze: Sequence[str], replay: Sequence[str] | None) -> bool:
        """Whether the nodes ended cleanly, there is a report, and the limits are kept."""
        clean = self._clean_ends()
        if replay:
            self._replay(replay)
        reported = self._report(analyze)
        found = figures(self._flight)
        passed = found.get('verdict') == 'pass'
        if quiet() and not passed:  # else the monitor has told it
            for reason in found.get('reasons', ()):
                self._complain(reason)
        return clean and reported and passed

    def _watch(self) -> bool:
        while not self._signals.code:
            self._pause(0.1)
            ended = [node for node in START_ORDER if self._nodes[node].code is not None]
            for node in ended:
                words = self._last_words(node)
                code = self._nodes[node].code
                self._complain(f'failed: {node} ended early with exit code {code}{words}')
                self._complain(f'its log: {self._log(node)}')
            if ended or (self._out / 'metrics.json').is_file():
                return not ended
            self._tell_of_views()
        return False

    def _tell_of_views(self) -> None:
        """Say that a view has ended, which the flight does not heed."""
        for node in self._flight.views:
            code = self._nodes[node].code
            if code is not None and node not in self._gone:
                self._gone.add(node)
                words = self._last_words(node)
                self._complain(f'{node} ended with exit code {code}, the flight goes on{words}')

    def _clean_ends(self) -> bool:
        clean = True
        for node in STOP_ORDER:
            code = self._nodes[node].code
            if code != 0:
                words = self._last_words(node)
                self._complain(f'failed: {node} did not end cleanly, exit code {code}{words}')
                clean = False
        return clean

    def _replay(self, replay: Sequence[str]) -> None:
        """Make the flight in 3D, to which the report leads; a run is none the worse without it."""
        log = self._log('replay')
        code = run_to_end(
            [*replay, f'{self._out}/bag', '--out', str(self._out)], self._signals, log
        )
        if code:
            tell = say if code == NO_VISER else complain
            tell(f'{self._name}: no replay: {last_words(log).removeprefix("replay: error: ")}')

    def _report(self, analyze: Sequence[str]) -> bool:
        log, report = self._log('analyze'), self._out / 'report.html'
        command = [*analyze, f'{self._out}/bag', '--out', str(self._out)]
        code = run_to_end(command, self._signals, log)
        if code is None:
            return False
        if code > 1 or not report.is_file() or not report.stat().st_size:
            lines = log.read_text(errors='replace').splitlines() or ['']
            self._complain(f'failed: no report: {lines[-1]}')
            return False
        return True

    def _last_words(self, node: str) -> str:
        words = why_killed(self._nodes[node].code) or self._logs[node].last_words()
        return f': {words}' if words else ''

    def _log(self, node: str) -> Path:
        return self._out / 'log' / f'{node}.log'

    def _pause(self, duration: float) -> None:
        self._signals.pause(duration)
        self._show()

    def _show(self, rest: bool = False) -> None:
        for log in self._logs.values():
            log.show(rest)

    def _complain(self, text: str) -> None:
        complain(f'{self._name}: {text}')
