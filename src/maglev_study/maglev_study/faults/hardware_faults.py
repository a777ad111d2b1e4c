"""What encoders, boards and amplifiers do wrong."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge.emulation.card import HILError
from maglev_hw_bridge.signal_parameters import ENCODER_NAMES
from maglev_study.faults.kinds import CUT, DEGRADED, NOMINAL, Expected, Fault, Kind, Run
from maglev_study.faults.programme import PHASES

FOR_EVER = 10**9
UNHEARD = 0.6
"""As hard as the platen may meet a stop where outputs keep their volts, whatever is written."""
INTERRUPTED = -35
"""What the vendor calls QERR_INTERRUPTED: a signal came during a blocking call."""

# -- encoders --------------------------------------------------------------------------------------

SHOWS = np.array([3e-4, 3e-4, 3e-4, 3e-4, 4e-4, 4e-4])
"""How far an encoder is off the truth, beyond which it must be found out [m]."""

_COUNT = 1e-5  # what sizes of encoders' faults are drawn in, whatever their resolution [m]

_DISPENSABLE = 2
"""Gap encoders that the model can stand in for."""

SIZES = {'stuck': (0, 0), 'slip': (1, 50), 'jump': (51, 5000), 'noise': (5, 100), 'reset': (0, 0)}
WHICH = ('a gap', 'x or z', 'several')


def blame_of(failed: Sequence[int]) -> str:
    """What the words of a fault must match that blame some of these encoders, and no other."""
    one = f'(?:{"|".join(ENCODER_NAMES[encoder] for encoder in failed)})'
    return f'encoder {one}(?:, {one})* (?:jumped|is stuck|reads|did not count)|contradict'


def encoders(name: str, which: str) -> Kind:
    row = f'{name}: {which}'

    def draw(rng: np.random.Generator) -> Fault:
        if which == 'a gap':
            targets = [int(rng.integers(4))]
        elif which == 'x or z':
            targets = [int(rng.integers(4, 6))]
        else:
            bits = int(rng.choice([b for b in range(64) if bin(b).count('1') > 1]))
            targets = [i for i in range(6) if bits >> i & 1]
        low, high = SIZES[name]
        size = float(rng.integers(low, high + 1) * (rng.choice((-1, 1)) if low else 1))
        return Fault(row, tuple(targets), size)

    def counts(run: Run, fault: Fault) -> NDArray[np.int64]:
        resolution = np.array(run.flight.parameters.encoder.resolution)[list(fault.targets)]
        return np.rint(fault.size * _COUNT / resolution).astype(np.int64)

    def begin(run: Run, fault: Fault) -> None:
        world, targets = run.flight.world, list(fault.targets)
        if name == 'stuck':
            world.stuck[targets] = True
        elif name == 'noise':
            world.noise[targets] = abs(counts(run, fault))
        elif name == 'reset':
            world.jumps[targets] -= world.rig.counts()[targets] + world.jumps[targets]
        else:
            signs = run.rng.choice((-1, 1), len(targets)) if len(targets) > 1 else 1
            world.jumps[targets] += counts(run, fault) * signs

    def expected(fault: Fault) -> Expected:
        gaps = sum(target < 4 for target in fault.targets)
        lasting = name in ('stuck', 'noise')
        hopeless = lasting and gaps > _DISPENSABLE
        stuck = fault.targets if name == 'stuck' else ()
        blame = blame_of(fault.targets)
        return Expected(
            CUT if hopeless else DEGRADED, 0.01, blame, stuck=stuck, encoders=fault.targets
        )

    lost_unseen = name in ('slip', 'jump', 'reset') and which != 'a gap'
    phases = tuple(phase for phase in PHASES if not (lost_unseen and phase == 'arming'))
    return Kind(row, draw, begin, expected, phases)


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
WRONG: dict[str, Callable[[Callable[..., Any], tuple[Any, ...]], Any]] = {
    'task_read_encoder': lambda sound, arguments: 0,
    'read_encoder': lambda sound, arguments: None,
    'watchdog_reload': lambda sound, arguments: False,
    'watchdog_is_expired': lambda sound, arguments: True,
    'write_analog': lambda sound, arguments: None,
    'write_digital': lambda sound, arguments: None,
}
"""Calls that come back without an error, and have not done what they should."""


def calls(mode: str, names: Sequence[str], lasts: bool) -> Kind:
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
                return WRONG[fault.call](sound, arguments)
            if mode == 'hang':
                flight.world.let_pass(1e-3 * fault.size)
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
            if fault.call == 'write_analog':
                return Expected(UNHEARD, None, '')
        return Expected(CUT, 0.003 if telling else None, '', aloft=True)

    return Kind(f'call: {mode}', draw, begin, expected, weight=4)


def _error(mode: str) -> Exception:
    if mode == 'foreign exception':
        return RuntimeError('injected: none of the vendor')
    if mode == 'interrupted':
        return HILError(INTERRUPTED, 'the operation was interrupted by a signal')
    return HILError(-8, 'injected: the board does not answer')


# -- amplifiers ------------------------------------------------------------------------------------


def amplifier(name: str) -> Kind:
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

    impact = CUT if name == 'stuck on' else DEGRADED
    return Kind(f'phase: {name}', draw, begin, lambda fault: Expected(impact, None, ''))
