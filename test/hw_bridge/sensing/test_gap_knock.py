"""Gaps are asked whether they count: what that finds, and what it costs a sound machine."""

from __future__ import annotations

import bridge_flight
import numpy as np
import pytest
from bridge_flight import Flight, hover
from hovering import Hover
from rough import PARAMS

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing.gap_knock import GapKnock
from maglev_hw_bridge.sensing.guard_arrays import LOST, GuardArrays
from maglev_hw_bridge.stage import Mode
from maglev_model.axes import FloatArray, Y
from maglev_model.machine import machine_constants
from maglev_model.parameters import build, from_yaml, read_yaml
from maglev_model.platen import gaps_from_outputs, output_accelerations

UNLIKE = {'emulation.seed': 3, 'effects.motor.spread': 0.03, 'effects.sensor.random_phase': True}
TWO = [(0, 1), (1, 2), (2, 3), (0, 3), (0, 2), (1, 3)]
THREE = [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)]
ALL = (0, 1, 2, 3)
PATIENCE = 30  # [samples]
HARDEST = 4.6  # 2 (0.8 + 2.4 * 10 um / (4 ms)^2) [m/s²]


def unlike(silence: float = 0.03) -> Flight:
    """Hovers on motors that are unlike; its encoders switch at places of their own."""
    flight = Flight(hover(0.025), {**UNLIKE, 'fault.gap_silence': silence})
    flight.run(700)
    assert flight.stage.fault is None
    return flight


def gaps(flight: Flight) -> FloatArray:
    """True gaps (4,) [m]."""
    found = np.empty(4)
    machine = machine_constants(flight.stage.parameters.machine)
    gaps_from_outputs(machine, np.array(flight.rig.state[::2]), found)
    return found


@pytest.mark.parametrize('stuck', [*TWO, *THREE, ALL])
def test_those_that_do_not_answer_are_named_while_the_platen_is_where_it_was(
    stuck: tuple[int, ...],
) -> None:
    flight = unlike()
    before = gaps(flight)
    flight.boards.stuck[list(stuck)] = True
    for _ in range(200):
        if flight.stage.fault is None:
            flight.step()
    assert flight.stage.fault is not None
    names = ', '.join(f'gap {i + 1}' for i in stuck)
    assert flight.stage.fault.reason.startswith(f'encoder {names} is stuck')
    assert np.max(np.abs(gaps(flight) - before)) < 1e-4
    if stuck == ALL:  # nobody sees the way down
        assert flight.stage.mode is Mode.DISABLED
        return
    flight.rig.forget_impact()
    flight.until_no_current()
    flight.run(200)
    assert flight.rig.impact < 0.03


@pytest.mark.parametrize('stuck', [THREE[0], ALL])
def test_never_asked_they_are_not_found_out_and_the_platen_wanders(stuck: tuple[int, ...]) -> None:
    flight = unlike(silence=0.0)
    before = gaps(flight)
    flight.boards.stuck[list(stuck)] = True
    flight.run(1500)
    assert flight.stage.fault is None
    assert np.max(np.abs(gaps(flight) - before)) > 3e-4


def asked_of(flight: Flight, samples: int) -> tuple[int, float, float]:
    """How often it is asked, how far y comes from its mean, and how far at rms [m]."""
    times, asked, y = 0, False, []
    for _ in range(samples):
        flight.step()
        assert flight.stage.fault is None
        under_way = flight.stage._gap_knock._pushes.under_way
        times, asked = times + int(under_way and not asked), under_way
        y.append(float(flight.rig.state[0]))
    away = np.array(y) - np.mean(y)
    return times, float(np.abs(away).max()), float(away.std())


