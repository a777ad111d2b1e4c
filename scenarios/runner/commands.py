"""The scripts, one function each: from options to what is to be done after the set-up."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NoReturn

from runner.console import complain, talk_to, write
from runner.folder import default_folder
from runner.graph import VIEWS, Flight, Scenario
from runner.options import (
    Command,
    HelpAskedError,
    Option,
    WrongUseError,
    folder,
    namespace,
    one_of,
    seconds,
    whole,
)
from runner.overlays import PARAMS, SECTIONS, check_overlay, overlay
from runner.paper_tables import fly_all
from runner.process import installed, program, run_to_end
from runner.run import fly
from runner.signals import Signals

Job = Callable[[], int]
"""What returns an exit code; it may raise WrongUseError before anything is started."""

LATER = 75
"""Exit code of ``--check`` when there is more to do than to answer."""

MODE = Option(
    'as fast as it computes and repeatable, or 1 kHz by the clock\n(default lockstep)',
    'lockstep|realtime',
    one_of('lockstep', 'realtime'),
)
NAMESPACE = Option(
    'where on the graph the nodes are: several runs, each in its own, fly at once',
    'NS',
    namespace,
)
VIEW = {
    '--view': Option('show the flight live in the browser'),
    '--no-view': Option('no standard topics for RViz, Foxglove and PlotJuggler'),
}
PAPER = {
    'ellipse': "The paper's ellipse in y, x and z: lifts off, follows it for 60 s measured, lands.",
    'ellipse_4dof': "The paper's ellipse with theta turning along: lifts off, follows it for 60 s"
    ' measured, lands.',
    'steps': "The steps of the paper's Table III in y, x, z and theta, each from rest, other axes"
    ' held.',
}
SINGLE_MOTOR = """\
The single-motor machine of refs. [10], [11]: steps, then sinusoids, in air gap and displacement."""
TRAJECTORY = """\
A trajectory: lifts off, follows it measured, lands.

  NAME      {names}
  FILE.csv  header t,y,x,z,phi,theta in s, m, rad; equally spaced rows; followed over and over, so
            that its last row is its first again
params/matched_NAME.yaml, where there is one, is an overlay with internal models to match."""
PAPER_TABLES = """\
All experiments of the paper, Table III and Figs. 4 to 8, through the nodes on the benchmark plant,
with the paper's controller and with ours; then one page with the paper's own figures beside both.
Some minutes in lockstep, a quarter of an hour in real time."""
COMPARE = """\
Flies all control laws over the same steps, ellipses, disturbances and mismatches on the benchmark
plant, prints one table and draws their regions of operation. A few minutes on two cores."""
HEARD_BY_COMPARE = ('controller', 'plant', '**')
FAULTS = """\
The hardware bridge on emulated boards under every fault in every phase, judged by what truly
happens: thousands of runs, faster than real time, without ROS; one page at the end. About ten runs
a second and core.

Exits with 1 when a rule is broken; each failure can be flown again by its seed."""
ROBUSTNESS = """\
Draws machines from the distributions in params/robustness.yaml, flies each under each law through
the ellipse, also under forces, steps, a slow scan and a hold, without ROS, and leaves a table and a
page: who survives what, how far errors spread, which parameter matters, which machine is worst.

