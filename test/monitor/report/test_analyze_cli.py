"""``analyze BAG`` from a bag alone: same figures as live, the report, exit codes."""

from __future__ import annotations

import html
import json
import math
import re
import resource
import shutil
from pathlib import Path
from typing import Any

import pytest
from bokeh.resources import Resources
from made_up_run import TOPICS, open_bag, write_samples

from maglev_model.parameters import DIFFERS, ParameterError, build
from maglev_monitor.bag.analysis import UNTOLD, analyse
from maglev_monitor.bag.export_cli import DONE, export
from maglev_monitor.metrics.decoding import decode
from maglev_monitor.metrics.joiner import Joiner
from maglev_monitor.metrics.result_file import write_metrics, write_whole
from maglev_monitor.metrics.run_metrics import RunMetrics
from maglev_monitor.metrics.run_parameters import RunParameters, run_from_json, run_to_json
from maglev_monitor.report import run_report
from maglev_monitor.report.analyze_cli import BAD_BAG, NOT_PASSED, PASS, analyze
from maglev_monitor.report.terminal import as_text


@pytest.fixture
def no_plots(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures take seconds; one test draws them all."""
    monkeypatch.setattr(run_report, 'charts', lambda _: [])


def test_live_and_bag_agree_exactly(bag: Path, run: Any, messages: dict[str, list[bytes]]) -> None:
    parameters = RunParameters(scenario='made_up', stage='plant', mode='lockstep')
    metrics, joiner = RunMetrics(parameters), Joiner()
    for first in range(0, len(run), 13):
        for key, part in messages.items():
            joiner.add(key, decode(key, part[first : first + 13]))
        for block in joiner.take():
            metrics.add(block)
    for block in joiner.finish():
        metrics.add(block)
    assert json.dumps(metrics.result()) == json.dumps(analyse(bag).result)


def test_report_is_self_contained(bag: Path, tmp_path: Path, capsys: Any) -> None:
    assert analyze([str(bag), '--out', str(tmp_path)]) == PASS
    page = (tmp_path / 'report.html').read_text(encoding='utf-8')
    assert len(page) < 3_000_000
    library = Resources(mode='inline', components=['bokeh']).render_js()
    assert library in page
    assert 'http' not in page.replace(library, '')
    assert not re.findall(r'(?:src|href)=', page.replace(library, ''))
    titles = re.findall(r'<h2>([^<]*)</h2>', page)
    charts = ['The whole run', 'Steps', 'Tracking in detail', 'Reversal peaks']
    charts += ['The path', 'Currents', 'Timing']
    assert [title for title in titles if title not in ('Tracking errors', 'Limits')][1:] == charts
    assert page.count('data-root-id=') == 10 + 4 + 10 + 3 + 3 + 8 + 2
    assert 'made_up' in page
    assert 'Flown on 20' in page
    assert '<td>14.3 %, &lt; 3 s, about 5 s</td>' in page
    assert "the paper's machine: mean |e|" not in html.unescape(page)
    printed = capsys.readouterr().out
    found = json.loads((tmp_path / 'metrics.json').read_text())
    assert as_text(found) in printed
    assert found['scenario'] == 'made_up'
    assert not list(tmp_path.glob('*.tmp'))


@pytest.mark.usefixtures('no_plots')
@pytest.mark.parametrize('name', ['.', 'bag', 'bag/bag_0.mcap', 'bag/metadata.yaml'])
def test_report_goes_beside_the_bag_and_keeps_the_live_metrics(
    name: str, bag: Path, tmp_path: Path
) -> None:
    folder = tmp_path / 'run'
    shutil.copytree(bag, folder / 'bag')
    told = {'command': 'ellipse.sh --params=a&b.yaml', 'software': '7.1, abc-dirty'}
    metadata = folder / 'bag' / 'metadata.yaml'
    text = metadata.read_text().replace('custom_data: null', f'custom_data: {json.dumps(told)}')
    metadata.write_text(text)
    (folder / 'replay.html').write_text('')
    (folder / 'metrics.json').write_text('live')
    (folder / 'params').mkdir()
    lines = f'{DIFFERS}fan: 7 (by default 2)\n{DIFFERS}effective_parameters: no news\nplant:\n'
    (folder / 'params' / 'plant.yaml').write_text(lines)
    assert analyze([str(folder / name)]) == PASS
    page = (folder / 'report.html').read_text(encoding='utf-8')
    assert '<a href="replay.html">' in page
    assert 'Flown by ellipse.sh --params=a&amp;b.yaml on 20' in page
    assert 'UTC with 7.1, abc-dirty.' in page
    assert '<tr><td>plant</td><td>fan: 7 (by default 2)</td></tr>' in page
    assert 'no news' not in page
    assert (folder / 'metrics.json').read_text() == 'live'


@pytest.mark.usefixtures('no_plots')
def test_no_other_bag_s_metrics_stay_beside_a_report(bag: Path, tmp_path: Path) -> None:
    shutil.copytree(bag, tmp_path / 'flight')
    (tmp_path / 'bag').mkdir()  # of another run
    (tmp_path / 'metrics.json').write_text('of another run')
    assert analyze([str(tmp_path / 'flight')]) == PASS
    assert json.loads((tmp_path / 'metrics.json').read_text())['scenario'] == 'made_up'


@pytest.mark.usefixtures('no_plots')
def test_of_a_lone_file_the_report_goes_beside_it(
    bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    deep = tmp_path / 'lone' / 'deep'
    deep.mkdir(parents=True)
    shutil.copy(bag / 'bag_0.mcap', deep / 'flight.mcap')
    monkeypatch.chdir(deep)
    assert analyze(['flight.mcap']) == PASS
    assert export(['flight.mcap', '--format', 'npz']) == DONE
    names = {'flight.mcap', 'report.html', 'metrics.json', 'samples.npz'}
    assert {path.name for path in deep.iterdir()} == names
    assert [path.name for path in deep.parent.iterdir()] == ['deep']


@pytest.mark.parametrize('kept', [('measurement', 'currents'), ('measurement',)])
def test_a_run_on_hardware_or_with_topics_lost_is_reported(
    kept: tuple[str, ...],
    tmp_path: Path,
    run: Any,
    messages: dict[str, list[bytes]],
) -> None:
    writer = open_bag(tmp_path / 'bag')
    for key in ('reference', *kept):
        stamps = run.stamp[:900].tolist()
        writer.write(TOPICS[key][0], zip(messages[key], stamps, strict=False))
    writer.close()
    assert analyze([str(tmp_path / 'bag')]) == NOT_PASSED
    found = json.loads((tmp_path / 'metrics.json').read_text())
    assert found['error_source'] == 'measured'
    assert found['verdict'] == 'incomplete'
    assert ('currents' in kept) == (found['missing_by_topic']['currents'] == 0)
    page = (tmp_path / 'report.html').read_text(encoding='utf-8')
    assert ('<h2>Currents</h2>' in page) == ('currents' in kept)
    assert '<h2>Tracking in detail</h2>' in page


@pytest.mark.usefixtures('no_plots')
def test_a_cut_off_bag_is_reported_and_says_so(bag: Path, tmp_path: Path, capsys: Any) -> None:
    whole = (bag / 'bag_0.mcap').read_bytes()
    cut = tmp_path / 'bag.mcap'
    cut.write_bytes(whole[:-2000])
    assert analyze([str(cut), '--out', str(tmp_path / 'out')]) == BAD_BAG
    assert (tmp_path / 'out' / 'report.html').is_file()
    captured = capsys.readouterr()
    assert 'recovered' in captured.err
    assert len(captured.err.splitlines()) == 1


@pytest.mark.usefixtures('no_plots')
def test_a_whole_bag_without_a_monitor_says_that_no_limits_are_known(
    tmp_path: Path, run: Any, messages: dict[str, list[bytes]], capsys: Any
) -> None:
    writer = open_bag(tmp_path / 'bag')
    write_samples(writer, run, messages)
    writer.close()
    assert analyze([str(tmp_path / 'bag')]) == PASS
    assert capsys.readouterr().err == f'analyze: {UNTOLD}\n'
    assert f'<li>{UNTOLD}</li>' in (tmp_path / 'report.html').read_text(encoding='utf-8')


def test_no_bag_is_one_clear_line(tmp_path: Path, capsys: Any) -> None:
    assert analyze([str(tmp_path / 'nothing')]) == BAD_BAG
    captured = capsys.readouterr()
    assert captured.out == ''
    assert captured.err == f"analyze: error: there is no bag '{tmp_path / 'nothing'}'\n"


@pytest.mark.usefixtures('no_plots')
def test_an_output_that_cannot_be_written_is_one_clear_line(
    bag: Path, tmp_path: Path, capsys: Any
) -> None:
    (tmp_path / 'file').write_text('')
    assert analyze([str(bag), '--out', str(tmp_path / 'file')]) == BAD_BAG
    assert 'cannot write to' in capsys.readouterr().err


@pytest.mark.usefixtures('no_plots')
def test_faults_and_limits_of_the_monitor_are_in_the_bag(
    tmp_path: Path, run: Any, messages: dict[str, list[bytes]], encoder: Any
) -> None:
    limits = build(RunParameters, {'limits.max_overshoot': 5.0, 'scenario': 'limited'})
    stamp = int(run.stamp[300])
    writer = open_bag(tmp_path / 'bag')
    write_samples(writer, run, messages)
    for level, name, values in (
        (0, 'monitor', {'run': run_to_json(limits)}),
        (1, 'reference', {}),
        (2, 'plant', {}),
    ):
        data = encoder.diagnostic(stamp, level, name, f'{name} says', values)
        writer.write('/diagnostics', [(data, stamp)])
    for hardware in ('a camera', ''):
        data = encoder.diagnostic(stamp, 2, 'plant', 'another one', {'run': '{}'}, hardware)
        writer.write('/diagnostics', [(data, stamp)])
    writer.close()
    assert analyze([str(tmp_path / 'bag')]) == NOT_PASSED
    found = json.loads((tmp_path / 'metrics.json').read_text())
    assert found['scenario'] == 'limited'
    assert found['faults'] == ['plant: plant says']
    assert found['reasons'][0] == 'fault in plant: plant says'
    assert any('overshoot' in reason for reason in found['reasons'])


@pytest.mark.usefixtures('no_plots')
@pytest.mark.parametrize(
    ('told', 'lost'),
    [
        ({'metrics.modules': ['nobody.knows'], 'scenario': 'known'}, 'further metrics'),
        ({'limits.unheard_of': 1.0}, 'limits and parameters of the run'),
    ],
)
def test_what_is_not_known_here_of_a_run_is_said_and_the_rest_reported(
    told: dict[str, Any],
    lost: str,
    tmp_path: Path,
    run: Any,
    messages: dict[str, list[bytes]],
    encoder: Any,
    capsys: Any,
) -> None:
    """As of a bag from another machine, or by another version."""
    stamp = int(run.stamp[0])
    writer = open_bag(tmp_path / 'bag')
    data = encoder.diagnostic(stamp, 0, 'monitor', 'ok', {'run': json.dumps(told)})
    writer.write('/diagnostics', [(data, stamp)])
    write_samples(writer, run, messages)
    writer.close()
    assert analyze([str(tmp_path)]) == BAD_BAG
    captured = capsys.readouterr()
    (line,) = captured.err.splitlines()
    assert line.startswith(f'analyze: {lost}')
    assert next(iter(told)) in line
    assert 'verdict: pass' in captured.out
    assert (told.get('scenario', 'run:')) in captured.out
    assert lost in (tmp_path / 'report.html').read_text(encoding='utf-8')


def test_parameters_survive_the_bag() -> None:
    parameters = build(
        RunParameters,
        {'scenario': 'a', 'machine.radius': 0.4, 'limits.max_error': (1.0, 2.0, 3.0, 4.0, 5.0)},
    )
    assert run_from_json(run_to_json(parameters)) == parameters


def test_a_bag_with_former_names_of_parameters_is_analysed() -> None:
    former = '{"scenario":"old","metrics.radius":0.4,"metrics.pole_pitch":0.06}'
    run = run_from_json(former)
    assert (run.scenario, run.machine.radius, run.machine.pole_pitch) == ('old', 0.4, 0.06)
    assert json.loads(run_to_json(run)).keys().isdisjoint({'metrics.radius', 'metrics.pole_pitch'})


@pytest.mark.parametrize('text', ['', '[]', '{"nothing": 1}', '{"metrics.radius": -1.0}'])
def test_damaged_parameters_are_refused(text: str) -> None:
    with pytest.raises(ParameterError):
        run_from_json(text)


def test_metrics_are_written_whole_or_not_at_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / 'new' / 'metrics.json'
    write_metrics(path, {'verdict': 'pass'})
    with pytest.raises(TypeError):
        write_metrics(path, {'verdict': object()})
    assert json.loads(path.read_text()) == {'verdict': 'pass'}
    write_metrics(path, {'rms': [1.0, math.nan], 'timing': {'tick': math.inf}})
    assert json.loads(path.read_text()) == {'rms': [1.0, None], 'timing': {'tick': None}}


def test_a_page_that_does_not_fit_the_disk_leaves_nothing_there(tmp_path: Path) -> None:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        with pytest.raises(OSError, match='File too large'):
            write_whole(tmp_path / 'report.html', 'x' * 100_000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert not list(tmp_path.iterdir())


def test_two_runs_lie_side_by_side(bag: Path, tmp_path: Path, capsys: Any) -> None:
    other = tmp_path / 'other' / 'bag'
    shutil.copytree(bag, other)
    (other.parent / 'params').mkdir()
    (other.parent / 'params' / 'plant.yaml').write_text(f'{DIFFERS}fan: 7 (by default 2)\n')
    assert analyze([str(bag), str(other), '--out', str(tmp_path)]) == PASS
    page = (tmp_path / 'two_runs.html').read_text(encoding='utf-8')
    assert 'plant: fan: 7 (by default 2)' in page
    assert page.count('<td>1.00</td>') == 3 * 5
    assert page.count('overshoot') == 2 * 2
    assert page.count('data-root-id=') == 5
    assert capsys.readouterr().out.count('verdict: pass') == 2
    assert not (tmp_path / 'metrics.json').exists()


def test_two_unlike_runs_say_whose_errors_and_the_worse_verdict(
    bag: Path, tmp_path: Path, run: Any, messages: dict[str, list[bytes]], encoder: Any
) -> None:
    """One simulated; one that failed on hardware, in a folder with an odd name."""
    folder = tmp_path / 'a<b&c'
    writer = open_bag(folder / 'bag')
    for key in ('reference', 'measurement', 'currents'):
        writer.write(TOPICS[key][0], zip(messages[key], run.stamp.tolist(), strict=True))
    stamp = int(run.stamp[300])
    writer.write('/diagnostics', [(encoder.diagnostic(stamp, 2, 'bridge', 'stop', {}), stamp)])
    writer.close()
    assert analyze([str(bag), str(folder), '--out', str(tmp_path)]) == NOT_PASSED
    page = (tmp_path / 'two_runs.html').read_text(encoding='utf-8')
    assert 'a&lt;b&amp;c, fail:' in page
    assert 'a<b' not in page
    assert '<span class="badge fail">fail</span>' in page
    assert '<li>made_up, plant, lockstep, errors of the true position</li>' in page
    assert '<li>errors of the measured position</li>' in page


def test_a_second_run_that_cannot_be_read_is_one_line(
    bag: Path, tmp_path: Path, capsys: Any
) -> None:
    assert analyze([str(bag), str(tmp_path / 'none'), '--out', str(tmp_path)]) == BAD_BAG
    assert 'none' in capsys.readouterr().err
    assert not list(tmp_path.glob('*.html'))
