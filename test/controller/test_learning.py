"""Iterative learning: what is learned, when it ends, what is kept; in the graph as without."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
import pytest

from maglev_controller.learning import IterativeLearning, iterative_learning
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_controller.step.learning import DONE, GREW
from maglev_controller.supervision import Supervisor
from maglev_model.axes import X, Y
from maglev_model.contract.phases import Phase
from maglev_model.parameters import ParameterError, build, from_yaml, replace
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run
from maglev_study.references import HOVER, References, ellipse, held

PARAMS = Path(__file__).resolve().parents[2] / 'params'
PERIOD, PASS, RUN_IN = 1e-3, 4000, 8000
SHORT = {'learning.period': 0.4, 'learning.passes': 3}


def learned_ellipse(*overlays: str, **effects: object) -> tuple[np.ndarray, IterativeLearning]:
    """Mean |e| (10, 5) of eight passes and two after, on the encoders' own scales, in micro."""
    files = [PARAMS / f'{name}.yaml' for name in ('machine', 'benchmark', *overlays)]
    start = {'initial.position': tuple(HOVER), **{f'effects.{k}': v for k, v in effects.items()}}
    plant = replace(from_yaml(PlantParameters, 'plant', *files), start)
    table = from_yaml(ControllerParameters, 'controller', *files, PARAMS / 'learning.yaml')
    references = ellipse(PERIOD * (RUN_IN + 10 * PASS), 0.010, PERIOD, grow=2.0)
    learning = IterativeLearning(table)
    follows = np.arange(len(references.position)) >= RUN_IN
    outcome = run(
        Regulator(table), SimulatedStage(plant), references, learning=learning, follows=follows
    )
    error = 1e6 * np.abs(outcome.own - references.position)[RUN_IN:]
    return error.reshape(10, PASS, 5).mean(axis=1), learning


def test_eight_passes_of_the_ellipse_on_the_benchmark_plant() -> None:
    """From measured errors. Nearly equal starts give 0.66 to 0.78 in y, 0.78 to 0.91 in x and z."""
    error, learning = learned_ellipse()
    assert np.all(error[-2:] <= [0.8, 1.1, 1.1, 0.1, 2.9])
    assert np.all(error[-1, :3] < [0.85, 0.95, 0.95] * error[0, :3])
    assert len(learning.history) == 8
    assert learning.arrays.state['stage'] == DONE


def test_and_on_the_rough_one() -> None:
    error, learning = learned_ellipse('rough')
    assert np.all(error[-2:] <= [1.1, 1.6, 1.6, 2.2, 4.0])
    assert np.all(error[-1] < [0.85, 0.9, 0.9, 1.1, 0.9] * error[0])
    assert learning.arrays.state['stage'] == DONE


@pytest.mark.parametrize('overlays', [(), ('rough',)])
def test_and_where_all_magnets_are_off_the_model(overlays: tuple[str, ...]) -> None:
    """By 10 %: what the internal model makes of it is not fed forward on top of that.

    Once it was, y err by three times as much while that faded in, which ended the learning.
    """
    error, learning = learned_ellipse(*overlays, **{'motor.magnet': (1.1,) * 4})
    assert learning.arrays.state['stage'] == DONE
    assert np.all(error[1, :3] < error[0, :3])
    assert np.all(error[-1, :3] < 0.92 * error[0, :3])


# -- a pass at a time, with made-up samples --------------------------------------------------------


AT_REST = (HOVER, np.zeros(5))


def pass_by(
    learning: IterativeLearning, control: Regulator, disturbance: np.ndarray, factor: float = 1.0
) -> None:
    """A pass in which x is held still against a force that the law has to make up for.

    The error is ``factor`` times what is still missing of it.
    """
    sample, axes = control.arrays.sample, control.arrays.axes
    for force in disturbance:
        learning.look_ahead(control.arrays, True, *AT_REST)
        sample['error'][X] = factor * 1e-4 * (force + axes['learned'][X])
        sample['realised'][X] = -force
        learning.learn(control.arrays)


def learning_parameters(values: dict[str, object]) -> ControllerParameters:
    return build(ControllerParameters, {**SHORT, 'learning.passes': 20, **values})


def made_up(**values: object) -> tuple[IterativeLearning, Regulator, np.ndarray]:
    parameters = learning_parameters(values)
    time = PERIOD * np.arange(400)
    return (
        IterativeLearning(parameters),
        Regulator(parameters),
        0.5 * np.sin(2.0 * np.pi * time / 0.2),
    )


