"""On its lower stop: lifted to tell it from the upper one, resting, and leaving it unbidden."""

from __future__ import annotations

import numpy as np
import pytest
from bridge_flight import Flight, hover

from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.encoders import HomingError
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage, Mode
from maglev_model.guide import GuideParameters
from maglev_model.parameters import build

UPPER_STOP, LOWER_STOP = 0.018, 0.031
NOMINAL = 0.01  # [m/s]
FRICTION = np.array(GuideParameters().coulomb)

HEAVY = {'K_v1': 0.9, 'K_v2': 0.9, 'K_v3': 0.9, 'mass_y': 1.1}
LIGHT = {'K_v1': 1.1, 'K_v2': 1.1, 'K_v3': 1.1, 'mass_y': 0.9}


def machine(place: float, friction: float, offset: dict[str, float]) -> BridgeStage:
    """A bridge, ready to home, to a machine that rests there."""
    parameters = build(
        BridgeParameters,
        {
            'homing.x': 0.0,
            'homing.z': 0.0,
            'emulation.guide.coulomb': (friction * FRICTION).tolist(),
            **{f'emulation.offset.{name}': value for name, value in offset.items()},
        },
    )
    boards = EmulatedBoards(parameters)
    boards.rig.place(np.array([place, 0.0, 0.0, 0.0, 0.0]))
    for _ in range(50):
        boards.tick()
    assert boards.rig.state[0] == pytest.approx(place, abs=1e-5)
    stage = BridgeStage(
        parameters, driver=QuanserDriver(parameters, boards, boards.now, boards.sleep)
    )
    stage.configure()
    return stage


@pytest.mark.parametrize('friction', [0.2, 2.0])
@pytest.mark.parametrize('offset', [HEAVY, LIGHT])
def test_homing_tells_the_stops_apart_on_any_sound_machine(
    offset: dict[str, float], friction: float
) -> None:
    stage = machine(LOWER_STOP, friction, offset)
    stage.home()
    assert stage.encoders.homed
    stage.activate()
    stage.close()
    stage = machine(UPPER_STOP, friction, offset)
    with pytest.raises(HomingError, match=r'the platen rose 0\.0.* upper stop'):
        stage.home()
    assert not stage.encoders.homed
    stage.close()


def test_what_is_heavier_than_any_sound_machine_is_not_lifted() -> None:
    stage = machine(LOWER_STOP, 2.0, {**HEAVY, 'mass_y': 1.25})
    with pytest.raises(HomingError, match='something holds it'):
        stage.home()
    stage.close()


@pytest.mark.parametrize('samples', [40, 200])  # shorter, longer than what rests stands still
@pytest.mark.parametrize(('above', 'ends'), [(0.0, True), (5e-5, False), (1.5e-4, False)])
def test_what_does_not_rest_yet_is_set_down(above: float, ends: bool, samples: int) -> None:
    flight = Flight(hover(LOWER_STOP - above))
    flight.run(samples if above else 200)
    flight.rig.forget_impact()
    flight.stage.stop()
    assert (flight.stage.mode is Mode.DISABLED) == ends
    flight.until_no_current()
    assert flight.rig.impact < NOMINAL


def test_a_landing_is_not_cut_short_by_a_fault() -> None:
    flight = Flight(hover(0.0305))
    flight.run(200)
    flight.stage.land('test')
    while flight.rig.state[0] < LOWER_STOP - 1e-4:
        flight.step(False)
    flight.rig.forget_impact()
    flight.stage.stop()
    assert flight.stage.mode is Mode.LANDING
    flight.until_no_current()
    assert flight.rig.impact < NOMINAL


@pytest.mark.parametrize(
    ('samples', 'above', 'rests'),
    [(60, 1e-4, False), (130, 1e-4, True), (130, 1.9e-4, True), (130, 2.3e-4, False)],
)
def test_where_it_stands_still_near_its_stop_it_rests(
    samples: int, above: float, rests: bool
) -> None:
    flight = Flight(hover(LOWER_STOP))
    flight.stage.encoders.arrays.zero[:4] -= above  # a stop that is higher here
    for _ in range(samples):
        flight.stage.read()
        flight.stage.write(np.full(4, 0.05), np.zeros(4))
    assert flight.stage.guard.arrays.position[0] < LOWER_STOP - 5e-5
    flight.stage.read()
    flight.stage.write(np.zeros(4), np.zeros(4))
    assert (flight.stage.fault is None) == rests


def lift(flight: Flight, height: float, speed: float) -> None:
    """Move the platen up by that from its stop, while the controller commands nothing."""
    for above in np.arange(0.0, height, 1e-3 * speed):
        flight.rig.place(np.array([LOWER_STOP - above, 0.0, 0.0, 0.0, 0.0]))
        flight.stage.read()
        flight.stage.write(np.zeros(4), np.zeros(4))


@pytest.mark.parametrize(
    ('height', 'speed', 'left'),
    [(2.2e-4, 2e-3, False), (4e-4, 2e-3, True), (4e-5, 1e-3, False), (2.4e-4, 0.02, True)],
)
def test_a_platen_that_leaves_its_stop_without_current_is_a_fault(
    height: float, speed: float, left: bool
) -> None:
    flight = Flight(hover(LOWER_STOP), {'boards.enable_output': 1})
    flight.run(20, controlled=False)
    lift(flight, height, speed)
    assert ('left its stop' in str(flight.stage.fault)) == left
    assert flight.boards.lines.enabled != left


