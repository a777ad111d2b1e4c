"""The control laws at configuration: loop shapes, linearisation, refusals."""

from __future__ import annotations

import math
from pathlib import Path

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_controller.design.axis_design import AxisDesign
from maglev_controller.design.margins import loop_margins
from maglev_controller.laws import control_law, find_law
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_controller.step.voltage import USED
from maglev_model.axes import AXES
from maglev_model.equilibrium import equilibrium_current, equilibrium_inverse, stiffness
from maglev_model.inverse import Answer, CurrentLimits
from maglev_model.machine import MachineParameters, machine_constants
from maglev_model.parameters import ParameterError, build, from_yaml, read_yaml, replace
from maglev_model.parameters.plugins import names_in
from maglev_model.platen import output_accelerations
from maglev_plant.parameters import PlantParameters

PARAMS = Path(__file__).resolve().parents[3] / 'params'
PERIOD = 1e-3
MACHINE = machine_constants(MachineParameters())
SHAPED = {
    'jacobian_lead_lag': 'equilibrium',
    'feedback_lead_lag': 'exact',
    'feedback_soi': 'exact',
}


def parameters(file: str, **overrides: object) -> ControllerParameters:
    """The parameters of ``params/laws``, and more."""
    found = from_yaml(ControllerParameters, 'controller', PARAMS / 'laws' / f'{file}.yaml')
    return replace(found, {name.replace('__', '.'): value for name, value in overrides.items()})


def design(file: str, axis: str, **overrides: object) -> AxisDesign:
    """One axis of a law."""
    chosen = parameters(file, **overrides)
    return control_law(chosen).design(chosen, axis)


def sampled(found: AxisDesign) -> control.StateSpace:
    """Its compensator by python-control."""
    return control.ss(
        found.transition,
        found.drive[:, None],
        -found.gain[None, 2:],
        [[-found.gain[0]]],
        PERIOD,
    )


