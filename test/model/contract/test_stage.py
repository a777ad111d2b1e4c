"""One contract for every stage, simulated or on boards."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from bridge_flight import HOME, Flight, hover

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage
from maglev_model.contract.stage import EncoderSample, Stage, StageError, motor_currents
from maglev_model.parameters import build
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage

QUICK = {'landing.braking_time': 0.05, 'landing.descent_time': 0.2, 'landing.settle_time': 0.05}
PATIENT = {
    'boards.watchdog': 1.0,
    'boards.overrun': 1.0,
    'boards.buffer': 1000,
    'emulation.patience': 0.02,  # boards stand still with a machine that does, for over 5 ms
}
BRIDGE = build(BridgeParameters, {**HOME, **QUICK, **PATIENT})
STAGES: dict[str, Callable[[], Stage]] = {
    'plant': lambda: SimulatedStage(build(PlantParameters, {'watchdog': 0.005})),
    'hw_bridge': lambda: BridgeStage(BRIDGE),
    'hw_bridge, real time': lambda: BridgeStage(BRIDGE, realtime=True),
}
TIMED = ('hw_bridge, real time',)
ZERO = np.zeros(4)
BEHIND = 60  # samples at most
FALLING = np.full(4, 0.1)  # [A]
LIFTING = np.full(4, -0.6)  # [A]; for some samples only: it falls back, not up to the magnets


def ready(name: str) -> Stage:
    stage = STAGES[name]()
    stage.configure()
    stage.activate()
    return stage


@pytest.fixture(
    params=[
        pytest.param(
            name, marks=[pytest.mark.alone, pytest.mark.real_time] if name in TIMED else []
        )
        for name in STAGES
    ]
)
def stage(request: pytest.FixtureRequest) -> Iterator[Stage]:
    made = ready(request.param)
    yield made
    made.close()


def rest(sample: EncoderSample) -> None:
    assert isinstance(sample.gap, np.ndarray)
    assert (sample.gap.shape, sample.gap.dtype) == ((4,), np.float64)
    assert sample.gap == pytest.approx([0.031] * 4, abs=1e-5)
    assert (type(sample.x), type(sample.z)) == (float, float)
    assert (sample.x, sample.z) == pytest.approx((0.0, 0.0), abs=1e-5)


def lift(stage: Stage, samples: int = 6) -> EncoderSample:
    """Command what lifts the platen; the last sample."""
    sample = stage.read()
    for _ in range(samples):
        stage.write(LIFTING, ZERO)
        sample = stage.read()
    return sample


def lifts(stage: Stage) -> bool:
    """Whether currents are followed, seen from rest.

    In real time only after what was sampled while the machine was busy elsewhere.
    """
    stage.read()
    for _ in range(BEHIND):
        stage.write(LIFTING, ZERO)
        if np.all(stage.read().gap < 0.03095):
            return True
    return False


def come_to_rest(stage: Stage) -> None:
    """Go on without a controller until no current flows, and the platen lies on its stop."""
    for _ in range(1000):
        if not stage.flying:
            break
        stage.hold()
        stage.read()
    assert not stage.flying
    for _ in range(200):
        stage.hold()
        sample = stage.read()
    rest(sample)


def test_it_rests_until_something_is_written(stage: Stage) -> None:
    rest(stage.read())
    for _ in range(10):
        stage.write(ZERO, ZERO)
        rest(stage.read())


def test_samples_are_its_readers_to_keep(stage: Stage) -> None:
    first = stage.read()
    first.gap[:] = 0.0
    stage.write(ZERO, ZERO)
    rest(stage.read())


def test_currents_lift_and_push_as_the_paper_has_it(stage: Stage) -> None:
    stage.read()
    for _ in range(25):
        stage.write(np.full(4, -1.0), np.array([0.0, -1.0, 0.0, -1.0]))
        sample = stage.read()
    assert np.all(sample.gap < 0.0305)
    assert sample.x > 1e-4
    assert abs(sample.z) < 1e-4


@pytest.mark.parametrize(
    'bad', [np.array([np.nan, 0, 0, 0]), np.array([0, 0, np.inf, 0]), np.zeros(3), np.zeros((4, 1))]
)
def test_bad_currents_are_refused(stage: Stage, bad: np.ndarray) -> None:
    stage.read()
    with pytest.raises(ValueError, match=r'finite|shape'):
        stage.write(bad, ZERO)
    with pytest.raises(ValueError, match=r'finite|shape'):
        stage.write(ZERO, bad)
    rest(stage.read())


def test_lists_and_integers_are_currents_too(stage: Stage) -> None:
    stage.read()
    stage.write([0, 0, 0, 0], np.zeros(4, dtype=np.float32))  # type: ignore[arg-type]
    rest(stage.read())


def test_currents_are_contiguous_and_the_same_array_where_that_is() -> None:
    """What takes them reads four numbers one behind the other, whatever the strides."""
    table = np.arange(8.0).reshape(4, 2)
    assert motor_currents('i_d', table[:, 1]).strides == (8,)
    assert motor_currents('i_d', table[:, 1]).tolist() == [1.0, 3.0, 5.0, 7.0]
    assert motor_currents('i_d', ZERO) is ZERO


def test_without_fresh_currents_the_last_stay_for_a_while(stage: Stage) -> None:
    before = lift(stage)
    for _ in range(3):
        stage.hold()
        sample = stage.read()
        assert stage.flying
        assert np.all(sample.gap < before.gap)
        before = sample
    assert stage.fault is None


def test_without_fresh_currents_for_long_it_comes_down_with_a_fault(stage: Stage) -> None:
    lift(stage)
    come_to_rest(stage)
    fault = stage.fault
    assert fault is not None
    assert (fault.kind, fault.remedy) == ('stale', 'start the controller again')
    assert 'no fresh currents for' in str(fault)
    assert not lifts(stage)
    assert stage.reset() == (True, f'cleared: {fault.reason}')
    assert stage.fault is None
    assert lifts(stage)


def test_fresh_currents_that_answer_old_samples_are_no_fresh_ones(stage: Stage) -> None:
    lift(stage, 3)
    for age in (1, 2, 3, 4):
        stage.write(LIFTING, ZERO, age)
        stage.read()
        assert stage.flying
    assert stage.fault is None
    stage.write(LIFTING, ZERO, 6)
    assert stage.fault is not None
    assert (stage.fault.kind, stage.fault.reason) == ('stale', 'no fresh currents for 6 ms')
    come_to_rest(stage)
    assert not lifts(stage)


def test_a_stop_says_whose_fault_it_is(stage: Stage) -> None:
    lift(stage)
    stage.stop('it is mad', kind='controller', remedy='calm it')
    assert stage.fault is not None
    assert stage.fault[:3] == ('controller', 'it is mad', 'calm it')
    come_to_rest(stage)


def test_at_rest_it_needs_no_fresh_currents(stage: Stage) -> None:
    stage.read()
    stage.write(ZERO, ZERO)
    for _ in range(300):
        stage.hold()
        rest(stage.read())
    assert stage.fault is None
    assert stage.reset() == (False, 'there is no fault')


def test_landed_it_follows_nothing_until_a_reset(stage: Stage) -> None:
    lift(stage)
    stage.land('asked to')
    come_to_rest(stage)
    assert stage.fault is None
    assert not lifts(stage)
    assert stage.reset() == (True, 'follows the controller again')
    assert lifts(stage)


def test_stopped_it_comes_down_and_keeps_the_first_reason(stage: Stage) -> None:
    lift(stage)
    stage.stop()
    fault = stage.fault
    stage.stop('something else')
    assert stage.fault is fault
    assert fault is not None
    assert (fault.kind, fault.reason) == ('stop', 'emergency stop')
    come_to_rest(stage)
    stage.land('asked to')
    assert not lifts(stage)
    refused, why = stage.reset()
    assert not refused
    assert 'something else' in why
    assert stage.fault is fault
    assert stage.reset() == (True, 'cleared: emergency stop')
    assert lifts(stage)
    stage.stop('for a reason')
    assert 'for a reason' in str(stage.fault)


def test_deactivated_it_carries_no_current_and_can_be_activated_again(stage: Stage) -> None:
    lift(stage)
    stage.land('deactivated')
    come_to_rest(stage)
    stage.deactivate()
    assert not stage.flying
    stage.activate()
    rest(stage.read())
    assert lifts(stage)


def test_a_fault_outlives_a_deactivation(stage: Stage) -> None:
    stage.stop()
    stage.deactivate()
    if isinstance(stage, BridgeStage):  # where amplifiers would be enabled, it is refused
        with pytest.raises(StageError, match='a fault is latched'):
            stage.activate()
        assert stage.reset()[0]
        assert not stage.flying
        stage.activate()
        assert lifts(stage)
        return
    stage.activate()
    assert stage.fault is not None
    assert not lifts(stage)


def test_the_truth_is_of_the_sample_read_last(stage: Stage) -> None:
    truths = []
    for current in (LIFTING, LIFTING, FALLING):
        for _ in range(12):
            stage.write(current, ZERO)
            sample = stage.read()
            truth = stage.truth()
            assert truth is not None
            assert truth.state.shape == (10,)
            assert truth.state[0] == pytest.approx(np.mean(sample.gap), abs=1e-5)
            truths.append(truth)
            assert truth.own_length == pytest.approx([*sample.gap, sample.x, sample.z], abs=5.1e-6)
    assert [len(array) for array in truths[0][1:]] == [4, 4, 4, 6]
    assert truths[23].direct_current == pytest.approx(LIFTING, abs=2e-2)
    assert truths[35].direct_current == pytest.approx(FALLING, abs=2e-2)
    assert not truths[35].quadrature_current.any()
    assert np.all(truths[35].thermal_load > truths[0].thermal_load)
    assert truths[0].state[0] > truths[35].state[0]  # theirs to keep


def test_boards_that_are_real_do_not_know_the_truth() -> None:
    assert Flight(hover(0.025)).stage.truth() is None


def test_who_waits_and_who_comes_back() -> None:
    stages = {name: ready(name) for name in STAGES}
    assert [stage.paced for stage in stages.values()] == [False, True, True]
    assert [stage.restartable for stage in stages.values()] == [False, True, True]
    for stage in stages.values():
        stage.read()
        assert stage.sample_time == 1e-3
        assert 0.0 <= stage.late < 0.1
        stage.close()


def test_it_closes_twice(stage: Stage) -> None:
    stage.read()
    stage.close()
    stage.close()
    assert not stage.flying


def test_what_is_closed_gives_no_samples_of_boards() -> None:
    stage = ready('hw_bridge')
    stage.close()
    with pytest.raises(StageError, match='closed'):
        stage.read()


def test_the_same_flight_on_plant_and_boards() -> None:
    """Mean tracking errors within 10 %, with the same bandwidth of the amplifiers."""
    figures = {}
    for name in ('plant', 'hw_bridge'):
        stage, regulator = ready(name), Regulator(ControllerParameters())
        i_d, i_q = np.zeros(4), np.zeros(4)
        errors = []
        for k in range(4000):
            time = 1e-3 * k
            risen = min(time, 1.0)
            lift = risen**3 * (10.0 - 15.0 * risen + 6.0 * risen**2)
            angle = 4.71238898038469 * time
            wave = 0.03 * lift * np.sin([angle, angle + 1.5])
            y = 0.031 - 0.006 * lift + 0.004 * lift * np.sin(angle)
            position = np.array([y, *wave, 0.0, 0.0])
            slope = np.array([0.004, 0.03, 0.03]) * lift * 4.71238898038469
            velocity = np.zeros(5)
            velocity[:3] = slope * np.cos([angle, angle, angle + 1.5])
            regulator.step(*stage.read(), position, velocity, np.zeros(5), i_d, i_q)
            stage.write(i_d, i_q)
            errors.append(np.abs(regulator.error[:3]))
        figures[name] = np.mean(errors[2500:], axis=0)
        stage.close()
    assert figures['hw_bridge'] == pytest.approx(figures['plant'], rel=0.1)