@pytest.mark.parametrize(('tilt', 'left'), [(2e-4, False), (1.2e-3, True)])
@pytest.mark.parametrize('axis', [3, 4])
@pytest.mark.parametrize('sign', [-1.0, 1.0])
def test_a_corner_that_leaves_the_stop_is_enough(
    axis: int, sign: float, tilt: float, left: bool
) -> None:
    flight = Flight(hover(LOWER_STOP), {'boards.enable_output': 1})
    flight.run(20, controlled=False)
    for share in np.linspace(0.0, 1.0, 100):
        place = np.array([LOWER_STOP, 0.0, 0.0, 0.0, 0.0])
        place[axis] = sign * share * tilt
        flight.rig.place(place - 0.1 * abs(place[axis]) * np.eye(5)[0])
        flight.stage.read()
        flight.stage.write(np.zeros(4), np.zeros(4))
    assert ('left its stop' in str(flight.stage.fault)) == left


@pytest.mark.parametrize('axis', [3, 4])
@pytest.mark.parametrize('sign', [-1.0, 1.0])
@pytest.mark.parametrize(
    ('off', 'rising', 'left'),
    [(1.5e-4, 4e-3, False), (1.5e-4, 0.012, True), (2.9e-4, 0.0, False), (3.1e-4, 0.0, True)],
)
def test_a_corner_that_will_soon_be_off_the_stop_is_enough(
    axis: int, sign: float, off: float, rising: float, left: bool
) -> None:
    """A corner that is so far off and rises at so many m/s, about the middle that stays."""
    flight = Flight(hover(LOWER_STOP))
    flight.run(20, controlled=False)
    state, radius = flight.stage.guard.arrays, flight.stage.parameters.machine.radius
    corner = np.array([[-1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, -1.0]])[axis - 3]
    state.length[:4] = LOWER_STOP - off * sign * corner
    state.rate[:] = 0.0
    state.rate[axis] = -sign * rising / radius
    assert flight.stage._leaves() == left


def test_what_was_moved_while_nobody_looked_has_not_left_its_stop() -> None:
    flight = Flight(hover(LOWER_STOP))
    lift(flight, 1e-4, 2e-3)
    flight.stage.deactivate()
    flight.boards.place(np.array([UPPER_STOP, 0.0, 0.0, 0.0, 0.0]))
    flight.stage.activate()
    for _ in range(5):
        flight.stage.read()
        flight.stage.write(np.zeros(4), np.zeros(4))
    assert flight.stage.fault is None


@pytest.mark.parametrize(
    ('axis', 'way', 'slid'), [(1, 2.8e-4, False), (1, -3.2e-4, True), (2, 3.2e-4, True)]
)
@pytest.mark.parametrize('parked', [50, 150])
def test_a_platen_that_slides_along_without_current_is_a_fault(
    axis: int, way: float, slid: bool, parked: int
) -> None:
    """One that has stood still there; after a touchdown it may come to rest."""
    flight = Flight(hover(LOWER_STOP), {'boards.enable_output': 1})
    flight.run(parked, controlled=False)
    slid = slid and parked > 100
    for share in np.linspace(0.0, 1.0, 60):
        place = LOWER_STOP * (np.arange(5) == 0) + share * way * (np.arange(5) == axis)
        flight.rig.place(place)
        flight.stage.read()
        flight.stage.write(np.zeros(4), np.zeros(4))
    assert ('slid along' in str(flight.stage.fault)) == slid
    assert flight.boards.lines.enabled != slid
    if slid:
        for _ in range(20):
            flight.stage.read()
            flight.stage.write(np.zeros(4), np.zeros(4))
        assert flight.stage.reset()[0]
        flight.run(200, controlled=False)
        assert flight.stage.fault is None  # it stands there now


@pytest.mark.parametrize(('speed', 'slid'), [(0.5e-3, False), (0.9e-3, True)])
def test_what_creeps_along_on_its_stop_is_pulled_by_no_amplifier(speed: float, slid: bool) -> None:
    flight = Flight(hover(LOWER_STOP))
    for k in range(1500):
        flight.rig.place(np.array([LOWER_STOP, 1e-3 * speed * k, 0.0, 0.0, 0.0]))
        flight.stage.read()
        flight.stage.write(np.zeros(4), np.zeros(4))
    assert ('slid along' in str(flight.stage.fault)) == slid


@pytest.mark.parametrize(('height', 'refused'), [(0.031, False), (0.03097, True)])
def test_no_current_may_be_asked_for_where_the_encoders_have_it_on_the_stop(
    height: float, *, refused: bool
) -> None:
    flight = Flight(hover(height))
    flight.run(30)
    assert flight.stage.flying
    flight.stage.read()
    flight.stage.guard.arrays.position[0] = height - 1.5e-5  # as where the stop bears a part
    flight.stage.write(np.zeros(4), np.zeros(4))
    fault = flight.stage.fault
    assert (fault is not None and 'zero currents' in str(fault)) == refused
    assert flight.stage.flying == refused


@pytest.mark.parametrize(('rate', 'refused'), [(3.1e-3, False), (2e-2, True)])
def test_a_count_of_coarse_encoders_on_the_stop_is_no_flight(rate: float, *, refused: bool) -> None:
    flight = Flight(hover(LOWER_STOP))
    flight.run(30)
    assert flight.stage.flying
    flight.stage.read()
    flight.stage.guard.arrays.rate[0] = -rate
    flight.stage.write(np.zeros(4), np.zeros(4))
    assert ('zero currents' in str(flight.stage.fault)) == refused
    assert flight.stage.flying == refused
