"""The process in which a regulator is designed while another one flies.

Designing takes a tenth of a second and more, most of it in calls that keep the interpreter to
themselves: in a thread it would stop the loop. The other process reads the regulator in use and the
new parameters, and writes what came of it.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack

from maglev_controller.bumpless_transfer import ModelMaps, model_maps
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.parameters import ParameterError

_LONGEST = 20.0  # [s]

# Gives back the real-time priority it has from the loop it shall not disturb, before it imports
# anything, packages of the environment (-S) included; what a law of somebody else's prints goes to
# stderr.
_PROGRAM = """
import os
os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
import site
site.main()
result = os.dup(1)
os.dup2(2, 1)
from maglev_controller.design_process import main
main(result)
"""


class DesignProcess:
    """A design under way; :meth:`result` once it is :attr:`done`."""

    def __init__(self, regulator: Regulator, parameters: ControllerParameters) -> None:
        """Begin to design for ``parameters`` a successor of ``regulator``.

        Raises ParameterError when no process can be begun.
        """
        self._begun = time.monotonic()
        try:
            with ExitStack() as files:
                self._output = files.enter_context(tempfile.TemporaryFile())
                given = files.enter_context(tempfile.TemporaryFile())
                pickle.dump((regulator.arrays, parameters), given)
                given.seek(0)
                self._process = subprocess.Popen(
                    [sys.executable, '-S', '-c', _PROGRAM],
                    stdin=given,
                    stdout=self._output,
                    start_new_session=True,  # Ctrl-C is for the node, which ends it
                )
                self._files = files.pop_all()
        except OSError as error:
            raise ParameterError(f'no design begins: {error}; the old gains stay') from error

    @property
    def done(self) -> bool:
        """Whether there is a result; a design that takes too long is ended."""
        if time.monotonic() - self._begun > _LONGEST:
            self.end()
        return self._process.poll() is not None

    def end(self) -> None:
        """Design no more: there will be no result."""
        self._process.kill()
        self._process.wait()

    def result(self) -> tuple[Regulator, ModelMaps]:
        """The new regulator and how it takes over. Raises ParameterError when there is none."""
        with self._files:
            if self._process.returncode != 0:
                raise ParameterError(
                    'the design failed, took too long or was ended; the old gains stay'
                )
            try:
                self._output.seek(0)
                outcome = pickle.load(self._output)
            except (OSError, EOFError, pickle.UnpicklingError) as error:
                text = f'the design cannot be read: {error}; the old gains stay'
                raise ParameterError(text) from error
        if isinstance(outcome, ParameterError):
            raise outcome
        regulator, maps = outcome
        return regulator, maps


def main(result: int) -> None:
    """Design what is asked for on stdin, and write it to the file descriptor ``result``."""
    arrays, parameters = pickle.load(sys.stdin.buffer)
    outcome: tuple[Regulator, ModelMaps] | ParameterError
    try:
        regulator = Regulator(parameters)
        outcome = regulator, model_maps(arrays, regulator.arrays)
        regulator.foreign = None  # that is for the process that flies to make, or to keep
    except ParameterError as error:
        outcome = error
    with open(result, 'wb') as output:
        pickle.dump(outcome, output)
