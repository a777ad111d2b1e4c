"""What the programs of this package have in common: how they end, and what they tell of it."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from maglev_model.parameters import ParameterError
from maglev_model.programs.optional import MissingLibraryError
from maglev_model.programs.progress import talking

DONE, WRONG_USE, INTERRUPTED = 0, 2, 130

Work = Callable[[argparse.Namespace], tuple[int, dict[str, Any]]]
"""From options to an exit code and what else is to be told of the outcome."""


def command(name: str, options: argparse.Namespace, work: Work) -> int:
    """Do the work of a command with ``--out``, and print its outcome for who wants it as JSON.

    What is wrong in its use is said in a line, and is exit code 2; Ctrl-C is exit code 130.
    """
    for variable in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS'):
        os.environ.setdefault(variable, '1')  # before NumPy: its libraries read it once
    outcome: dict[str, Any] = {}
    code, reason = WRONG_USE, ''
    with talking(options):
        try:
            code, outcome = work(options)
        except (ParameterError, MissingLibraryError) as error:
            reason = str(error)
        except BrokenPipeError:
            raise  # nobody reads any more
        except OSError as error:
            reason = f"cannot write to '{error.filename}': " if error.filename else ''
            reason += error.strerror or str(error)
        except KeyboardInterrupt:
            code, reason = INTERRUPTED, 'interrupted'
    if reason:
        print(f'{name}: error: {reason}', file=sys.stderr)
    if options.json:
        print(json.dumps({'passed': code == DONE, 'out': str(options.out), **outcome}))
    return code


def writable(folder: Path) -> Path:
    """A folder that can be written to, made where there is none; ParameterError where not."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / '.try'
        probe.write_bytes(bytes(65536))
        probe.unlink()
    except OSError as error:
        raise ParameterError(f"cannot write to '{folder}': {error.strerror}") from error
    return folder.resolve()
