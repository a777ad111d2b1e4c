"""Currents within the voltage, against the plant's own windings."""

from __future__ import annotations

import numpy as np
import pytest
from retuning import retuned
from supervised import STANDING, STOP, lead

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_controller.supervision import Supervisor
from maglev_model.contract.phases import Phase
from maglev_model.inverse import CURRENT, Answer, CurrentLimits, simplified_inverse
from maglev_model.machine import machine_constants
from maglev_model.parameters import build, replace
from maglev_model.platen import output_accelerations
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run
from maglev_study.references import ellipse, held

PERIOD = 1e-3
PLANT = {'effects.winding.voltage': 28.0, 'substeps': 10}


def test_28_volts_carry_the_ellipse_and_are_not_asked_for_more() -> None:
    """With L(g): errors of 2 µm, and what flows at each sample's end is what was asked for."""
    references = ellipse(9.0, 0.010, PERIOD, grow=2.0)
    table = build(PlantParameters, {'initial.position': tuple(references.position[0]), **PLANT})
    regulator = Regulator(
        build(ControllerParameters, {'winding.voltage': 28.0, 'observer.bandwidth': 500.0})
    )
    outcome = run(regulator, SimulatedStage(table), references)
    error = 1e6 * np.abs(outcome.output - references.position)[-5000:]
    assert np.all(error.mean(axis=0) < [2.0, 2.0, 2.0, 1.0, 8.0])
    steps = np.abs(np.diff(outcome.direct_current, axis=0)).max()
    assert steps < 28.0 * PERIOD / 0.045 * 1.2


def flown_currents(law: dict[str, object], scaling: str) -> tuple[np.ndarray, np.ndarray]:
    """Currents asked for and those that flow in the windings when the sample is over (n, 8) [A]."""
    references = ellipse(1.5, 0.010, PERIOD, grow=0.5)
    machine = {'machine.dq_scaling': scaling}
    start = {'initial.position': tuple(references.position[0])}
    stage = SimulatedStage(build(PlantParameters, {**start, **machine, **PLANT}))
    regulator = Regulator(build(ControllerParameters, {**law, **machine}))
    answer = np.zeros((2, 4))
    asked, flowing = [], []
    for wanted in zip(*references, strict=True):
        reading = stage.read()
        flowing.append(stage.arrays.flowing.copy())  # at the end of the sample before
        regulator.step(*reading, *wanted, *answer)
        asked.append(answer.ravel().copy())
        stage.write(*answer)
    return np.array(asked)[50:-1], np.array(flowing)[51:]


@pytest.mark.parametrize('scaling', ['amplitude', 'rms'])
def test_what_is_asked_for_flows_in_the_windings(scaling: str) -> None:
    """Within what the angle turns by in a sample; a law that does not know the rail misses it."""
    missed = {}
    for voltage in (0.0, 28.0):
        asked, flowing = flown_currents({'winding.voltage': voltage}, scaling)
        missed[voltage] = np.abs(flowing - asked).max(axis=1)
    assert missed[28.0].max() < 0.02
    assert missed[0.0].max() > 0.1
    assert np.mean(missed[0.0] > 0.02) > 0.1


NEAR = np.array([0.020, 0.0, 0.0, 0.0, 0.0])
"""Where the platen is held off the magnets by 1 A in each motor."""


@pytest.mark.parametrize('voltage', [0.0, 28.0])
def test_a_voltage_that_is_given_in_flight_finds_the_currents_that_flow(voltage: float) -> None:
    """Whether there was another before, and whatever it was."""
    references = held(NEAR, 1.0, PERIOD)
    stage = SimulatedStage(build(PlantParameters, {'initial.position': tuple(NEAR)}))
    old = Regulator(build(ControllerParameters, {'winding.voltage': voltage}))
    before = run(old, stage, references).direct_current[-1]
    new = retuned(old, replace(old.parameters, {'winding.voltage': 15.0}))
    currents = np.empty((2, 4))
    new.step(*stage.read(), *(column[0] for column in references), *currents)
    assert before.min() > 0.9
    np.testing.assert_allclose(currents[0], before, atol=0.01)


def test_what_the_voltage_takes_is_all_that_is_lost() -> None:
    """Of an inverse that is off by itself: the simplified one at 20 mm by more than 1 m/s².

    What is realised of w falls short by what the shorter currents change, no more.
    """
    chosen = build(ControllerParameters, {'inverse': 'simplified', 'winding.voltage': 15.0})
    regulator, currents = Regulator(chosen), np.empty((2, 4))
    step = NEAR + np.array([2e-5, 0.0, 0.0, 0.0, 0.0])
    for output in [NEAR] * 60 + [step]:
        gap = np.full(4, output[0])
        limited = regulator.step(gap, 0.0, 0.0, NEAR, *np.zeros((2, 5)), *currents)
    assert limited == CURRENT
    machine, whole = machine_constants(chosen.machine), np.empty((2, 4))
    told = Answer(*whole, np.empty(5), np.empty(2))
    limits = CurrentLimits(chosen.limits.current, 1.0, chosen.limits.least_attraction)
    assert not simplified_inverse(
        machine, limits, np.ones(5), step, regulator.virtual_input.copy(), told
    )
    made, wanted = (
        output_accelerations(machine, step[0], 0.0, 0.0, *each)[0] for each in (currents, whole)
    )
    assert abs(wanted - told.realised[0]) > 1.0
    realised = regulator.arrays.sample['realised'][0]
    assert realised == pytest.approx(told.realised[0] + made - wanted, abs=1e-9)


def test_a_saved_regulator_remembers_the_currents_that_flow() -> None:
    """From where 10 V take some samples to bring them elsewhere."""
    stage = SimulatedStage(build(PlantParameters, {'initial.position': tuple(NEAR)}))
    regulator = Regulator(build(ControllerParameters, {'winding.voltage': 10.0}))
    run(regulator, stage, held(NEAR, 0.1, PERIOD))
    saved = stage.arrays.block.copy(), regulator.save()
    step = held(NEAR + np.array([0.005, 0.005, 0.0, 0.0, 0.0]), 0.01, PERIOD)
    ways = []
    for _ in range(2):
        stage.arrays.block[:] = saved[0]
        regulator.restore(saved[1])
        ways.append(run(regulator, stage, step))
    np.testing.assert_array_equal(ways[0].quadrature_current, ways[1].quadrature_current)
    np.testing.assert_array_equal(ways[0].direct_current, ways[1].direct_current)


@pytest.mark.parametrize('voltage', [0.0, 28.0])
def test_a_law_that_begins_anew_at_a_step_does_not_forget_the_currents_that_flow(
    voltage: float,
) -> None:
    given = {'winding.voltage': voltage, 'internal_model.restart_at_step': True}
    supervisor = Supervisor(build(ControllerParameters, {**STANDING, **given}))
    lead(supervisor, 0, Phase.REST, STOP, 0.031)
    for sequence in range(1, 30):
        lead(supervisor, sequence, Phase.TRACK, NEAR, NEAR[0])
    before = supervisor.direct_current.copy()
    lead(supervisor, 30, Phase.STEP, NEAR, NEAR[0], segment=1)
    assert before.min() > 0.8
    np.testing.assert_allclose(supervisor.direct_current, before, atol=0.2)
    supervisor.regulator.reset()  # as before a lift-off, from where none flow
    assert not supervisor.regulator.arrays.sample['asked'].any()
