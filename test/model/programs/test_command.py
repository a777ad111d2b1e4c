"""A command's end, with and without a reader of what it prints; its signals."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

from maglev_model.programs.command import noted

PROGRAM = """
import sys

from maglev_model.programs.command import leave_with


def command():
    print('a line')
    {body}
    return 3


leave_with(command)
"""


def run(body: str, shell: str) -> tuple[int, str, str]:
    """Exit code of the command, what is left of its output, and its errors."""
    script = f'"$0" -c "$1" {shell}; exit "${{PIPESTATUS[0]}}"'
    done = subprocess.run(
        ['bash', '-c', script, sys.executable, PROGRAM.format(body=body)],
        capture_output=True,
        text=True,
        timeout=60,
    )
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize(
    ('body', 'code'), [('pass', 3), ('sys.exit(2)', 2), ('raise SystemExit(0)', 0)]
)
def test_who_reads_to_the_end_gets_the_exit_code(body: str, code: int) -> None:
    assert run(body, '| cat') == (code, 'a line\n', '')


@pytest.mark.parametrize('body', ['print("x" * 500_000)', 'print("x" * 500_000); sys.exit(0)'])
def test_who_leaves_early_ends_it_without_a_word(body: str) -> None:
    assert run(body, '| head -n 1') == (141, 'a line\n', '')


def test_ctrl_c_ends_it_without_a_word() -> None:
    body = 'import signal; signal.raise_signal(signal.SIGINT)'
    assert run(body, '| cat') == (130, 'a line\n', '')


@pytest.mark.parametrize('body', ['pass', 'print("x" * 500_000)'])
def test_a_full_disk_is_told_in_a_line(body: str) -> None:
    code, _, errors = run(body, '> /dev/full')
    assert code == 1
    assert errors == 'error: cannot write to the standard output: No space left on device\n'


@pytest.mark.parametrize(
    'body', ['pass', 'sys.stdout.write("a bar" * sys.stdout.isatty())', 'open("/dev/null")']
)
@pytest.mark.parametrize('shell', ['>&-', '<&- >&- 2>&-'])
def test_without_anywhere_to_print_it_ends_as_ever(body: str, shell: str) -> None:
    assert run(body, shell) == (3, '', '')


def test_what_is_wrong_is_not_taken_for_output_where_no_errors_are_wanted() -> None:
    assert run('print("it is wrong", file=sys.stderr)', '2>&- | cat') == (3, 'a line\n', '')


def test_a_defect_shows() -> None:
    code, _, errors = run('1 / 0', '| cat')
    assert code == 1
    assert 'ZeroDivisionError' in errors


def test_a_signal_is_noted_and_the_second_does_what_it_did_before() -> None:
    with noted(signal.SIGINT, signal.SIGTERM) as caught:
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGTERM)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert caught == [signal.SIGINT, signal.SIGTERM]
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
