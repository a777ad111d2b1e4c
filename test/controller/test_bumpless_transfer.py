"""Other gains in flight: w does not jump, the flight goes on, what cannot change is refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from retuning import retuned

from maglev_controller.bumpless_transfer import model_maps
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.axes import AXES
from maglev_model.parameters import ParameterError, build, read_yaml, replace
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run
from maglev_study.references import References

PARAMS = Path(__file__).resolve().parents[2] / 'params'
PERIOD, OMEGA = 1e-3, 1.5 * math.pi
HOVER = np.array([0.025, 0.0, 0.0, 0.0, 0.0])


def ellipse(first: int, samples: int) -> References:
    """The 4DOF ellipse from sample ``first`` on."""
    amplitude = np.array([0.005, 0.03, 0.03, 0.0, 0.010])
    angle = OMEGA * PERIOD * (first + np.arange(samples))[:, None]
    angle = angle + np.array([-math.pi / 2, -math.pi / 2, 0.0, 0.0, 0.0])
    return References(
        HOVER + amplitude * np.sin(angle),
        amplitude * OMEGA * np.cos(angle),
        -amplitude * OMEGA**2 * np.sin(angle),
    )


def stage(plant: str, references: References) -> SimulatedStage:
    """A stage at the start of a reference."""
    found = read_yaml(PARAMS / plant, 'plant')
    found['initial.position'] = tuple(references.position[0])
    found['initial.velocity'] = tuple(references.velocity[0])
    return SimulatedStage(build(PlantParameters, found))


CHANGES: dict[str, dict[str, object]] = {
    'nothing': {},
    'slower': {f'{a}.bandwidth': 140.0 for a in ('y', 'x', 'z', 'phi', 'theta')},
    'fewer frequencies': {f'{a}.multiples': (0.0, 1.0, 2.0) for a in ('y', 'x', 'theta')},
    'more frequencies': {f'{a}.multiples': tuple(map(float, range(8))) for a in ('y', 'z')},
    'no feed-forward': {'feed_forward': False},
    'derivative filter': {'rate_estimate': 'derivative'},
    'observer slower': {'observer.bandwidth': 600.0},
}


def virtual_inputs(
    regulators: list[Regulator], flying: SimulatedStage, references: References
) -> np.ndarray:
    """w of each sample and regulator (N, regulators, 5); the last one's currents fly."""
    currents = np.zeros((2, 4))
    wanted = np.zeros((len(references.position), len(regulators), 5))
    sample = flying.read()
    for row, reference in zip(wanted, zip(*references, strict=True), strict=True):
        for w, regulator in zip(row, regulators, strict=True):
            regulator.step(*sample, *reference, *currents)
            w[:] = regulator.virtual_input
        flying.write(*currents)
        sample = flying.read()
    return wanted


@pytest.mark.parametrize('name', CHANGES)
def test_w_does_not_jump_and_the_flight_goes_on(name: str) -> None:
    """Beside the law that goes on unchanged.

    With counts, what they move w by from sample to sample is the bound.
    """
    before, after = ellipse(0, 6000), ellipse(6000, 6000)
    first = References(*(array[:500] for array in after))
    rest = References(*(array[500:] for array in after))
    for plant, error in (('ideal.yaml', 4e-5), ('benchmark.yaml', 6e-5)):
        old, flying = Regulator(ControllerParameters()), stage(plant, before)
        run(old, flying, before)
        new = retuned(old, replace(old.parameters, CHANGES[name]))
        wanted = virtual_inputs([old, new], flying, first)
        difference = np.abs(wanted[0, 0] - wanted[0, 1])
        steps = np.abs(np.diff(wanted[:, 1], axis=0)).max(axis=0)
        if name == 'nothing':
            assert difference.max() < 1e-9
        else:
            assert np.all(difference <= (0.02 if plant == 'ideal.yaml' else steps))
        off = np.abs(run(new, flying, rest).output - rest.position)
        assert off.max() < (2e-3 if name == 'no feed-forward' else error)


def fewer_frequencies(period: float) -> np.ndarray:
    """How y's internal model is carried over to one with fewer frequencies."""
    old = build(ControllerParameters, {'sample_time': period})
    new = replace(old, CHANGES['fewer frequencies'])
    return model_maps(*(Regulator(each).arrays for each in (old, new)))[0]


