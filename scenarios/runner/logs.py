"""The logs of the nodes while they are written: what of them the terminal shows."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from runner.console import complain, say
from runner.process import last_words

_LOGGED = re.compile(r'(WARN|ERROR|FATAL) \S+ (.*)')  # as ENVIRONMENT has nodes write it
_QUIET = re.compile(r'(INFO|DEBUG) \d')  # which stays in the log
_SEVERITY = {'WARN': 'warning', 'ERROR': 'error', 'FATAL': 'fatal error'}
_MOST = 20  # warnings of a node


class Tail:
    """The lines of a file that have come since they were last asked for."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._position = 0

    def lines(self, rest: bool = False) -> Iterator[str]:
        """Whole lines; with ``rest`` the last one without its end too."""
        try:
            with self._path.open('rb') as file:
                file.seek(self._position)
                new = file.read()
        except FileNotFoundError:
            return
        if not rest:
            new = new[: new.rfind(b'\n') + 1]
        self._position += len(new)
        yield from new.decode(errors='replace').splitlines()


class NodeLog:
    """Shows a node's warnings and errors as they come, each text once.

    :param who: scenario and node, ``ellipse: controller``.
    :param everything: show too what it prints and does not log, as it is.
    """

    def __init__(self, who: str, path: Path, *, everything: bool = False) -> None:
        self._who, self._path, self._everything = who, path, everything
        self._tail = Tail(path)
        self._said: set[str] = set()

    def show(self, rest: bool = False) -> None:
        """Print what has come since; at the end, the ``rest`` without a line's end too."""
        for line in self._tail.lines(rest):
            found = _LOGGED.fullmatch(line)
            if found:
                self._warn(_text(found))
            elif self._everything and not _QUIET.match(line):
                say(line)

    def last_words(self) -> str:
        """The line that says why the node ended, unless it was shown; for after its end."""
        self.show(rest=True)
        words = last_words(self._path)
        found = _LOGGED.fullmatch(words)
        return '' if found and _text(found) in self._said else words

    def _warn(self, text: str) -> None:
        if text in self._said or len(self._said) > _MOST:
            return
        self._said.add(text)
        if len(self._said) > _MOST:
            text = f'more warnings and errors are in {self._path}'
        complain(f'{self._who}: {text}')


def _text(logged: re.Match[str]) -> str:
    return f'{_SEVERITY[logged[1]]}: {logged[2]}'
