"""Enable line, stop input and no current: what the driver makes of them, what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from driven import LINES, driver_on, run
from hil_check import CallError, Module

from maglev_hw_bridge.doubts import doubts
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import ParameterError, build


def test_whatever_was_put_out_before_it_starts_with_no_current() -> None:
    module = Module(offset=0.3)
    driver = driver_on(module, amplifier__offset=[0.3] * 12)
    driver.open()
    for card in module.cards:
        card.volts[:6] = 2.0
    driver.start()
    for card in module.cards:
        assert card.volts[:6].tolist() == [0.3] * 6
        card.volts[:6] = 2.0
    driver.enable()
    for card in module.cards:
        assert card.volts[:6].tolist() == [0.3] * 6
    driver.close()


def test_no_current_is_what_the_offset_says() -> None:
    module = Module(offset=0.3)
    driver = driver_on(module, amplifier__offset=[0.3] * 12)
    driver.open()
    assert all(card.resting for card in module.cards)
    driver.start()
    run(driver)
    driver.disable()
    assert all(card.resting for card in module.cards)
    run(driver)
    driver.stop()
    assert all(card.resting for card in module.cards)
    driver.start()
    run(driver)
    driver.close()
    module.check_end()


def test_enable_output_and_stop_input() -> None:
    module = Module(enable_line=5)
    driver = driver_on(module, **LINES)
    driver.open()
    assert not module.enabled
    driver.start()
    assert module.enabled
    run(driver, 1)
    assert not driver.stop_pressed
    module.stop_level = 1  # as a broken wire
    run(driver, 1)
    assert driver.stop_pressed
    driver.disable()
    assert not module.enabled
    driver.enable()
    assert module.enabled
    driver.stop()
    assert not module.enabled
    for level in (0, 1, 0):
        module.stop_level = level
        driver.counts(np.zeros(6, dtype=np.int32))
        assert driver.stop_pressed == bool(level)
    driver.close()


def test_polarities_are_parameters() -> None:
    module = Module()
    driver = driver_on(
        module, boards__enable_level=1, boards__open_level=0, boards__stop_level=0, **LINES
    )
    driver.open()
    assert module.cards[0].latch[5] == 0
    assert driver.stop_pressed
    driver.start()
    assert module.cards[0].latch[5] == 1
    driver.close()
    assert module.cards[0].latch[5] == 0


@pytest.mark.parametrize(
    ('given', 'text'),
    [
        ({'boards.enable_level': 1}, r'enable_level.*expires.*would be on'),
        ({'boards.digital_expiry': 'low'}, r'enable_level.*would be on'),
        ({'boards.digital_expiry': 'no_change'}, r'enable_level.*would be on'),
        ({'boards.open_level': 0}, r'enable_level.*would be on'),
        ({'boards.stop_input': 5}, r'stop_input'),
    ],
)
def test_an_enable_line_that_expiry_would_turn_on_is_refused(
    given: dict[str, object], text: str
) -> None:
    with pytest.raises(ParameterError, match=text):
        build(BridgeParameters, {'boards.enable_output': 5, **given})
    if 'boards.stop_input' not in given:
        build(BridgeParameters, given)  # without such a line it is nobody's business


def test_what_can_be_but_is_not_safe_is_said() -> None:
    real = {'driver': 'quanser'}
    wired = {**real, 'boards.stop_input': 3, 'boards.enable_output': 5}
    assert doubts(build(BridgeParameters, wired)) == []
    assert doubts(BridgeParameters()) == []
    none = ' '.join(doubts(build(BridgeParameters, real)))
    assert 'boards.stop_input' in none
    assert 'boards.enable_output' in none
    pulled = doubts(build(BridgeParameters, {**wired, 'boards.stop_level': 0}))
    assert len(pulled) == 1
    assert 'broken wire' in pulled[0]
    offset = [0.0] * 7 + [0.3] + [0.0] * 4
    left = doubts(build(BridgeParameters, {**wired, 'amplifier.offset': offset}))
    assert len(left) == 1
    assert 'amplifier.offset[7]' in left[0]


def test_the_expiry_of_the_outputs_where_a_card_can_do_better() -> None:
    module = Module(offset=0.3)
    offset = [0.3] * 12
    driver = driver_on(module, amplifier__offset=offset, boards__analog_expiry='no_current')
    driver.open()
    with pytest.raises(CallError, match='0 V'):  # not a Q8
        driver.start()


def test_one_board_is_not_two() -> None:
    with pytest.raises(ParameterError, match=r"boards\.identifier' names board '7' twice"):
        build(BridgeParameters, {'boards.identifier': ['7', '7']})


@pytest.mark.parametrize(
    ('given', 'name'),
    [
        ({'machine.gap_min': 0.0185}, 'fault.lower[0]'),
        ({'machine.x_max': 0.048}, 'fault.lower[1] fault.upper[1]'),
        ({'machine.theta_max': 0.012}, 'fault.lower[4] fault.upper[4]'),
        ({'machine.gap_max': 0.0312}, ''),
    ],
)
def test_a_range_of_flight_that_a_stop_ends_first_is_said(
    given: dict[str, float], name: str
) -> None:
    wired = {'driver': 'quanser', 'boards.stop_input': 3, 'boards.enable_output': 5}
    said = doubts(build(BridgeParameters, {**wired, **given}))
    assert ' '.join(text.split("'")[1] for text in said) == name
