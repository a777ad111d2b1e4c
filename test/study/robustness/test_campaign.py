"""A campaign: the same on one process and on two, and after an interruption; what it leaves."""

from __future__ import annotations

import csv
import dataclasses
import html
import json
import os
import re
import shlex
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from maglev_controller.parameters import ControllerParameters
from maglev_model.axes import AXES
from maglev_model.parameters import ParameterError, from_yaml
from maglev_model.programs.optional import MissingLibraryError
from maglev_model.programs.progress import Progress
from maglev_plant.parameters import PlantParameters
from maglev_reference.parameters import ReferenceParameters
from maglev_study.command import DONE, INTERRUPTED, WRONG_USE
from maglev_study.robustness import fleet, guarantee
from maglev_study.robustness.draw import NOMINAL
from maglev_study.robustness.experiments import experiments
from maglev_study.robustness.fleet import JOURNAL, Campaign, Plan, fly_plan, make_plan
from maglev_study.robustness.fly import FLOWN, LOST, Flown, fly
from maglev_study.robustness.main import run
from maglev_study.robustness.outcome import Group, groups, influence, worst
from maglev_study.robustness.page import render, survivors
from maglev_study.robustness.table import write_table

PARAMS = Path(__file__).resolve().parents[3] / 'params'
EXPERIMENTS = ('ellipse', 'step_theta')


@pytest.fixture(scope='module')
def plan() -> Plan:
    """The nominal machine and two drawn ones, under the default law, through little."""
    return make_plan(PARAMS, 2, names=EXPERIMENTS)


def call_of(out: Path) -> list[str]:
    """The command's arguments for that plan."""
    call = ['--params', str(PARAMS), '--machines', '2', '--jobs', '1', '--out', str(out)]
    return [*call, '--experiment', *EXPERIMENTS]


@pytest.fixture(scope='module')
def whole(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> tuple[Campaign, Path]:
    """Flown in one go, in this process."""
    out = tmp_path_factory.mktemp('whole')
    return fly_plan(plan, out), out


def plain(campaign: Campaign) -> list[str]:
    """All results, to the last bit."""
    return [repr(one.to_json()) for one in campaign.flown]


def test_two_processes_give_what_one_gives(
    plan: Plan, whole: tuple[Campaign, Path], tmp_path: Path
) -> None:
    found = fly_plan(plan, tmp_path, jobs=2)
    assert plain(found) == plain(whole[0])
    assert not found.interrupted


def test_an_interrupted_campaign_goes_on_where_it_was(
    plan: Plan, whole: tuple[Campaign, Path], tmp_path: Path
) -> None:
    heard: list[tuple[int, int]] = []

    def stop(done: int, wanted: int, new: Sequence[Flown]) -> None:
        heard.append((done, wanted))
        if len(heard) == 2:
            raise KeyboardInterrupt

    part = fly_plan(plan, tmp_path, heard=stop)
    assert part.interrupted
    assert heard == [(0, 3), (1, 3)]
    path = tmp_path / JOURNAL
    with path.open('ab') as file:
        file.write(path.read_bytes().splitlines()[-1][:100])  # the machine went down in mid-line
    heard.clear()
    found = fly_plan(plan, tmp_path, heard=lambda *told: heard.append(told[:2]))
    assert heard == [(1, 3), (2, 3), (3, 3)]
    assert plain(found) == plain(whole[0])
    assert path.read_bytes() == (whole[1] / JOURNAL).read_bytes()
    heard.clear()
    again = fly_plan(dataclasses.replace(plan, machines=1), tmp_path, heard=heard_all(heard))
    assert heard == [(2, 2)]
    assert {one.machine for one in again.flown} == {0, 1}


def heard_all(heard: list[tuple[int, int]]) -> Any:
    """What adds to a list."""
    return lambda *told: heard.append(told[:2])


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        ({'seed': 1}, 'holds a campaign whose seed is 0'),
        ({'laws': ['paper']}, r"whose laws is \['default'\]"),
        ({'names': ['ellipse']}, r"whose experiments is \['ellipse', 'step_theta'\]"),
    ],
)
def test_a_folder_of_another_campaign_is_refused(
    change: dict[str, Any], words: str, whole: tuple[Campaign, Path]
) -> None:
    with pytest.raises(ParameterError, match=words):
        fly_plan(make_plan(PARAMS, 2, **{'names': EXPERIMENTS, **change}), whole[1])


