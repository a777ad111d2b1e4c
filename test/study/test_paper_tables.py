"""``paper_tables FOLDER``: the paper's figures beside those of made-up runs."""

from __future__ import annotations

import copy
import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from maglev_model.paper import SCENARIOS, STEPS, TRACKING
from maglev_monitor.bag.analysis import analyse
from maglev_study import paper_plots, paper_tables
from maglev_study.paper_tables import CASES, COLUMNS, HEADS, NOT_PASSED, NOTHING, PASS

MADE = [step for step in STEPS if (step.axis, step.target) in (('y', 0.027), ('theta', 0.01))]
"""The steps that the made-up run has."""


@pytest.fixture(scope='module')
def result(bag: Path) -> dict[str, Any]:
    return analyse(bag).result


def factor_of(case: str, scenario: str) -> float:
    """What the figures of a made-up run are multiplied by."""
    return 1.5 ** (1 + 3 * list(CASES).index(case) + SCENARIOS.index(scenario))


@pytest.fixture
def folder(tmp_path: Path, bag: Path, result: dict[str, Any]) -> Path:
    """All runs, their bags all the same one, their figures told apart by a factor."""
    for case, (_, scenarios) in CASES.items():
        for scenario in scenarios:
            run = tmp_path / case / scenario
            run.mkdir(parents=True)
            (run / 'bag').symlink_to(bag)
            own = copy.deepcopy(result)
            own['own_axes']['x']['mean_abs_error'] *= factor_of(case, scenario)
            own['own_steps'][0]['settling_time'] *= factor_of(case, scenario)
            (run / 'metrics.json').write_text(json.dumps(own))
    return tmp_path


@pytest.fixture
def two_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ask for the two steps only that the made-up run has."""
    monkeypatch.setattr(paper_tables, 'STEPS', MADE)
    monkeypatch.setattr(paper_plots, 'STEPS', MADE)


@pytest.fixture
def no_plots(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(paper_plots, 'paper_plots', lambda _: [])


def change(run: Path, **fields: Any) -> None:
    """Change fields of a run's metrics."""
    path = run / 'metrics.json'
    path.write_text(json.dumps({**json.loads(path.read_text()), **fields}))


@pytest.mark.usefixtures('two_steps')
def test_page_is_self_contained_with_every_figure(folder: Path, capsys: Any) -> None:
    assert paper_tables.paper_tables([str(folder)]) == PASS
    page = (folder / 'paper_tables.html').read_text(encoding='utf-8')
    assert not re.findall(r'(?:src|href)="(?!data:)', page)
    assert 'http' not in re.sub(r'base64,[^"]*', '', page)
    titles = re.findall(r'<h2>([^<]*)</h2>', page)
    assert [title[:6] for title in titles] == [
        'Fig. 4',
        'Fig. 5',
        'Fig. 6',
        'Fig. 7',
        'Fig. 8',
        'Runs',
    ]
    assert page.count('data:image/png;base64,') == 5
    assert 'class="badge pass"' in page
    printed = capsys.readouterr()
    assert printed.err == ''
    assert (folder / 'paper_tables.md').read_text(encoding='utf-8') in printed.out
    assert not list(folder.glob('*.tmp'))


@pytest.mark.usefixtures('two_steps', 'no_plots')
def test_each_run_fills_its_own_cells(folder: Path, result: dict[str, Any]) -> None:
    assert paper_tables.paper_tables([str(folder), '--out', str(folder / 'page')]) == PASS
    lines = (folder / 'page' / 'paper_tables.md').read_text(encoding='utf-8').splitlines()
    cells = [[cell.strip() for cell in re.split(r'(?<!\\)\|', line)[1:-1]] for line in lines]
    assert cells[0] == list(HEADS)
    assert {len(row) for row in cells} == {2 + len(COLUMNS)}
    # Two head lines; for each ellipse a heading and its axes; twice a heading and the steps.
    assert len(cells) == 2 + (1 + 3) + (1 + 4) + 2 * (1 + len(MADE))
    found = result['own_axes']['x']
    mean, largest = 1e6 * found['mean_abs_error'], 1e6 * found['max_abs_error']
    for published, scenario, row in zip(
        ('78.33 µm', '77.98 µm'), TRACKING, (row for row in cells if row[0] == 'x'), strict=True
    ):
        shown = [f'{factor_of(case, scenario) * mean:.1f}, {largest:.1f} µm' for case in COLUMNS]
        assert row[1:] == [published, *shown]
    assert [row[1] for row in cells if row[0] == 'theta'] == ['123.9 µrad']
    y, theta = result['own_steps']
    assert theta['encoder_time'] is None
    raw, rounded = cells[-5], cells[-2]
    assert raw[:2] == ['y, 20 → 27 mm', '14.3 %, < 3 s, about 5 s']
    assert cells[-4][:2] == ['theta, 0 → 10 mrad', '22 %, < 5 s, < 10 s']
    assert rounded[:2] == ['y, 20 → 27 mm', '']
    for row, cases in (
        (raw, ('paper', '', '', '')),
        (rounded, ('paper_shaped', 'ours', '', 'ours_rough')),
    ):
        for cell, case in zip(row[2:], cases, strict=True):
            settled = y['settling_time'] * factor_of(case, 'steps') if case else 0.0
            words = f'{y["overshoot_percent"]:.1f} %, {settled:.2f} s, {y["encoder_time"]:.2f} s'
            assert cell == (words if case else '')
    assert cells[-1][2].endswith(' s, never')
    assert f'60 s, simulated over {result["duration"]:g} s' in cells[2][0]


