"""What a user may ask of a scenario, and what the nodes are told then. They are stand-ins."""

from __future__ import annotations

import pytest
import yaml
from stand_ins import NODES, ROOT, Tree

from maglev_model.parameters import read_argument, specs
from maglev_reference.parameters import ReferenceParameters
from runner import options, overlays
from runner.commands import main
from runner.graph import text_value

WATCHING = ('monitor', 'recorder')
WATCHERS = "watchers:=['monitor','recorder']"


def test_the_nodes_get_their_parameters(tree: Tree) -> None:
    tree.parameters('mine.yaml', 'controller')
    tree.parameters('params/machine.yaml')
    options = ('--mode', 'realtime', '--duration=3', '--params', 'soft', '--params', 'mine.yaml')
    code, output = tree.run(*options)
    assert code == 0, output
    over = ['params/scenario_ellipse.yaml', 'params/soft.yaml', 'mine.yaml']
    assert tree.files('plant') == ['params/machine.yaml', 'params/plant.yaml', *over]
    for node in NODES:
        assert tree.files(node)[0] == 'params/machine.yaml'
        assert tree.files(node)[-3:] == over
        if node != 'watchers':
            assert f'effective_parameters:="{tree.out}/params/{node}.yaml"' in tree.arguments(node)
    assert {'mode:=realtime', WATCHERS} <= set(tree.arguments('plant'))
    reference = tree.arguments('reference')
    assert {'duration:=3.0', 'autostart:=true', WATCHERS, 'lead:=0.128'} <= set(reference)
    watchers = tree.arguments('watchers')
    assert {
        *(f'monitor:output:="{tree.out}/metrics.json"', f'recorder:output:="{tree.out}/bag"'),
        *('monitor:scenario:=ellipse', 'monitor:stage:=plant', 'monitor:mode:=realtime'),
        *(f'{w}:effective_parameters:="{tree.out}/params/{w}.yaml"' for w in WATCHING),
    } <= set(watchers)


@pytest.mark.parametrize('name', ['run #2', 'run: 2', "o'neil", '[2', '2026', '~'])
def test_the_nodes_read_the_folder_as_it_is_named(tree: Tree, name: str) -> None:
    tree.out = tree.path / name
    code, output = tree.run()
    assert code == 0, output
    for node in WATCHING:
        heard: dict[str, object] = {}
        for word in tree.arguments('watchers'):
            heard.update(read_argument(word, node) if ':=' in word else {})
        own = 'bag' if node == 'recorder' else 'metrics.json'
        assert heard['output'] == str(tree.out / own)
        assert heard['effective_parameters'] == str(tree.out / 'params' / f'{node}.yaml')


def test_without_a_machine_file_each_node_starts_with_its_own(tree: Tree) -> None:
    assert tree.run()[0] == 0
    assert tree.files('plant') == ['params/plant.yaml', 'params/scenario_ellipse.yaml']
    assert tree.files('controller') == ['params/scenario_ellipse.yaml']
    assert not [word for word in tree.arguments('reference') if 'duration' in word]


def test_a_duration_is_what_the_reference_takes() -> None:
    spec = specs(ReferenceParameters)['duration']
    assert (spec.lower, spec.upper) == options.DURATION