def test_a_repeated_force_is_learned() -> None:
    """The table becomes its opposite, and fades in at the next use."""
    learning, control, force = made_up()
    for _ in range(8):
        pass_by(learning, control, force, factor=0.0)
    np.testing.assert_allclose(learning.table[:, X], -force, atol=0.03)
    assert not learning.table[:, [0, 2, 3, 4]].any()
    learning.rest()
    learning.look_ahead(control.arrays, True, *AT_REST)
    assert abs(control.arrays.axes['learned'][X]) < 0.005


@pytest.mark.parametrize(
    ('rested', 'share'), [('never', 0.0), ('at times', 1.0), ('always', 1.0), ('law', 1.0)]
)
def test_what_the_internal_model_makes_is_left_to_it(rested: str, share: float) -> None:
    """Where it has that frequency, and its oscillators do not fade because the reference rests."""
    law = {'law': 'test.other'} if rested == 'law' else {}
    values = {'internal_model.fundamental': 2.0 * np.pi / 0.2}
    learning, control, force = made_up(**values)
    if law:
        learning = IterativeLearning(replace(learning_parameters(values), law))
    sample, axes = control.arrays.sample, control.arrays.axes
    for k in range(1600):
        axes['rested'][X] = 1.0 if rested == 'always' or (rested == 'at times' and k > 300) else 0.0
        learning.look_ahead(control.arrays, True, *AT_REST)
        sample['realised'][X] = -force[k % 400] - 0.2
        learning.learn(control.arrays)
    found = []
    for _ in range(400):
        learning.look_ahead(control.arrays, True, *AT_REST)
        found.append(axes['learned'][X])
        learning.learn(control.arrays)
    mean = -0.2 if rested in ('at times', 'law') else 0.0
    np.testing.assert_allclose(found, mean - share * force, atol=0.1)


def test_what_was_loaded_is_fed_forward_whole(tmp_path: Path) -> None:
    """An internal model that begins with it has nothing yet; then it stays, in every table."""
    learned, control, force = made_up(**{'internal_model.fundamental': 2.0 * np.pi / 0.2})
    for _ in range(4):
        pass_by(learned, control, force, factor=0.0)
    learned.save(tmp_path / 'learned.npz')
    for learning in (learned, made_up(**{'internal_model.fundamental': 2.0 * np.pi / 0.2})[0]):
        learning.load(tmp_path / 'learned.npz')
        learning.rest()
        for _ in range(4):
            pass_by(learning, control, force, factor=0.0)
        pass_by(learning, control, force[:51], factor=0.0)
        assert control.arrays.axes['learned'][X] == pytest.approx(-force[50], abs=0.06)


@pytest.mark.parametrize('way', [[[0.0, 2e-6, 0.0, 0.0, 0.0]], [[0.0] * 5, [0.0, 0.0, 0.01, 0, 0]]])
def test_a_reference_that_begins_elsewhere_is_fed_nothing(
    way: list[list[float]], tmp_path: Path
) -> None:
    """Until it is the one to learn."""
    learned, control, force = made_up()
    for _ in range(4):
        pass_by(learned, control, force, factor=0.0)
    learned.rest()
    learned.save(tmp_path / 'learned.npz')
    loaded = made_up(**{'learning.file': str(tmp_path / 'learned.npz')})[0]
    loaded.load(tmp_path / 'learned.npz')
    other = np.array(AT_REST)
    other[: len(way)] += way
    for learning in (learned, loaded):
        for measured in (True, True, False, True):
            learning.look_ahead(control.arrays, measured, *other)
            assert not np.any(control.arrays.axes['learned'])
        learning.look_ahead(control.arrays, False, *AT_REST)
        pass_by(learning, control, force[:350], factor=0.0)
        assert abs(control.arrays.axes['learned'][X]) > 0.05
        learning.rest()
        learning.begin()
        learning.look_ahead(control.arrays, True, *other)
        assert learning.arrays.state['follows']


@pytest.mark.parametrize(('growth', 'grew'), [(1.25, False), (1.4, True)])
def test_a_growing_error_brings_the_best_back(growth: float, grew: bool) -> None:
    """Within the pass in which it grows by more than 1.3."""
    learning, control, force = made_up()
    for each in (force, force, force, force, force[:150]):
        pass_by(learning, control, each, factor=0.3)
    best = int(learning.arrays.state['best'][0])
    kept = learning.arrays.tables[best].copy()
    learning.arrays.state['floor'] = 0.0
    least = np.sqrt(learning.arrays.state['least'][0][X] / 400)
    for _ in range(400):
        learning.look_ahead(control.arrays, True, *AT_REST)
        control.arrays.sample['error'][X] = growth * least  # of a whole pass
        learning.learn(control.arrays)
    assert (learning.arrays.state['stage'][0] == GREW) == grew
    assert learning.learning != grew
    if grew:
        np.testing.assert_array_equal(learning.table, kept)