Called again with the same --out, it goes on where it was. --replay flies one machine through the
whole graph, the ellipse in 4DOF."""
HEARD_BY_ROBUSTNESS = (*HEARD_BY_COMPARE, 'robustness')
COMMISSION = """\
Brings a machine up step by step at low current and says what is wired or set wrongly. Without an
overlay it runs on the emulated boards."""


def main(arguments: Sequence[str]) -> int:
    """Do what ``[--check] NAME OPTION...`` asks for and return the exit code.

    With ``--check`` nothing that needs the set-up is done, and :data:`LATER` returned instead.
    """
    check_only = arguments[0] == '--check'
    name, *options = arguments[check_only:]
    try:
        job = COMMANDS[name](options)
        return LATER if check_only else job()
    except HelpAskedError as text:
        write(str(text))
        return 0
    except WrongUseError as error:
        complain(f'{name}: error: {error}')
        return 2


def _out_option(what: str, name: str) -> Option:
    return Option(f'where {what} left (default runs/{name}-<time>)', 'DIR', folder)


def _out(name: str, given: Mapping[str, list[str]]) -> Path:
    return Path(given['--out'][-1]) if '--out' in given else default_folder(name)


def _flight_command(name: str, description: str, call: str = '') -> Command:
    options = {
        '--stage': Option(
            'what is levitated: the simulated plant, or the hardware (default plant)',
            'plant|hw_bridge',
            one_of('plant', 'hw_bridge'),
        ),
        '--mode': MODE,
        '--duration': Option(
            'measured time: of the tracking window, or of each step [s]', 'S', seconds
        ),
        '--params': Option(
            "parameters on top of the scenario's, from the current folder or from\n"
            'params/; repeatable, the last one wins',
            'OVERLAY.yaml',
            overlay,
        ),
        '--namespace': NAMESPACE,
        **VIEW,
        '--out': _out_option('the run is', name),
        '--quiet': Option('say only what is wrong'),
        '--json': Option(
            'print the outcome with all figures as one line of JSON, all else to stderr'
        ),
    }
    return Command(call or f'{name}.sh', description, options)


def _flight(scenario: Scenario, command: Command, options: Sequence[str]) -> Flight:
    given = command.parse(options)
    where = given.get('--namespace', [''])[-1]
    if '--quiet' in given:
        talk_to(None)
    elif '--json' in given:
        talk_to(2)
    return Flight(
        scenario,
        out=_out(scenario.name + where.replace('/', '-'), given),
        stage=given.get('--stage', ['plant'])[-1],
        mode=given.get('--mode', ['lockstep'])[-1],
        duration=given.get('--duration', [''])[-1],
        overlays=tuple(given.get('--params', ())),
        namespace=where,
        as_json='--json' in given,
        views=_views(given),
    )


def _views(given: Mapping[str, list[str]]) -> tuple[str, ...]:
    wanted = {'view': '--no-view' not in given, 'web': '--view' in given}
    return tuple(view for view in VIEWS if wanted[view])


def _fly_in_turn(*flights: Flight) -> int:
    """Fly one after another, until one does not pass."""
    signals = Signals()
    return next((code for flight in flights if (code := fly(flight, signals))), 0)


def _one_flight(name: str, description: str, options: Sequence[str]) -> Job:
    scenario = Scenario(name, (f'scenario_{name}.yaml',))
    return partial(_fly_in_turn, _flight(scenario, _flight_command(name, description), options))


def _single_motor(options: Sequence[str]) -> Job:
    name = 'single_motor'
    flight = _flight(Scenario(name, ()), _flight_command(name, SINGLE_MOTOR), options)
    parts = [
        flight._replace(
            scenario=Scenario(name, (f'{name}.yaml', f'scenario_{name}_{part}.yaml')),
            out=flight.out / part,
        )
        for part in ('steps', 'sinusoids')
    ]
    return partial(_fly_in_turn, *parts)


def _trajectory(options: Sequence[str]) -> Job:
    found = sorted(path.stem.removeprefix('scenario_') for path in PARAMS.glob('scenario_*.yaml'))
    names = [name for name in found if name != 'file' and not name.startswith('single_motor_')]
    description = TRAJECTORY.format(names=' '.join(names))
    call = 'trajectory.sh NAME|FILE.csv'
    chosen, *rest = options or ['--help']
    if chosen in ('--help', '-h'):
        raise HelpAskedError(_flight_command('trajectory', description, call).usage())
    if chosen.endswith('.csv'):
        if not Path(chosen).is_file() or not os.access(chosen, os.R_OK):
            raise WrongUseError(f"cannot read '{chosen}'")
        quoted = str(Path(chosen).resolve()).replace("'", "''")
        scenario = Scenario('file', ('scenario_file.yaml',), (f"file.path:='{quoted}'",))
    else:
        name = one_of(*names)('the trajectory', chosen)
        scenario = Scenario(name, (f'scenario_{name}.yaml',))
    command = _flight_command(scenario.name, description, call)
    return partial(_fly_in_turn, _flight(scenario, command, rest))


def _paper_tables(options: Sequence[str]) -> Job:
    name = 'paper_tables'
    table = {
        '--mode': MODE,
        '--namespace': NAMESPACE,
        **VIEW,
        '--out': _out_option('runs and page are', name),
        '--quick': Option('short windows: 6 s for each step, 4 s of each ellipse'),
    }
    given = Command(f'{name}.sh', PAPER_TABLES, table).parse(options)
    mode, where = given.get('--mode', ['lockstep'])[-1], given.get('--namespace', [''])[-1]
    quick, views = '--quick' in given, _views(given)
    return partial(fly_all, _out(name, given), mode, where, quick=quick, views=views)


def _compare(options: Sequence[str]) -> Job:
    laws = 'only these: files of params/laws, paper, default'
    bandwidth = 'crossover of the laws with compensators, on all axes (default: as in their files)'
    table = {
        '--params': Option(
            "parameters of controller and plant on top of every law's own, from the current\n"
            'folder or from params/; repeatable, the last one wins',
            'OVERLAY.yaml',
            overlay,
        ),
        '--out': _out_option('the results are', 'compare'),
        '--quick': Option('coarse regions and short windows'),
        '--laws': Option(laws, 'NAME...', several=True),
        '--bandwidth': Option(bandwidth, 'RAD_S'),
    }
    given = Command('compare.sh', COMPARE, table).parse(options)
    arguments = ['--params', str(PARAMS), '--out', str(_out('compare', given))]
    arguments += _as_given(given, '--quick', '--laws', '--bandwidth')
    overlays = given.get('--params', [])
    for file in overlays:
        arguments += ['--overlay', file]
    return partial(_become, 'maglev_study', 'compare', arguments, overlays, HEARD_BY_COMPARE)


def _faults(options: Sequence[str]) -> Job:
    table = {
        '--runs': Option('how many runs (default 3000)', 'N', whole),
        '--seed': Option('of the first run; the others count up (default 0)', 'S', whole),
        '--jobs': Option('processes (default: one for each core)', 'J', whole),
        '--double': Option('a second fault up to 0.5 s after the first'),
        '--short': Option('one run of each cell of fault and phase'),
        '--replay': Option(
            'fly one run alone and draw it: fault, detection, landing', 'SEED|FILE.json'
        ),
        '--out': _out_option('the page is', 'faults'),
    }
    given = Command('faults.sh', FAULTS, table).parse(options)
    arguments = ['--out', str(_out('faults', given))]
    arguments += _as_given(given, '--runs', '--seed', '--jobs', '--double', '--short', '--replay')
    return partial(_become, 'maglev_study', 'faults', arguments)


def _robustness(options: Sequence[str]) -> Job:
    name = 'robustness'
    table = {
        '--machines': Option('how many are drawn (default 200)', 'N', whole),
        '--params': Option(
            "parameters of plant, controller and distributions on top of every law's own, from\n"
            'the current folder or from params/; repeatable, the last one wins',
            'OVERLAY.yaml',
            overlay,
        ),
        '--law': Option(
            'files of params/laws, paper, default (default: default)', 'NAME...', several=True
        ),
        '--seed': Option('of the machines (default 0)', 'S', whole),
        '--jobs': Option('processes (default: one for each core)', 'J', whole),
        '--scheduler': Option('a Dask cluster to fly on, tcp://HOST:8786', 'ADDRESS'),
        '--replay': Option('fly machine N through the graph; 0 is the nominal one', 'N', whole),
        '--out': _out_option('the results are', name),
    }
    given = Command(f'{name}.sh', ROBUSTNESS, table).parse(options)
    out, overlays = _out(name, given), given.get('--params', [])
    arguments = ['--params', str(PARAMS), '--out', str(out)]
    arguments += _as_given(given, '--machines', '--seed', '--jobs', '--scheduler', '--replay')
    arguments += ['--law', *given['--law']] if '--law' in given else []
    for file in overlays:
        arguments += ['--overlay', file]
    if '--replay' in given:
        return partial(_replay_machine, int(given['--replay'][-1]), out, arguments, overlays)
    return partial(_become, 'maglev_study', name, arguments, overlays, HEARD_BY_ROBUSTNESS)


def _replay_machine(
    number: int, out: Path, arguments: Sequence[str], overlays: Sequence[str]
) -> int:
    """Have the parameters of a machine written, then fly the graph with them."""
    for path in overlays:
        check_overlay(path, sections=HEARD_BY_ROBUSTNESS)
    signals = Signals()
    code = run_to_end([*program('maglev_study', 'robustness'), *arguments], signals)
    if code or signals.code:
        return code or signals.code
    scenario = Scenario('ellipse_4dof', ('scenario_ellipse_4dof.yaml',))
    files = (str(out / f'machine-{number}.yaml'),)
    return fly(Flight(scenario, out=out, overlays=files), signals)


def _commission(options: Sequence[str]) -> Job:
    where = 'parameters of hw_bridge, from the current folder or from params/;'
    current = 'largest current of a phase alone, 0.2 to 3 A (default 1.5)'
    table = {
        '--params': Option(f'{where}\nrepeatable, the last one wins', 'OVERLAY.yaml', overlay),
        '--current': Option(current, 'A'),
        '--yes': Option('do not ask before each step'),
    }
    given = Command('commission.sh', COMMISSION, table).parse(options)
    overlays = given.get('--params', [])
    files = [PARAMS / name for name in ('machine.yaml', 'hw_bridge.yaml')]
    arguments = []
    for file in [*(str(file) for file in files if file.is_file()), *overlays]:
        arguments += ['--params', file]
    arguments += _as_given(given, '--current', '--yes')
    return partial(_become, 'maglev_hw_bridge', 'commission', arguments, overlays)


def _as_given(given: Mapping[str, list[str]], *names: str) -> list[str]:
    return [part for name in names if name in given for part in (name, *given[name])]


def _become(
    package: str,
    executable: str,
    arguments: Sequence[str],
    overlays: Sequence[str],
    heard: Sequence[str] = SECTIONS,
) -> NoReturn:
    """Go on as another program, which has the terminal and its signals to itself.

    It hears those sections of the overlays.
    """
    for path in overlays:
        check_overlay(path, sections=heard)
    path = installed(package, executable)
    os.execv(path, [path, *arguments])


COMMANDS: dict[str, Callable[[Sequence[str]], Job]] = {
    **{name: partial(_one_flight, name, text) for name, text in PAPER.items()},
    'single_motor': _single_motor,
    'trajectory': _trajectory,
    'paper_tables': _paper_tables,
    'compare': _compare,
    'faults': _faults,
    'robustness': _robustness,
    'commission': _commission,
}
