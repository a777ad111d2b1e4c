"""Bring a machine up step by step at low current, saying what is seen and what to change.

No graph is needed, and nothing else may use the boards meanwhile. Before every step it asks; no
current flows while it waits. With dummy loads it first proves what ends the current when all else
fails; only then the motors are connected. The first thing that is wrong ends it, with exit code 1.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from maglev_hw_bridge.amplifiers import Amplifiers
from maglev_hw_bridge.board import ENDING, unbroken
from maglev_hw_bridge.commissioning.gains import measured_current, prove_gains
from maglev_hw_bridge.commissioning.operators import (
    Act,
    EmulatedPerson,
    Operator,
    Person,
    StoppedError,
)
from maglev_hw_bridge.commissioning.phases import prove_phases
from maglev_hw_bridge.commissioning.proof import Proof, WrongError
from maglev_hw_bridge.commissioning.response import Pulses
from maglev_hw_bridge.commissioning.scales import prove_scales
from maglev_hw_bridge.doubts import doubts
from maglev_hw_bridge.drivers import Driver, DriverError, make_driver
from maglev_hw_bridge.drivers.emulated import EmulatedDriver
from maglev_hw_bridge.encoders import Encoders, HomingError
from maglev_hw_bridge.lift import Lift
from maglev_hw_bridge.memory import Memory
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.signal_parameters import ENCODER_NAMES, PHASES
from maglev_hw_bridge.stage import BridgeStage
from maglev_model.axes import FloatArray
from maglev_model.contract.stage import Fault, StageError
from maglev_model.parameters import ParameterError, from_yaml
from maglev_model.programs.arguments import number
from maglev_model.programs.command import leave_with
from maglev_model.programs.progress import add_output_options, talking

if TYPE_CHECKING:
    from maglev_hw_bridge.node import BridgeNodeParameters

_HOP = 5e-4  # first lift-off [m]


class Commissioning:
    """The steps, on one machine; the operator agrees to each and acts where it is needed."""

    def __init__(
        self,
        parameters: BridgeParameters,
        driver: Driver,
        *,
        peak: float,
        operator: Operator,
        tell: Callable[[str], None] = print,
        priority: int = 0,
        signals: Sequence[int] = (),
    ) -> None:
        """``peak``: largest current of a phase alone [A]; ``priority`` in the air, real-time.

        ``signals`` that came end it before it goes on, where the exception of one was lost.
        """
        self._parameters, self._driver = parameters, driver
        self._peak, self._operator, self._tell = peak, operator, tell
        self._memory = Memory(parameters)
        self._priority, self._signals = priority, signals
        self._realtime = parameters.driver != 'emulated'
        self._encoders = Encoders(parameters)
        self._counts = np.zeros(6, dtype=np.int32)
        self._amplifiers = Amplifiers(parameters)
        self._amplifiers.drive_phases(np.zeros(PHASES))  # compiled while no watchdog runs
        self._cooling_since = time.monotonic()
        self._across = False  # x saw what z was to, and z what x was to
        self._fault: Fault | None = None  # latched since before, until all is well

    def run(self) -> None:
        """All steps. Raises WrongError, StoppedError, DriverError, StageError, ParameterError."""
        self._parameters.check_homing()
        self._memory.claim()
        try:
            self._recall()
            self._without_flying()
        finally:
            self._memory.release()
        self._first_lift_off()

    def _without_flying(self) -> None:
        try:
            self._boards()
            self._keep(active=True)
            self._last_line()
            self._gains()
            self._homing()
            self._scales()
            self._phases()
        finally:
            with unbroken():
                self._driver.close()
                with contextlib.suppress(StageError):  # what is kept then is worse
                    self._keep(active=False)

    def _ask(self, step: str) -> None:
        self._heed_signals()
        self._operator.go_on(step)

    def _heed_signals(self) -> None:
        """C code that calls Python, as Numba's while it loads, swallows what a signal raises."""
        if self._signals:
            raise KeyboardInterrupt

    def _recall(self) -> None:
        """What came before: a fault is for the operator to look into now."""
        load, fault = self._memory.recall()
        if fault is not None:
            self._ask(f'a fault is latched since before: {fault.reason}; {fault.remedy}, then on')
        self._amplifiers.arrays.load[:], self._fault = load, fault
        self._cooling_since = time.monotonic()

    def _keep(self, *, active: bool) -> None:
        self._cool()
        self._memory.keep(self._amplifiers.arrays.load, self._fault, active=active)

    def _cool(self) -> None:
        """What the amplifiers have cooled since current flowed, or since this was asked last."""
        now = time.monotonic()
        self._amplifiers.cool(now - self._cooling_since)
        self._cooling_since = now

    def _let_cool(self) -> None:
        """Wait until they are no hotter than a bridge may be activated with."""
        self._cool()
        load, wait = self._amplifiers.load, self._amplifiers.cooling_time
        if wait > 0.0:
            self._tell(f'  the amplifiers are hot, I2t load {load:.2f}: they cool for {wait:.1f} s')
            time.sleep(wait)
            self._cool()

    @contextlib.contextmanager
    def _current(self) -> Iterator[None]:
        """In here it may flow."""
        self._let_cool()
        self._heed_signals()
        try:
            yield
        finally:
            self._cooling_since = time.monotonic()

    def _boards(self) -> None:
        self._ask('open and check the boards; no current')
        self._driver.open()
        self._driver.counts(self._counts)
        self._encoders.start(self._counts)
        for name, count in zip(ENCODER_NAMES, self._counts, strict=True):
            self._tell(f'  encoder {name}: {count} counts')
        for doubt in doubts(self._parameters):
            self._tell(f'  {doubt}')

    def _last_line(self) -> None:
        self._ask(
            'prove the last line with dummy loads, 0.5 A in one of each board: stop input, '
            'enable line, watchdog, emergency stop'
        )
        self._memory.forget_proof()
        with self._current():
            Proof(
                self._parameters, self._driver, self._amplifiers, self._operator, self._tell
            ).run()
        self._memory.record_proof(self._parameters)

    def _gains(self) -> None:
        self._ask(
            f'measure {measured_current(self._parameters):g} A through each load in turn, and what '
            'is left when none is commanded'
        )
        with self._current():
            prove_gains(self._parameters, self._driver, self._amplifiers, self._operator)
        self._operator.act(Act.MOTORS)
        self._tell('  every amplifier makes of a volt what it is believed to')

    def _homing(self) -> None:
        home = self._parameters.homing
        self._ask(
            'home: the platen rests on its lower stop, held by nothing, at x = '
            f'{home.x * 1e3:g} mm, z = {home.z * 1e3:g} mm'
        )
        readings = np.zeros((home.samples, 6), dtype=np.int32)
        for row in readings:
            self._driver.counts(row)
            if self._realtime:
                time.sleep(self._parameters.sample_time)
        try:
            self._encoders.home(readings)
        except HomingError as error:
            raise WrongError(str(error)) from error
        self._tell('  at rest; zeros taken')

    def _scales(self) -> None:
        self._ask('move the platen by hand, to see what a count of each encoder is worth')
        self._across = prove_scales(self._parameters, self._operator, self._lengths)
        self._tell('  every encoder sees what it is moved by')

    def _lengths(self) -> FloatArray:
        """What the encoders read now (6,) [m]."""
        self._driver.counts(self._counts)  # and looks at the emergency stop
        return np.array(self._encoders.decode(self._counts))

    def _phases(self) -> None:
        pulses = Pulses(
            self._parameters, self._driver, self._encoders, self._amplifiers, self._peak
        )

        def pulse(phase: int) -> FloatArray:
            if phase % 3 == 0:
                self._ask(f'motor {phase // 3 + 1}: up to {self._peak:g} A in each phase alone')
            with self._current():
                self._lengths()
                return pulses.phase(phase)

        prove_phases(self._parameters, self._peak, self._operator, self._lengths, pulse, self._tell)
        if self._across:
            raise WrongError(
                'pushed along X the platen moves along z: motors, gaps, x and z are all numbered '
                '90 degrees round; check amplifier.channel and encoder.channel'
            )

    def _first_lift_off(self) -> None:
        self._ask(
            f'first lift-off by {_HOP * 1e3:g} mm for a second, then landing; the platen rests '
            'where it was homed or was moved to by hand'
        )
        self._let_cool()
        lift = Lift(self._parameters, _HOP)
        fault = self._fly(lift)
        if fault is not None:
            raise WrongError(f'{fault}; check machine.* and the currents')
        seen = f'rose {lift.risen * 1e3:.2f} mm, tilted {lift.tilt * 1e3:.2f} mrad at most'
        if not lift.fine:
            raise WrongError(
                f'it {seen}: check amplifier.gain, amplifier.offset, commutation.* and machine.*'
            )
        self._tell(f'  {seen}, landed')

    def _fly(self, lift: Lift) -> Fault | None:
        """The fault that came of it. What was latched before goes where the lift is as it is to be.

        No signal ends it in the air.
        """
        stage = BridgeStage(self._parameters, realtime=self._realtime, driver=self._driver)
        with self._on_time(), unbroken():
            try:
                stage.configure()
                stage.fault = None
                stage.encoders.arrays.zero[:] = self._encoders.arrays.zero
                stage.encoders.homed = True
                stage.activate()
                lift.fly(stage)
            finally:
                fault = stage.fault
                if not lift.fine:
                    stage.fault = fault or self._fault
                stage.close()
        return fault

    @contextlib.contextmanager
    def _on_time(self) -> Iterator[None]:
        """With real boards, what the operating system gives a process that must be on time."""
        if not self._realtime:
            yield
            return
        from maglev_node import realtime  # with the nodes, only needed here

        refused = realtime.take(self._priority)
        if refused:
            self._tell(f'  not permitted: {", ".join(refused)}: samples may come late')
        try:
            yield
        finally:
            realtime.give_priority_back()


