"""Notches against python-control, and axes with a flexible mode known to 5 %."""

from __future__ import annotations

import itertools
import math

import control
import numpy as np
import pytest

from maglev_controller.design.axis_design import controller_system
from maglev_controller.design.margins import all_margins, check_margins, loop_margins
from maglev_controller.design.notch import notch, notch_response, notch_system
from maglev_controller.design.state_space import Mode, closed_loop, plant_system, response
from maglev_controller.laws.output_regulator import design
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.parameters import ParameterError, build

PERIOD = 1e-3


def with_mode(frequency: float, gain: float, **others: object) -> ControllerParameters:
    """The defaults with one mode of y, damping 1 %."""
    mode = {
        'modes.axis': ('y',),
        'modes.frequency': (frequency,),
        'modes.damping': (0.01,),
        'modes.gain': (gain,),
    }
    return build(ControllerParameters, {**mode, **others})


def test_a_notch_is_tustins_exact_at_its_frequency() -> None:
    """And two in series are the product of both."""
    omega, depth, width = 700.0, 0.05, 0.4
    continuous = control.tf([1, 2 * depth * omega, omega**2], [1, 2 * width * omega, omega**2])
    sampled = control.sample_system(continuous, PERIOD, method='bilinear', prewarp_frequency=omega)
    z = np.exp(1j * PERIOD * np.geomspace(1.0, 3000.0, 40))
    first, second = notch(omega, depth, width, PERIOD), notch(1500.0, 0.1, 0.5, PERIOD)
    np.testing.assert_allclose(notch_response(first, z), sampled(z), rtol=1e-9)
    both = notch_response(first, z) * notch_response(second, z)
    np.testing.assert_allclose(response(notch_system((first, second)), z), both, rtol=1e-9)


def test_a_plant_with_a_mode_is_python_controls() -> None:
    """1 / s² + κ / (s² + 2 ζ ω s + ω²), w held."""
    omega, damping, gain = 800.0, 0.02, -0.3
    flexible = control.tf([gain], [1.0, 2.0 * damping * omega, omega**2])
    wanted = control.sample_system(control.tf([1.0], [1.0, 0.0, 0.0]) + flexible, PERIOD, 'zoh')
    found = plant_system(PERIOD, modes=(Mode(omega, damping, gain),))
    z = np.exp(1j * PERIOD * np.geomspace(10.0, 3000.0, 40))
    np.testing.assert_allclose(response(found, z), wanted(z), rtol=1e-6)


@pytest.mark.parametrize('gain', [-0.3, -0.1, 0.3])
@pytest.mark.parametrize('frequency', [80.0, 120.0, 200.0, 400.0])
@pytest.mark.parametrize('delay', [0, 1])
def test_a_mode_five_per_cent_off_is_borne(frequency: float, gain: float, delay: int) -> None:
    """Stable anywhere in between, also with less of the mode; the margins are those asked for."""
    parameters = with_mode(frequency, gain, input_delay=delay)
    chosen = design(parameters, 'y')
    controller = controller_system(chosen, PERIOD, delay)
    for share in np.linspace(0.95, 1.05, 11):
        for part in (0.0, 0.3, 1.0):
            mode = Mode(2.0 * math.pi * frequency * share, 0.01, part * gain)
            loop = closed_loop(controller, plant_system(PERIOD, delay, modes=(mode,)))
            assert np.abs(np.linalg.eigvals(loop)).max() < 1.0
    margins = all_margins(parameters, [chosen] * 5)[0]
    check_margins(parameters, margins, 'y')
    assert margins.sensitivity < 2.7
    assert f'with a mode at {frequency:g} Hz ± 5 %' in margins.text('y')


@pytest.mark.parametrize(('first', 'second', 'speed'), [(60.0, 120.0, 0.5), (100.0, 200.0, 0.99)])
def test_a_mode_is_borne_beside_one_that_needs_a_notch(
    first: float, second: float, speed: float
) -> None:
    """The second is unstable without its notch, which is not there yet when the first's is chosen.

    Alone the first takes no speed from the axis, and the second a fifth of it, or none.
    """
    modes = {
        'modes.axis': ('x', 'x'),
        'modes.frequency': (first, second),
        'modes.damping': (0.01, 0.01),
        'modes.gain': (0.3, -0.3),
    }
    parameters = build(ControllerParameters, modes)
    chosen = design(parameters, 'x')
    check_margins(parameters, all_margins(parameters, [chosen] * 5)[1], 'x')
    whole = design(ControllerParameters(), 'x')
    assert chosen.gain[0] / whole.gain[0] > speed**2


