"""The simulated stage against SciPy's integrator and against motions known in closed form."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from paper_motor import L_h, L_v1, L_v2, L_v3, vertical_force
from scipy.integrate import DOP853

from maglev_model.compiled import compiled
from maglev_model.contract.stage import EncoderSample
from maglev_model.machine import Machine, MachineParameters, machine_constants
from maglev_model.motor import attraction_coefficients, force_coefficients
from maglev_model.parameters import build, read_yaml
from maglev_plant.dynamics import advance
from maglev_plant.encoder import encode
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage, simulate

FloatArray = NDArray[np.float64]
IDEAL = read_yaml(Path(__file__).resolve().parents[2] / 'params' / 'ideal.yaml', 'plant')
M = machine_constants(MachineParameters())
W = 1.5 * math.pi
ZERO = np.zeros(4)
CENTRE = np.array([0.025, 0.0, 0.0, 0.0, 0.0])
COSINE = np.array([-0.003, -0.03, 0.0, 0.0, 0.0])
SINE = np.array([0.0, 0.0, 0.03, 0.001, 0.01])


def _stage(**overrides: object) -> SimulatedStage:
    named = {name.replace('__', '.'): value for name, value in overrides.items()}
    return SimulatedStage(build(PlantParameters, {**IDEAL, **named}))


@compiled
def _feedback(m: Machine, time: float, state: FloatArray, currents: FloatArray) -> None:
    """Exact linearisation around a path of all axes; ``currents`` i_d, then i_q, is written."""
    cos, sin = math.cos(W * time), math.sin(W * time)
    w = np.empty(5)
    for axis in range(5):
        position = CENTRE[axis] + COSINE[axis] * cos + SINE[axis] * sin
        velocity = W * (SINE[axis] * cos - COSINE[axis] * sin)
        error, rate = state[2 * axis] - position, state[2 * axis + 1] - velocity
        w[axis] = -400.0 * error - 40.0 * rate
    lift = m.M_y * (w[0] - m.G) / 4.0
    phi = m.I_x * (w[3] + m.k_s_phi * state[6]) / (2.0 * m.r)
    theta = m.I_x * (w[4] + m.k_s_theta * state[8]) / (2.0 * m.r)
    force = np.array([lift - phi, lift + theta, lift + phi, lift - theta])
    gap = state[0] + m.r * np.array(
        [-math.sin(state[6]), math.sin(state[8]), math.sin(state[6]), -math.sin(state[8])]
    )
    for i in range(4):
        a, b, k_h = attraction_coefficients(m, gap[i])
        i_q = -m.M_z * w[2] / (2.0 * k_h) if i % 2 == 0 else -m.M_x * w[1] / (2.0 * k_h)
        currents[i] = (a - math.sqrt(-force[i] - (b * i_q) ** 2)) / b
        currents[4 + i] = i_q


@compiled
def _printed_dynamics(m: Machine, s: FloatArray, c: FloatArray) -> FloatArray:
    """(6), (7) summed motor by motor from the printed L functions, for the reference integrator."""
    gap = s[0] + m.r * np.array([-math.sin(s[6]), math.sin(s[8]), math.sin(s[6]), -math.sin(s[8])])
    down, along = np.empty(4), np.empty(4)
    for i in range(4):
        down[i] = -m.K_v1 / m.M_y * L_v1(m, gap[i]) + m.K_v2 / m.M_y * L_v2(m, gap[i]) * c[i]
        down[i] -= m.K_v3 / m.M_y * L_v3(m, gap[i]) * (c[i] ** 2 + c[4 + i] ** 2)
        along[i] = L_h(m, gap[i]) * c[4 + i]
    rate = np.empty(10)
    rate[0::2] = s[1::2]
    rate[1] = m.G + down.sum()
    rate[3] = -m.K_h / m.M_x * (along[1] + along[3])
    rate[5] = -m.K_h / m.M_z * (along[0] + along[2])
    rate[7] = m.k_rot * (down[2] - down[0]) - m.k_s_phi * s[6]
    rate[9] = m.k_rot * (down[1] - down[3]) - m.k_s_theta * s[8]
    return rate


def test_ten_seconds_agree_with_an_adaptive_integrator_of_eighth_order() -> None:
    """Both loops close at 1 kHz over a zero-order hold; every axis moves, all terms matter."""
    position = CENTRE + COSINE
    stage = _stage(initial__position=position.tolist(), initial__velocity=(W * SINE).tolist())
    reference = stage.state
    ours, theirs = np.empty(8), np.empty(8)
    worst = 0.0
    for k in range(10_000):
        stage.read()
        state = stage.state
        worst = max(worst, float(np.max(np.abs(state[::2] - reference[::2]))))
        _feedback(M, k * 1e-3, state, ours)
        stage.write(ours[:4], ours[4:])
        _feedback(M, k * 1e-3, reference, theirs)
        solver = DOP853(
            lambda _, s: _printed_dynamics(M, s, theirs),
            0.0,
            reference,
            1e-3,
            rtol=1e-12,
            atol=1e-14,
            first_step=1e-3,
        )
        while solver.status == 'running':
            solver.step()
        assert solver.status == 'finished'
        reference = solver.y
    assert worst < 1e-9


def test_the_integrator_is_of_fourth_order() -> None:
    ends = []
    for substeps in (4, 8, 16, 128):
        stage = _stage(
            substeps=substeps, sample_time=0.01, initial__position=(0.025, 0, 0, 0.002, 0.005)
        )
        stage.write(np.full(4, 0.37), np.array([0.2, -0.1, 0.2, 0.3]))
        for _ in range(5):
            stage.read()
        ends.append(stage.state)
    errors = [float(np.max(np.abs(end - ends[-1]))) for end in ends[:-1]]
    for coarse, fine in pairwise(errors):
        assert coarse / fine == pytest.approx(16.0, rel=0.3)


def test_the_first_read_is_the_initial_state_and_writes_hold_until_the_next() -> None:
    start = (0.025, 0.0, 0.0, 0.0, 0.0)
    stage = _stage(initial__position=start, guide__locked=(True, False, True, True, True))
    stage.write(ZERO, [0.0, 1.0, 0.0, 1.0])
    sample = stage.read()
    assert isinstance(sample, EncoderSample)
    assert (sample.x, stage.sequence) == (0.0, 0)
    _, _, _, k_h = force_coefficients(M, 0.025)
    push = -2.0 * k_h / M.M_x
    for k in range(1, 6):
        assert stage.read().x == pytest.approx(0.5 * push * (k * 1e-3) ** 2, rel=1e-12)
    stage.write(ZERO, ZERO)
    before = stage.state
    assert stage.read().x == pytest.approx(before[2] + before[3] * 1e-3, rel=1e-12)
    assert stage.sequence == 6


@pytest.mark.parametrize(
    ('i_d', 'i_q', 'message'),
    [
        ([0.0, math.nan, 0.0, 0.0], ZERO, 'direct_current of motor 2 is nan'),
        (ZERO, np.array([0.0, 0.0, 0.0, -math.inf]), 'quadrature_current of motor 4 is -inf'),
        (np.zeros(3), ZERO, r'direct_current must have shape \(4,\)'),
        (ZERO, np.zeros((4, 1)), r'quadrature_current must have shape \(4,\)'),
        (ZERO, 'full', 'quadrature_current must be four numbers'),
        (None, ZERO, 'direct_current'),
    ],
)
def test_bad_currents_are_refused_and_the_last_good_ones_held(
    i_d: object, i_q: object, message: str
) -> None:
    stage = _stage()
    stage.write([0.1] * 4, [0.2] * 4)
    with pytest.raises(ValueError, match=message):
        stage.write(i_d, i_q)  # type: ignore[arg-type]
    stage.read()
    stage.read()
    assert list(stage.direct_current) == [0.1] * 4
    assert list(stage.quadrature_current) == [0.2] * 4


def test_written_arrays_may_be_reused() -> None:
    stage = _stage()
    written = np.full(4, 0.1)
    stage.write(written, written)
    written[:] = 9.0
    stage.read()
    stage.read()
    assert list(stage.direct_current) == [0.1] * 4


def test_locked_axes_keep_their_place_and_others_move() -> None:
    stage = _stage(
        initial__position=(0.025, 0.01, -0.02, 0.001, 0.002),
        initial__velocity=(0.1, 0.1, 0.1, 0.1, 0.1),
        guide__locked=(True, False, True, True, False),
    )
    stage.write([1.0, 2.0, -1.0, 0.0], [1.0] * 4)
    for _ in range(20):
        stage.read()
    state = stage.state
    assert list(state[[0, 4, 6]]) == [0.025, -0.02, 0.001]
    assert not state[[1, 5, 7]].any()
    assert state[2] != 0.01
    assert state[8] != 0.002


def test_friction_stops_a_sliding_platen_where_it_should() -> None:
    """Coulomb friction alone takes v²/2f of way (less tanh's tail), viscous alone v/c."""
    sliding = {
        'initial__position': (0.025, 0.0, 0.0, 0.0, 0.0),
        'initial__velocity': (0.0, 0.1, 0.1, 0.0, 0.0),
        'guide__locked': (True, False, False, True, True),
    }
    stage = _stage(
        guide__coulomb=(0.0, 0.5, 0.0, 0.0, 0.0), guide__viscous=(0, 0, 5.0, 0, 0), **sliding
    )
    for _ in range(2001):
        stage.read()
    assert stage.state[2] == pytest.approx(0.1**2 / (2 * 0.5), rel=0.01)
    assert stage.state[4] == pytest.approx(0.1 / 5.0 * -math.expm1(-10.0), rel=1e-9)


@pytest.mark.parametrize(('axis', 'mass'), [(1, 10.6), (2, 8.6)])
def test_disturbances_push_as_forces_on_the_axis_mass(axis: int, mass: float) -> None:
    constant, amplitude = np.zeros(5), np.zeros(5)
    constant[axis], amplitude[axis] = 0.5, 2.0
    stage = _stage(
        initial__position=(0.025, 0.0, 0.0, 0.0, 0.0),
        guide__locked=tuple(i != axis for i in range(5)),
        disturbance__constant=constant.tolist(),
        disturbance__amplitude=amplitude.tolist(),
        disturbance__frequency=(3.0,) * 5,
        disturbance__phase=(0.4,) * 5,
    )
    for _ in range(301):
        stage.read()
    t, w, p = 0.3, 6.0 * math.pi, 0.4
    wave = (math.sin(p) - math.sin(w * t + p)) / w**2 + t * math.cos(p) / w
    assert stage.state[2 * axis] == pytest.approx((0.25 * t**2 + 2.0 * wave) / mass, rel=1e-9)


def test_disturbances_lift_and_tilt() -> None:
    """A downward force that a motor force balances exactly leaves the platen where it is."""
    weight_share = -vertical_force(M, 0.025, 0.0, 0.0)
    hold = 4.0 * weight_share - M.M_y * M.G
    torque = M.k_s_theta * 0.005 * M.I_x
    torque -= M.r * (
        vertical_force(M, 0.025 + M.r * math.sin(0.005), 0.0, 0.0)
        - vertical_force(M, 0.025 - M.r * math.sin(0.005), 0.0, 0.0)
    )
    level = _stage(initial__position=CENTRE.tolist(), disturbance__constant=(hold, 0, 0, 0, 0))
    tilted = _stage(
        initial__position=(0.025, 0, 0, 0, 0.005),
        guide__locked=(True, False, False, False, False),
        disturbance__constant=(0, 0, 0, 0, torque),
    )
    for _ in range(51):
        level.read()
        tilted.read()
    assert level.state == pytest.approx([0.025] + [0.0] * 9, abs=1e-13)
    assert tilted.state[8] == pytest.approx(0.005, abs=1e-13)


def test_offsets_scale_the_forces_felt() -> None:
    free = {
        'initial__position': (0.025, 0.0, 0.0, 0.0, 0.0),
        'guide__locked': (True, False, False, True, True),
    }
    places = []
    for offsets in ({}, {'offset__K_h': 1.2}, {'offset__mass_x': 1.25}):
        stage = _stage(**free, **offsets)
        stage.write(ZERO, [1.0] * 4)
        for _ in range(11):
            stage.read()
        places.append(stage.state[[2, 4]])
    assert places[1] / places[0] == pytest.approx([1.2, 1.2], rel=1e-9)
    assert places[2] / places[0] == pytest.approx([0.8, 1.0], rel=1e-9)


def test_two_runs_are_bit_identical_also_when_configured_anew() -> None:
    noisy = build(PlantParameters, {'encoder.gap_noise': 3e-6, 'seed': 5})

    def law(sample: EncoderSample) -> tuple[FloatArray, FloatArray]:
        return np.asarray(-0.3 + 20.0 * (sample.gap - 0.028)), np.full(4, 0.5 - sample.x)

    first, second = simulate(noisy, law, 0.3), simulate(noisy, law, 0.3)
    for one, other in zip(first, second, strict=True):
        assert np.array_equal(one, other)
    assert first.time[-1] == pytest.approx(0.3)
    assert np.ptp(first.state[:, 0]) > 1e-4
    stage = SimulatedStage(noisy)
    for _ in range(2):
        for k in range(50):
            sample = stage.read()
            assert np.array_equal(sample.gap, first.measured[k, :4])
            assert np.array_equal(stage.state, first.state[k])
            stage.write(*law(sample))
        stage.configure()
        assert not stage.direct_current.any()


def test_compiled_loops_do_what_read_and_write_do() -> None:
    arrays = _stage().arrays
    arrays.command[:] = [-0.3] * 4 + [0.1] * 4
    for _ in range(30):
        advance(arrays.block)
    encode(arrays.block)
    stage = _stage()
    stage.write([-0.3] * 4, [0.1] * 4)
    for _ in range(31):
        sample = stage.read()
    assert list(arrays.reading) == [*sample.gap, sample.x, sample.z]


def test_closing_takes_the_currents_away() -> None:
    stage = _stage()
    stage.write([0.5] * 4, [0.5] * 4)
    stage.close()
    stage.close()
    stage.read()
    stage.read()
    assert not stage.direct_current.any()
    assert not stage.quadrature_current.any()


def test_the_watchdog_counts_stage_time_since_fresh_currents() -> None:
    stage = _stage(watchdog=0.05)
    stage.write([0.1] * 4, ZERO)
    for _ in range(50):
        stage.hold()
    assert stage.fault is None
    stage.write([0.1] * 4, ZERO)  # fresh, though nothing has changed
    for _ in range(50):
        stage.hold()
    assert stage.flying
    assert stage.fault is None
    stage.hold()
    assert stage.fault is not None
    assert stage.fault.reason == 'no fresh currents for 51 ms'
    assert not stage.flying
    stage.write([0.1] * 4, ZERO)
    assert not stage.flying


def test_configured_anew_it_has_no_fault() -> None:
    stage = _stage()
    stage.stop()
    stage.configure()
    assert stage.fault is None
    stage.write([0.1] * 4, ZERO)
    assert stage.flying
