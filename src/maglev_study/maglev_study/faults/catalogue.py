"""Every kind of fault: how it is drawn, what it does to the flight, and what it is judged by."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from maglev_hw_bridge.emulated_card import HILError
from maglev_hw_bridge.signal_parameters import ENCODER_NAMES
from maglev_study.faults.flight import Answer, Bridge, Flight
from maglev_study.faults.programme import BEFORE_THE_FIRST_SAMPLE, PHASES
from maglev_study.faults.world import CALLS

NOMINAL = 0.01
"""A landing that nothing makes harder meets the stop below this [m/s]."""
DEGRADED = 0.05
"""One without an encoder, or with a failing amplifier, below this [m/s]."""
CUT = None
"""The current may be cut: no faster than that was foretold."""

FOR_EVER = 10**9
INTERRUPTED = -4
"""What the vendor calls QERR_INTERRUPTED: a signal came during a blocking call."""

_GAPS, _ACROSS = (0, 1, 2, 3), (4, 5)
_NO_PHASE_YET = tuple(phase for phase in PHASES if phase not in BEFORE_THE_FIRST_SAMPLE)


@dataclasses.dataclass(frozen=True)
class Fault:
    """One fault: what fails, how much, and how long after the instant of the run."""

    kind: str
    targets: tuple[int, ...] = ()  # encoders, phases, or a board
    size: float = 0.0  # counts, samples, share: by kind
    call: str = ''  # of the vendor's module
    delay: int = 0  # [samples]


class Expected(NamedTuple):
    """What must come of a fault."""

    impact: float | None  # greatest [m/s], or CUT
    seen: int | None  # samples from when it shows to when it is latched; None: need not be
    blame: str  # what the reason must match, or ''
    aloft: bool = False  # seen only where the platen flies when it shows


Begin = Callable[['Run', Fault], None]


class Run(NamedTuple):
    """What a fault acts on: the flight, random numbers, and where it notes when it shows."""

    flight: Flight
    rng: np.random.Generator
    shows: list[int]  # samples at which something could be seen of it


class Kind(NamedTuple):
    """A row of the campaign's table."""

    name: str
    draw: Callable[[np.random.Generator], Fault]
    begin: Begin
    expected: Callable[[Fault], Expected]
    phases: tuple[str, ...] = PHASES
    weight: int = 1


# -- encoders --------------------------------------------------------------------------------------

SHOWS = np.array([30, 30, 30, 30, 40, 40])
"""Counts an encoder is off the truth from which on it must be found out."""

_SIZES = {'stuck': (0, 0), 'slip': (1, 50), 'jump': (51, 5000), 'noise': (5, 100), 'reset': (0, 0)}
_WHICH = {'a gap': 'gap', 'x or z': 'across', 'several': 'several'}


def _encoders(name: str, which: str) -> Kind:
    def draw(rng: np.random.Generator) -> Fault:
        if which == 'gap':
            targets = [int(rng.integers(4))]
        elif which == 'across':
            targets = [int(rng.integers(4, 6))]
        else:
            bits = int(rng.choice([b for b in range(64) if bin(b).count('1') > 1]))
            targets = [i for i in range(6) if bits >> i & 1]
        low, high = _SIZES[name]
        size = float(rng.integers(low, high + 1) * (rng.choice((-1, 1)) if low else 1))
        return Fault(_row(name, which), tuple(targets), size)

    def begin(run: Run, fault: Fault) -> None:
        world, targets = run.flight.world, list(fault.targets)
        if name == 'stuck':
            world.stuck[targets] = True
        elif name == 'noise':
            world.noise[targets] = abs(int(fault.size))
        elif name == 'reset':
            world.jumps[targets] -= world.rig.counts()[targets] + world.jumps[targets]
        else:
            signs = run.rng.choice((-1, 1), len(targets)) if len(targets) > 1 else 1
            world.jumps[targets] += int(fault.size) * signs

    def expected(fault: Fault) -> Expected:
        gaps = sum(target < 4 for target in fault.targets)
        lasting = name in ('stuck', 'noise')
        hopeless = lasting and (gaps > 1 or len(fault.targets) > gaps)
        names = '|'.join(rf'encoder {ENCODER_NAMES[target]}\b' for target in fault.targets)
        return Expected(CUT if hopeless else DEGRADED, 10, f'{names}|contradict')

    return Kind(_row(name, which), draw, begin, expected)


def _row(name: str, which: str) -> str:
    return f'{name}: {next(text for text, short in _WHICH.items() if short == which)}'


# -- the vendor's calls ----------------------------------------------------------------------------

_FIRST_BOARD_ONLY = (
    'set_digital_directions',
    'read_digital',
    'write_digital',
    'task_create_encoder_reader',
    'task_start',
    'task_read_encoder',
    'task_stop',
    'task_delete',
)
_WRONG: dict[str, Callable[[Callable[..., Any], tuple[Any, ...]], Any]] = {
    'task_read_encoder': lambda sound, arguments: 0,
    'read_encoder': lambda sound, arguments: None,
    'watchdog_reload': lambda sound, arguments: False,
    'watchdog_is_expired': lambda sound, arguments: True,
    'write_analog': lambda sound, arguments: None,
    'write_digital': lambda sound, arguments: None,
}
"""Calls that come back without an error, and have not done what they should."""