def test_other_parameters_and_other_files_are_refused(
    whole: tuple[Campaign, Path], tmp_path: Path
) -> None:
    over = tmp_path / 'over.yaml'
    over.write_text('plant: {ros__parameters: {offset: {K_h: 1.01}}}\n')
    with pytest.raises(ParameterError, match='whose plant of default is'):
        fly_plan(make_plan(PARAMS, 2, names=EXPERIMENTS, overlays=[over]), whole[1])
    over.write_text('robustness: {ros__parameters: {factor: {magnets: {width: 0.0}}}}\n')
    with pytest.raises(ParameterError, match='whose distributions is'):
        fly_plan(make_plan(PARAMS, 2, names=EXPERIMENTS, overlays=[over]), whole[1])
    (tmp_path / JOURNAL).write_text('[]\n')
    with pytest.raises(ParameterError, match='is no campaign'):
        fly_plan(make_plan(PARAMS, 2), tmp_path)


def test_figures_are_those_of_the_flight(plan: Plan, whole: tuple[Campaign, Path]) -> None:
    campaign = whole[0]
    assert [(one.machine, one.experiment) for one in campaign.flown] == [
        (machine, name) for machine in range(3) for name in EXPERIMENTS
    ]
    for one in campaign.flown:
        assert one.verdict == FLOWN
        assert np.all(one.mean <= one.rms + 1e-18)
        assert np.all(one.rms <= one.peak + 1e-18)
        assert one.envelope.max(axis=0) == pytest.approx(one.peak, rel=1e-6)
        assert np.isfinite(one.settling) == one.experiment.startswith('step')
        assert Flown.from_json(one.to_json()).to_json() == one.to_json() or np.isnan(one.settling)


def test_a_machine_that_no_current_can_carry_is_lost(plan: Plan) -> None:
    drawn = plan.draw(plan.contestants[0], NOMINAL)
    heavy = dataclasses.replace(
        drawn.plant, offset=dataclasses.replace(drawn.plant.offset, mass_y=9.0)
    )
    found = fly(dataclasses.replace(drawn, plant=heavy), plan.contestants[0], EXPERIMENTS)
    assert [one.experiment for one in found] == list(EXPERIMENTS)
    assert {one.verdict for one in found} == {LOST}
    assert 'the platen meets a stop' in found[0].reason
    assert np.isnan(found[0].mean).all()
    assert found[0].envelope.shape == (0, 5)


def group(means: Sequence[float], lost: int = 0) -> Group:
    """The ellipse with these mean errors of y, first the nominal one's, and some more lost."""
    flown = [
        Flown(number, 'default', 'ellipse', FLOWN, mean=np.array([mean, 0.0, 0.0, 0.0, 0.0]))
        for number, mean in enumerate(means)
    ]
    flown += [
        Flown(len(means) + number, 'default', 'ellipse', LOST, 'sample 3: it fell')
        for number in range(lost)
    ]
    return Group('default', experiments(1e-3)[0], tuple(flown))


def test_worse_is_more_than_twice_the_nominal_error_and_lost_is_worst() -> None:
    found = group([5e-6, 9.9e-6, 10.1e-6, 4e-6])
    assert found.worse.tolist() == [False, True, False]
    told = worst([found], 'default')
    assert told is not None
    assert (told.machine, told.experiment) == (2, 'ellipse')
    assert told.what == 'mean error of y 10.10 µm, 5.00 on the nominal machine'
    assert survivors([found], ['default']) == [['ellipse', '3 of 3, 1 worse']]
    assert not group([1e-9, 0.9e-6]).worse.any()
    found = group([5e-6, 9.9e-6], lost=2)
    told = worst([found], 'default')
    assert told is not None
    assert (told.machine, told.what) == (2, 'lost: sample 3: it fell')
    assert survivors([found], ['default']) == [['ellipse', '1 of 3']]


def test_the_parameter_that_matters_comes_first() -> None:
    drawn = {'mass': np.arange(6.0), 'other': np.array([1.0, 5.0, 2.0, 0.0, 3.0, 4.0])}
    drawn['fixed'] = np.ones(6)
    found = influence(group([1e-6, 2e-6, 3e-6, 4e-6, 5e-6, 6e-6], lost=1), drawn)
    assert [name for name, _ in found] == ['mass', 'other']
    assert found[0][1] == pytest.approx(1.0)
    assert influence(group([1e-6] * 7), drawn) == []