def test_an_axis_that_errs_by_less_than_counts_does_not_decide() -> None:
    """y read as still in the first pass, and off by a part of a count from then on."""
    learning, control, force = made_up(**{'learning.passes': 4})
    for n in range(5):
        control.arrays.sample['error'][Y] = 5e-7 * n
        pass_by(learning, control, force, factor=0.3)
    assert learning.arrays.state['stage'] == DONE
    np.testing.assert_allclose(learning.table[:, X], -force, atol=0.2)


def test_what_is_learned_is_limited() -> None:
    learning, control, force = made_up(**{'learning.largest': (0.1,) * 5})
    for _ in range(4):
        pass_by(learning, control, force)
    assert np.abs(learning.table).max() == 0.1


def test_learning_begins_with_a_period_and_ends_on_demand() -> None:
    """Begun in the middle of one, a pass is flown before it counts."""
    learning, control, force = made_up()
    learning.end()
    pass_by(learning, control, force[:150])
    learning.begin()
    pass_by(learning, control, force[150:])
    assert learning.arrays.state['recorded'] == 0
    pass_by(learning, control, force)
    assert len(learning.history) == 0
    pass_by(learning, control, force)
    assert len(learning.history) == 1
    learning.end()
    assert not learning.learning
    assert learning.describe().startswith('not learning') or 'passes' in learning.describe()


@pytest.mark.parametrize('passes', [2, 3])
def test_another_law_goes_on_where_the_one_before_has_come(passes: int) -> None:
    """Learns over what is left, or no more."""
    learning, control, force = made_up(**{'learning.passes': 3})
    for _ in range(passes):
        pass_by(learning, control, force, factor=0.3)
    pass_by(learning, control, force[:150])
    changed = replace(control.parameters, {'x.bandwidth': 180.0})
    successor, control = learning.redesigned(changed), Regulator(changed)
    np.testing.assert_array_equal(successor.history, learning.history)
    np.testing.assert_array_equal(successor.table, learning.table)
    assert successor.learning == learning.learning == (passes < 3)
    assert successor.describe() == learning.describe()
    for each in (force, force[:150]):
        pass_by(successor, control, each, factor=0.3)
    assert len(successor.history) == 3
    assert successor.arrays.state['stage'] == DONE
    learning.end()
    assert learning.redesigned(changed).arrays.state['stage'] == learning.arrays.state['stage']


# -- files -----------------------------------------------------------------------------------------


def test_what_is_learned_is_saved_and_loaded(tmp_path: Path) -> None:
    path = tmp_path / 'learned.npz'
    learning, control, force = made_up()
    for _ in range(3):
        pass_by(learning, control, force)
    learning.save(path)
    again = iterative_learning(
        build(ControllerParameters, {**SHORT, 'learning.file': str(path), 'learning.passes': 0})
    )
    assert again is not None
    assert not again.learning
    np.testing.assert_array_equal(again.table, learning.table)
    assert [file.name for file in tmp_path.iterdir()] == ['learned.npz']


@pytest.mark.parametrize('bandwidth', [50.0, 250.0, 1570.0])
def test_what_is_learned_passes_a_low_pass(bandwidth: float) -> None:
    """Nearly 1 at rest, half at the bandwidth, nothing at half the sample rate; above it nothing.

    Beyond what the samples can hold a windowed sinc is a high-pass, and what is slow is forgotten.
    """
    given = {'learning.period': 8.0, 'learning.bandwidth': bandwidth}
    learning = IterativeLearning(build(ControllerParameters, given))
    low = learning.arrays.kernels[0]
    place = np.arange(low.size) - low.size // 2
    gains = [low @ np.cos(PERIOD * omega * place) for omega in (0.0, bandwidth, np.pi / PERIOD)]
    np.testing.assert_allclose(gains, [1.0, 0.5, 0.0], atol=0.01)


