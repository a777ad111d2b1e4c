"""Poles and margins against python-control, and what is refused."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import control
import numpy as np
import pytest
from scipy.optimize import brentq

from maglev_controller.design.axis_design import controller_system, resting
from maglev_controller.design.margins import check_in_real_time, check_margins, loop_margins
from maglev_controller.design.state_space import Mode, closed_loop, plant_system, response
from maglev_controller.laws.output_regulator import design as design_axis
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_controller.step.estimation import DOUBT
from maglev_controller.supervision import Supervisor
from maglev_model.axes import AXES
from maglev_model.parameters import ParameterError, build, read_yaml, replace

PARAMS = Path(__file__).resolve().parents[3] / 'params'
PERIOD = 1e-3
HOVER = np.array([0.025, 0.0, 0.0, 0.0, 0.0])


def parameters(*overlays: str, **overrides: object) -> ControllerParameters:
    """Defaults with overlays from params/ and single parameters, dots written ``__``."""
    found: dict[str, object] = {}
    for name in overlays:
        found.update(read_yaml(PARAMS / name, 'controller'))
    found.update({name.replace('__', '.'): value for name, value in overrides.items()})
    return build(ControllerParameters, found)


def weights(axis: str, **changes: object) -> dict[str, object]:
    """An axis designed by LQR weights, dots written ``__``."""
    chosen = {'error': 1.6e9, 'rate': 8e4, 'model': (1.3e13, 1.6e11), **changes}
    named = {f'{axis}__weight_{name}': value for name, value in chosen.items()}
    return {f'{axis}__design': 'lqr_discrete', **named}


CHOICES = [
    parameters(),
    parameters(input_delay=1),
    parameters(rate_estimate='derivative'),
    parameters('paper.yaml'),
]


@pytest.mark.parametrize('chosen', CHOICES, ids=['default', 'delay', 'derivative', 'paper'])
def test_the_controller_system_is_what_the_regulator_computes(chosen: ControllerParameters) -> None:
    """The same errors in, the same w out, sample by sample."""
    chosen = replace(chosen, {'internal_model.rest': 'hold'})
    regulator = Regulator(chosen)
    system = controller_system(regulator.designs[1], PERIOD, chosen.input_delay)
    rng = np.random.default_rng(2)
    state, direct, quadrature, zero = np.zeros(system.input.size), *np.zeros((2, 4)), np.zeros(5)
    regulator.step(np.full(4, 0.025), 0.0, 0.0, HOVER, zero, zero, direct, quadrature)
    for _ in range(60):
        error = 1e-6 * rng.normal()
        regulator.step(np.full(4, 0.025), error, 0.0, HOVER, zero, zero, direct, quadrature)
        wanted = system.output @ state + system.direct * error
        assert regulator.virtual_input[1] == pytest.approx(wanted, rel=1e-9, abs=1e-12)
        state = system.state @ state + system.input * error


@pytest.mark.parametrize('delay', [0, 1, 3])
def test_the_plant_is_python_controls(delay: int) -> None:
    """Stiffness and friction included, sampled with w held, then delayed."""
    continuous = control.ss([[0.0, 1.0], [1700.0, -300.0]], [[0.0], [1.0]], [[1.0, 0.0]], 0.0)
    wanted = control.sample_system(continuous, PERIOD, method='zoh')
    found = control.ss(
        *_matrices(plant_system(PERIOD, delay, stiffness=1700.0, friction=300.0)), PERIOD
    )
    z = np.exp(1j * PERIOD * np.geomspace(1.0, 3000.0, 20))
    np.testing.assert_allclose(found(z), wanted(z) / z**delay, rtol=1e-7)


def _matrices(system: object) -> tuple[np.ndarray, ...]:
    state, drive, output, direct = system  # type: ignore[misc]
    return state, drive[:, None], output[None, :], np.array([[direct]])


@pytest.mark.parametrize('chosen', CHOICES, ids=['default', 'delay', 'derivative', 'paper'])
def test_margins_are_python_controls(chosen: ControllerParameters) -> None:
    """Crossover, phase and gain margin, sensitivity peak and poles, by its own algorithms."""
    delay = chosen.input_delay
    found = loop_margins(design_axis(chosen, 'y'), PERIOD, delay=delay, designed=delay)
    controller = control.ss(
        *_matrices(controller_system(design_axis(chosen, 'y'), PERIOD, delay)), PERIOD
    )
    loop = -control.ss(*_matrices(plant_system(PERIOD, delay)), PERIOD) * controller
    poles = control.feedback(loop, 1).poles()
    assert found.spectral_radius == pytest.approx(np.abs(poles).max(), abs=1e-6)
    at = complex(loop(np.exp(1j * found.crossover * PERIOD)))
    assert abs(at) == pytest.approx(1.0, rel=1e-3)
    assert math.degrees(np.angle(-at)) == pytest.approx(found.phase, abs=0.1)
    for factor in (found.gain_up, found.gain_down):
        edge = [
            np.abs(control.feedback(f * loop, 1).poles()).max()
            for f in (factor * 0.99, factor * 1.01)
        ]
        assert min(edge) < 1.0 < max(edge)
    omega = np.linspace(5.0, 3000.0, 8000)
    peak = np.max(1.0 / np.abs(1.0 + loop(np.exp(1j * PERIOD * omega))))
    assert found.sensitivity == pytest.approx(peak, rel=0.01)


def test_narrow_peaks_are_found() -> None:
    """Beside an oscillator above the crossover, which learns slowly."""
    chosen = parameters(internal_model__fundamental=137.0, input_delay=1)
    design = design_axis(chosen, 'y')
    found = loop_margins(design, PERIOD, delay=1, designed=1)
    z = np.exp(1j * PERIOD * 685.0 * (1.0 + np.linspace(-5e-3, 5e-3, 5001)))
    loop = -response(controller_system(design, PERIOD, 1), z) * response(plant_system(PERIOD, 1), z)
    peak = float(np.max(1.0 / np.abs(1.0 + loop)))
    assert peak > 4.0
    assert found.sensitivity == pytest.approx(peak, rel=0.01)
    with pytest.raises(ParameterError, match=r'the phase margin is 1\d\.\d deg'):
        check_margins(chosen, found, 'y')


@pytest.mark.parametrize('peak', [1.0003, 1.00003])
def test_crossovers_beside_a_peak_that_just_reaches_one_are_found(peak: float) -> None:
    """Nearer each other than any grid: the smallest phase margin is at one of them."""
    design, frequency = design_axis(parameters(), 'y'), 600.0 * math.pi
    omega = frequency * (1.0 + np.linspace(-2e-3, 2e-3, 100_001))
    z = np.exp(1j * PERIOD * omega)
    feedback, rigid = response(controller_system(design, PERIOD, 0), z), plant_system(PERIOD)
    flexible = plant_system(PERIOD, modes=(Mode(frequency, 1e-3, 1.0),))
    bend = response(flexible, z) - response(rigid, z)
    gain = brentq(
        lambda k: np.max(np.abs(feedback * (response(rigid, z) + k * bend))) - peak, 0.0, 0.1
    )
    loop = -feedback * (response(rigid, z) + gain * bend)
    above = np.flatnonzero(np.abs(loop) > 1.0)
    found = loop_margins(design, PERIOD, modes=(Mode(frequency, 1e-3, gain),))
    assert found.crossover == pytest.approx(omega[above[-1]], abs=1e-4)
    assert found.phase == pytest.approx(np.degrees(np.angle(-loop[above[-1]])) % 360.0, abs=5e-3)


@pytest.mark.parametrize('slope', [10.0, 200.0, 1320.0, 1500.0])
@pytest.mark.parametrize('delay', [0, 1])
def test_friction_at_rest_leaves_the_default_stable(slope: float, delay: int) -> None:
    """For every slope up to the parameter's, also with currents that come a sample late."""
    controller = controller_system(design_axis(parameters(), 'theta'), PERIOD, 0)
    loop = closed_loop(controller, plant_system(PERIOD, delay, friction=slope))
    assert np.abs(np.linalg.eigvals(loop)).max() < 1.0


