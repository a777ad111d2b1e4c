"""The scripts, one function each: from options to what is to be done after the set-up."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from runner import usage
from runner.console import complain, say
from runner.folder import default_folder
from runner.graph import Flight, Scenario
from runner.options import (
    HelpAskedError,
    Option,
    WrongUseError,
    folder,
    one_of,
    parse,
    seconds,
    word,
)
from runner.overlays import PARAMS, check_overlay, overlay
from runner.paper_tables import fly_all
from runner.process import installed
from runner.run import fly
from runner.signals import Signals

Job = Callable[[], int]
"""What returns an exit code; it may raise WrongUseError before anything is started."""

LATER = 75
"""Exit code of ``--check`` when there is more to do than to answer."""

MODE = Option(one_of('lockstep', 'realtime'))
OUT = Option(folder)
PARAMETERS = Option(overlay)
FLIGHT = {
    '--stage': Option(one_of('plant', 'hw_bridge')),
    '--mode': MODE,
    '--duration': Option(seconds),
    '--params': PARAMETERS,
    '--out': OUT,
}


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
        say(str(text))
        return 0
    except WrongUseError as error:
        complain(f'{name}: error: {error}')
        return 2


def _flight(scenario: Scenario, text: str, options: Sequence[str]) -> Flight:
    given = parse(options, FLIGHT, text.format(name=scenario.name))
    return Flight(
        scenario,
        out=_out(scenario.name, given),
        stage=given.get('--stage', ['plant'])[-1],
        mode=given.get('--mode', ['lockstep'])[-1],
        duration=given.get('--duration', [''])[-1],
        overlays=tuple(given.get('--params', ())),
    )


def _out(name: str, given: dict[str, list[str]]) -> Path:
    return Path(given['--out'][-1]) if '--out' in given else default_folder(name)


def _fly_in_turn(flights: Sequence[Flight]) -> int:
    """Fly one after another, until one does not pass."""
    signals = Signals()
    return next((code for flight in flights if (code := fly(flight, signals))), 0)


def _one_flight(name: str, text: str, options: Sequence[str]) -> Job:
    scenario = Scenario(name, (f'scenario_{name}.yaml',))
    return partial(_fly_in_turn, [_flight(scenario, text, options)])


def _single_motor(options: Sequence[str]) -> Job:
    scenario = Scenario('single_motor', ('single_motor.yaml',))
    flight = _flight(scenario, usage.SINGLE_MOTOR, options)
    parts = []
    for part in ('steps', 'sinusoids'):
        files = (*scenario.files, f'scenario_single_motor_{part}.yaml')
        parts.append(
            flight._replace(scenario=scenario._replace(files=files), out=flight.out / part)
        )
    return partial(_fly_in_turn, parts)


def _trajectory(options: Sequence[str]) -> Job:
    names = [
        name
        for path in sorted(PARAMS.glob('scenario_*.yaml'))
        if (name := path.stem.removeprefix('scenario_')) != 'file'
        and not name.startswith('single_motor_')
    ]
    text = usage.TRAJECTORY.replace('NAMES', ' '.join(names))
    chosen, *rest = options or ['--help']
    if chosen in ('--help', '-h'):
        raise HelpAskedError(text.format(name='trajectory'))
    if not chosen.endswith('.csv'):
        return _one_flight(one_of(*names)('the trajectory', chosen), text, rest)
    if not Path(chosen).is_file() or not os.access(chosen, os.R_OK):
        raise WrongUseError(f"cannot read '{chosen}'")
    path = str(Path(chosen).resolve()).replace("'", "''")
    scenario = Scenario('file', ('scenario_file.yaml',), (f"file.path:='{path}'",))
    return partial(_fly_in_turn, [_flight(scenario, text, rest)])


def _paper_tables(options: Sequence[str]) -> Job:
    table = {'--mode': MODE, '--out': OUT, '--quick': Option()}
    given = parse(options, table, usage.PAPER_TABLES)
    mode = given.get('--mode', ['lockstep'])[-1]
    return partial(fly_all, _out('paper_tables', given), mode, quick='--quick' in given)


def _compare(options: Sequence[str]) -> Job:
    table = {
        '--out': OUT,
        '--quick': Option(),
        '--laws': Option(word, several=True),
        '--bandwidth': Option(word),
    }
    given = parse(options, table, usage.COMPARE)
    arguments = ['--params', str(PARAMS), '--out', str(_out('compare', given))]
    for name in ('--quick', '--laws', '--bandwidth'):
        if name in given:
            arguments += [name, *given[name]]
    return partial(_become, 'maglev_study', 'compare', arguments)


def _commission(options: Sequence[str]) -> Job:
    table = {'--params': PARAMETERS, '--current': Option(word), '--yes': Option()}
    given = parse(options, table, usage.COMMISSION)
    overlays = given.get('--params', [])
    files = [str(PARAMS / name) for name in ('machine.yaml', 'hw_bridge.yaml')]
    arguments = []
    for file in [*filter(os.path.isfile, files), *overlays]:
        arguments += ['--params', file]
    for name in ('--current', '--yes'):
        if name in given:
            arguments += [name, *given[name]]

    def job() -> int:
        for path in overlays:
            check_overlay(path)
        return _become('maglev_hw_bridge', 'commission', arguments)

    return job


def _become(package: str, executable: str, arguments: Sequence[str]) -> int:
    """Go on as another program, which has the terminal and its signals to itself."""
    path = installed(package, executable)
    os.execv(path, [path, *arguments])
    return 1  # not reached


COMMANDS: dict[str, Callable[[Sequence[str]], Job]] = {
    'ellipse': partial(_one_flight, 'ellipse', usage.ELLIPSE),
    'ellipse_4dof': partial(_one_flight, 'ellipse_4dof', usage.ELLIPSE_4DOF),
    'steps': partial(_one_flight, 'steps', usage.STEPS),
    'single_motor': _single_motor,
    'trajectory': _trajectory,
    'paper_tables': _paper_tables,
    'compare': _compare,
    'commission': _commission,
}
