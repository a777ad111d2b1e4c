"""What the parser takes and how it refuses the rest; every line of the documents it takes."""

from __future__ import annotations

import configparser
import re
import shlex
from pathlib import Path

import pytest
from ros2_command import Ros2

from maglev_ros2cli.cli import COMMANDS, parser
from maglev_ros2cli.messages import find_type
from maglev_ros2cli.parser import SUBSET

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = [
    *(ROOT / name for name in ('README.md', 'CONTRIBUTING.md', 'CHANGELOG.md')),
    *sorted(ROOT.glob('docs/*.md')),
    *sorted(ROOT.glob('params/*.yaml')),
]


NATIVE = ('security',)
"""Commands that the documents tell for a native installation only."""


def told_lines() -> list[tuple[str, str]]:
    """Every command ``ros2 ...`` of the documents, in blocks or within a text."""
    found = []
    for path in DOCUMENTS:
        text = re.sub(r'^# ?', '', path.read_text(encoding='utf-8'), flags=re.MULTILINE)
        text = text.replace('\\\n', '')
        inline = re.findall(r'(?<!`)`(ros2 [^`]+)`(?!`)', text)
        block = re.findall(r'^ *(?:nice )?(ros2 \w.*)$', text, re.MULTILINE)
        for line in [*(' '.join(each.split()) for each in inline), *block]:
            if '`' not in line and line.split()[1] not in NATIVE:
                found.append((path.name, line))
    return found


def executables(package: str) -> set[str]:
    """The executables that a package of ours declares."""
    config = configparser.ConfigParser()
    config.read(ROOT / 'src' / package / 'setup.cfg', encoding='utf-8')
    scripts = config['options.entry_points']['console_scripts'].split('\n')
    return {line.partition('=')[0].strip() for line in scripts if line}


def test_the_documents_are_searched() -> None:
    where = {name for name, _ in told_lines()}
    assert {'README.md', 'graph.md', 'hardware.md', 'theory.md', 'rosbag2_qos.yaml'} <= where


@pytest.mark.parametrize(('document', 'line'), told_lines())
def test_a_line_of_the_documents(document: str, line: str) -> None:
    words = shlex.split(line, comments=True)[1:]
    given = parser(words).parse_args(words)
    if given.command == 'run' and given.package_name.startswith('maglev_'):
        assert given.executable_name in executables(given.package_name)
    if 'service_type' in given:
        find_type(given.service_type, 'srv')


@pytest.mark.parametrize('command', COMMANDS)
def test_a_command_alone_helps(ros2: Ros2, command: str) -> None:
    answer = ros2(command)
    if command == 'run':
        assert answer.code == 2
    else:
        assert answer.code == 0
        assert f'Call `ros2 {command} <command> -h` for more detailed usage.' in answer.out


def test_without_words_the_commands_are_told(ros2: Ros2) -> None:
    code, out, _ = ros2()
    assert code == 0
    assert all(re.search(rf'^    {command} ', out, re.MULTILINE) for command in COMMANDS)


def test_an_unknown_verb_says_which_there_are(ros2: Ros2) -> None:
    code, out, err = ros2('topic', 'nonsense')
    assert (code, out) == (2, '')
    usage, _, error, subset = err.splitlines()
    assert usage == 'usage: ros2 topic [-h]'
    assert error.startswith(
        'ros2 topic: error: argument Call `ros2 topic <command> -h` for more detailed usage.:'
        " invalid choice: 'nonsense' (choose from "
    )
    for verb in ('echo', 'hz', 'info', 'list', 'pub', 'type'):
        assert verb in error
    assert subset == SUBSET
    assert 'native installation' in SUBSET


def test_unknown_commands_and_options_say_so_too(ros2: Ros2) -> None:
    assert ros2('doctor').err.endswith(f'{SUBSET}\n')
    code, _, err = ros2('node', 'list', '--nonsense')
    assert code == 2
    assert 'unrecognized arguments: --nonsense' in err
    assert err.endswith(f'{SUBSET}\n')


def test_what_is_merely_wrong_is_not_blamed_on_the_subset(ros2: Ros2) -> None:
    code, _, err = ros2('bag', 'info', 'nothing')
    assert code == 2
    assert err.endswith(
        "ros2 bag info: error: argument bag_path: Bag path 'nothing' does not exist!\n"
    )
    for words in (
        ('topic', 'echo', '/a', '-l', '-1'),
        ('topic', 'hz', '/a', '-w', '0'),
        ('topic', 'pub', '/a', 'std_msgs/msg/String', '-r', '0'),
        ('topic', 'pub', '/a', 'std_msgs/msg/String', '-t', '-1'),
        ('topic', 'pub', '/a', 'std_msgs/msg/String', '-1', '-t', '2'),
    ):
        code, _, err = ros2(*words)
        assert code == 2
        assert SUBSET not in err


def test_a_negative_number_is_a_value() -> None:
    words = ['param', 'set', '/controller', 'limits.current', '-6.5']
    assert parser(words).parse_args(words).value == '-6.5'
