"""Landing and cutting: the speed at the stop, from several heights and from the ellipse."""

from __future__ import annotations

import re

import numpy as np
import pytest
from bridge_flight import OMEGA, Flight, ellipse, hover
from paper_motor import vertical_force

from maglev_hw_bridge.landing import impact_of_cut, impacts_of_cut
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import Mode
from maglev_model.currents import exact_currents
from maglev_model.inverse import CurrentLimits
from maglev_model.machine import machine_constants
from maglev_model.parameters import ParameterError, build

SOFT = 0.05  # [m/s]
HEIGHTS = [0.0185, 0.020, 0.0225, 0.025, 0.0285, 0.030, 0.0308]
MOMENTS = [0.0, 0.2, 0.333, 0.7, 0.92, 1.1]  # on the ellipse; z is fastest at 0, x a quarter on


def fly(target: object, samples: int, **overrides: object) -> Flight:
    flight = Flight(target, overrides)  # type: ignore[arg-type]
    flight.run(samples)
    assert flight.stage.fault is None
    flight.rig.forget_impact()
    return flight


def impact_when_cut(flight: Flight) -> float:
    flight.stage.deactivate()
    for _ in range(2000):
        flight.boards.tick()
    return flight.rig.impact


@pytest.mark.parametrize('y', HEIGHTS)
def test_landed_softly_from_any_height(y: float) -> None:
    flight = fly(hover(y), 250)
    flight.stage.land('test')
    flight.until_no_current()
    assert flight.stage.fault is None
    assert flight.rig.impact <= SOFT
    assert flight.rig.state[0] == 0.031


@pytest.mark.parametrize('moment', MOMENTS)
def test_landed_softly_from_the_ellipse_at_full_speed(moment: float) -> None:
    flight = fly(lambda t: ellipse(t + moment), 250)
    flight.stage.land('test')
    nearest = 1.0
    while flight.stage.mode is Mode.LANDING:
        flight.step(controlled=False)
        nearest = min(nearest, float(np.min(flight.stage.encoders.arrays.length[:4])))
    assert nearest > 0.018
    flight.until_no_current()
    assert flight.stage.fault is None
    assert flight.rig.impact <= SOFT
    assert np.max(np.abs(flight.rig.state[[2, 4]])) < 0.045
    assert flight.tilt < 1e-4


@pytest.mark.parametrize('offset', [{'K_v1': 0.93}, {'K_v1': 1.07}, {'mass_y': 1.1}])
def test_landed_softly_though_the_machine_is_not_as_known(offset: dict[str, float]) -> None:
    overrides = {f'emulation.offset.{name}': value for name, value in offset.items()}
    flight = fly(hover(0.022), 600, **overrides)
    flight.stage.land('test')
    flight.until_no_current()
    assert flight.rig.impact <= SOFT


def test_the_single_motor_machine_lands_softly() -> None:
    single = {'machine.motors': 1, 'machine.mass_y': 1.725, 'machine.mass_x': 5.3}
    locked = {'emulation.guide.locked': [False, False, True, True, True]}
    flight = Flight(hover(0.022, 0.01), {**single, **locked})
    machine = machine_constants(flight.stage.parameters.machine)
    limits = CurrentLimits(7.0, 1.0, 0.0)
    for _ in range(8):
        flight.stage.read()
        position = flight.stage.guard.arrays.position
        i_d, i_q, _ = exact_currents(machine, position[None], np.zeros((1, 5)), limits)
        assert not np.any(i_d[0, [0, 2, 3]])
        flight.stage.write(i_d[0], i_q[0])
    flight.rig.forget_impact()
    flight.stage.land('test')
    flight.until_no_current()
    assert flight.stage.fault is None
    assert flight.rig.impact <= SOFT
    assert flight.rig.state[0] == 0.031


@pytest.mark.parametrize('y', [0.0185, 0.020, 0.025, 0.0285, 0.030])
def test_a_cut_strikes_the_stop_as_foretold(y: float) -> None:
    free = {'emulation.guide.coulomb': [0.0] * 5, 'emulation.guide.viscous': [0.0] * 5}
    flight = fly(hover(y), 400, **free)
    state = flight.rig.state
    foretold, stop = impact_of_cut(flight.stage.parameters, state[0], state[1])
    struck = impact_when_cut(flight)
    assert stop == ('upper' if y < 0.0287 else 'lower')
    assert struck == pytest.approx(foretold, rel=0.12, abs=0.01)
    if y < 0.028:
        assert struck > SOFT  # a cut is no landing


@pytest.mark.parametrize('y', [0.021, 0.023, 0.026, 0.0285])
def test_all_gaps_on_one_plug_end_on_the_lower_stop_softer_than_by_a_cut(y: float) -> None:
    flight = fly(hover(y), 600)
    flight.boards.stuck[:4] = True
    flight.run(600)
    flight.until_no_current()
    fault = flight.stage.fault
    assert fault is not None
    assert not fault.cut
    told = re.search(r'strikes the lower stop at about ([\d.]+) m/s', fault.reason)
    assert told is not None
    assert flight.rig.state[0] == 0.031
    cut, stop = impact_of_cut(flight.stage.parameters, y, 0.0)
    assert stop == 'upper'
    assert flight.rig.impact < min(1.15 * float(told.group(1)) + 0.03, 0.8 * cut)


