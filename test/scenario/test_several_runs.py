"""Scripts that make several runs, or none of the graph. Nodes and programs are stand-ins."""

from __future__ import annotations

import json
import signal
import sys
import time
from pathlib import Path

import pytest
from stand_ins import Tree

from runner.commands import COMMANDS, main
from runner.options import WrongUseError
from runner.overlays import PARAMS, check_overlay
from runner.programs import HEARD_BY_COMPARE, HEARD_BY_ROBUSTNESS, PROGRAMS


@pytest.fixture
def papers(tree: Tree) -> Tree:
    """A tree with all that the paper's tables ask for."""
    for name in ('steps', 'ellipse_4dof'):
        tree.parameters(f'params/scenario_{name}.yaml')
    for name in ('benchmark', 'paper', 'paper_exact', 'paper_shaped', 'rough'):
        tree.parameters(f'params/{name}.yaml')
    return tree


def tables(tree: Tree, *options: str) -> tuple[int, str]:
    """Run the paper's tables into ``out``."""
    return tree.finish('--out', str(tree.out), *options, script='paper_tables')


def flown(tree: Tree) -> list[str]:
    """The runs that began, by their folders within ``out``."""
    return [
        word.removeprefix(f'recorder:output:="{tree.out}/').removesuffix('/bag"')
        for line in tree.history('watchers')
        for word in line.split()
        if word.startswith('recorder:output:=')
    ]


ALL_RUNS = [
    *(
        f'{law}/{name}'
        for law in ('paper', 'ours')
        for name in ('steps', 'ellipse', 'ellipse_4dof')
    ),
    *('paper_rough/ellipse', 'paper_rough/ellipse_4dof'),
    *('ours_rough/steps', 'ours_rough/ellipse', 'ours_rough/ellipse_4dof', 'paper_shaped/steps'),
]
OVERLAYS = {
    'paper': ['paper.yaml', 'paper_exact.yaml'],
    'ours': [],
    'paper_rough': ['rough.yaml', 'paper.yaml', 'paper_exact.yaml'],
    'ours_rough': ['rough.yaml'],
    'paper_shaped': ['paper.yaml', 'paper_exact.yaml', 'paper_shaped.yaml'],
}


def test_all_runs_then_the_page(papers: Tree) -> None:
    code, output = tables(papers, '--mode=realtime')
    assert (code, output.splitlines()[-1]) == (0, 'paper_tables: passed')
    assert flown(papers) == ALL_RUNS
    for run, line in zip(ALL_RUNS, papers.history('reference'), strict=True):
        words = line.split()
        assert 'mode:=realtime' in words
        assert 'duration:=' not in line
        files = [Path(word).name for word in words if word.endswith('.yaml') and ':=' not in word]
        case, scenario = run.split('/')
        assert files == [f'scenario_{scenario}.yaml', 'benchmark.yaml', *OVERLAYS[case]]
    assert papers.history('paper_tables') == [str(papers.out)]
    assert (papers.out / 'ours' / 'ellipse_4dof' / 'report.html').exists()


def test_all_runs_are_in_the_namespace(papers: Tree) -> None:
    code, output = tables(papers, '--namespace', 'lab')
    assert code == 0, output
    assert [line.count('-r __ns:=/lab ') for line in papers.history('reference')] == [1] * 12


def test_quick_runs_are_short(papers: Tree) -> None:
    assert tables(papers, '--quick')[0] == 0
    for run, line in zip(ALL_RUNS, papers.history('reference'), strict=True):
        assert f'duration:={6.0 if run.endswith("steps") else 4.0}' in line.split()


def test_a_run_that_fails_does_not_stop_the_others(papers: Tree) -> None:
    papers.behave('watchers@ellipse', 'miss')
    code, output = tables(papers, '--json')
    failed = [run for run in ALL_RUNS if run.endswith('/ellipse')]
    assert code == 1
    assert output.splitlines()[-1] == f'paper_tables: FAILED: {" ".join(failed)}'
    (outcome,) = (json.loads(line) for line in output.splitlines() if line.startswith('{'))
    assert outcome['passed'] is False
    assert [run['passed'] for run in outcome['runs']] == [run not in failed for run in ALL_RUNS]
    assert outcome['page'] == str(papers.out / 'paper_tables.html')
    assert flown(papers) == ALL_RUNS
    assert len(papers.history('paper_tables')) == 1


