"""All experiments of the paper as runs of the graph, one after another; then the page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

from runner.console import GREEN, complain, quiet, say, write
from runner.folder import cannot_write, refuse_full
from runner.graph import Flight, Scenario
from runner.options import WrongUseError
from runner.overlays import PARAMS
from runner.process import program, run_to_end
from runner.run import fly, outcome
from runner.signals import Signals

_PAPER = ('paper.yaml', 'paper_exact.yaml')
_STEPS, _ELLIPSES = ('steps',), ('ellipse', 'ellipse_4dof')
CASES = {
    'paper': (_PAPER, _STEPS + _ELLIPSES),
    'ours': ((), _STEPS + _ELLIPSES),
    'paper_rough': (('rough.yaml', *_PAPER), _ELLIPSES),
    'ours_rough': (('rough.yaml',), _STEPS + _ELLIPSES),
    'paper_shaped': ((*_PAPER, 'paper_shaped.yaml'), _STEPS),
}
"""Laws and plants that are compared: their overlays, and their scenarios."""
QUICK = {'steps': '6.0', 'ellipse': '4.0', 'ellipse_4dof': '4.0'}
"""The scenarios, with short windows [s]."""


class Wanted(NamedTuple):
    """How the runs are flown: with ``quick`` in short windows, with ``as_json`` as one line."""

    mode: str
    namespace: str
    quick: bool
    views: tuple[str, ...]
    as_json: bool


def fly_all(out: Path, wanted: Wanted) -> int:
    """Fly all runs into a folder and write the page: 0 when all passed, 1 when not, 128 + signal.

    Raises WrongUseError before anything is started.
    """
    page = program('maglev_study', 'paper_tables')
    out = _make_folder(out)
    where = f' in {wanted.namespace}' if wanted.namespace else ''
    say(f'paper_tables: {wanted.mode}{where}, into {out}')
    signals = Signals()
    codes: dict[str, int] = {}
    flights = _flights(out, wanted)
    for number, flight in enumerate(flights, start=1):
        name = str(flight.out.relative_to(out))
        say(f'paper_tables: {name}, {number} of {len(flights)}')
        codes[name] = _attempt(flight, signals)
        if signals.code:
            break
    log = out / 'paper_tables.log' if wanted.as_json or quiet() else None
    code = None if signals.code else run_to_end([*page, str(out)], signals, log)
    failed = [name for name, ended in codes.items() if ended]
    passed = not (signals.code or code or failed)
    if wanted.as_json:
        runs = [
            outcome(flight, not ended)
            for flight, ended in zip(flights, codes.values(), strict=False)  # those that were flown
        ]
        facts = {'out': str(out), 'page': str(out / 'paper_tables.html')}
        write(json.dumps({'passed': passed, **facts, 'runs': runs}))
    if signals.code:
        complain(f'paper_tables: interrupted; finished runs are kept in {out}')
        return signals.code
    if not passed:
        complain(f'paper_tables: FAILED{": " if failed else ""}{" ".join(failed)}')
        return 1
    say('paper_tables: passed', GREEN)
    return 0


def _flights(out: Path, wanted: Wanted) -> list[Flight]:
    return [
        Flight(
            Scenario(scenario, (f'scenario_{scenario}.yaml',)),
            out=out / case / scenario,
            mode=wanted.mode,
            duration=QUICK[scenario] if wanted.quick else '',
            overlays=tuple(str(PARAMS / name) for name in ('benchmark.yaml', *files)),
            namespace=wanted.namespace,
            views=wanted.views,
        )
        for case, (files, scenarios) in CASES.items()
        for scenario in scenarios
    ]


def _attempt(flight: Flight, signals: Signals) -> int:
    try:
        return fly(flight, signals)
    except WrongUseError as error:
        complain(f'{flight.scenario.name}: error: {error}')
        return 2


def _make_folder(out: Path) -> Path:
    refuse_full(out, (*CASES, 'paper_tables.html'), 'runs')
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(out) from error
    return out.resolve()
