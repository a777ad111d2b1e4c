"""The last line proven, before anything levitates: stop input, enable line, watchdog.

With dummy loads in place of the motors, each of them does what it is there for while the operator
looks at one load of each board; the first that does not names the parameter that is wrong.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from maglev_hw_bridge.amplifiers import Amplifiers
from maglev_hw_bridge.commissioning.operators import Act, Meanwhile, Operator
from maglev_hw_bridge.drivers import Driver, SampledDriver, WatchdogError
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.signal_parameters import PHASE_NAMES, PHASES

_CURRENT = 0.5  # through each load that is looked at [A]
_FLOW = 0.5  # for so long, before the watchdog is let expire [s]
_STRETCHED = 1.5  # of a wait, beyond which nothing is proven by it
_PRESS = 15.0  # time to press the stop [s]


class WrongError(Exception):
    """A step found something wrong; the message says what to change."""


def refuse_pressed(driver: SampledDriver) -> None:
    """Raises WrongError where the emergency stop was pressed when the boards were read last."""
    if driver.stop_pressed:
        raise WrongError('the emergency stop is pressed: release it, then begin anew')


class Proof:
    """The steps, on boards that are open; they are left open, with no current, the loads on."""

    def __init__(
        self,
        parameters: BridgeParameters,
        driver: Driver,
        amplifiers: Amplifiers,
        operator: Operator,
        tell: Callable[[str], None],
    ) -> None:
        self._boards = parameters.boards
        self._driver, self._operator, self._tell = driver, operator, tell
        self._amplifiers = amplifiers
        self._period = parameters.sample_time
        self._counts = np.zeros(6, dtype=np.int32)
        board = parameters.amplifier.board
        self._shown = (0, max(phase for phase in range(PHASES) if board[phase] != board[0]))
        self._current = np.zeros(PHASES)
        self._current[list(self._shown)] = _CURRENT

    def run(self) -> None:
        """All steps that the parameters name lines for. Raises WrongError, DriverError."""
        self._tell(f'  loads that show their current: at {_named(self._shown)}')
        self._operator.act(Act.LOADS)
        if self._boards.stop_input >= 0:
            self._stop_input()
        else:
            self._tell('  boards.stop_input is -1: there is no emergency stop to prove')
        self._enable_line()
        self._watchdog()
        if self._boards.stop_input >= 0:
            self._emergency_stop()

    # -- stop input --------------------------------------------------------------------------------

    def _stop_input(self) -> None:
        level = self._boards.stop_level
        wire = f'or boards.stop_input ({self._boards.stop_input}) is another line'
        turned = f'boards.stop_level must be {1 - level}, {wire}'
        self._operator.act(Act.RELEASE)
        self._expect(False, f'released, the emergency stop reads as pressed: {turned}')
        self._operator.act(Act.PRESS)
        self._expect(True, f'pressed, the emergency stop reads as released: {turned}')
        self._operator.act(Act.RELEASE)
        self._expect(False, f'it reads as pressed when it is released again: {wire}')
        self._operator.act(Act.UNPLUG)
        self._expect(
            True,
            'a broken wire reads as released: use a contact that opens when it is pressed, and '
            'for boards.stop_level what an open line reads (boards.open_level)',
        )
        self._operator.act(Act.PLUG)
        self._expect(False, 'with its plug back, the emergency stop reads as pressed')
        self._tell('  stop input: pressed, released, broken wire: pass')

    def _expect(self, pressed: bool, wrong: str) -> None:
        self._driver.counts(self._counts)
        if self._driver.stop_pressed != pressed:
            raise WrongError(wrong)

    # -- enable line and watchdog ------------------------------------------------------------------

    @contextlib.contextmanager
    def _started(self) -> Iterator[None]:
        self._driver.start()
        try:
            yield
        finally:
            self._driver.stop()

    def _sample(self) -> None:
        """Ask the outputs for the current for a sample, whatever the emergency stop says."""
        self._driver.read(self._counts)
        self._driver.write(self._amplifiers.drive_phases(self._current))

    def _drive(self) -> None:
        """As that, with the emergency stop released. Raises WrongError."""
        self._sample()
        refuse_pressed(self._driver)

    def _flowing(self, meanwhile: Meanwhile | None = None) -> list[int]:
        """The phases of the loads that carry current."""
        return [p for p in self._shown if self._operator.sees_current(p, meanwhile)]

    def _enable_line(self) -> None:
        boards = self._boards
        with self._started():
            enabled = self._flowing(self._drive)
        still = _named(phase for phase in self._shown if phase not in enabled)
        if boards.enable_output < 0:
            if still:
                raise WrongError(
                    f'no current flows at {still}: check amplifier.board and channel, the supply'
                )
            self._tell('  boards.enable_output is -1: there is no enable line to prove')
            return
        with self._started():
            self._driver.disable()
            disabled = self._flowing(self._drive)
        line = f'boards.enable_output ({boards.enable_output})'
        if not set(disabled) <= set(enabled):
            raise WrongError(f'the enable line acts the wrong way round: see to {line} and '
                             f'boards.enable_level ({boards.enable_level}); what the amplifiers '
                             'need otherwise takes an inverter')  # fmt: skip
        if disabled:
            raise WrongError(f'current flows at {_named(disabled)} whether enabled or not: {line} '
                             'is another line')  # fmt: skip
        if still:
            raise WrongError(f'no current flows at {still} even when enabled: {line} is another '
                             'line, or the supply is off')  # fmt: skip
        self._tell('  enable line: current when enabled, none when disabled: pass')

    def _watchdog(self) -> None:
        longest = 2.0 * self._boards.watchdog
        with self._started():
            for _ in range(round(_FLOW / self._period)):
                self._drive()
            waited = self._operator.wait(longest)
            if running := self._running():
                raise WrongError(
                    f'the watchdog of board {" and ".join(running)} did not expire within '
                    f'{longest:g} s: see to boards.watchdog'
                )
            if waited > _STRETCHED * longest:
                raise WrongError(
                    f'this machine took {waited:.3f} s for a wait of {longest:g} s, in which a '
                    'watchdog that is late expires too: free it of other load'
                )
            flows = self._flowing()
            enabled = self._boards.enable_output >= 0 and self._operator.sees_enabled()
        if flows:
            raise WrongError(
                f'current flows on at {_named(flows)} after the watchdog expired: see to the boards'
            )
        if enabled:
            raise WrongError(
                'the amplifiers are enabled after the watchdog expired: boards.enable_level, '
                'open_level or digital_expiry do not say what the boards do'
            )
        self._tell('  watchdog: expires in time, no current: pass')

    def _running(self) -> Sequence[str]:
        """The boards whose watchdog has not expired: one that has refuses the current."""
        try:
            self._driver.write(self._amplifiers.volts)
        except WatchdogError as error:
            return error.running
        return self._boards.identifier

    def _emergency_stop(self) -> None:
        with self._started():
            self._operator.act_soon(Act.PRESS)
            for _ in range(round(_PRESS / self._period)):
                self._sample()
                if self._driver.stop_pressed:
                    break
            else:
                raise WrongError('the emergency stop was not seen while current flowed')
            self._driver.disable()
            if self._boards.enable_output < 0:  # then it is the commands alone that end it
                self._current[:] = 0.0
            flows = self._flowing(self._sample)
        if flows:
            raise WrongError(f'current flows on at {_named(flows)} after an emergency stop')
        self._operator.act(Act.RELEASE)
        self._expect(False, 'the emergency stop reads as pressed still: release it, begin anew')
        self._tell('  emergency stop: no current: pass')


def _named(phases: Iterable[int]) -> str:
    return ' and '.join(PHASE_NAMES[phase] for phase in phases)