@pytest.mark.parametrize('period', [2.5e-4, 1.25e-3, 2e-3])
def test_internal_models_are_compared_over_two_seconds_at_any_sample_time(period: float) -> None:
    np.testing.assert_allclose(fewer_frequencies(period), fewer_frequencies(PERIOD), atol=0.02)


@pytest.mark.parametrize('frequency', [50.0, 100.0, 150.0])
def test_an_oscillator_of_any_frequency_is_carried_over_whole(frequency: float) -> None:
    """As at 100 Hz, where moments 5 ms apart show nothing of one of its two states."""
    chosen = {'internal_model.fundamental': 2.0 * np.pi * frequency, 'y.multiples': (0.0, 1.0)}
    others = {f'{axis}.multiples': (0.0,) for axis in AXES[1:]}
    old = build(ControllerParameters, {**chosen, **others, 'margins.override': True})
    new = replace(old, {'observer.bandwidth': 840.0})
    found = model_maps(*(Regulator(each).arrays for each in (old, new)))[0]
    np.testing.assert_allclose(found, np.eye(3), atol=1e-9)


def test_the_share_that_fades_is_gone_soon() -> None:
    """A tenth of a per cent is left after 0.35 s."""
    before, after = ellipse(0, 3000), ellipse(3000, 400)
    old, flying = Regulator(ControllerParameters()), stage('ideal.yaml', before)
    run(old, flying, before)
    new = retuned(old, replace(old.parameters, {'feed_forward': False}))
    first = np.abs(new.arrays.axes['bump']).max()
    run(new, flying, after)
    assert first > 0.1
    assert np.abs(new.arrays.axes['bump']).max() < 1e-3 * first


def test_back_to_the_derivative_filter_and_forth() -> None:
    """Either estimator takes the rate over from the other."""
    before = ellipse(0, 3000)
    regulator, flying = Regulator(ControllerParameters()), stage('ideal.yaml', before)
    run(regulator, flying, before)
    for part, choice in enumerate(('derivative', 'observer', 'derivative'), start=3):
        regulator = retuned(regulator, replace(regulator.parameters, {'rate_estimate': choice}))
        piece = ellipse(1000 * part, 1000)
        outcome = run(regulator, flying, piece)
        assert np.abs(outcome.output - piece.position).max() < 4e-5


def test_on_the_ground_there_is_nothing_to_take_over() -> None:
    """Before the first sample a retuned regulator is a new one."""
    old = Regulator(ControllerParameters())
    new = retuned(old, replace(old.parameters, {'y.bandwidth': 180.0}))
    fresh = Regulator(new.parameters)
    for kept, begun in zip(new.save(), fresh.save(), strict=True):
        np.testing.assert_array_equal(kept, begun)


@pytest.mark.parametrize(
    ('change', 'reason'),
    [
        ({'machine.mass_y': 7.5}, "'machine.mass_y' cannot change in flight .it is 6.9, not 7.5"),
        ({'inverse': 'simplified'}, "'inverse' cannot change in flight"),
        ({'phi.controlled': False}, "'phi.controlled' cannot change in flight"),
        ({'input_delay': 1}, "'input_delay' cannot change in flight"),
        ({'y.multiples': (0.0, 1.0, 1.0)}, 'y: .* given twice'),
        ({'feed_forward': False}, "'feed_forward' is false: what is learned"),
        ({'rate_estimate': 'derivative', 'x.bandwidth': 1800.0}, 'x: .* unstable'),
    ],
)
def test_what_cannot_be_is_refused_and_changes_nothing(
    change: dict[str, object], reason: str
) -> None:
    """The regulator in flight is as before, bit by bit."""
    before = ellipse(0, 200)
    learns = build(ControllerParameters, {'learning.period': 0.4})
    old, flying = Regulator(learns), stage('ideal.yaml', before)
    run(old, flying, before)
    saved = old.save()
    with pytest.raises(ParameterError, match=reason):
        retuned(old, replace(old.parameters, change))
    for kept, after in zip(saved, old.save(), strict=True):
        np.testing.assert_array_equal(after, kept)