def test_a_page_that_fails_fails(papers: Tree) -> None:
    papers.behave('paper_tables', '2')
    code, output = tables(papers)
    assert (code, output.splitlines()[-1]) == (1, 'paper_tables: FAILED'), output


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_run_in_progress_and_no_other_begins(
    papers: Tree, number: signal.Signals
) -> None:
    papers.behave('watchers@ellipse', 'run')
    process = papers.start('--out', str(papers.out), script='paper_tables')
    while min(len(papers.history('reference')), len(flown(papers))) < 2:
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(number)
    output, _ = process.communicate(timeout=20)
    assert process.returncode == 128 + number
    assert papers.alive() == [], 'it did not wait for the clean-up'
    assert flown(papers) == ALL_RUNS[:2]
    assert 'interrupted' in output.splitlines()[-1]
    assert not papers.history('paper_tables')


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        (['--mode', 'fast'], "--mode is 'fast', it must be one of: lockstep realtime"),
        (['--duration', '3'], "unknown option '--duration'"),
        (['--out='], '--out needs a folder'),
        (['--mode'], '--mode needs a value'),
        (['--quick=no'], '--quick takes no value'),
        (['--out', '/proc/nothing'], "cannot write to '/proc/nothing'"),
    ],
)
def test_wrong_use_is_one_line(papers: Tree, options: list[str], words: str) -> None:
    code, output = tables(papers, *options)
    assert code == 2
    assert output.startswith('paper_tables: error: ')
    assert words in output
    assert output.count('\n') == 1
    assert not flown(papers)


def test_a_folder_with_runs_is_refused(papers: Tree) -> None:
    (papers.out / 'ours').mkdir(parents=True)
    code, output = tables(papers)
    assert code == 2
    assert 'already holds runs' in output
    assert not flown(papers)


@pytest.mark.parametrize(
    ('script', 'options'),
    [
        ('paper_tables', ('--mode', '--namespace', '--out', '--quick')),
        ('compare', ('--params', '--out', '--quick', '--laws', '--bandwidth')),
        ('commission', ('--params', '--current', '--yes')),
        ('single_motor', ('--stage', '--mode', '--duration', '--params', '--namespace', '--out')),
    ],
)
def test_help_names_every_option(tree: Tree, script: str, options: tuple[str, ...]) -> None:
    code, output = tree.finish('--help', script=script)
    assert code == 0
    for option in (*options, '--help', f'usage: scenarios/{script}.sh'):
        assert option in output
    assert not tree.started()
    assert not tree.history(script)


