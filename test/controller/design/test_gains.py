"""Gains against python-control, against the published ones, and what is refused."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_controller.design.axis_design import AxisDesign, following_gain
from maglev_controller.design.gains import (
    Weights,
    augmented,
    augmented_discrete,
    bandwidth_weights,
    dlqr,
    lqr,
    place,
    split_phase,
)
from maglev_controller.design.internal_model import InternalModel, internal_model
from maglev_controller.laws.output_regulator import design as design_axis
from maglev_controller.parameters import ControllerParameters
from maglev_model.parameters import ParameterError, build

OMEGA = 1.5 * np.pi
PERIOD = 1e-3
PUBLISHED = {
    'y': ([-173.2, -2.61, -2.61, -2.16, -2.16], [0.0, 5.48, -5.48, 1.77, -1.77]),
    'x': ([-38.73, -3.2, -3.2, -2.69, -2.69], [0.0, 5.89, -5.89, 2.23, -2.23]),
    'theta': ([-200.0, -2.81, -2.81, -2.19, -2.19], [0.0, 5.58, -5.58, 1.82, -1.82]),
}
WEIGHTS = {'design': 'lqr_discrete', 'weight_error': 1.6e9, 'weight_rate': 8e4}
LQR = {
    'y': ((3e4, 3e4, 2.5e9, 2.5e7, 2.5e7), (-1699.7, -182.75, -50000.0, 2725.0, -7807.0)),
    'x': ((1.5e3, 1.5e3, 4.5e8, 2.25e6, 2.25e6), (-525.3, -50.5, -21213.0, -1254.0, -2742.0)),
    'theta': ((4e4, 4e4, 4e9, 4e7, 4e7), (-2050.0, -210.0, -63246.0, 1911.0, -9901.0)),
}


def sorted_poles(poles: np.ndarray) -> np.ndarray:
    """By real, then by imaginary part."""
    return np.array(sorted(poles, key=lambda p: (round(p.real, 4), round(p.imag, 4))))


def feedback(design: AxisDesign) -> np.ndarray:
    """K of (16), without Γ."""
    assert design.model is not None
    gain = design.gain.copy()
    gain[2:] -= design.model.output
    return gain


def axis_parameters(**overrides: object) -> ControllerParameters:
    """Defaults but for parameters of the y axis and, with a double underscore, of groups."""
    return build(
        ControllerParameters,
        {k.replace('__', '.') if '__' in k else f'y.{k}': v for k, v in overrides.items()},
    )


def closed_loop_poles(model: InternalModel, gain: np.ndarray) -> np.ndarray:
    """Poles of the continuous closed loop of (13), (14), (16)."""
    state, drive = augmented(model)
    return np.linalg.eigvals(state + np.outer(drive, gain))


@pytest.mark.parametrize('axis', list(LQR))
def test_published_weights_give_the_published_poles_and_gains(axis: str) -> None:
    """The LQR weights behind the paper's poles, and the gains of both."""
    weights, wanted = LQR[axis]
    model = internal_model([0.0, OMEGA], 'companion')
    gain = lqr(model, Weights(weights[0], weights[1], weights[2:], 1.0))
    total = gain.copy()
    total[2] += 1.0  # Γ
    np.testing.assert_allclose(total, wanted, rtol=3e-5, atol=0.6)
    poles = np.array(PUBLISHED[axis][0]) + 1j * np.array(PUBLISHED[axis][1])
    reached = closed_loop_poles(model, gain)
    np.testing.assert_allclose(sorted_poles(reached), sorted_poles(poles), atol=8e-3)
    # Poles printed to two decimals fix the gains only so far.
    placed = place(model, poles)
    placed[2] += 1.0
    np.testing.assert_allclose(placed, wanted, rtol=2.5e-2)


