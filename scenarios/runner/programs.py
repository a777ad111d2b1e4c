"""The scripts that hand over to a program of the workspace, which has the terminal to itself."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import NoReturn

from runner.common_options import OUTPUT, Job, as_given, out_folder, out_option, overlays, talk
from runner.graph import Flight, Scenario
from runner.options import Command, Option, WrongUseError, number_of, whole
from runner.overlays import DISTRIBUTIONS, PARAMS, SECTIONS, check_overlay
from runner.process import installed, program, run_to_end
from runner.run import fly
from runner.signals import Signals
from runner.texts import COMMISSION, COMPARE, FAULTS, ROBUSTNESS, TUNE

EXPERIMENT = Option(
    'only these: ellipse, forces, step_y, step_x, step_theta, scan, hold',
    'EXPERIMENT...',
    several=True,
)
JOBS = Option('processes (default: one for each core)', 'J', number_of)
SCHEDULER = Option('a Dask cluster to fly on, tcp://HOST:8786', 'ADDRESS')
HEARD_BY_FAULTS = ('controller', 'hw_bridge', '**')
HEARD_BY_COMPARE = ('controller', 'plant', '**')
HEARD_BY_ROBUSTNESS = (*HEARD_BY_COMPARE, DISTRIBUTIONS)


def _compare(options: Sequence[str]) -> Job:
    laws = 'only these: files of params/laws, paper, default, or a file of your own, my_law.yaml'
    bandwidth = 'crossover of the laws with compensators, on all axes (default: as in their files)'
    table = {
        '--params': overlays("parameters of controller and plant on top of every law's own"),
        '--out': out_option('the results are', 'compare'),
        '--quick': Option('coarse regions and short windows'),
        '--laws': Option(laws, 'NAME...', several=True),
        '--bandwidth': Option(bandwidth, 'RAD_S'),
        **OUTPUT,
    }
    given = Command('compare.sh', COMPARE, table).parse(options)
    return _study('compare', table, given, HEARD_BY_COMPARE, '--params', str(PARAMS))


def _faults(options: Sequence[str]) -> Job:
    of = 'parameters of bridge and controller, as of a machine of your own'
    table = {
        '--runs': Option('how many runs (default 3000)', 'N', number_of),
        '--seed': Option('of the first run; the others count up (default 0)', 'S', whole),
        '--jobs': JOBS,
        '--double': Option('a second fault up to 0.5 s after the first'),
        '--short': Option('one run of each cell of fault and phase'),
        '--replay': Option(
            'fly one run alone and draw it: fault, detection, landing', 'SEED|FILE.json'
        ),
        '--params': overlays(of),
        '--out': out_option('the page is', 'faults'),
        **OUTPUT,
    }
    given = Command('faults.sh', FAULTS, table).parse(options)
    return _study('faults', table, given, HEARD_BY_FAULTS)


def _robustness(options: Sequence[str]) -> Job:
    of = "parameters of plant, controller and distributions on top of every law's own"
    laws = 'files of params/laws, paper, default (default: default)'
    table = {
        '--machines': Option('how many are drawn (default 200)', 'N', number_of),
        '--params': overlays(of),
        '--law': Option(laws, 'NAME...', several=True),
        '--experiment': EXPERIMENT,
        '--seed': Option('of the machines (default 0)', 'S', whole),
        '--jobs': JOBS,
        '--scheduler': SCHEDULER,
        '--replay': Option('fly machine N through the graph; 0 is the nominal one', 'N', whole),
        '--out': out_option('the results are', 'robustness'),
        **OUTPUT,
    }
    given = Command('robustness.sh', ROBUSTNESS, table).parse(options)
    if '--replay' not in given:
        return _study('robustness', table, given, HEARD_BY_ROBUSTNESS, '--params', str(PARAMS))
    talk(given)
    out = out_folder('robustness', given)
    words = ['--params', str(PARAMS), *_told(table, given, out, *OUTPUT)]
    words += ['--quiet'] if {'--quiet', '--json'} & set(given) else []
    machine = Flight(
        Scenario('ellipse_4dof', ('scenario_ellipse_4dof.yaml',)),
        out=out,
        overlays=(str(out / f'machine-{int(given["--replay"][-1])}.yaml'),),
        as_json='--json' in given,
    )
    return partial(_replay_machine, machine, words, given.get('--params', []))


def _tune(options: Sequence[str]) -> Job:
    of = "parameters of plant, controller and distributions on top of the law's own"
    margin = 'gain that all currents at once must be guaranteed, up and down (default 6.0)'
    table = {
        '--machines': Option('how many are drawn (default 40)', 'N', number_of),
        '--trials': Option('how many numbers are tried (default 60)', 'N', number_of),
        '--margin': Option(margin, 'DB'),
        '--params': overlays(of),
        '--law': Option('the law that is tuned (default: default)', 'LAW'),
        '--experiment': EXPERIMENT,
        '--seed': Option('of machines and search (default 0)', 'S', whole),
        '--jobs': JOBS,
        '--scheduler': SCHEDULER,
        '--out': out_option('tuned.yaml is', 'tune'),
        **OUTPUT,
    }
    given = Command('tune.sh', TUNE, table).parse(options)
    return _study('tune', table, given, HEARD_BY_ROBUSTNESS, '--params', str(PARAMS))


def _study(
    name: str,
    table: Mapping[str, Option],
    given: Mapping[str, list[str]],
    heard: Sequence[str],
    *words: str,
) -> Job:
    """Go on as a study of that name, which hears those sections of the overlays."""
    arguments = [*words, *_told(table, given, out_folder(name, given))]
    return partial(_become, 'maglev_study', name, arguments, given.get('--params', []), heard)


def _told(
    table: Mapping[str, Option], given: Mapping[str, list[str]], out: Path, *but: str
) -> list[str]:
    """What a study is told: its folder, the options as they were given ``but`` some, overlays."""
    names = [name for name in table if name not in ('--params', '--out', *but)]
    words = ['--out', str(out), *as_given(table, given, *names)]
    return words + [word for file in given.get('--params', ()) for word in ('--overlay', file)]


def _replay_machine(machine: Flight, arguments: Sequence[str], given: Sequence[str]) -> int:
    """Have the parameters of a machine written, then fly the graph with them over the overlays'."""
    under = []
    for path in given:
        check_overlay(path, sections=HEARD_BY_ROBUSTNESS)
        with suppress(WrongUseError):  # of distributions alone: no node hears it
            check_overlay(path)
            under.append(path)
    signals = Signals()
    code = run_to_end([*program('maglev_study', 'robustness'), *arguments], signals)
    if code or signals.code:
        return code or signals.code
    return fly(machine._replace(overlays=(*under, *machine.overlays)), signals)


