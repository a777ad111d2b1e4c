"""The folder a run is left in."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Sequence
from pathlib import Path

from runner.console import say
from runner.options import WrongUseError
from runner.overlays import ROOT

RUN = ('bag', 'log', 'params', 'metrics.json', 'report.html')


def default_folder(name: str) -> Path:
    """A folder in runs/ that is named after what is run and when."""
    folder = ROOT / 'runs' / f'{name}-{time.strftime("%Y%m%d-%H%M%S")}'
    return folder if not folder.exists() else Path(f'{folder}-{os.getpid()}')


def make_folder(out: Path) -> Path:
    """Make the folder of a run, with room in it; its real path.

    Raises :class:`WrongUseError` when it holds a run or cannot be written to.
    """
    refuse_full(out, RUN, 'a run')
    log, params = out / 'log', out / 'params'
    try:
        log.mkdir(parents=True, exist_ok=True)
        params.mkdir(exist_ok=True)
        _write_block(log)
    except OSError as error:
        for remove in (log.rmdir, params.rmdir):
            with contextlib.suppress(OSError):
                remove()
        raise cannot_write(out) from error
    return out.resolve()


def why_unwritable(out: Path) -> str:
    """What keeps logs from being written, and so from telling of it; empty for nothing."""
    try:
        _write_block(out / 'log')
    except OSError as error:
        return f"cannot write to '{out}': {error.strerror}"
    return ''


def _write_block(folder: Path) -> None:
    """Try it with a whole block at once, so that a full disk shows. Raises OSError."""
    probe = folder / '.try'
    try:
        probe.write_bytes(bytes(65536))
    finally:
        probe.unlink(missing_ok=True)


def refuse_full(out: Path, names: Sequence[str], what: str) -> None:
    """Refuse a folder that holds one of these."""
    if any(os.path.lexists(out / name) for name in names):
        raise WrongUseError(f"'{out}' already holds {what}: choose another --out")


def cannot_write(out: Path) -> WrongUseError:
    """The refusal of a folder that cannot be made or is on a full disk."""
    return WrongUseError(
        f"cannot write to '{out}': check its permissions and the space left,"
        ' or choose another --out'
    )


def say_where(out: Path) -> None:
    """What of a run is there, and where."""
    for name in ('report.html', 'replay.html', 'metrics.json', 'bag', 'params', 'log'):
        if (out / name).exists():
            say(f'  {out / name}')
