"""The comparison of the laws: its pieces, its output, what it refuses."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from maglev_model.axes import THETA, X, Y
from maglev_model.parameters import ParameterError, build
from maglev_plant.parameters import PlantParameters
from maglev_study.closed_loop import at_stops
from maglev_study.comparison import experiments, region
from maglev_study.comparison.contestants import find_contestants
from maglev_study.comparison.experiments import Row, StepExperiment
from maglev_study.comparison.flight import Flight, judge
from maglev_study.comparison.main import compare
from maglev_study.comparison.region import LOST, NOT_SETTLED, Region
from maglev_study.comparison.table import share, table, to_json
from maglev_study.references import HOVER

PARAMS = Path(__file__).resolve().parents[2] / 'params'


def test_the_approaches_come_in_the_papers_order() -> None:
    """All six, each what its file says, and a name that is none of them."""
    found = find_contestants(PARAMS)
    assert tuple(one.name for one in found) == (
        'jacobian_lead_lag',
        'feedback_lead_lag',
        'feedback_soi',
        'regulator_3dof',
        'paper',
        'default',
    )
    by_name = {one.name: one for one in found}
    assert by_name['paper'].controller.inverse == 'simplified'
    assert by_name['default'].controller.law == 'output_regulator'
    assert not by_name['regulator_3dof'].tilts
    assert by_name['regulator_3dof'].stage().guide.locked == (False, False, False, True, True)
    assert by_name['paper'].stage().guide.locked == (False,) * 5
    with pytest.raises(ParameterError, match="no law 'ours', there are: jacobian_lead_lag"):
        find_contestants(PARAMS, ['ours'])


def test_a_law_may_be_a_file_that_lies_anywhere(tmp_path: Path) -> None:
    path = tmp_path / 'mine.yaml'
    path.write_text('controller: {ros__parameters: {y: {bandwidth: 150.0}}}\n')
    found = find_contestants(PARAMS, ['default', str(path)])
    assert {one.name: one.controller.y.bandwidth for one in found} == {
        'default': 195.0,
        'mine': 150.0,
    }
    with pytest.raises(ParameterError, match='cannot read'):
        find_contestants(PARAMS, [str(tmp_path / 'none.yaml')])


def test_an_overlay_lies_over_every_law(tmp_path: Path) -> None:
    """Its machine is the law's and the stage's; the last one wins; others' sections are theirs."""
    over, last = tmp_path / 'over.yaml', tmp_path / 'last.yaml'
    over.write_text(
        '/**: {ros__parameters: {machine: {mass_y: 7.5}, guide: {viscous: [1.0, 1.0,'
        ' 1.0, 1.0, 1.0]}}}\nreference: {ros__parameters: {duration: 3.0}}\n'
    )
    last.write_text(
        'controller: {ros__parameters: {y: {controlled: true}}}\n'
        'plant: {ros__parameters: {machine: {mass_y: 7.6}}}\n'
    )
    for one in find_contestants(PARAMS, overlays=[over, last]):
        assert one.controller.machine.mass_y == 7.5
        assert one.stage().machine.mass_y == 7.6
        assert one.stage().guide.viscous == (1.0,) * 5


def test_judgement() -> None:
    """Overshoot and settling of a known response: e^(-t) (1 + 0.2 at one sample)."""
    time = 1e-3 * np.arange(12_000)
    response = 2.0 - np.exp(-time)
    found = judge(response, 1.0, 2.0, 1e-3, 1e-3)
    assert found.overshoot == 0.0
    assert found.settling == pytest.approx(-math.log(1e-3), abs=2e-3)
    response[3000] = 2.2
    assert judge(response, 1.0, 2.0, 1e-3, 1e-3).overshoot == pytest.approx(20.0)
    assert math.isinf(judge(response[:3000], 1.0, 2.0, 1e-3, 1e-3).settling)


def test_saved_flights_go_on_alike() -> None:
    """Restoring brings stage and regulator back to the last bit."""
    flight = Flight(find_contestants(PARAMS, ['feedback_soi'])[0])
    assert flight.approach(HOVER, 0.1, 0.2)
    saved = flight.save()
    target = HOVER + np.array([0.0, 2e-4, 0.0, 0.0, 0.0])
    outcomes = []
    for _ in range(2):
        flight.restore(saved)
        outcome = flight.step(HOVER, target, 0.0, 0.2)
        assert outcome is not None
        outcomes.append(outcome.state)
    np.testing.assert_array_equal(outcomes[0], outcomes[1])


def test_a_platen_at_a_stop_is_lost() -> None:
    """Ten millimetres up from 25 mm without a law that could: None, not a figure."""
    law = find_contestants(PARAMS, ['jacobian_lead_lag'])[0]
    flight = Flight(law)
    target = HOVER.copy()
    target[Y] = 0.020
    assert flight.step(HOVER, target, 0.0, 1.0) is None
    level = Flight(find_contestants(PARAMS, ['default'])[0])
    low = HOVER.copy()
    low[Y] = 0.019
    assert level.approach(low, 1.0, 0.2)
    tilted = low.copy()
    tilted[THETA] = 0.0101  # the seats at 0.1 m come to 18 mm
    assert level.step(low, tilted, 1.0, 2.0) is None