def _commission(options: Sequence[str]) -> Job:
    current = 'largest current of a phase alone, 0.2 to 3 A (default 1.5)'
    table = {
        '--params': overlays('parameters of hw_bridge', width=70),
        '--current': Option(current, 'A'),
        '--yes': Option('do not ask before each step'),
        **OUTPUT,
    }
    given = Command('commission.sh', COMMISSION, table).parse(options)
    files = [PARAMS / name for name in ('machine.yaml', 'hw_bridge.yaml')]
    own = given.get('--params', [])
    arguments = []
    for file in [*(str(file) for file in files if file.is_file()), *own]:
        arguments += ['--params', file]
    arguments += as_given(table, given, '--current', '--yes', *OUTPUT)
    return partial(_become, 'maglev_hw_bridge', 'commission', arguments, own)


def _become(
    package: str,
    executable: str,
    arguments: Sequence[str],
    given: Sequence[str] = (),
    heard: Sequence[str] = SECTIONS,
) -> NoReturn:
    """Go on as another program, which has the terminal and its signals to itself.

    It hears those sections of the overlays that are ``given``.
    """
    for path in given:
        check_overlay(path, sections=heard)
    path = installed(package, executable)
    # While it imports what it needs, Python would answer with a traceback; leave_with unblocks.
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    os.execv(path, [path, *arguments])


PROGRAMS: dict[str, Callable[[Sequence[str]], Job]] = {
    'compare': _compare,
    'faults': _faults,
    'robustness': _robustness,
    'tune': _tune,
    'commission': _commission,
}
"""By the scripts' names."""