def test_an_interrupted_campaign_is_called_incomplete(
    whole: tuple[Campaign, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    for charts in (
        'fans',
        'distributions',
        'tornado',
    ):  # which take long, and are on the page below
        monkeypatch.setattr(f'maglev_study.robustness.page.{charts}', lambda *_: [])
    for interrupted in (False, True):
        text = render(dataclasses.replace(whole[0], interrupted=interrupted), (), {})
        assert ('class="badge incomplete"' in text) == interrupted


def test_the_page_and_the_command(
    whole: tuple[Campaign, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setattr(guarantee, 'GAPS', (0.02, 0.025))
    monkeypatch.setattr(guarantee, 'SETS', 2)
    shutil.copy(whole[1] / JOURNAL, tmp_path)
    assert run([*call_of(tmp_path), '--json']) == DONE
    captured = capsys.readouterr()
    assert 'robustness: 3 of 3 flown' in captured.err
    outcome = json.loads(captured.out)
    assert outcome['passed'] is True
    assert outcome['survivors']['ellipse'] == {'default': '2 of 2'}
    assert str(tmp_path / 'robustness.html') in outcome['files']
    page = (tmp_path / 'robustness.html').read_text(encoding='utf-8')
    told = worst(groups(whole[0]), 'default')
    assert told is not None
    for words in (
        '2 of 2',
        f'scenarios/robustness.sh --seed 0 --replay {told.machine}',
        '47.0',
        'Errors over time: ellipse',
        'Distributions',
        'Guaranteed margins over the range',
        'machines 1 to 2 are guaranteed ±',
        'Which parameter matters',
        'offset.spring_theta',
        'remanence within a grade',
    ):
        assert words in page


def test_the_command_that_flies_the_worst_machine_finds_its_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(guarantee, 'GAPS', (0.025,))
    monkeypatch.setattr(guarantee, 'SETS', 2)
    law, over = tmp_path / 'my law.yaml', tmp_path / "o'er.yaml"
    for path in (law, over):
        path.write_text('/**: {ros__parameters: {}}\n')
    call = [
        '--params',
        str(PARAMS),
        '--machines',
        '1',
        '--jobs',
        '1',
        '--law',
        os.path.relpath(law),
    ]
    call += ['--overlay', str(PARAMS / 'benchmark.yaml'), '--overlay', os.path.relpath(over)]
    assert run([*call, '--experiment', 'step_theta', '--out', str(tmp_path)]) == DONE
    page = html.unescape((tmp_path / 'robustness.html').read_text(encoding='utf-8'))
    (told,) = re.findall('scenarios/robustness.sh .* --replay 1', page)
    assert shlex.split(told)[3:-2] == [
        *('--params', 'benchmark', '--params', str(over), '--law', str(law)),
    ]


def test_margins_are_those_within_the_stops(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(guarantee, 'GAPS', (0.02, 0.025))
    monkeypatch.setattr(guarantee, 'SETS', 2)
    over = tmp_path / 'over.yaml'
    over.write_text('/**: {ros__parameters: {machine: {gap_min: 0.021, theta_max: 0.005}}}\n')
    (found,) = guarantee.guarantees(make_plan(PARAMS, 1, overlays=[over]))
    assert {(one.place.gap, one.place.tilt) for one in found.over} == {(0.025, 0.0)}


def test_without_margins_there_is_a_page_that_says_why(
    whole: tuple[Campaign, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setattr(guarantee, 'GAPS', ())
    monkeypatch.setattr(guarantee, 'HOVERING', guarantee.Place(0.05, 0.0, 0.1, 0))
    shutil.copy(whole[1] / JOURNAL, tmp_path)
    assert run(call_of(tmp_path)) == DONE
    page = (tmp_path / 'robustness.html').read_text(encoding='utf-8')
    for said in (capsys.readouterr().out, page):
        assert 'puts y at 0.05 m, it must lie within the stops' in said
    assert '2 of 2' in page


def test_the_table_holds_every_figure(
    whole: tuple[Campaign, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    parquet = pytest.importorskip('pyarrow.parquet', reason='pyarrow comes with the test tools')
    path, note = write_table(whole[0], tmp_path)
    assert (path.name, note) == ('machines.parquet', '')
    table = parquet.read_table(path).to_pydict()
    monkeypatch.setitem(sys.modules, 'pyarrow', None)
    path, note = write_table(whole[0], tmp_path)
    assert path.name == 'machines.csv'
    assert "pip install 'pyarrow<26'" in note
    with path.open('r', encoding='utf-8') as file:
        rows = list(csv.DictReader(file))
    assert list(table) == list(rows[0])
    assert len(rows) == len(whole[0].flown)
    for number, (row, one) in enumerate(zip(rows, whole[0].flown, strict=True)):
        assert (int(row['machine']), row['experiment']) == (one.machine, one.experiment)
        assert [float(row[f'mean_{axis}']) for axis in AXES] == one.mean.tolist()
        assert [table[f'peak_{axis}'][number] for axis in AXES] == one.peak.tolist()
    assert table['offset.mass_y'][-1] == float(rows[-1]['offset.mass_y']) != 1.0


def test_a_campaign_of_other_code_is_refused(
    plan: Plan, whole: tuple[Campaign, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fleet, 'sources_digest', lambda: 'other')
    with pytest.raises(ParameterError, match=r"whose code is .*, this one's is 'other'"):
        fly_plan(plan, whole[1])


def test_a_machine_is_written_for_the_graph(plan: Plan, tmp_path: Path) -> None:
    call = ['--params', str(PARAMS), '--out', str(tmp_path), '--replay']
    assert run([*call, '2']) == DONE
    path = tmp_path / 'machine-2.yaml'
    (contestant,) = plan.contestants
    assert from_yaml(PlantParameters, 'plant', path) == plan.draw(contestant, 2).plant
    assert from_yaml(ControllerParameters, 'controller', path) == contestant.controller
    assert run([*call, '2', '--law', 'paper', 'default']) == WRONG_USE


@pytest.mark.parametrize(('law', 'amplitude'), [('default', 0.01), ('regulator_3dof', 0.0)])
def test_the_graph_flies_what_the_campaign_flew(law: str, amplitude: float, tmp_path: Path) -> None:
    call = ['--params', str(PARAMS), '--out', str(tmp_path), '--law', law, '--replay', '1']
    assert run(call) == DONE
    files = PARAMS / 'scenario_ellipse_4dof.yaml', tmp_path / 'machine-1.yaml'
    course = from_yaml(ReferenceParameters, 'reference', *files).sinusoids
    assert course.theta.amplitude == (amplitude,)
    assert course.x.amplitude == (0.03,)


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (['--law', 'ours'], "there is no law 'ours'"),
        (['--experiment', 'step'], "there is no experiment 'step', there are: ellipse, forces,"),
        (['--overlay', 'none.yaml'], 'cannot read parameter file'),
        (['--scheduler', 'host'], "'host' is no address of a scheduler: missing port number"),
        (['--out', '/proc/none'], "cannot write to '/proc/none': No such file or directory"),
    ],
)
def test_wrong_use_is_told_in_a_line(
    arguments: list[str], words: str, tmp_path: Path, capsys: Any
) -> None:
    assert run(['--params', str(PARAMS), '--out', str(tmp_path), *arguments]) == WRONG_USE
    said = capsys.readouterr().err
    assert words in said
    assert len(said.splitlines()) == 1


def test_a_scheduler_without_dask_is_told_what_to_install(
    plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, 'distributed', None)
    with pytest.raises(MissingLibraryError, match=r'needs distributed: /.* -m pip'):
        fly_plan(plan, tmp_path, scheduler='tcp://localhost:1')


def test_ctrl_c_among_the_margins_keeps_what_was_flown(
    whole: tuple[Campaign, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(progress: Progress, *_: object) -> None:
        if progress._what == 'margins':
            raise KeyboardInterrupt

    monkeypatch.setattr(Progress, 'tell', interrupted)
    shutil.copy(whole[1] / JOURNAL, tmp_path)
    assert run(call_of(tmp_path)) == INTERRUPTED
    page = (tmp_path / 'robustness.html').read_text(encoding='utf-8')
    assert 'incomplete' in page
    assert '2 of 2' in page


def test_ctrl_c_leaves_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr('maglev_model.programs.progress.Progress.tell', interrupted)
    assert run(['--params', str(PARAMS), '--jobs', '1', '--out', str(tmp_path)]) == INTERRUPTED
    assert 'incomplete' in (tmp_path / 'robustness.html').read_text(encoding='utf-8')
