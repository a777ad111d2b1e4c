"""The world fails as it is told to, and is sound again when it is cured."""

from __future__ import annotations

import numpy as np
import pytest

from maglev_hw_bridge.emulation.card import HILError
from maglev_study.faults.flight import Flight
from maglev_study.faults.hardware_faults import INTERRUPTED


@pytest.fixture
def flight() -> Flight:
    """Lifted off, on a machine that is not what it is believed to be."""
    flight = Flight(2)
    assert flight.bridge.configure()
    assert flight.bridge.home(vouched=True)
    assert flight.bridge.activate()
    for _ in range(400):
        flight.step()
    assert flight.world.rig.state[0] < 0.029
    return flight


def test_nothing_is_off_the_truth_without_a_fault(flight: Flight) -> None:
    assert not np.any(flight.world.deviation)
    assert flight.bridge.stage.fault is None


def test_a_stuck_encoder_is_off_by_what_the_platen_moves(flight: Flight) -> None:
    world = flight.world
    before = world.rig.counts()
    world.stuck[1] = True
    for _ in range(3):
        world.tick()
    moved = world.rig.counts() - before
    assert world.deviation[1] == -moved[1] != 0
    assert not np.any(world.deviation[[0, 2, 3, 4, 5]])


def test_noise_stays_within_its_size(flight: Flight) -> None:
    world = flight.world
    world.noise[4] = 7
    seen = []
    for _ in range(200):
        world.tick()
        seen.append(int(world.deviation[4]))
    assert min(seen) == -7
    assert max(seen) == 7
    world.cure()
    world.tick()
    assert world.deviation[4] == 0


def test_an_amplifier_that_is_stuck_on_ends_when_it_is_disabled(flight: Flight) -> None:
    world = flight.world
    world.stick_on(3, 4.0)
    world.let_pass(0.02)
    rest = world.parameters.emulation.wiring.offset[3]
    assert world.rig.phase_current[3] == pytest.approx(4.0 - rest, abs=1e-3)
    flight.bridge.vanish()
    world.let_pass(0.06)
    assert not world.enabled
    assert np.max(np.abs(world.rig.phase_current)) < 1e-6


@pytest.mark.parametrize('factor', [0.0, 0.7, 1.3])
def test_a_gain_scales_what_flows_in_its_phase_alone(flight: Flight, factor: float) -> None:
    world = flight.world
    volts = world.volts[world._outputs]
    world.scale_gain(0, factor)
    world.let_pass(0.01)
    rest = np.array(world.parameters.emulation.wiring.offset)
    expected = volts - rest
    expected[0] *= factor
    assert world.rig.phase_current == pytest.approx(expected, abs=1e-3)


def test_a_failing_call_fails_on_its_board_until_it_is_cured(flight: Flight) -> None:
    world = flight.world
    boards = flight.bridge.stage.driver._boards  # type: ignore[attr-defined]

    def raise_it(_sound: object, _arguments: object) -> None:
        raise HILError(INTERRUPTED, 'injected')

    world.fail('watchdog_reload', 1, raise_it)
    assert boards[0].card.watchdog_reload()
    with pytest.raises(HILError, match='injected'):
        boards[1].card.watchdog_reload()
    world.cure()
    assert boards[1].card.watchdog_reload()