def loop(found: AxisDesign, stiff: float, delay: int = 0) -> control.StateSpace:
    """The open loop from e to -e by python-control, plant ``1 / (s² - α)`` held."""
    n = found.drive.size
    compensator = sampled(found)
    assert compensator.nstates == n
    continuous = control.ss([[0.0, 1.0], [stiff, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
    plant = control.sample_system(continuous, PERIOD, method='zoh')
    late = control.ss(control.tf([1.0], [1.0, *([0.0] * delay)], PERIOD)) if delay else 1.0
    return plant * late * compensator


def test_every_law_has_a_name_a_file_and_a_regulator() -> None:
    """The modules of the folder and params/laws agree, and all files build."""
    files = {path.stem for path in (PARAMS / 'laws').glob('*.yaml')}
    assert files == set(names_in('maglev_controller.laws')) - {'output_regulator'}
    for name in files:
        chosen = parameters(name)
        assert chosen.law == name
        assert len(Regulator(chosen).designs) == 5
        build(PlantParameters, read_yaml(PARAMS / 'laws' / f'{name}.yaml', 'plant'))


def test_a_law_of_another_package_is_found_by_its_dotted_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It designs and refuses as those here do; what is wrong in its module is told."""
    package = tmp_path / 'someones_laws'
    package.mkdir()
    (package / '__init__.py').touch()
    (package / 'doubled.py').write_text(
        'import dataclasses\n'
        'from maglev_controller.laws import feedback_soi\n'
        'from maglev_controller.laws.feedback_soi import check\n'
        'def design(parameters, axis):\n'
        '    found = feedback_soi.design(parameters, axis)\n'
        '    return dataclasses.replace(found, gain=1.1 * found.gain)\n'
    )
    (package / 'broken.py').write_text('1 / 0\n')
    monkeypatch.syspath_prepend(tmp_path)
    wanted = Regulator(parameters('feedback_soi')).designs[2].gain
    found = Regulator(parameters('feedback_soi', law='someones_laws.doubled')).designs[2].gain
    np.testing.assert_allclose(found, 1.1 * wanted, rtol=1e-7)
    with pytest.raises(ParameterError, match='feeds back no rate'):
        Regulator(parameters('feedback_soi', law='someones_laws.doubled', rate_estimate='observer'))
    with pytest.raises(ParameterError, match='cannot be imported: ZeroDivisionError'):
        find_law('someones_laws.broken')


@pytest.mark.parametrize('law', SHAPED)
@pytest.mark.parametrize('axis', ['y', 'x', 'phi', 'theta'])
@pytest.mark.parametrize(('crossover', 'margin', 'delay'), [(300.0, 45.0, 0), (150.0, 50.0, 1)])
def test_loops_have_the_wanted_bandwidth_and_margin(
    law: str, axis: str, crossover: float, margin: float, delay: int
) -> None:
    """python-control finds crossover, phase margin and a stable closed loop."""
    found = design(
        law,
        axis,
        compensator__crossover=(crossover,) * 5,
        compensator__phase_margin=margin,
        input_delay=delay,
    )
    open_loop = loop(found, found.stiffness, delay)
    at = complex(open_loop(np.exp(1j * crossover * PERIOD)))
    assert abs(at) == pytest.approx(1.0, rel=1e-6)
    assert math.degrees(np.angle(-at)) == pytest.approx(margin, abs=1e-4)
    poles = np.abs(control.feedback(open_loop, 1).poles())
    assert poles.max() < 1.0
    margins = loop_margins(found, PERIOD, delay=delay, designed=delay)
    assert margins.spectral_radius == pytest.approx(poles.max(), abs=1e-6)
    assert margins.phase == pytest.approx(margin, abs=0.5)
    above = np.exp(1j * PERIOD * np.linspace(1.05 * crossover, 0.99 * math.pi / PERIOD, 50))
    assert np.all(np.abs(open_loop(above)) < 1.0)


def test_the_shapes_are_what_they_are_called() -> None:
    """Zeros and poles of the sampled compensators, by Tustin's rule, and the integrator's pole."""
    for law, poles in (('feedback_lead_lag', 2), ('feedback_soi', 3)):
        found = design(law, 'x', compensator__roll_off=6.0)
        values = np.linalg.eigvals(found.transition)
        assert values.size == poles
        assert np.min(np.abs(values - 1.0)) < 1e-12
        zeros = control.ss2tf(sampled(found)).zeros()
        slow = zeros[np.argmin(np.abs(zeros - 1.0))].real
        corner = 2.0 / PERIOD * (1.0 - slow) / (1.0 + slow)
        assert corner == pytest.approx(30.0, rel=1e-6)
        others = values[np.abs(values - 1.0) > 1e-9]
        continuous = 2.0 / PERIOD * (others - 1.0) / (others + 1.0)
        assert np.all(continuous.real < 0.0)
        if law == 'feedback_soi':
            np.testing.assert_allclose(np.abs(continuous), 6.0 * 300.0, rtol=1e-6)
            np.testing.assert_allclose(np.cos(np.angle(-continuous)), math.sqrt(0.5), rtol=1e-6)


def accelerate(state: np.ndarray, direct: np.ndarray, quadrature: np.ndarray) -> np.ndarray:
    """(6), (7)."""
    return np.array(output_accelerations(MACHINE, *state[[0, 6, 8]], direct, quadrature))


@pytest.mark.parametrize('gap', [0.0195, 0.025, 0.0295])
def test_linearisation_is_that_of_the_full_model(gap: float) -> None:
    """Equilibrium, stiffness and gains against differences of (6), (7)."""
    state = np.zeros(10)
    state[0] = gap
    i_d = np.full(4, equilibrium_current(MACHINE, gap))
    none = np.zeros(4)
    np.testing.assert_allclose(accelerate(state, i_d, none), 0.0, atol=1e-9)
    found = stiffness(MACHINE, gap)
    for axis in range(5):
        for sign in (1.0, -1.0):
            moved = state.copy()
            moved[2 * axis] += sign * 1e-6
            got = accelerate(moved, i_d, none)[axis] / (sign * 1e-6)
            assert got == pytest.approx(found[axis], rel=2e-3, abs=1e-6)
    assert found[0] > 0.0
    limits = CurrentLimits(7.0, 0.0, 0.0)
    for axis in range(5):
        wanted = np.zeros(5)
        wanted[axis] = 1e-4
        direct, quadrature, realised, excess = (np.zeros(n) for n in (4, 4, 5, 2))
        answer = Answer(direct, quadrature, realised, excess)
        saturated = equilibrium_inverse(MACHINE, limits, np.ones(5), gap, wanted, answer)
        assert not saturated
        np.testing.assert_allclose(realised, wanted, atol=1e-13)
        np.testing.assert_allclose(accelerate(state, direct, quadrature), wanted, atol=2e-8)


@settings(max_examples=50)
@given(st.lists(st.floats(-300.0, 300.0), min_size=5, max_size=5))
def test_what_the_linear_inverse_says_it_realises(wanted: list[float]) -> None:
    """Within limits always, and with the currents it returns its own linear model agrees."""
    direct, quadrature, realised, excess = (np.zeros(n) for n in (4, 4, 5, 2))
    answer = Answer(direct, quadrature, realised, excess)
    limits = CurrentLimits(7.0, 0.0, 0.0)
    saturated = equilibrium_inverse(MACHINE, limits, np.ones(5), 0.025, np.array(wanted), answer)
    assert np.abs(direct).max() <= 7.0
    assert np.abs(quadrature).max() <= 7.0
    if saturated:
        assert np.abs(np.concatenate((direct, quadrature))).max() == pytest.approx(7.0)
    else:
        np.testing.assert_allclose(realised, wanted, atol=1e-9)


@pytest.mark.parametrize(
    ('law', 'overrides', 'reason'),
    [
        ('jacobian_lead_lag', {'inverse': 'exact'}, "'inverse' is 'exact'.*it takes 'equilibrium'"),
        ('feedback_soi', {'inverse': 'equilibrium'}, "double integrators.*takes 'exact' or"),
        ('regulator_3dof', {'inverse': 'equilibrium'}, 'double integrators'),
        ('feedback_lead_lag', {'law': 'output_regulator', 'inverse': 'equilibrium'}, 'double int'),
        ('feedback_lead_lag', {'internal_model__antiwindup': 'paper'}, r'equation \(17\)'),
        ('feedback_lead_lag', {'internal_model__restart_at_step': True}, 'must not be lost'),
        ('feedback_soi', {'rate_estimate': 'observer'}, 'feeds back no rate'),
        ('regulator_3dof', {'theta__controlled': True}, "'theta.controlled' is true.*false"),
        ('jacobian_lead_lag', {'compensator__equilibrium': 0.032}, 'between the stops'),
        ('jacobian_lead_lag', {'machine__gravity': 0.0}, "'machine.gravity' is 0"),
        ('feedback_lead_lag', {'compensator__crossover': (900.0,) * 5}, 'y: a crossover of 900'),
        ('feedback_soi', {'compensator__phase_margin': 80.0}, 'y: .*at most a phase margin of'),
        (
            'feedback_soi',
            {'law': 'feedback_sio'},
            "'feedback_sio'.*must be one of feedback_lead_lag, .*output_regulator.* or the dotted",
        ),
        (
            'feedback_soi',
            {'law': 'no_such_package.my_law'},
            "'law' is 'no_such_package.my_law', which cannot be imported: .*'no_such_package'",
        ),
        (
            'feedback_soi',
            {'law': 'maglev_model.axes'},
            "'law' is 'maglev_model.axes', a module without the function 'check'",
        ),
        ('feedback_soi', {'machine__motors': 1}, "'z.controlled' is true.*y and x only"),
        ('feedback_soi', {'machine__motors': 3}, 'it must be 1 or 4'),
    ],
)
def test_contradictions_are_refused(law: str, overrides: dict[str, object], reason: str) -> None:
    """With the parameter and the reason, before anything moves."""
    with pytest.raises(ParameterError, match=reason):
        Regulator(parameters(law, **overrides))


def test_a_single_motor_has_the_exact_inverse_only() -> None:
    """The others do not hold for it."""
    single = from_yaml(ControllerParameters, 'controller', PARAMS / 'single_motor.yaml')
    assert Regulator(single).parameters.machine.motors == 1
    with pytest.raises(ParameterError, match=r"'simplified'.*single motor has 'exact' only"):
        Regulator(replace(single, {'inverse': 'simplified'}))


def test_currents_that_the_magnets_overcome_are_refused() -> None:
    """From the gap on at which they cannot hold the platen any more it would strike the stop."""
    least = equilibrium_current(MACHINE, MachineParameters().gap_min)
    volts = least * ControllerParameters().winding.resistance / USED
    for name, bound in (('limits.current', least), ('winding.voltage', volts)):
        Regulator(build(ControllerParameters, {name: 1.001 * bound}))
        with pytest.raises(ParameterError, match=f"'{name}' is .* at least {bound:.6g} [AV]"):
            Regulator(build(ControllerParameters, {name: 0.999 * bound}))
    single = from_yaml(ControllerParameters, 'controller', PARAMS / 'single_motor.yaml')
    with pytest.raises(ParameterError, match='upper stop'):
        Regulator(replace(single, {'limits.current': 0.999 * least}))


def test_the_bandwidth_is_that_of_the_default_regulator() -> None:
    """So that what is compared is the approach."""
    ours = Regulator(ControllerParameters()).margins
    wanted = ControllerParameters().compensator.crossover
    for found, crossover in zip(ours, wanted, strict=True):
        assert found.crossover == pytest.approx(crossover, rel=0.1)


def test_axis_names_are_those_of_the_machine() -> None:
    """The bandwidth is per axis, in output order."""
    crossover = (100.0, 110.0, 120.0, 130.0, 140.0)
    chosen = parameters('feedback_lead_lag', compensator__crossover=crossover)
    for axis, wanted in zip(AXES, crossover, strict=True):
        open_loop = loop(control_law(chosen).design(chosen, axis), 0.0)
        assert abs(complex(open_loop(np.exp(1j * wanted * PERIOD)))) == pytest.approx(1.0, rel=1e-6)