def test_at_rest_no_friction_makes_the_loop_unstable() -> None:
    """With any slope, the counts believed or doubted; the oscillators held would hunt with some."""
    design = design_axis(parameters(), 'theta')
    for slope in np.geomspace(0.1, 1e7, 30):
        plant = plant_system(PERIOD, friction=slope)
        for doubt in (0.0, DOUBT):
            loop = closed_loop(controller_system(resting(design, doubt), PERIOD, 0), plant)
            assert np.abs(np.linalg.eigvals(loop)).max() < 1.0
    assert loop_margins(design, PERIOD).friction == math.inf
    held = design_axis(parameters(internal_model__rest='hold'), 'theta')
    loop = closed_loop(controller_system(held, PERIOD, 0), plant_system(PERIOD, friction=1e4))
    assert np.abs(np.linalg.eigvals(loop)).max() > 1.0
    hunting = dataclasses.replace(loop_margins(design, PERIOD), friction=250.0)
    with pytest.raises(ParameterError, match=r'theta: standing still hunts .* slope of 250 1/s'):
        check_margins(parameters(), hunting, 'theta')


def test_the_default_stands_delay_and_wrong_gains() -> None:
    """Two samples late, or one with 0.36 to 1.5 times the model's gain."""
    controller = controller_system(design_axis(parameters(), 'x'), PERIOD, 0)
    for delay in (0, 1, 2):
        loop = closed_loop(controller, plant_system(PERIOD, delay))
        assert np.abs(np.linalg.eigvals(loop)).max() < 1.0
    for factor in (0.36, 0.9, 1.1, 1.5):
        scaled = controller._replace(
            direct=factor * controller.direct, output=factor * controller.output
        )
        loop = closed_loop(scaled, plant_system(PERIOD, 1))
        assert np.abs(np.linalg.eigvals(loop)).max() < 1.0