def _operator(driver: Driver, yes: bool) -> Operator:
    person = Person(yes)
    if isinstance(driver, EmulatedDriver):
        return EmulatedPerson(driver.boards, person.go_on)
    return person


@contextlib.contextmanager
def _ended_by_signals() -> Iterator[Sequence[int]]:
    """What may end or stop it does so in order, as SIGINT does: none leaves current.

    Those that came are noted here.
    """
    caught: list[int] = []

    def end(number: int, _frame: object) -> None:
        caught.append(number)
        raise KeyboardInterrupt

    before = {number: signal.signal(number, end) for number in ENDING}
    try:
        yield caught
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _load(files: Sequence[str]) -> BridgeNodeParameters:
    from maglev_hw_bridge.node import BridgeNodeParameters  # with ROS, only needed here

    return from_yaml(BridgeNodeParameters, 'hw_bridge', *files)


def run(arguments: Sequence[str] | None = None) -> int:
    """The executable ``commission``; returns its exit code, 0 when every step was fine."""
    parser = argparse.ArgumentParser(prog='commission', description=__doc__)
    parser.add_argument(
        '--params',
        action='append',
        default=[],
        metavar='FILE',
        help='parameter file of hw_bridge; repeatable, the last one wins',
    )
    parser.add_argument(
        '--current',
        type=number(0.2, 3.0),
        default=1.5,
        metavar='A',
        help='largest current of a phase alone, 0.2 to 3 A (default 1.5)',
    )
    parser.add_argument('--yes', action='store_true', help='do not ask before each step')
    add_output_options(parser)
    options = parser.parse_args(arguments)
    if options.quiet and not options.yes:
        parser.error('--quiet needs --yes: it asks nothing')
    said: list[str] = []
    with talking(options):
        code = _commission(options, said)
    if options.json:
        print(json.dumps({'passed': code == 0, 'said': said}))
    return code


def _commission(options: argparse.Namespace, said: list[str]) -> int:
    """Exit code; what is said on the way is put down, too."""

    def tell(text: str) -> None:
        said.append(text.strip())
        print(text)

    try:
        parameters = _load(options.params)
        driver = make_driver(parameters, realtime=parameters.driver != 'emulated')
        operator = _operator(driver, options.yes)
        with _ended_by_signals() as signals:
            Commissioning(
                parameters,
                driver,
                peak=options.current,
                operator=operator,
                tell=tell,
                priority=parameters.realtime_priority,
                signals=signals,
            ).run()
    except WrongError as error:
        said.append(f'wrong: {error}')
        print(f'\ncommission: wrong: {error}', file=sys.stderr)
        return 1
    except (ParameterError, DriverError, StageError) as error:
        print(f'commission: error: {error}', file=sys.stderr)
        return 1
    except (StoppedError, EOFError, KeyboardInterrupt):
        print('\ncommission: stopped; no current flows', file=sys.stderr)
        return 130
    print(
        '\ncommission: all is well; next: scenarios/ellipse.sh --stage hw_bridge, --params as here'
    )
    return 0


def main() -> NoReturn:
    """Entry point of the executable ``commission``."""
    leave_with(run)
