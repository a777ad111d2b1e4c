"""The file a campaign is written to as it goes, and from which one that was interrupted goes on."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO, Generic, TypeVar

from maglev_model.parameters import ParameterError

FORMAT = 1

T = TypeVar('T')


class Journal(Generic[T]):
    """Lines that are only ever appended: what is flown first, then what came of each part of it.

    A line that a crash cut short is as if it had never been. To be used in a ``with`` statement.
    """

    def __init__(
        self,
        path: Path,
        head: Mapping[str, Any],
        to_json: Callable[[T], object],
        from_json: Callable[[Any], T],
    ) -> None:
        """Begin a file, or go on with one.

        ``head`` tells campaigns apart; the two functions make plain values of what is flown, and it
        of them. Raises :class:`ParameterError` where the file that is there is another's, is being
        written, or is none of a campaign, and OSError where it cannot be written.
        """
        self.path, self._to_json = path, to_json
        head = {'format': FORMAT, **head}
        self.flown: list[T] = []
        self._file = path.open('a+b')
        try:
            self._go_on(head, from_json)
        except BaseException:
            self._file.close()
            raise

    def _go_on(self, head: Mapping[str, Any], from_json: Callable[[Any], T]) -> None:
        try:
            fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # which no fork inherits
        except BlockingIOError as error:
            raise ParameterError(
                f"'{self.path}' is being written by another campaign: choose another --out"
            ) from error
        kept = 0
        self._file.seek(0)
        for number, line in enumerate(_whole_lines(self._file)):
            plain = self._read(line, number)
            if number == 0:
                self._compare(plain, head)
            else:
                self.flown += [from_json(one) for one in plain]
            kept += len(line)
        self._file.truncate(kept)
        if not kept:
            self._append(head)

    def __enter__(self) -> Journal[T]:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def add(self, flown: Sequence[T]) -> None:
        """Append what came of a part, at once and for good."""
        self._append([self._to_json(one) for one in flown])
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


def _whole_lines(file: BinaryIO) -> Iterator[bytes]:
    return (line for line in file if line.endswith(b'\n'))