@pytest.mark.parametrize('delay', [0, 1])
def test_the_step_runs_the_notches_as_designed(delay: int) -> None:
    """The same errors in, the same w out as of the controller system, with two modes of x."""
    modes = {
        'modes.axis': ('x', 'x'),
        'modes.frequency': (100.0, 220.0),
        'modes.damping': (0.01, 0.01),
        'modes.gain': (-0.2, 0.3),
        'internal_model.rest': 'hold',
    }
    regulator = Regulator(build(ControllerParameters, {**modes, 'input_delay': delay}))
    assert regulator.designs[1].notches
    system = controller_system(regulator.designs[1], PERIOD, delay)
    rng, zero, gap = np.random.default_rng(2), np.zeros(5), np.full(4, 0.025)
    hover = np.array([0.025, 0.0, 0.0, 0.0, 0.0])
    state, direct, quadrature = np.zeros(system.input.size), *np.zeros((2, 4))
    regulator.step(gap, 0.0, 0.0, hover, zero, zero, direct, quadrature)
    for _ in range(60):
        error = 1e-6 * rng.normal()
        regulator.step(gap, error, 0.0, hover, zero, zero, direct, quadrature)
        wanted = system.output @ state + system.direct * error
        assert regulator.virtual_input[1] == pytest.approx(wanted, rel=1e-9, abs=1e-12)
        state = system.state @ state + system.input * error


def test_without_modes_nothing_changes() -> None:
    """A mode of another axis leaves this one alone."""
    plain = design(ControllerParameters(), 'x')
    np.testing.assert_array_equal(design(with_mode(80.0, -0.3), 'x').gain, plain.gain)
    assert plain.notches == ()


def test_a_mode_beyond_half_the_sample_rate_is_looked_for_where_it_shows() -> None:
    """At 600 Hz it shows at 400 Hz."""
    chosen = with_mode(600.0, 0.25, **{'modes.damping': (1e-3,), 'modes.tolerance': 0.0})
    regulator = Regulator(chosen)
    controller = controller_system(regulator.designs[0], PERIOD, 0)
    plant = plant_system(PERIOD, modes=chosen.modes.of('y'))
    z = np.exp(2j * math.pi * PERIOD * np.linspace(398.0, 402.0, 4001))
    loop = -response(controller, z) * response(plant, z)
    peak = float(np.max(1.0 / np.abs(1.0 + loop)))
    assert regulator.margins[0].sensitivity == pytest.approx(max(peak, 1.6), rel=0.03)
    assert peak < chosen.modes.sensitivity


@pytest.mark.parametrize('damping', [0.2, 0.25, 0.3, 1.0])
def test_what_is_damped_well_leaves_the_margins(damping: float) -> None:
    """However far below the mode its width would reach."""
    found = Regulator(with_mode(400.0, 0.3, **{'modes.damping': (damping,)})).margins[0]
    plain = Regulator(ControllerParameters()).margins[0]
    for name in ('crossover', 'phase', 'gain_up', 'gain_down', 'sensitivity'):
        assert getattr(found, name) == pytest.approx(getattr(plain, name), rel=0.02)


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        ({'modes.frequency': (60.0,), 'modes.gain': (-1.5,), 'modes.tolerance': 0.2}, 'at 60 Hz'),
        (
            {'modes.gain': (0.1, 0.1)},
            "'modes.axis', .* and 'gain' have 1, 1, 1 and 2",
        ),
        (
            {
                name: 5 * value
                for name, value in {
                    'modes.axis': ('y',),
                    'modes.frequency': (90.0,),
                    'modes.damping': (0.01,),
                    'modes.gain': (0.1,),
                }.items()
            },
            "'modes.axis' names 5 modes of y, an axis has at most 4",
        ),
    ],
)
def test_what_cannot_be_is_refused(changes: dict[str, object], reason: str) -> None:
    """A mode with its frequency, lists with their lengths."""
    with pytest.raises(ParameterError, match=reason):
        Regulator(with_mode(90.0, -0.3, **{'margins.override': True, **changes}))


def test_of_two_modes_either_may_be_missing_and_they_may_be_off_by_other_shares() -> None:
    """The margins are the least there are, also where only one of them shows."""
    omega, gain = (102.5, 125.6), (-0.1, 0.3)
    both = {'axis': ('x', 'x'), 'frequency': omega, 'damping': (0.01, 0.01), 'gain': gain}
    parameters = build(
        ControllerParameters, {f'modes.{name}': value for name, value in both.items()}
    )
    chosen = design(parameters, 'x')
    told = all_margins(parameters, [chosen] * 5)[1].sensitivity
    assert told < parameters.modes.sensitivity
    for shares in itertools.product((0.95, 0.98, 1.0, 1.05), repeat=2):
        for parts in itertools.product((0.0, 0.5, 1.0), repeat=2):
            modes = tuple(
                Mode(2.0 * math.pi * frequency * share, 0.01, part * size)
                for frequency, size, share, part in zip(omega, gain, shares, parts, strict=True)
            )
            found = loop_margins(chosen, PERIOD, modes=modes)
            assert found.spectral_radius < 1.0
            assert found.sensitivity < 1.02 * told