def test_nodes_that_would_never_see_each_other_are_not_started(
    tree: Tree, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF')
    code, output = tree.run()
    assert code == 2
    assert 'with ROS_AUTOMATIC_DISCOVERY_RANGE=OFF no node sees another' in output
    assert not tree.out.exists()


@pytest.mark.parametrize('name', ['robustness', 'faults', 'tune'])
def test_none_of_what_is_flown_or_flies_is_refused_before_the_set_up(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    many = '--runs' if name == 'faults' else '--machines'
    for option, value in ((many, '0'), ('--jobs', '00'), (many, 'nan')):
        assert main(['--check', name, option, value]) == 2
        assert f"{option} is '{value}', it must be" in capsys.readouterr().err


@pytest.mark.parametrize('domain', ['-1', '5a', ' '])
def test_a_domain_that_ros_would_take_for_another_is_refused(
    domain: str, tree: Tree, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', domain)
    code, output = tree.run()
    assert code == 2
    assert f"ROS_DOMAIN_ID is '{domain}', it must be a whole number" in output
    assert not tree.out.exists()


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        (['--speed', '3'], "unknown option '--speed'"),
        (['ellipse'], "unknown option 'ellipse'"),
        (['--mode', 'fast'], "--mode is 'fast', it must be one of: lockstep realtime"),
        (['--stage=model'], "--stage is 'model', it must be one of: plant hw_bridge"),
        (['--duration', 'long'], "--duration is 'long', it must be seconds from 0.01 to"),
        (['--duration', '1e3'], "--duration is '1e3', it must be seconds from 0.01 to 36000, as"),
        (['--duration', '9' * 26], 'it must be seconds from 0.01 to 36000, as 2.5'),
        (['--duration', '36000.1'], "--duration is '36000.1'"),
        (['--duration', '-1'], "--duration is '-1'"),
        (['--duration', '0'], "--duration is '0'"),
        (['--duration'], '--duration needs a value'),
        (['--out='], '--out needs a folder'),
        (['--out', '/..'], "--out is '/..', it must be a folder other than the root"),
        (['--params', 'none.yaml'], "there is no file 'none.yaml'"),
        (['--params', 'typo.yaml'], "parameters for 'contoller', which is no node"),
        (['--params', 'twice.yaml'], "'speed' is given twice"),
        (['--params', 'merged.yaml'], "'<<' in line 2: ROS does not merge mappings"),
        (['--params', 'mixed.yaml'], 'the list in line 2 mixes float and int: ROS takes one type'),
        (['--params', 'alias.yaml'], "'*one' in line 4: ROS follows no aliases"),
        (['--params', 'other.yaml', '--namespace', 'b'], "parameters for '/a/plant', which is no"),
        (['--namespace', ''], "--namespace is ''"),
        (['--namespace', '/'], "--namespace is '/'"),
        (['--namespace', '1st'], "--namespace is '1st', it must be names of letters"),
        (['--namespace', 'a/'], "--namespace is 'a/'"),
        (['--namespace', 'a//b'], "--namespace is 'a//b'"),
        (['--namespace', 'a__b'], "--namespace is 'a__b'"),
        (['--namespace', 'a-b'], "--namespace is 'a-b'"),
        (['--out', 'caf\udce9'], "'caf\\udce9' is no text in UTF-8"),
        (['--params', 'flat.yaml'], "section 'controller' must hold 'ros__parameters'"),
    ],
)
def test_options_that_make_no_sense(tree: Tree, options: list[str], words: str) -> None:
    (tree.path / 'typo.yaml').write_text('# why\n\ncontoller:\n  ros__parameters:\n    a: 1\n')
    (tree.path / 'twice.yaml').write_text('plant:\n  ros__parameters: {speed: 1, speed: 2}\n')
    (tree.path / 'merged.yaml').write_text('plant:\n  <<: {ros__parameters: {speed: 1}}\n')
    (tree.path / 'mixed.yaml').write_text('plant:\n  ros__parameters: {speed: [1, 2.0]}\n')
    (tree.path / 'alias.yaml').write_text(
        'plant: &one\n  ros__parameters: {speed: 1}\nreference:\n  *one\n'
    )
    (tree.path / 'other.yaml').write_text('/a/plant:\n  ros__parameters: {speed: 1}\n')
    (tree.path / 'flat.yaml').write_text('controller:\n  speed: 1\n')
    code, output = tree.run(*options)
    assert code == 2
    assert words in output
    assert output.startswith('ellipse: error: ')
    assert len(output.splitlines()) == 1
    assert tree.started() == []
    assert not tree.out.exists()


def test_help_starts_nothing(tree: Tree) -> None:
    (tree.path / 'setup.sh').write_text('exit 70\n')
    code, output = tree.run('--help')
    assert code == 0
    for option in ('--stage', '--mode', '--duration', '--params', '--namespace', '--out'):
        assert option in output


def test_what_is_wrong_is_said_before_the_set_up_where_there_is_a_python(tree: Tree) -> None:
    (tree.path / 'setup.sh').write_text('echo set-up\nexit 70\n')
    code, output = tree.run('--mode', 'fast')
    assert code == 2
    assert "--mode is 'fast'" in output
    assert tree.run() == (70, 'set-up\n')
    tree.script(tree.path / 'bin' / 'python3', '#!/usr/bin/env bash\nexit 1\n')
    assert tree.run('--mode', 'fast') == (70, 'set-up\n')


def test_a_whole_number_is_refused_with_its_bound() -> None:
    with pytest.raises(options.WrongUseError, match=r"seed is '-1', it must be .* of at least 0"):
        options.whole('--seed', '-1')


@pytest.mark.parametrize('text', ["x'y", 'x"y', 'x\\ny', 'a\nb', 'ü 😀', '$HOME', '~', ' '])
def test_any_text_reaches_the_nodes(text: str) -> None:
    name, _, value = text_value('output', text).partition(':=')
    assert (name, yaml.safe_load(value)) == ('output', text)


def test_a_trajectory_is_chosen_by_name_or_file(tree: Tree) -> None:
    tree.parameters('params/scenario_file.yaml')
    code, output = tree.finish('ellipse', '--out', str(tree.out), script='trajectory')
    assert code == 0, output
    assert 'file.path' not in ' '.join(tree.arguments('reference'))
    path = tree.path / "a path's.csv"
    path.write_text('t,y,x,z,phi,theta\n')
    second = str(tree.path / 'second')
    code, output = tree.finish(path.name, '--out', second, '--duration', '3', script='trajectory')
    assert code == 0, output
    arguments = tree.arguments('reference')
    assert f'file.path:="{tree.path}/a path\'s.csv"' in arguments
    assert 'duration:=3.0' in arguments
    assert 'params/scenario_file.yaml' in tree.files('reference')


@pytest.mark.parametrize(
    ('options', 'code', 'words'),
    [
        (['elipse'], 2, "the trajectory is 'elipse', it must be one of: ellipse"),
        (['none.csv'], 2, "cannot read 'none.csv'"),
        (['--out', 'x'], 2, "the trajectory is '--out'"),
        ([], 0, 'usage: scenarios/trajectory.sh NAME|FILE.csv'),
        (['ellipse', '--help'], 0, 'usage: scenarios/trajectory.sh NAME|FILE.csv'),
        (['ellipse', '--mode', 'fast'], 2, 'must be one of: lockstep realtime'),
    ],
)
def test_a_trajectory_that_makes_no_sense(
    tree: Tree, options: list[str], code: int, words: str
) -> None:
    found, output = tree.finish(*options, script='trajectory')
    assert found == code, output
    assert words in output
    assert not tree.started()


def test_the_shipped_overlays_are_taken() -> None:
    others = {ROOT / 'params' / 'rosbag2_qos.yaml', ROOT / 'params' / 'robustness.yaml'}
    for path in sorted({*(ROOT / 'params').rglob('*.yaml')} - others):  # these are not for flights
        name = str(path.relative_to(ROOT / 'params').with_suffix(''))
        assert overlays.overlay('--params', name) == str(path)
        overlays.check_overlay(str(path))


@pytest.mark.parametrize(('given', 'full'), [('stage1', '/stage1'), ('/lab/b_2', '/lab/b_2')])
def test_all_nodes_are_in_the_namespace(tree: Tree, given: str, full: str) -> None:
    tree.parameters('mine.yaml', f'{full}/controller')
    code, output = tree.run('--namespace', given, '--params', 'mine.yaml')
    assert code == 0, output
    assert f'ellipse: plant, lockstep in {full}, into {tree.out}' in output
    for node in NODES:
        words = tree.arguments(node)
        assert words[words.index('-r') + 1] == f'__ns:={full}'
        assert tree.files(node)[-1] == 'mine.yaml'


def test_without_a_namespace_none_is_set(tree: Tree) -> None:
    assert tree.run()[0] == 0
    assert '-r' not in tree.arguments('plant')


@pytest.mark.parametrize('section', ['/**/plant', '/*/plant', 'a/plant', '/a/*', '/**/a/**'])
def test_a_section_may_name_nodes_by_wildcards_as_in_ros(tree: Tree, section: str) -> None:
    path = str(tree.parameters('mine.yaml', section))
    overlays.check_overlay(path, '/a')
    with pytest.raises(options.WrongUseError, match='which is no node here'):
        overlays.check_overlay(path, '/b/c' if '**/plant' not in section else '/a', ('reference',))


def test_runs_in_namespaces_are_left_apart(tree: Tree) -> None:
    code, output = tree.finish('--namespace', 'lab/b', script='ellipse')
    assert code == 0, output
    (folder,) = (tree.path / 'runs').iterdir()
    assert folder.name.startswith('ellipse-lab-b-')