def test_seats_meet_a_stop_also_where_the_gap_is_locked() -> None:
    plant = build(PlantParameters, {'guide.locked': (True, False, False, False, False)})
    low, tilted = np.array([0.019, 0.0, 0.0, 0.0, 0.0]), np.array([0.019, 0.0, 0.0, 0.0, 0.0101])
    assert at_stops(plant)(np.stack([low, tilted])).tolist() == [False, True]


def test_region_of_the_default_and_of_the_linear_law(monkeypatch: pytest.MonkeyPatch) -> None:
    """The one survives all, the other small steps; where there is no such step is NaN."""
    sizes = np.array([-5e-3, 1e-4, 2e-3])
    monkeypatch.setattr(region, 'grids', lambda axis, quick: (np.array([0.022]), sizes))
    monkeypatch.setattr(region, '_HORIZON', 1.0)
    laws = {one.name: one for one in find_contestants(PARAMS)}
    ours = region.region(laws['default'], Y, True).settling
    assert math.isnan(ours[0, 0])
    assert np.all((ours[0, 1:] >= 0.0) & (ours[0, 1:] < 0.3))
    linear = region.region(laws['jacobian_lead_lag'], Y, True).settling
    assert 0.0 <= linear[0, 1] < 0.5
    assert linear[0, 2] == LOST
    assert np.isnan(region.region(laws['regulator_3dof'], THETA, True).settling).all()


@pytest.mark.parametrize('quick', [True, False])
@pytest.mark.parametrize('axis', [Y, X, THETA])
def test_grids_stay_in_range(axis: int, quick: bool) -> None:
    """Ascending, gaps within the stops, x and tilt steps within theirs."""
    gap, size = region.grids(axis, quick)
    assert np.all(np.diff(gap) > 0.0)
    assert np.all(np.diff(size) > 0.0)
    assert 0.018 < gap[0] < gap[-1] < 0.031
    assert size[-1] <= {Y: 0.011, X: 0.060, THETA: 0.013}[axis] + 1e-9


def test_table_and_json() -> None:
    """Columns by law, rows by experiment, sections once; infinite figures are null."""
    rows = {
        'one': [Row('steps', 'y', '1 %', (1.0, 2.0)), Row('steps', 'x', 'lost', (math.inf,) * 2)],
        'two': [Row('steps', 'y', '3 %', (3.0, 4.0)), Row('steps', 'x', '-', ())],
    }
    settling = np.array([[0.2, LOST, NOT_SETTLED, np.nan]])
    one = Region(Y, np.array([0.025]), np.arange(4.0), settling)
    regions = {name: [one] for name in rows}
    text = table(rows, regions).splitlines()
    assert text[0].split() == ['one', 'two']
    first = next(line for line in text if line.startswith('  y '))
    assert first.split() == ['y', '1', '%', '3', '%']
    assert sum(line == 'steps' for line in text) == 1
    assert share(one) == '67 %, 33 %'
    content = json.loads(to_json(rows, regions, {}))
    assert content['experiments']['one'][1]['values'] == [None, None]
    assert content['regions']['two'][0]['settling'] == [[0.2, 'lost', 'unsettled', None]]


def test_the_whole_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two laws over a few experiments: table, JSON and picture."""
    sizes = np.array([1e-4, 1e-3])
    monkeypatch.setattr(region, 'grids', lambda axis, quick: (np.array([0.025]), sizes))
    monkeypatch.setattr(experiments, 'MISMATCHES', experiments.MISMATCHES[:1])
    monkeypatch.setattr(experiments, 'SMALL_STEPS', (StepExperiment(THETA, 0.0, 2e-4, fine=True),))
    monkeypatch.setattr(experiments, 'LARGE_STEPS', (StepExperiment(Y, 0.020, 0.027),))
    monkeypatch.setattr(experiments, 'SHAPED_STEPS', ())
    out = tmp_path / 'a' / 'b'
    options = ['--params', str(PARAMS), '--out', str(out), '--quick', '--laws']
    assert compare([*options, 'default', 'regulator_3dof', '--json']) == 0
    captured = capsys.readouterr()
    printed, outcome = captured.err, json.loads(captured.out)
    assert 'without ROS' in printed
    text = (out / 'comparison.txt').read_text()
    assert text in printed
    line = next(line for line in text.splitlines() if '20 -> 27' in line)
    assert '13.5 %' in line
    assert '0.1 %' in line
    assert (out / 'regions.png').read_bytes()[:4] == b'\x89PNG'
    found = json.loads((out / 'comparison.json').read_text())
    assert set(found['regions']) == {'default', 'regulator_3dof'}
    assert outcome == {'passed': True, 'out': str(out), 'comparison': found}


@pytest.mark.parametrize(
    ('options', 'reason'),
    [
        (['--laws', 'nobody'], "there is no law 'nobody'"),
        (['--laws', 'feedback_soi', '--bandwidth', '900'], 'y: a crossover of 900 rad/s'),
        (['--laws', 'default', '--out', '/proc/none/x'], "cannot write to '/proc/none/x'"),
        (['--overlay', 'none.yaml'], "cannot read parameter file 'none.yaml'"),
    ],
)
def test_bad_options(
    options: list[str], reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line, exit code 2, nothing flown."""
    assert compare(['--params', str(PARAMS), '--out', str(tmp_path), *options]) == 2
    captured = capsys.readouterr()
    assert reason in captured.err
    assert captured.err.count('\n') == 1
    assert not captured.out
