"""The scripts that fly the graph."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

from runner.common_options import OUTPUT, Job, out_folder, out_option, overlays, talk
from runner.graph import VIEWS, Flight, Scenario, text_value
from runner.options import (
    Command,
    HelpAskedError,
    Option,
    WrongUseError,
    namespace,
    one_of,
    seconds,
)
from runner.overlays import PARAMS
from runner.paper_tables import Wanted, fly_all
from runner.run import fly
from runner.signals import Signals
from runner.texts import PAPER, PAPER_TABLES, SINGLE_MOTOR, TRAJECTORY

MODE = Option(
    'as fast as it computes and repeatable, or 1 kHz by the clock\n(default lockstep)',
    'lockstep|realtime',
    one_of('lockstep', 'realtime'),
)
NAMESPACE = Option(
    'where on the graph the nodes are: several runs, each in its own, fly at once', 'NS', namespace
)
VIEW = {
    '--view': Option('show the flight live in the browser'),
    '--no-view': Option('no standard topics for RViz, Foxglove and PlotJuggler'),
}


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
        '--params': overlays("parameters on top of the scenario's", width=70),
        '--namespace': NAMESPACE,
        **VIEW,
        '--out': out_option('the run is', name),
        **OUTPUT,
    }
    return Command(call or f'{name}.sh', description, options)


def _flight(scenario: Scenario, command: Command, options: Sequence[str]) -> Flight:
    given = command.parse(options)
    where = given.get('--namespace', [''])[-1]
    talk(given)
    return Flight(
        scenario,
        out=out_folder(scenario.name + where.replace('/', '-'), given),
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
        path = text_value('file.path', str(Path(chosen).resolve()))
        scenario = Scenario('file', ('scenario_file.yaml',), (path,))
    else:
        name = one_of(*names)('the trajectory', chosen)
        offer = f'matched_{name}.yaml' if (PARAMS / f'matched_{name}.yaml').is_file() else ''
        scenario = Scenario(name, (f'scenario_{name}.yaml',), offer=offer)
    command = _flight_command(scenario.name, description, call)
    return partial(_fly_in_turn, _flight(scenario, command, rest))


def _paper_tables(options: Sequence[str]) -> Job:
    name = 'paper_tables'
    table = {
        '--mode': MODE,
        '--namespace': NAMESPACE,
        **VIEW,
        '--out': out_option('runs and page are', name),
        '--quick': Option('short windows: 6 s for each step, 4 s of each ellipse'),
        **OUTPUT,
    }
    given = Command(f'{name}.sh', PAPER_TABLES, table).parse(options)
    mode, where = given.get('--mode', ['lockstep'])[-1], given.get('--namespace', [''])[-1]
    talk(given)
    wanted = Wanted(mode, where, '--quick' in given, _views(given), '--json' in given)
    return partial(fly_all, out_folder(name, given), wanted)


FLIGHTS: dict[str, Callable[[Sequence[str]], Job]] = {
    **{name: partial(_one_flight, name, text) for name, text in PAPER.items()},
    'single_motor': _single_motor,
    'trajectory': _trajectory,
    'paper_tables': _paper_tables,
}
"""By the scripts' names."""
