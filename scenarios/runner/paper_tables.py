"""All experiments of the paper as runs of the graph, one after another; then the page."""

from __future__ import annotations

from pathlib import Path

from runner.console import GREEN, RED, complain, say
from runner.folder import cannot_write, refuse_full
from runner.graph import Flight, Scenario
from runner.options import WrongUseError
from runner.overlays import PARAMS
from runner.process import program, run_to_end
from runner.run import fly
from runner.signals import Signals

LAWS = {'paper': ('paper.yaml', 'paper_exact.yaml'), 'ours': ()}
"""Overlays of the two controllers that are compared."""
QUICK = {'steps': '6.0', 'ellipse': '4.0', 'ellipse_4dof': '4.0'}
"""The scenarios, with short windows [s]."""


def fly_all(out: Path, mode: str, namespace: str, *, quick: bool, views: tuple[str, ...]) -> int:
    """Fly six runs into a folder and write the page: 0 when all passed, 1 when not, 128 + signal.

    Raises WrongUseError before anything is started.
    """
    page = program('maglev_study', 'paper_tables')
    out = _make_folder(out)
    where = f' in {namespace}' if namespace else ''
    say(f'paper_tables: {mode}{where}, into {out}')
    signals = Signals()
    failed = []
    for flight in _flights(out, mode, namespace, quick, views):
        name = str(flight.out.relative_to(out))
        say(f'paper_tables: {name}')
        if _attempt(flight, signals):
            failed.append(name)
        if signals.code:
            break
    code = None if signals.code else run_to_end([*page, str(out)], signals)
    if signals.code:
        complain(f'paper_tables: interrupted; finished runs are kept in {out}')
        return signals.code
    if code or failed:
        say(f'paper_tables: FAILED{": " if failed else ""}{" ".join(failed)}', RED)
        return 1
    say('paper_tables: passed', GREEN)
    return 0


def _flights(
    out: Path, mode: str, namespace: str, quick: bool, views: tuple[str, ...]
) -> list[Flight]:
    return [
        Flight(
            Scenario(scenario, (f'scenario_{scenario}.yaml',)),
            out=out / controller / scenario,
            mode=mode,
            duration=duration if quick else '',
            overlays=tuple(str(PARAMS / name) for name in ('benchmark.yaml', *files)),
            namespace=namespace,
            views=views,
        )
        for controller, files in LAWS.items()
        for scenario, duration in QUICK.items()
    ]


def _attempt(flight: Flight, signals: Signals) -> int:
    try:
        return fly(flight, signals)
    except WrongUseError as error:
        complain(f'{flight.scenario.name}: error: {error}')
        return 2


def _make_folder(out: Path) -> Path:
    refuse_full(out, ('paper', 'ours', 'paper_tables.html'), 'runs')
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(out) from error
    return out.resolve()