@pytest.mark.parametrize('friction', [0.2, 1.0, 3.0])
@pytest.mark.parametrize('y', [0.019, 0.030])
def test_sound_ones_answer_and_are_asked_ever_less(y: float, friction: float) -> None:
    coulomb = friction * np.array((0.303, 0.171, 0.149, 1.32, 1.32))
    flight = Flight(hover(y), {**UNLIKE, 'emulation.guide.coulomb': coulomb.tolist()})
    flight.run(300)
    first, farthest, _ = asked_of(flight, 1500)
    assert 0 < first <= 6
    assert farthest < 1.8e-5
    later, farthest, rms = asked_of(flight, 3000)
    assert later <= 5
    assert farthest < 1.8e-5
    assert rms < 5e-6


@pytest.mark.parametrize('seed', [1, 2])
@pytest.mark.parametrize('friction', ['lugre', 'coulomb', 'tanh'])
def test_sound_ones_of_the_rough_machine_answer(
    seed: int, friction: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    regulator = Regulator(from_yaml(ControllerParameters, 'controller', PARAMS / 'rough.yaml'))
    monkeypatch.setattr(bridge_flight, '_regulator', lambda: regulator)
    rough = read_yaml(PARAMS / 'rough.yaml', 'hw_bridge')
    overrides = {**rough, 'emulation.seed': seed, 'effects.friction.model': friction}
    flight = Flight(hover(0.0223), overrides)
    flight.run(500)
    times, farthest, rms = asked_of(flight, 2500)
    assert times <= 7
    assert farthest < 3e-5
    assert rms < 5e-6


# -- sample by sample ------------------------------------------------------------------------------


def asked(silent: dict[int, int], **overrides: object) -> tuple[GapKnock, GuardArrays]:
    """All gaps, and what they are watched by; those are ``silent`` for so many samples."""
    named = {name.replace('__', '.'): value for name, value in overrides.items()}
    watched: GuardArrays = Hover().watched
    watched.silent[:] = 0
    for gap, samples in silent.items():
        watched.silent[gap] = samples
    return GapKnock(build(BridgeParameters, named)), watched


def begins(asking: GapKnock, watched: GuardArrays, *, flying: bool = True) -> bool:
    assert asking.look(watched, flying) == ()
    return asking._pushes.under_way


def answer(asking: GapKnock, watched: GuardArrays) -> None:
    """All count at once, and it is pushed back."""
    watched.silent[:] = 0
    while asking._pushes.under_way:
        assert asking.look(watched, True) == ()


@pytest.mark.parametrize('late', [-1, 0, 1])
@pytest.mark.parametrize('pair', TWO)
def test_two_are_asked_when_they_have_been_silent_for_long_twice_as_long_face_to_face(
    pair: tuple[int, int], late: int
) -> None:
    patience = PATIENCE * (2 if pair in ((0, 2), (1, 3)) else 1)
    asking, watched = asked({pair[0]: patience + late, pair[1]: patience})
    assert begins(asking, watched) == (late >= 0)


@pytest.mark.parametrize('three', THREE)
def test_three_are_asked_as_soon_as_neighbours(three: tuple[int, ...]) -> None:
    assert begins(*asked(dict.fromkeys(three, PATIENCE)))


@pytest.mark.parametrize('gap', ALL)
def test_one_is_not_for_the_others_tell(gap: int) -> None:
    assert not begins(*asked({gap: 10**6}))


def test_x_and_z_are_no_gaps() -> None:
    assert not begins(*asked({3: 1000, 4: 1000, 5: 1000}))


def test_who_is_lost_is_not_asked() -> None:
    asking, watched = asked({0: 1000, 1: 1000})
    watched.trust[0] = LOST
    assert not begins(asking, watched)


def test_with_no_silence_that_is_too_long_it_is_never_asked() -> None:
    assert not begins(*asked(dict.fromkeys(ALL, 10**6), fault__gap_silence=0.0))


def test_each_answer_doubles_the_patience_with_such_and_no_others_up_to_a_bound() -> None:
    asking, watched = asked({})
    for times in range(10):
        expected = PATIENCE * min(2**times, 128)
        assert (asking.patience(False), asking.patience(True)) == (expected, 2 * PATIENCE)
        watched.silent[:2] = expected
        assert begins(asking, watched)
        answer(asking, watched)
    watched.silent[[1, 3]] = 2 * PATIENCE
    assert begins(asking, watched)
    answer(asking, watched)
    assert (asking.patience(False), asking.patience(True)) == (128 * PATIENCE, 4 * PATIENCE)


def test_with_the_flight_it_ends_and_is_forgotten() -> None:
    asking, watched = asked({0: PATIENCE, 1: PATIENCE})
    assert begins(asking, watched)
    answer(asking, watched)
    watched.silent[:2] = 2 * PATIENCE
    assert begins(asking, watched)
    assert not begins(asking, watched, flying=False)
    assert asking.patience(False) == PATIENCE
    watched.silent[:] = 0
    assert not begins(asking, watched)


def test_three_times_to_and_fro_and_a_wait_then_it_is_told_who_did_not_count_since() -> None:
    asking, watched = asked({0: PATIENCE, 1: PATIENCE, 2: 5, 3: 5})
    assert begins(asking, watched)
    pushes, found = [], []
    for sample in range(28):
        pushes.append(asking._pushes.acceleration)
        watched.silent[:4] += 1
        if sample == 10:
            watched.silent[3] = 0
        found.append(asking.look(watched, True))
    hard = [HARDEST / 4.0, HARDEST / 2.0, HARDEST]
    to_and_fro = [push for a in hard for push in (a, a, a, a, -a, -a, -a, -a)]
    assert pushes == pytest.approx(to_and_fro + [0.0] * 4)
    assert found == [()] * 27 + [(0, 1, 2)]
    assert not asking._pushes.under_way


def test_it_goes_on_until_all_that_were_silent_have_counted() -> None:
    asking, watched = asked({0: PATIENCE, 1: PATIENCE, 2: PATIENCE})
    assert begins(asking, watched)
    for sample in range(1, 15):
        watched.silent[:3] += 1
        if sample in (2, 5, 11):  # gap 2 at last
            watched.silent[[0, 2, 1][(2, 5, 11).index(sample)]] = 0
        assert asking.look(watched, True) == ()
        assert asking._pushes.under_way == (sample < 14), sample


def test_what_is_added_accelerates_y_by_as_much_and_takes_no_quadrature_current() -> None:
    asking, watched = asked({0: PATIENCE, 1: PATIENCE})
    watched.position[:] = [0.022, 0.01, -0.02, 1e-3, -2e-3]
    i_d, i_q = np.array([0.3, -0.2, 0.5, 0.1]), np.array([0.1, 0.2, -0.3, 0.4])
    assert asking.added(watched, i_d, i_q) is i_d
    assert begins(asking, watched)
    given = i_d.copy()
    added = asking.added(watched, i_d, i_q)
    assert np.array_equal(i_d, given)
    assert np.ptp(added - i_d) < 1e-12
    machine = machine_constants(BridgeParameters().machine)
    y, phi, theta = watched.position[[0, 3, 4]]

    def along_y(direct: FloatArray) -> float:
        return float(output_accelerations(machine, y, phi, theta, direct, i_q)[Y])

    step = 1e-4 * (added - i_d)  # the attraction is a square: by its slope where it is
    slope = (along_y(i_d + step) - along_y(i_d - step)) / 2e-4
    assert slope == pytest.approx(HARDEST / 4.0, rel=1e-6)


def test_as_much_as_the_motors_have_is_not_too_much() -> None:
    asking, watched = asked({0: PATIENCE, 1: PATIENCE})
    assert begins(asking, watched)
    i_d, i_q = np.array([-3.0, -0.1, -0.1, -0.1]), np.array([4.0, 0.0, 0.0, 0.0])
    most = float(np.max(np.hypot(asking.added(watched, i_d, i_q), i_q)))
    asking._limit = most
    assert asking.added(watched, i_d, i_q) is not i_d
    asking._limit = np.nextafter(most, 0.0)
    assert asking.added(watched, i_d, i_q) is i_d
    assert not asking._pushes.under_way
