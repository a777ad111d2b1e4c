"""The file a campaign is written to as it goes, and from which one that was interrupted goes on."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from maglev_model.parameters import ParameterError
from maglev_study.robustness.fly import Flown

FORMAT = 1


class Journal:
    """Lines that are only ever appended: what is flown first, then each machine under each law.

    A line that a crash cut short is as if it had never been. To be used in a ``with`` statement.
    """

    def __init__(self, path: Path, head: Mapping[str, Any]) -> None:
        """Begin a file, or go on with one.

        ``head`` tells campaigns apart. Raises :class:`ParameterError` where the file that is there
        is another's, or none of a campaign, and OSError where it cannot be written.
        """
        self.path = path
        head = {'format': FORMAT, **head}
        self.flown: list[Flown] = []
        kept = 0
        if path.is_file():
            for number, line in enumerate(_whole_lines(path)):
                plain = self._read(line, number)
                if number == 0:
                    self._compare(plain, head)
                else:
                    self.flown += [Flown.from_json(one) for one in plain]
                kept += len(line)
        self._file = path.open('ab')
        self._file.truncate(kept)
        if not kept:
            self._append(head)

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    @property
    def done(self) -> set[tuple[int, str]]:
        """Machine and law of what has been flown."""
        return {(one.machine, one.law) for one in self.flown}

    def add(self, flown: Sequence[Flown]) -> None:
        """Append what came of one machine under one law, at once and for good."""
        self._append([one.to_json() for one in flown])
        self.flown += flown

    def _append(self, content: object) -> None:
        self._file.write(json.dumps(content).encode('ascii') + b'\n')
        self._file.flush()
        os.fsync(self._file.fileno())

    def _read(self, line: bytes, number: int) -> Any:
        try:
            return json.loads(line)
        except ValueError as error:
            raise ParameterError(f"'{self.path}', line {number + 1}: {error}") from error

    def _compare(self, was: Any, wanted: Mapping[str, Any]) -> None:
        if not isinstance(was, dict) or 'format' not in was:
            raise ParameterError(f"'{self.path}' is no campaign's: choose another --out")
        for name, value in wanted.items():
            if was.get(name) != value:
                raise ParameterError(
                    f"'{self.path}' holds a campaign whose {name} is {was.get(name)!r}, this one's"
                    f' is {value!r}: choose another --out'
                )


def _whole_lines(path: Path) -> Iterator[bytes]:
    with path.open('rb') as file:
        for line in file:
            if line.endswith(b'\n'):
                yield line
