"""How far a long piece of work is, and where programs put what they print. No ROS here."""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
import time
from collections.abc import Iterator

_AFTER = 2.0  # work that is done before is not worth a bar [s]
_REDRAWN = 0.2  # at most so often, a bar on a terminal [s]
_REPEATED = 2.0  # and a line elsewhere [s]
_WIDTH = 24


class Progress:
    """A bar on a terminal; elsewhere a line now and then, with ``lines`` false none.

    :param name: of the program.
    :param what: is being done, ``runs flown``.
    """

    def __init__(self, name: str, what: str, *, lines: bool = True) -> None:
        self._name, self._what, self._lines = name, what, lines
        self._started = self._told = time.monotonic()
        self._first: float | None = None
        self._drawn = False

    def tell(self, done: float, wanted: float, words: str = '') -> None:
        """So much is done of what is wanted; ``words`` are about it."""
        if self._first is None:
            self._first = done
        now, terminal = time.monotonic(), sys.stdout.isatty()
        spent, over = now - self._started, done >= wanted
        pause = _REDRAWN if terminal else _REPEATED
        if (terminal and spent < _AFTER) or not (over or now - self._told > pause):
            return
        self._told = now
        left = spent / (done - self._first) * (wanted - done) if done > self._first else None
        text = f'{self._text(done, wanted)}{words}, {spent:.0f} s'
        text += '' if left is None or over else f', about {left:.0f} s left'
        if terminal:
            full = round(_WIDTH * min(done / wanted, 1.0)) if wanted else _WIDTH
            bar = '#' * full + '.' * (_WIDTH - full)
            print(f'\r\033[K{self._name} [{bar}] {text}', end='\n' if over else '', flush=True)
            self._drawn = not over
        elif self._lines:
            print(f'{self._name}: {text}', flush=True)

    def end(self) -> None:
        """Leave the line of the bar, where the work ended before it was done."""
        if self._drawn:
            print(flush=True)
            self._drawn = False

    def _text(self, done: float, wanted: float) -> str:
        if self._what == '%':
            return f'{100.0 * done / wanted:.0f} %' if wanted else '100 %'
        return f'{done:g} of {wanted:g} {self._what}'


def add_output_options(parser: argparse.ArgumentParser) -> None:
    """``--quiet`` and ``--json``, for :func:`talking`."""
    parser.add_argument('--quiet', action='store_true', help='say only what is wrong')
    parser.add_argument(
        '--json',
        action='store_true',
        help='print the outcome as a line of JSON, all else to stderr',
    )


@contextlib.contextmanager
def talking(options: argparse.Namespace) -> Iterator[None]:
    """Within it, what is printed goes where the options of :func:`add_output_options` say."""
    with contextlib.ExitStack() as stack:
        if options.quiet:
            nowhere = stack.enter_context(open(os.devnull, 'w', encoding='utf-8'))
            stack.enter_context(contextlib.redirect_stdout(nowhere))
        elif options.json:
            stack.enter_context(contextlib.redirect_stdout(sys.stderr))
        yield