@pytest.mark.parametrize('script', sorted(COMMANDS))
def test_every_script_can_be_quiet_and_talk_to_programs(
    script: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([script, '--help']) == 0
    usage = capsys.readouterr().out
    assert '\n  --quiet ' in usage
    assert '\n  --json ' in usage


@pytest.mark.parametrize(
    ('verdict', 'parts'), [('pass', ['steps', 'sinusoids']), ('miss', ['steps'])]
)
def test_the_single_motor_flies_its_second_part_when_the_first_passed(
    tree: Tree, verdict: str, parts: list[str]
) -> None:
    for name in ('single_motor', 'scenario_single_motor_steps', 'scenario_single_motor_sinusoids'):
        tree.parameters(f'params/{name}.yaml')
    tree.behave('watchers@steps', verdict)
    code, output = tree.finish('--duration=2', f'--out={tree.out}', script='single_motor')
    assert (code, flown(tree)) == (int(verdict != 'pass'), parts), output
    assert tree.files('controller') == [
        'params/single_motor.yaml',
        f'params/scenario_single_motor_{parts[-1]}.yaml',
    ]
    assert 'duration:=2.0' in tree.arguments('reference')


def test_the_comparison_is_told_what_the_user_wants(tree: Tree) -> None:
    tree.parameters('heavy.yaml', 'plant')
    options = ('--laws', 'paper', 'default', '--quick', '--bandwidth=300', '--out', 'here')
    overlays = ('--params', 'soft', '--params', 'heavy.yaml')
    tree.behave('compare', '3')
    assert tree.finish(*options, *overlays, script='compare') == (3, '')
    params = tree.path / 'params'
    assert tree.history('compare') == [
        f'--params {params} --out here --quick --laws paper default --bandwidth 300'
        f' --overlay {params}/soft.yaml --overlay {tree.path}/heavy.yaml'
    ]


@pytest.mark.parametrize('script', sorted(PROGRAMS))
def test_ctrl_c_while_a_program_imports_ends_it_without_a_word(tree: Tree, script: str) -> None:
    package = 'maglev_hw_bridge' if script == 'commission' else 'maglev_study'
    lines = (
        f'#!{sys.executable}',
        'import signal',
        'signal.raise_signal(signal.SIGINT)',
        'from maglev_model.programs.command import leave_with',
        'leave_with(lambda: 0)',
    )
    tree.executable(package, script, '\n'.join(lines))
    assert tree.finish(script=script) == (128 + signal.SIGINT, '')


@pytest.mark.parametrize('option', ['--stage', '--duration', '--law'])
def test_the_comparison_refuses_what_it_would_not_heed(tree: Tree, option: str) -> None:
    code, output = tree.finish(option, 'soft', script='compare')
    assert (code, output) == (2, f"compare: error: unknown option '{option}'; see --help\n")
    assert not tree.history('compare')


def test_the_comparison_refuses_parameters_of_nodes_that_it_has_not(tree: Tree) -> None:
    tree.parameters('ours.yaml', 'reference')
    code, output = tree.finish('--params', 'ours.yaml', script='compare')
    assert code == 2
    assert "parameters for 'reference', which is no node here: controller, plant, **" in output
    assert not tree.history('compare')


@pytest.mark.parametrize('heard', [HEARD_BY_COMPARE, HEARD_BY_ROBUSTNESS])
def test_the_rough_plant_is_an_overlay_of_every_study(heard: tuple[str, ...]) -> None:
    check_overlay(str(PARAMS / 'rough.yaml'), sections=heard)


def test_an_overlay_may_speak_to_others_too_but_not_to_none(tree: Tree) -> None:
    both, only = tree.parameters('both.yaml', 'plant'), tree.parameters('only.yaml', 'robustness')
    both.write_text(both.read_text() + only.read_text())
    check_overlay(str(both))
    check_overlay(str(only), sections=HEARD_BY_ROBUSTNESS)
    with pytest.raises(WrongUseError, match="parameters for 'robustness', which is no node here"):
        check_overlay(str(only))


def test_the_fault_campaign_is_told_what_the_user_wants(tree: Tree) -> None:
    tree.behave('faults', '1')
    options = ('--runs', '9', '--double', '--runs', '40', '--out', 'here', '--params', 'soft')
    assert tree.finish(*options, script='faults') == (1, '')
    overlay = tree.path / 'params' / 'soft.yaml'
    assert tree.history('faults') == [f'--out here --runs 40 --double --overlay {overlay}']


def test_the_drawn_machines_are_told_what_the_user_wants(tree: Tree) -> None:
    options = ('--machines=4', '--law', 'paper', '--law', 'default', '--out', 'here')
    assert tree.finish(*options, '--params', 'soft', script='robustness') == (0, '')
    params = tree.path / 'params'
    assert tree.history('robustness') == [
        f'--params {params} --out here --machines 4 --law paper default'
        f' --overlay {params}/soft.yaml'
    ]


def test_the_tuning_is_told_what_the_user_wants(tree: Tree) -> None:
    options = ('--machines', '9', '--margin=5.5', '--experiment', 'hold', 'scan', '--out', 'here')
    tree.behave('tune', '1')
    assert tree.finish(*options, '--params', 'soft', script='tune') == (1, '')
    params = tree.path / 'params'
    assert tree.history('tune') == [
        f'--params {params} --out here --machines 9 --margin 5.5 --experiment hold scan'
        f' --overlay {params}/soft.yaml'
    ]


def test_the_commissioning_gets_the_parameters_of_a_flight(tree: Tree) -> None:
    for name in ('machine', 'hw_bridge'):
        tree.parameters(f'params/{name}.yaml')
    options = ('--params', 'soft', '--yes', '--current', '1.0')
    assert tree.finish(*options, script='commission') == (0, '')
    files = [
        f'--params {tree.path}/params/{name}.yaml' for name in ('machine', 'hw_bridge', 'soft')
    ]
    assert tree.history('commission') == [f'{" ".join(files)} --current 1.0 --yes']


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        (['--params', 'none'], "there is no file 'none'"),
        (['--params', 'typo.yaml'], "parameters for 'bridge', which is no node"),
        (['--stage', 'plant'], "unknown option '--stage'"),
    ],
)
def test_the_commissioning_refuses(tree: Tree, options: list[str], words: str) -> None:
    tree.parameters('typo.yaml', 'bridge')
    code, output = tree.finish(*options, script='commission')
    assert code == 2
    assert words in output
    assert not tree.history('commission')
