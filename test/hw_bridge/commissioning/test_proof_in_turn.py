"""Each step of the proof asks for what it needs, and ends it where it does not see what it must."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from proving import prove

from maglev_hw_bridge.commissioning.operators import Act, EmulatedPerson
from maglev_hw_bridge.commissioning.proof import WrongError
from maglev_hw_bridge.drivers.emulated import EmulatedBoards

SHOWN = (0, 11)


class Witness(EmulatedPerson):
    """Does all that is asked but one thing, and notes what there is when it looks."""

    def __init__(self, boards: EmulatedBoards, refused: int = -1) -> None:
        super().__init__(boards, lambda _step: None, response=0.1)
        self.refused = refused
        self.acts: list[Act] = []
        self.currents: list[tuple[int, float]] = []
        self.outputs: list[float] = []  # [V]
        self.waited = self.looked = 0  # tick at which it did last

    def act(self, what: Act) -> None:
        self.acts.append(what)
        if len(self.acts) - 1 != self.refused:
            super().act(what)

    def sees_current(self, phase: int, meanwhile: Callable[[], None] | None = None) -> bool:
        seen = super().sees_current(phase, meanwhile)
        self.currents.append((phase, self._boards.rig.phase_current[phase]))
        self.outputs.append(float(np.abs(self._boards.outputs()).max()))
        self.looked = self._boards.ticks
        return seen

    def wait(self, seconds: float) -> float:
        if seconds < 0.1:  # for a watchdog, not to answer
            self.waited = self._boards.ticks - self.looked
        return super().wait(seconds)


def witnessed(claimed: dict[str, object]) -> Witness:
    """Who has seen all of it."""
    found: list[Witness] = []

    def witness(boards: EmulatedBoards) -> Witness:
        found.append(Witness(boards))
        return found[0]

    prove(claimed, whom=witness)
    return found[0]


def test_every_step_has_its_turn() -> None:
    person = witnessed({})
    assert person.acts == [
        Act.LOADS,
        *(Act.RELEASE, Act.PRESS, Act.RELEASE, Act.UNPLUG, Act.PLUG),
        *(Act.PRESS, Act.RELEASE),
    ]
    assert [phase for phase, _ in person.currents] == [*SHOWN] * 4
    enabled, *others = np.array([current for _, current in person.currents]).reshape(4, 2)
    assert enabled == pytest.approx(0.5, abs=0.02)
    assert not np.any(others)
    assert person.waited == pytest.approx(500, abs=3)  # for so long it flowed before


@pytest.mark.parametrize(('line', 'goes_on'), [(1, True), (0, True), (-1, False)])
def test_after_the_stop_current_is_asked_for_where_a_line_must_end_it(
    line: int, goes_on: bool
) -> None:
    person = witnessed({'boards.enable_output': line, 'boards.stop_input': 2})
    asked = np.array(person.outputs[-2:])
    assert asked == pytest.approx(0.5, abs=0.01) if goes_on else not np.any(asked)


@pytest.mark.parametrize('line', [0, 1])
def test_a_line_of_any_number_is_an_enable_line(line: int) -> None:
    claimed: dict[str, object] = {'boards.enable_output': line, 'boards.stop_input': 2}
    assert '  enable line: current when enabled, none when disabled: pass' in prove(claimed)

    def stay(boards: EmulatedBoards) -> None:
        boards.lines.let_go = lambda _expired: None  # type: ignore[method-assign]

    with pytest.raises(WrongError, match='enabled after the watchdog expired'):
        prove(claimed, stay)


@pytest.mark.parametrize(
    ('refused', 'text'),
    [
        (1, 'released, the emergency stop reads as pressed'),
        (2, 'pressed, the emergency stop reads as released'),
        (3, 'it reads as pressed when it is released again'),
        (4, 'a broken wire reads as released'),
        (5, 'with its plug back, the emergency stop reads as pressed'),
        (7, 'the emergency stop reads as pressed still'),
    ],
)
def test_what_is_not_done_to_the_stop_is_seen(refused: int, text: str) -> None:
    def press(boards: EmulatedBoards) -> None:
        boards.stop_pressed = True

    with pytest.raises(WrongError, match=f'^{text}'):
        prove({}, press, whom=lambda boards: Witness(boards, refused))


def test_a_stop_that_is_pressed_after_a_quarter_of_a_minute_is_not_seen() -> None:
    def soon(boards: EmulatedBoards) -> Any:
        person, tick = Witness(boards), boards.tick

        def press_late(_what: Act) -> None:
            due = boards.ticks + 15_100

            def ticking() -> None:
                tick()
                boards.stop_pressed |= boards.ticks >= due

            boards.tick = ticking  # type: ignore[method-assign]

        person.act_soon = press_late  # type: ignore[method-assign]
        return person

    with pytest.raises(WrongError, match='the emergency stop was not seen while current flowed'):
        prove({}, whom=soon)


def test_a_wait_that_is_stretched_by_less_than_a_half_proves_a_watchdog() -> None:
    def stretch(factor: float) -> Callable[[EmulatedBoards], None]:
        def stretched(boards: EmulatedBoards) -> None:
            sleep = boards.sleep
            boards.sleep = lambda seconds: sleep(factor * seconds)  # type: ignore[method-assign]

        return stretched

    prove({}, stretch(1.45))
    with pytest.raises(WrongError, match=r'for a wait of 0\.04 s'):
        prove({}, stretch(1.55))


def test_the_second_load_is_the_last_of_the_other_board_however_they_are_wired() -> None:
    board = (0, 1, *(0,) * 5, *(1,) * 5)
    channel = (0, 6, 2, 3, 4, 5, 1, 1, 2, 3, 4, 5)
    wired = {'phase_board': board, 'phase_channel': channel}
    claimed = {f'emulation.wiring.{name}': value for name, value in wired.items()}
    claimed |= {'amplifier.board': board, 'amplifier.channel': channel}
    assert prove(claimed)[0].endswith('at motor 1 phase a and motor 4 phase c')
