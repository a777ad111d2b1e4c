"""A machine flies its programme once; at the instant of each run a child process branches off.

A child has everything as it stands, down to the last array, in a few milliseconds, and cannot hurt
the others: it may hang, or die.
"""

from __future__ import annotations

import functools
import gc
import os
import pickle
import select
import signal
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TypeVar

from maglev_model.parameters import ParameterError
from maglev_study.faults.flight import Flight
from maglev_study.faults.fly import Scenario, fly
from maglev_study.faults.judge import Verdict
from maglev_study.faults.kinds import Fault
from maglev_study.faults.machines import NOMINAL, PLAIN, Believed
from maglev_study.faults.programme import BEFORE_THE_FIRST_SAMPLE

_PATIENCE = 60.0  # with a run, but for what it waits for a processor [s]

T = TypeVar('T')


@functools.cache
def warm_up(believed: Believed = PLAIN) -> None:
    """Compile all that a run calls, from homing to restart, before processes branch off.

    Each would do it again otherwise, for longer than a run may take where nothing is cached yet.
    """
    flight = Flight(NOMINAL, believed)
    fly(flight, Scenario(NOMINAL, BEFORE_THE_FIRST_SAMPLE[0], 0.0, (Fault('none'),), 0))


def fly_all(
    runs: Sequence[Scenario],
    believed: Believed = PLAIN,
    stopped: Callable[[], bool] = lambda: False,
    work: Callable[[Flight, Scenario], T] = fly,  # type: ignore[assignment]
) -> Iterator[tuple[Scenario, T | Verdict]]:
    """Fly runs of one machine in the order in which they branch off, each with its outcome."""
    warm_up(believed)
    flight = Flight(runs[0].machine, believed)
    gc.collect()
    gc.freeze()
    places = sorted(((_place(flight, run), number) for number, run in enumerate(runs)))
    for place, number in places:
        if stopped():
            return
        _go(flight, place)
        false_alarm = _false_alarm(flight)
        if false_alarm:
            yield runs[number], Verdict(((5, false_alarm),), 0.0, None, 'landed', '')
        else:
            yield runs[number], _branch(functools.partial(work, flight, runs[number]))


def _place(flight: Flight, run: Scenario) -> int:
    """The sample at which a run begins; negative before the first."""
    if run.phase in ('homing', 'arming'):
        return -2 if run.phase == 'homing' else -1
    return flight.course.sample_of(run.phase, run.instant)


def _go(flight: Flight, place: int) -> None:
    """Fly on to a sample."""
    bridge = flight.bridge
    if place >= -1 and not bridge.homed:
        _demand(bridge.configure() and bridge.home(), flight)
    if place >= 0 and not bridge.active:
        _demand(bridge.activate(), flight)
    while flight.samples < place:
        flight.step()
        _demand(bridge.active, flight)


def _false_alarm(flight: Flight) -> str:
    """What the bridge has found though nothing has failed yet, which spoils the flight; or ''."""
    stage = flight.bridge.stage
    if stage.fault is not None and stage.fault.kind != 'stop':  # which is part of the programme
        return f'though nothing had failed: {stage.fault.reason}'
    if stage.guard.failed:
        return f'though nothing had failed, encoders {stage.guard.failed} are not believed'
    return ''


def _demand(well: bool, flight: Flight) -> None:
    if not well:
        bridge = flight.bridge
        raise ParameterError(
            f'the machine does not fly even without a fault, at sample {flight.samples}:'
            f' {bridge.refused or bridge.stray}'
        )


def _branch(work: Callable[[], T]) -> T | Verdict:
    """Do it in a child process; a child that hangs or dies breaks rule 6."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            os.close(reading)
            gc.disable()
            data = pickle.dumps(_attempt(work))
            with os.fdopen(writing, 'wb') as pipe:
                pipe.write(data)
            code = 0
        finally:
            os._exit(code)
    os.close(writing)
    begun = time.monotonic()
    with os.fdopen(reading, 'rb') as pipe:
        answer = _drain(
            pipe.fileno(), lambda: begun + _PATIENCE + _kept_waiting(child) - time.monotonic()
        )
    if answer is None:
        os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    if not answer:
        return _broken('the run hangs' if answer is None else 'the run died')
    outcome: T | Verdict = pickle.loads(answer)
    return outcome


def _attempt(work: Callable[[], T]) -> T | Verdict:
    try:
        return work()
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        return _broken(f'{error!r} at {last.filename}:{last.lineno}')


def _broken(what: str) -> Verdict:
    return Verdict(((6, what),), 0.0, None, 'unknown', '')


def _kept_waiting(process: int) -> float:
    """How long others had the processors that it could have used [s]: no fault of its own."""
    try:
        return 1e-9 * int(Path(f'/proc/{process}/schedstat').read_text().split()[1])
    except (OSError, ValueError, IndexError):  # a kernel that does not tell
        return 0.0


def _drain(pipe: int, left: Callable[[], float]) -> bytes | None:
    """All that comes; None when it does not end while time is left [s]."""
    parts: list[bytes] = []
    while True:
        while not select.select([pipe], [], [], max(left(), 0.0))[0]:
            if left() <= 0.0:
                return None
        part = os.read(pipe, 1 << 20)
        if not part:
            return b''.join(parts)
        parts.append(part)