def _calls(mode: str, names: Sequence[str], lasts: bool) -> Kind:
    def draw(rng: np.random.Generator) -> Fault:
        name = str(rng.choice(names))
        board = 0 if name in _FIRST_BOARD_ONLY else int(rng.integers(2))
        size = float(rng.integers(2, 101)) if mode == 'hang' else 0.0
        return Fault(f'call: {mode}', (board,), size, name)

    def begin(run: Run, fault: Fault) -> None:
        flight, left = run.flight, FOR_EVER if lasts else 1

        def behave(sound: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
            nonlocal left
            if left <= 0:
                return sound(*arguments)
            left -= 1
            if flight.samples not in run.shows[-1:]:
                run.shows.append(flight.samples)
            if mode == 'wrong result':
                return _WRONG[fault.call](sound, arguments)
            if mode == 'hang':
                flight.world.let_pass(int(fault.size))
                return sound(*arguments)
            raise _error(mode)

        flight.world.fail(fault.call, fault.targets[0], behave)

    def expected(fault: Fault) -> Expected:
        if mode == 'interrupted':
            return Expected(NOMINAL, None, '')
        if mode == 'hang':
            return Expected(NOMINAL if fault.size < 18 else CUT, None, '')
        telling = fault.call in ('task_read_encoder', 'write_analog', 'watchdog_reload')
        if mode == 'wrong result':
            telling = fault.call == 'task_read_encoder'
        return Expected(CUT, 3 if telling else None, '', aloft=True)

    return Kind(f'call: {mode}', draw, begin, expected, weight=4)


def _error(mode: str) -> Exception:
    if mode == 'foreign exception':
        return RuntimeError('injected: none of the vendor')
    if mode == 'interrupted':
        return HILError(INTERRUPTED, 'the operation was interrupted by a signal')
    return HILError(-8, 'injected: the board does not answer')


# -- amplifiers ------------------------------------------------------------------------------------


def _amplifier(name: str) -> Kind:
    def draw(rng: np.random.Generator) -> Fault:
        size = float(rng.choice((-1.0, 1.0)) * rng.uniform(0.05, 0.3))
        if name == 'stuck on':
            size = float(rng.uniform(-5.0, 5.0))
        return Fault(f'phase: {name}', (int(rng.integers(12)),), size)

    def begin(run: Run, fault: Fault) -> None:
        world, (phase,) = run.flight.world, fault.targets
        if name == 'stuck on':
            world.stick_on(phase, fault.size)
        else:
            world.scale_gain(phase, 0.0 if name == 'dead' else 1.0 + fault.size)

    return Kind(f'phase: {name}', draw, begin, lambda fault: Expected(DEGRADED, None, ''))


# -- the controller --------------------------------------------------------------------------------

_BLAME_CURRENTS = r'currents|i_d|command|controller|carry|old|age'


def _controller(name: str, low: int, high: int, seen: int | None) -> Kind:
    def draw(rng: np.random.Generator) -> Fault:
        return Fault(f'controller: {name}', (), float(rng.integers(low, high + 1)))

    def begin(run: Run, fault: Fault) -> None:
        _CONTROLLERS[name](run, fault)
        if name not in ('slow', 'stalled'):
            run.shows.append(run.flight.samples + 1)

    return Kind(
        f'controller: {name}',
        draw,
        begin,
        lambda fault: Expected(NOMINAL, seen, _BLAME_CURRENTS, aloft=True),
        _NO_PHASE_YET,
    )


def _die(run: Run, fault: Fault) -> None:
    run.flight.controller.alive = False


def _except(run: Run, fault: Fault) -> None:
    run.flight.inbox = run.flight.controller.last_words()


def _zeros(run: Run, fault: Fault) -> None:
    run.flight.controller.twist = lambda answer: [
        answer._replace(direct=np.zeros(4), quadrature=np.zeros(4))
    ]


def _nan(run: Run, fault: Fault) -> None:
    def twist(answer: Answer) -> list[Answer]:
        direct = answer.direct.copy()
        direct[int(fault.size) % 4] = np.nan
        return [answer._replace(direct=direct)]

    run.flight.controller.twist = twist


def _slow(run: Run, fault: Fault) -> None:
    run.flight.controller.pace = 1.0 / (1.0 + fault.size / 100.0)


def _stall(run: Run, fault: Fault) -> None:
    controller, end = run.flight.controller, run.flight.samples + int(fault.size)
    controller.stalled = True

    def each() -> None:
        if run.flight.samples >= end:
            controller.stalled = False

    run.flight.each = each


def _replay(run: Run, fault: Fault) -> None:
    """What was said up to a while ago is said over and over, with the numbers it had."""
    heard: list[Answer] = []

    def twist(answer: Answer) -> list[Answer]:
        heard.append(answer)
        return [heard[(len(heard) - 1) % int(fault.size)]]

    run.flight.controller.twist = twist


def _foreign(run: Run, fault: Fault) -> None:
    """Somebody else publishes as well, with numbers and currents of its own."""
    number = int(run.rng.integers(0, 2**31))
    i_d, i_q = run.rng.uniform(-5.0, 5.0, 4), run.rng.uniform(-5.0, 5.0, 4)

    def twist(answer: Answer) -> list[Answer]:
        nonlocal number
        number += 1
        return [answer, Answer(number, i_d, i_q)]

    run.flight.controller.twist = twist


_CONTROLLERS: dict[str, Begin] = {
    'killed': _die,
    'exception': _except,
    'zeros': _zeros,
    'NaN': _nan,
    'slow': _slow,
    'stalled': _stall,
    'replayed': _replay,
    'foreign': _foreign,
}

# -- the bridge's process, and its operator --------------------------------------------------------


def _operator(
    name: str,
    act: Begin,
    impact: float | None = NOMINAL,
    blame: str = '',
    phases: tuple[str, ...] = PHASES,
    sizes: tuple[int, int] = (0, 0),
    seen: int | None = None,
) -> Kind:
    def begin(run: Run, fault: Fault) -> None:
        if seen is not None:
            run.shows.append(run.flight.samples + 1)
        act(run, fault)

    return Kind(
        name,
        lambda rng: Fault(name, (), float(rng.integers(sizes[0], sizes[1] + 1))),
        begin,
        lambda fault: Expected(impact, seen, blame),
        phases,
    )


def _stopped() -> Kind:
    def begin(run: Run, fault: Fault) -> None:
        run.flight.world.delay(int(fault.size))

    def expected(fault: Fault) -> Expected:
        return Expected(NOMINAL if fault.size < 18 else CUT, None, 'late|watchdog')

    return Kind(
        'bridge stopped',
        lambda rng: Fault('bridge stopped', (), float(rng.integers(1, 51))),
        begin,
        expected,
        _NO_PHASE_YET,
    )


def _press(run: Run, fault: Fault) -> None:
    run.flight.world.stop_pressed = True
    run.flight.forbidden = 'with the stop pressed'


def _skip_homing(run: Run, fault: Fault) -> None:
    run.flight.skip_homing = True
    run.flight.forbidden = 'without homing'


def _heat(run: Run, fault: Fault) -> None:
    run.flight.bridge.stage.amplifiers.arrays.load[:] = 0.95
    run.flight.forbidden = 'hot'


def _second(run: Run, fault: Fault) -> None:
    other = Bridge(run.flight.parameters, run.flight.world)
    if other.configure():
        other.stray = 'a second bridge had the boards of the first'
        run.flight.bridge.stray = other.stray
    other.die()


def _again(run: Run, fault: Fault) -> None:
    """Deactivate and clean up, as the life cycle wants it."""
    run.flight.bridge.deactivate()


KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        _operator('none', lambda run, fault: None),
        *(_encoders(name, which) for name in _SIZES for which in _WHICH.values()),
        _calls('once', CALLS, lasts=False),
        _calls('persistent', CALLS, lasts=True),
        _calls('interrupted', CALLS, lasts=False),
        _calls('foreign exception', CALLS, lasts=False),
        _calls('hang', CALLS, lasts=False),
        _calls('wrong result', tuple(_WRONG), lasts=True),
        *(_amplifier(name) for name in ('dead', 'stuck on', 'gain')),
        _controller('killed', 0, 0, 8),
        _controller('exception', 0, 0, 8),
        _controller('zeros', 0, 0, 8),
        _controller('NaN', 0, 3, 3),
        _controller('slow', 1, 50, None),
        _controller('stalled', 1, 50, None),
        _controller('replayed', 20, 500, None),
        _controller('foreign', 0, 0, None),
        _stopped(),
        _operator('signal once', lambda run, fault: run.flight.bridge.signal(1)),
        _operator('signal twice', lambda run, fault: run.flight.bridge.signal(2)),
        _operator('hang-up', lambda run, fault: run.flight.bridge.vanish()),
        _operator('kill', lambda run, fault: run.flight.bridge.vanish(), CUT),
        _operator(
            'stop service',
            lambda run, fault: run.flight.bridge.emergency_stop(),
            phases=_NO_PHASE_YET,
            blame='emergency stop',
            seen=2,
        ),
        _operator('stop input', _press, blame='emergency stop', seen=3),
        _operator('not homed', _skip_homing, phases=('homing',)),
        _operator('hot', _heat, phases=('arming',)),
        _operator('deactivate', _again),
        _operator('reset', lambda run, fault: void(run.flight.bridge.reset())),
        _operator('second bridge', _second),
    )
}
"""By name, in the order of the table."""


def void(_value: object) -> None:
    """Nothing is made of it."""