def test_what_does_not_fit_is_refused(tmp_path: Path) -> None:
    path = tmp_path / 'learned.npz'
    IterativeLearning(build(ControllerParameters, SHORT)).save(path)
    for given, reason in (
        ({'learning.period': 0.8}, r"'learning.file'.*\(400, 5\).*\(800, 5\)"),
        ({'learning.period': 4.0 / 3.0}, r"'learning.period' is 1\.33333 s.*4 s"),
        ({'learning.period': 0.1}, "'learning.period' is 0.1 s"),
        ({'learning.bandwidth': 1600.0}, "'learning.bandwidth' is 1600 rad/s, more than half"),
    ):
        with pytest.raises(ParameterError, match=reason):
            iterative_learning(
                build(ControllerParameters, {**SHORT, 'learning.file': str(path), **given})
            )
    for content in (b'', b'PK no archive', b'1,2,3\n'):
        path.write_bytes(content)
        with pytest.raises(ParameterError, match=r'cannot read .*learned'):
            iterative_learning(build(ControllerParameters, {**SHORT, 'learning.file': str(path)}))
    table = np.zeros((400, 5))
    np.savez(path, sample_time=PERIOD, table=table, start=np.zeros(5))
    with pytest.raises(ParameterError, match='does not say where its period begins'):
        iterative_learning(build(ControllerParameters, {**SHORT, 'learning.file': str(path)}))
    np.savez(path, sample_time=PERIOD, table=table)  # as was written before it said that
    assert iterative_learning(build(ControllerParameters, {**SHORT, 'learning.file': str(path)}))
    np.savez(path, sample_time=PERIOD, table=np.full((400, 5), np.nan))
    with pytest.raises(ParameterError, match='not finite'):
        iterative_learning(build(ControllerParameters, {**SHORT, 'learning.file': str(path)}))


@pytest.mark.parametrize(
    ('given', 'reason'),
    [
        ({'learning.period': 0.0}, "'learning.period' is 0, nothing is learned"),
        ({'learning.passes': 0}, "it is not there, and with 'learning.passes' 0"),
        ({'learning.file': '/proc/none/learned.npz'}, "cannot be written to '/proc/none'"),
        ({'learning.file': '/proc'}, 'no file'),
    ],
)
def test_a_file_that_would_not_be_used_is_refused(
    given: dict[str, object], reason: str, tmp_path: Path
) -> None:
    path = {'learning.file': str(tmp_path / 'learned.npz')}
    assert iterative_learning(build(ControllerParameters, {**SHORT, **path}))
    with pytest.raises(ParameterError, match=rf"parameter 'learning.file' is '.*': .*{reason}"):
        iterative_learning(build(ControllerParameters, {**SHORT, **path, **given}))


# -- in the graph as in the library ----------------------------------------------------------------


def test_the_supervisor_learns_what_the_compiled_loop_learns() -> None:
    """Bit for bit, over a break of the repeated reference and a landing."""
    parameters = build(ControllerParameters, SHORT)
    time = PERIOD * np.arange(1300)[:, None]
    still = held(HOVER, 0.2, PERIOD)
    omega, size = 2.0 * np.pi / 0.4, np.array([0.0, 5e-3, 2.5e-3, 0.0, 0.0])
    turning = References(
        HOVER + size * (1.0 - np.cos(omega * time)),
        size * omega * np.sin(omega * time),
        size * omega**2 * np.cos(omega * time),
    )
    references = References(
        *(np.concatenate(parts) for parts in zip(still, turning, still, turning, strict=True))
    )
    tracks = np.concatenate(
        [[p] * len(r.position) for p, r in ((False, still), (True, turning))] * 2
    )
    heavier = 1.2 * parameters.machine.mass_x  # a force to learn
    table = build(PlantParameters, {'initial.position': tuple(HOVER), 'machine.mass_x': heavier})
    supervisor = Supervisor(parameters)
    assert supervisor.learning is not None
    alone, regulator = copy.deepcopy(supervisor.learning), Regulator(parameters)
    outcome = run(regulator, SimulatedStage(table), references, learning=alone, follows=tracks)
    stage, buffer = SimulatedStage(table), supervisor.references
    buffer.store(0, Phase.REST, 0, HOVER, np.zeros(5), np.zeros(5))
    supervisor.step(buffer.find(0), np.full(4, HOVER[0]), 0.0, 0.0)
    for k, track in enumerate(tracks):
        phase = Phase.TRACK if track else Phase.HOLD
        buffer.store(k + 1, phase, 1, *(column[k] for column in references))
        supervisor.step(buffer.find(k + 1), *stage.read())
        stage.write(supervisor.direct_current, supervisor.quadrature_current)
        np.testing.assert_array_equal(supervisor.direct_current, outcome.direct_current[k])
    assert len(alone.history) == 3
    np.testing.assert_array_equal(supervisor.learning.table, alone.table)
    np.testing.assert_array_equal(supervisor.learning.history, alone.history)
    assert alone.table[:, X].any()
