"""What the scripts have in common: where results are left, and how much is said."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping
from pathlib import Path

from runner.console import talk_to
from runner.folder import default_folder
from runner.options import Option, folder
from runner.overlays import overlay

Job = Callable[[], int]
"""What returns an exit code; it may raise WrongUseError before anything is started."""

OUTPUT = {
    '--quiet': Option('say only what is wrong'),
    '--json': Option('print the outcome with all figures as one line of JSON, all else to stderr'),
}


def out_option(what: str, name: str) -> Option:
    """Where ``what``, as ``the run is``, is left of the script ``name``."""
    return Option(f'where {what} left (default runs/{name}-<time>)', 'DIR', folder)


def overlays(what: str, width: int = 82) -> Option:
    """Parameter files of the user's own, in whose help a line is so wide."""
    where = 'from the current folder or from params/; repeatable, the last one wins'
    return Option(textwrap.fill(f'{what}, {where}', width), 'OVERLAY.yaml', overlay)


def out_folder(name: str, given: Mapping[str, list[str]]) -> Path:
    """The folder that was given, or one by the script's name and the time."""
    return Path(given['--out'][-1]) if '--out' in given else default_folder(name)


def talk(given: Mapping[str, list[str]]) -> None:
    """Say what there is to say where it is wanted."""
    if '--quiet' in given:
        talk_to(None)
    elif '--json' in given:
        talk_to(2)


def as_given(table: Mapping[str, Option], given: Mapping[str, list[str]], *names: str) -> list[str]:
    """Some options of a table as they were given, for another program; the last value wins."""
    words: list[str] = []
    for name in names:
        if name in given:
            words += [name, *(given[name] if table[name].several else given[name][-1:])]
    return words