@pytest.mark.parametrize('form', ['companion', 'modal'])
@pytest.mark.parametrize('axis', list(PUBLISHED))
def test_placement_agrees_with_python_control(form: str, axis: str) -> None:
    """Same gain as Ackermann's and the robust algorithm find, both with Γξ in the plant."""
    model = internal_model([0.0, OMEGA], form)
    state, drive = augmented(model)
    poles = np.array(PUBLISHED[axis][0]) + 1j * np.array(PUBLISHED[axis][1])
    gain = place(model, poles)
    scale = np.abs(gain).max()
    np.testing.assert_allclose(
        gain, -control.place(state, drive[:, None], poles)[0], atol=1e-8 * scale
    )
    ackermann = np.asarray(control.acker(state, drive[:, None], poles)).ravel()
    np.testing.assert_allclose(gain, -ackermann, atol=1e-6 * scale)


@settings(max_examples=40)
@given(
    multiples=st.lists(st.integers(0, 6), max_size=6, unique=True),
    spread=st.floats(0.5, 3.0),
    data=st.data(),
)
def test_any_poles_are_reached(multiples: list[int], spread: float, data: st.DataObject) -> None:
    """The characteristic polynomial of the closed loop vanishes at every wanted pole."""
    model = internal_model([m * OMEGA for m in multiples], 'modal')
    size = model.order + 2
    pairs = data.draw(st.integers(0, size // 2))
    imaginary = [data.draw(st.floats(0.1, 30.0)) for _ in range(pairs)]
    real = [-spread * (k + 1.0) for k in range(size - pairs)]
    poles = np.array(real, dtype=complex)
    poles[:pairs] += 1j * np.array(imaginary)
    poles = np.concatenate((poles, poles[:pairs].conj()))
    state, drive = augmented(model)
    closed = state + np.outer(drive, place(model, poles))
    for pole in poles:
        shifted = pole * np.eye(size) - closed
        assert np.linalg.svd(shifted)[1][-1] < 1e-7 * np.linalg.norm(shifted)


@pytest.mark.parametrize('form', ['companion', 'modal'])
def test_lqr_and_dlqr_agree_with_python_control(form: str) -> None:
    """Continuous and discrete gains, the discrete one also with all harmonics."""
    model = internal_model([0.0, OMEGA], form)
    per_mode = (4e8, 2e6) if form == 'modal' else (4e8, 2e6, 2e6)
    cost = np.diag([1.5e3, 1.5e3, 4e8, 2e6, 2e6])
    weights = Weights(1.5e3, 1.5e3, per_mode, 1.0)
    state, drive = augmented(model)
    wanted = -control.lqr(state, drive[:, None], cost, np.eye(1))[0][0]
    np.testing.assert_allclose(lqr(model, weights), wanted, rtol=1e-6)
    state, drive = augmented_discrete(model, PERIOD)
    wanted = -control.dlqr(state, drive[:, None], cost, np.eye(1))[0][0]
    np.testing.assert_allclose(dlqr(model, weights, PERIOD), wanted, rtol=1e-6)


def test_the_default_gain_is_python_controls() -> None:
    """13 states, eleven of them on the unit circle in open loop; its oscillators then turned."""
    design = design_axis(ControllerParameters(), 'y')
    assert design.model is not None
    state, drive = augmented_discrete(design.model, PERIOD)
    own = ControllerParameters().y
    fourth = own.bandwidth**4
    integrator, oscillators = fourth * own.integration**2, fourth * own.learning**2
    cost = np.diag([fourth, 2.0 * own.bandwidth**2, integrator] + [oscillators] * 10)
    wanted = -control.dlqr(state, drive[:, None], cost, np.eye(1))[0][0]
    untouched = design_axis(axis_parameters(internal_model__rest='hold'), 'y')
    np.testing.assert_allclose(feedback(untouched), wanted, rtol=1e-4, atol=10.0)
    np.testing.assert_allclose(feedback(design)[:3], wanted[:3], rtol=1e-5)


def test_three_numbers_stand_for_the_weights() -> None:
    """The gain of the design 'bandwidth' is that of its weights given one by one."""
    three = axis_parameters(design='bandwidth', bandwidth=150.0, integration=60.0, learning=5.0)
    weights = axis_parameters(
        design='lqr_discrete',
        weight_error=150.0**4,
        weight_rate=2.0 * 150.0**2,
        weight_model=(150.0**4 * 60.0**2, 150.0**4 * 5.0**2),
        weight_effort=1.0,
    )
    np.testing.assert_array_equal(design_axis(three, 'y').gain, design_axis(weights, 'y').gain)


@pytest.mark.parametrize('bandwidth', [20.0, 200.0])
def test_bandwidth_is_where_the_poles_are(bandwidth: float) -> None:
    """Without an internal model both continuous poles are at -W."""
    model = internal_model([], 'modal')
    poles = closed_loop_poles(model, lqr(model, bandwidth_weights(bandwidth, 90.0, 10.0)))
    np.testing.assert_allclose(poles, -bandwidth, rtol=1e-6)


def test_split_phase_turns_every_oscillator_half_the_way() -> None:
    """By the residue at its pole, against the axis' answer without friction and with very steep."""
    model = internal_model([0.0, OMEGA, 3.0 * OMEGA], 'modal')
    gain = dlqr(model, Weights(1e8, 2e4, (1e12, 1e10), 1.0), PERIOD)
    turned = split_phase(model, gain)
    np.testing.assert_array_equal(turned[:3], gain[:3])
    for omega in model.frequencies[1:]:
        near = (1j * omega + 1e-6) * np.eye(5) - model.state
        modes = np.linalg.solve(near, model.input)
        before, after = ((k[2:] + model.output) @ modes for k in (gain, turned))
        moving, standing = (
            1.0 / (-gain[0] - omega**2 + 1j * omega * (friction - gain[1]))
            for friction in (0.0, 1e12)
        )
        turn = np.angle(after / before)
        assert turn == pytest.approx(0.5 * np.angle(moving / standing), abs=1e-4)
        assert abs(after) == pytest.approx(abs(before), rel=1e-5)


def test_discrete_model_is_the_sampled_continuous_one() -> None:
    """e and ė by python-control's zero-order hold; ξ by its own, driven by the sampled e."""
    model = internal_model([0.0, OMEGA], 'companion')
    state, drive = augmented_discrete(model, PERIOD)
    integrator = control.c2d(control.ss([[0, 1], [0, 0]], [[0], [1]], np.eye(2), 0), PERIOD, 'zoh')
    np.testing.assert_allclose(state[:2, :2], integrator.A)
    np.testing.assert_allclose(drive[:2], integrator.B[:, 0])
    np.testing.assert_allclose(state[:2, 2:], np.outer(integrator.B[:, 0], model.output))
    assert not drive[2:].any()


def test_without_an_antiwindup_observer_the_axis_speed_and_sample_time_are_named() -> None:
    """Of two undamped oscillators nobody sees the second."""
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    two = np.kron(np.eye(2), turn)
    with pytest.raises(ParameterError, match=r'phi: no anti-windup .* 1e-08 rad/s .* 0.001 s'):
        following_gain(two, np.array([1.0, 0.0, 0.0, 0.0]), PERIOD, 1e-8, 'phi')


def test_antiwindup_observer_lets_go_and_does_not_ring() -> None:
    """Φ_d − E κ is stable, faster for a larger speed."""
    design = design_axis(ControllerParameters(), 'x')
    slowest = []
    for speed in (1.0, 10.0):
        gain = following_gain(design.transition, design.gain[2:], PERIOD, speed)
        matrix = design.transition - np.outer(gain, design.gain[2:])
        slowest.append(np.abs(np.linalg.eigvals(matrix)).max())
    assert slowest[1] < slowest[0] < 1.0


@pytest.mark.parametrize(
    ('overrides', 'reason'),
    [
        ({'multiples': (0.0, 1.0, 1.0)}, 'y: .* given twice'),
        ({'multiples': (0.0, 0.0)}, 'y: .* given twice'),
        (
            {'design': 'poles', 'poles_real': (-5.0, -6.0), 'poles_imaginary': (0.0, 0.0)},
            'y: 2 closed-loop poles given, this internal model takes 13',
        ),
        (
            {'design': 'poles', 'poles_real': (-5.0,) * 13, 'poles_imaginary': (0.0,) * 12},
            'y: 13 real and 12 imaginary parts',
        ),
        (
            {
                'design': 'poles',
                'multiples': (0.0,),
                'poles_real': (-5.0, -6.0, -7.0),
                'poles_imaginary': (1.0, -2.0, 0.0),
            },
            'y: complex closed-loop poles must come in conjugate pairs',
        ),
        (
            {
                'design': 'poles',
                'multiples': (0.0,),
                'poles_real': (-5.0, -6.0, 0.0),
                'poles_imaginary': (0.0, 0.0, 0.0),
            },
            'y: closed-loop poles need real parts below 0',
        ),
        ({**WEIGHTS, 'weight_model': (0.0,)}, "y: .* 'weight_model' must be above 0"),
        (
            {**WEIGHTS, 'weight_model': (1.0, 2.0, 3.0)},
            "y: 'weight_model' has 3 elements.* 1, 2 or 6",
        ),
        ({**WEIGHTS, 'weight_model': ()}, "y: 'weight_model' has 0 elements.* 1, 2 or 6"),
        ({'design': 'lqr_continuous'}, "y: .*'lqr_continuous' takes 'weight_error' above 0"),
        ({'weight_rate': 8e4}, "y: 'weight_rate' is given, which .*'bandwidth' does not take"),
        ({'design': 'poles'}, 'y: 0 closed-loop poles given, this internal model takes 13'),
        ({'design': 'bandwidth', 'internal_model__form': 'companion'}, "'companion' does not tell"),
        ({'antiwindup': (1.0, 2.0)}, "y: 'antiwindup' has 2 elements"),
        ({'internal_model__fundamental': 900.0}, 'more than half of what a sample time'),
    ],
)
def test_what_cannot_be_stabilised_is_refused(overrides: dict[str, object], reason: str) -> None:
    """With the axis and the reason."""
    with pytest.raises(ParameterError, match=reason):
        design_axis(axis_parameters(**overrides), 'y')


def test_the_default_s_poles_give_the_default_s_gains() -> None:
    """Designing by its poles, rounded, keeps the loop nearly the same."""
    upper = [
        (-127.1, 77.51),
        (-1.305, 23.13),
        (-1.178, 18.47),
        (-0.9852, 13.86),
        (-0.7053, 9.272),
        (-0.3645, 4.658),
    ]
    poles = {
        'phi.poles_real': (-148.6, *(real for real, _ in upper for _ in range(2))),
        'phi.poles_imaginary': (0.0, *(sign * part for _, part in upper for sign in (1.0, -1.0))),
    }
    by_weights = design_axis(ControllerParameters(), 'phi')
    by_poles = design_axis(build(ControllerParameters, {'phi.design': 'poles', **poles}), 'phi')
    np.testing.assert_allclose(feedback(by_poles)[:3], feedback(by_weights)[:3], rtol=0.02)


@pytest.mark.parametrize('multiples', [(0.0,), (1.0, 2.0), (0.0, 1.0), (0.0, 1.0, 2.0, 3.0, 4.0)])
def test_two_weights_are_of_the_integrator_and_of_the_oscillators(
    multiples: tuple[float, ...],
) -> None:
    """Whichever frequencies there are."""
    integrator, oscillator = 1.3e13, 1.6e11
    each = tuple(integrator if multiple == 0.0 else oscillator for multiple in multiples)
    both = WEIGHTS | {'weight_model': (integrator, oscillator)}
    two = design_axis(axis_parameters(multiples=multiples, **both), 'y')
    if len(multiples) == 2:
        each = (each[0],) if each[0] == each[1] else each
    wanted = design_axis(
        axis_parameters(multiples=multiples, **WEIGHTS | {'weight_model': each}), 'y'
    )
    np.testing.assert_array_equal(two.gain, wanted.gain)