@pytest.mark.usefixtures('no_plots')
def test_what_is_wrong_with_a_run_is_said_and_fails(folder: Path, bag: Path, capsys: Any) -> None:
    change(folder / 'paper' / 'ellipse', verdict='fail', reasons=['x mean is 9', 'more'])
    (folder / 'paper' / 'ellipse_4dof' / 'metrics.json').write_text('{"verdict"')
    (folder / 'ours' / 'ellipse' / 'bag').unlink()
    cut = folder / 'ours' / 'ellipse_4dof' / 'bag'
    cut.unlink()
    cut.mkdir()
    (cut / 'bag.mcap').write_bytes((bag / 'bag_0.mcap').read_bytes()[:-2000])
    shutil.rmtree(folder / 'ours' / 'steps')
    assert paper_tables.paper_tables([str(folder)]) == NOT_PASSED
    problems = dict(
        line.removeprefix('paper_tables: ').split(': ', 1)
        for line in capsys.readouterr().err.splitlines()
    )
    law, ours, *_ = (name for name, _ in CASES.values())
    others = [f'{CASES[case][0]}, steps' for case in ('ours_rough', 'paper_shaped')]
    expected = {
        f'{law}, steps': '5 of 7 steps are missing, first that of y to 25 mm',
        f'{ours}, steps': 'it has not finished',
        f'{law}, ellipse': 'fail: x mean is 9',
        f'{ours}, ellipse': 'there is no bag',
        f'{law}, ellipse_4dof': 'its metrics.json is damaged',
        f'{ours}, ellipse_4dof': 'recovered',
    }
    assert problems.keys() == {*expected, *others}
    for run, words in expected.items():
        assert words in problems[run]
    page = (folder / 'paper_tables.html').read_text(encoding='utf-8')
    assert 'class="badge fail"' in page
    assert '4 of 12 runs passed' in page


def test_a_run_that_tracked_nothing_is_no_ellipse(folder: Path) -> None:
    path = folder / 'ours' / 'ellipse' / 'metrics.json'
    found = json.loads(path.read_text())
    for name in ('axes', 'own_axes'):
        found[name] = {axis: dict.fromkeys(row, None) for axis, row in found[name].items()}
    path.write_text(json.dumps(found))
    run = paper_tables.load_run(folder, 'ours', 'ellipse')
    assert run.problem == 'it tracked nothing'
    assert all(row[3] == '–' for row in list(paper_tables.rows([run]))[1:4])


def test_no_run_at_all_is_one_line(tmp_path: Path, capsys: Any) -> None:
    assert paper_tables.paper_tables([str(tmp_path / 'nothing')]) == NOTHING
    captured = capsys.readouterr()
    assert captured.out == ''
    assert captured.err.count('\n') == 1
    assert f"no finished run in '{tmp_path / 'nothing'}'" in captured.err


@pytest.mark.usefixtures('no_plots')
def test_a_page_that_cannot_be_written_is_one_line(folder: Path, capsys: Any) -> None:
    (folder / 'file').write_text('')
    assert paper_tables.paper_tables([str(folder), '--out', str(folder / 'file')]) == NOTHING
    captured = capsys.readouterr()
    assert captured.out == ''
    assert captured.err.startswith(f"paper_tables: error: cannot write to '{folder / 'file'}'")
    assert captured.err.count('\n') == 1