@pytest.mark.parametrize('pull', [0.92, 1.0, 1.08])
@pytest.mark.parametrize('y', [0.0278, 0.0287, 0.0296])
def test_a_cut_near_the_balance_is_no_harder_than_foretold(y: float, pull: float) -> None:
    machine = {'emulation.offset.K_v1': pull, 'emulation.guide.coulomb': [0.0] * 5}
    flight = fly(hover(y), 400, **machine)
    foretold = impacts_of_cut(flight.stage.parameters, *flight.rig.state[:2])
    assert impact_when_cut(flight) <= 1.15 * max(foretold.values()) + 0.03


def test_a_cut_on_the_ellipse_is_far_from_soft() -> None:
    flight = fly(ellipse, round(1000 * 0.25 * 2 * np.pi / OMEGA))
    assert impact_when_cut(flight) > 4 * SOFT


def test_landing_on_the_ground_ends_at_once() -> None:
    flight = Flight(hover(0.031))
    flight.step()
    flight.stage.land('test')
    assert flight.stage.mode is Mode.DISABLED
    flight.stage.resume()
    assert flight.stage.mode is Mode.FOLLOWING


def test_no_motor_gets_more_than_the_limit_while_it_lands() -> None:
    flight = fly(lambda t: ellipse(t + 0.2), 250, **{'landing.current': 0.2})
    flight.stage.land('test')
    largest = 0.0
    for _ in range(40):
        flight.step(controlled=False)
        landing = flight.stage.landing
        largest = max(largest, *np.hypot(landing.direct_current, landing.quadrature_current))
    assert 0.199 < largest <= 0.2 * (1.0 + 1e-9)


def test_it_presses_on_the_stop_for_the_settling_time() -> None:
    flight = fly(hover(0.03), 250)
    flight.stage.land('test')
    for _ in range(1499):  # 0.3 s of braking, 1 s down, 0.2 s on the stop
        flight.step(controlled=False)
    assert flight.stage.mode is Mode.LANDING
    flight.run(3, controlled=False)
    assert flight.stage.mode is Mode.DISABLED


def stick(flight: Flight, phase: int, current: float) -> None:
    """Let an amplifier carry a current [A] whatever it is asked for."""
    flight.rig.arrays.gain[phase] = 1e-9
    flight.rig.arrays.offset[phase] = -1e9 * current


@pytest.mark.parametrize(('current', 'held'), [(-1.0, True), (-5.0, False)])
def test_a_landing_that_an_amplifier_defeats_is_given_up(current: float, held: bool) -> None:
    flight = fly(hover(0.025), 250, **{'boards.enable_output': 1})
    stick(flight, 7, current)
    flight.run(5)
    flight.stage.stop()
    flight.run(40, controlled=False)
    assert flight.boards.lines.enabled == held
    fault = flight.stage.fault
    assert fault is not None
    assert fault.kind == ('stop' if held else 'current')
    assert ('left its way down' in fault.reason) == fault.cut == (not held)
    assert 'strikes' in fault.reason or held
    assert fault.reason.startswith('emergency stop')  # what came first is not forgotten
    assert np.max(np.abs(flight.rig.state[[1, 5]])) < 0.5


@pytest.mark.parametrize('gap', [0.025, 0.0285])
@pytest.mark.parametrize(('current', 'can_be_held'), [(0.2, True), (5.0, False)])
def test_what_no_motors_can_hold_against_an_amplifier(
    gap: float, current: float, can_be_held: bool
) -> None:
    """Level, the opposite motor must pull as hard; the two then pull more than the weight."""
    machine = machine_constants(BridgeParameters().machine)
    angles = np.linspace(0.0, 2.0 * np.pi, 73)
    share = 2.0 / 3.0 * current  # of a phase alone
    pull = [-vertical_force(machine, gap, share * np.cos(a), share * np.sin(a)) for a in angles]
    assert (2.0 * max(pull) < machine.M_y * machine.G) == can_be_held


def test_an_emergency_stop_ends_the_landing_in_time() -> None:
    times = {'boards.stop_time': 0.5, 'landing.braking_time': 0.1, 'landing.descent_time': 0.3}
    times |= {'landing.settle_time': 0.05}
    flight = Flight(hover(0.025), {**times, 'boards.enable_output': 1})
    flight.run(150)
    flight.stage.stop()
    flight.stage.landing.arrays.descent_start = 60.0  # a landing that does not end
    samples = 0
    while flight.boards.lines.enabled:
        flight.step(False)
        samples += 1
    assert samples == pytest.approx(500, abs=2)
    assert flight.stage.mode is Mode.DISABLED
    with pytest.raises(ParameterError, match=r'boards\.stop_time'):
        build(BridgeParameters, {'boards.stop_time': 1.0})