def test_designing_for_the_delay_gives_margin_back() -> None:
    """With ``input_delay`` the observer predicts over it."""
    late = loop_margins(design_axis(parameters(), 'y'), PERIOD, delay=1)
    chosen = parameters(input_delay=1)
    designed = loop_margins(design_axis(chosen, 'y'), PERIOD, delay=1, designed=1)
    assert designed.phase > late.phase + 8.0
    assert designed.sensitivity < late.sensitivity - 0.5


@pytest.mark.parametrize(
    ('overrides', 'reason'),
    [
        (
            {'rate_estimate': 'derivative', **weights('y', error=1e13)},
            'y: with these gains .* unstable at a sample time of 0.001 s',
        ),
        (
            {
                'rate_estimate': 'derivative',
                'x__design': 'poles',
                'x__multiples': (),
                'x__poles_real': (-2000.0, -2000.0),
                'x__poles_imaginary': (0.0, 0.0),
            },
            'x: with these gains .* the loop is unstable',
        ),
        ({'margins__phase': 60.0}, r"y: the phase margin is 42\.\d deg, 'margins.phase' asks for"),
        ({'margins__gain': 6.0}, r"y: the gain margin is a factor 3\.\d+, 'margins.gain' asks for"),
        ({'margins__sensitivity': 1.2}, r"y: the sensitivity peaks at 1\.6\d, 'margins.sensi"),
        ({'rate_estimate': 'derivative', 'input_delay': 1}, "y: the phase .* 'margins.override'"),
    ],
)
def test_what_falls_short_is_refused(overrides: dict[str, object], reason: str) -> None:
    """With the axis, the figure and the bound; the same with override is taken unless unstable."""
    with pytest.raises(ParameterError, match=reason):
        Regulator(parameters(**overrides))
    if 'unstable' in reason:
        with pytest.raises(ParameterError, match=reason):
            Regulator(parameters(**overrides, margins__override=True))
    else:
        Regulator(parameters(**overrides, margins__override=True))


@pytest.mark.parametrize(
    ('period', 'reason'),
    [(1.25e-3, 'phase margin is 17.*phi'), (2e-3, 'phase margin is 7.*y'), (2.5e-3, 'unstable')],
)
def test_what_real_time_leaves_too_little_margin_of_is_refused(period: float, reason: str) -> None:
    """A sample late, for which the design may count with it."""
    chosen = build(ControllerParameters, {'sample_time': period})
    with pytest.raises(ParameterError, match=f"'input_delay' is 0.*{period:g} s.*{reason}"):
        Supervisor(chosen, hurried=True)
    for taken in ({'input_delay': 1}, {'margins.override': True}, {'sample_time': 1e-3}):
        other = replace(chosen, taken)
        check_in_real_time(other, Regulator(other).designs)


def test_what_is_too_ill_conditioned_is_refused() -> None:
    chosen = parameters(
        internal_model__form='companion',
        **{f'{axis}__design': 'poles' for axis in AXES},
        **{f'{axis}__poles_real': (-200.0,) * 13 for axis in AXES},
        **{f'{axis}__poles_imaginary': (0.0,) * 13 for axis in AXES},
    )
    with pytest.raises(ParameterError, match=r'y: the loop .* is too ill-conditioned'):
        Regulator(chosen)


@pytest.mark.parametrize(
    'speeds', [{'integration': 10.0}, {'learning': 100.0}, {'integration': 5.0, 'learning': 5.0}]
)
def test_oscillators_that_learn_as_fast_as_the_integrator_are_told_of(
    speeds: dict[str, float],
) -> None:
    """They are stable as LQR has them, but not turned for friction at rest."""
    given: dict[str, object] = {f'theta__{name}': speed for name, speed in speeds.items()}
    with pytest.raises(
        ParameterError, match=r"theta: .* unstable .*; oscillators .* or 'internal_model\.rest' to"
    ):
        Regulator(parameters(**given))
    Regulator(parameters(**given, internal_model__rest='hold'))
    fast = {'rate_estimate': 'derivative', 'theta__bandwidth': 1800.0}
    with pytest.raises(ParameterError, match=r'theta: .* is unstable .* rad/s\)$'):
        Regulator(parameters(**fast))


def test_an_axis_without_control_is_not_judged() -> None:
    """Its gains are not used."""
    wild = {**weights('phi', error=1e13), 'phi__controlled': False}
    assert len(Regulator(parameters(**wild)).describe_loops()) == 4


def test_the_log_says_it_all() -> None:
    """One line for each axis."""
    lines = Regulator(parameters()).describe_loops()
    assert [line.split(':')[0] for line in lines] == ['y', 'x', 'z', 'phi', 'theta']
    for word in ('crossover', 'phase margin', 'gain margin', 'sensitivity peak', 'friction', '±'):
        assert word in lines[4]
