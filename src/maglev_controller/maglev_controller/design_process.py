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

from maglev_controller.bumpless_transfer import ModelMaps, model_maps
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.parameters import ParameterError

_LONGEST = 20.0  # [s]

# Gives back the real-time priority it has from the loop it shall not disturb, before it imports.
_PROGRAM = """
import os
os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
from maglev_controller.design_process import main
main()
"""


class DesignProcess:
    """A design under way; :meth:`result` once it is :attr:`done`."""

    def __init__(self, regulator: Regulator, parameters: ControllerParameters) -> None:
        """Begin to design for ``parameters`` a successor of ``regulator``."""
        self._input = tempfile.TemporaryFile()  # noqa: SIM115 - they live as long as the process
        self._output = tempfile.TemporaryFile()  # noqa: SIM115
        pickle.dump((regulator.arrays, parameters), self._input)
        self._input.seek(0)
        self._begun = time.monotonic()
        self._process = subprocess.Popen(
            [sys.executable, '-c', _PROGRAM],
            stdin=self._input,
            stdout=self._output,
        )

    @property
    def done(self) -> bool:
        """Whether there is a result; a design that takes too long is ended."""
        if time.monotonic() - self._begun > _LONGEST:
            self._process.kill()
            self._process.wait()
        return self._process.poll() is not None

    def result(self) -> tuple[Regulator, ModelMaps]:
        """The new regulator and how it takes over. Raises ParameterError when there is none."""
        self._output.seek(0)
        with self._input, self._output:
            content = self._output.read()
        if self._process.returncode != 0:
            raise ParameterError('the design failed or took too long; the old gains stay')
        outcome = pickle.loads(content)
        if isinstance(outcome, ParameterError):
            raise outcome
        regulator, maps = outcome
        return regulator, maps


def main() -> None:
    """Design what is asked for on stdin, and write it to stdout."""
    arrays, parameters = pickle.load(sys.stdin.buffer)
    try:
        regulator = Regulator(parameters)
        outcome = regulator, model_maps(arrays, regulator.arrays)
        regulator.foreign = None  # that is for the process that flies to make, or to keep
        sys.stdout.buffer.write(pickle.dumps(outcome))
    except ParameterError as error:
        sys.stdout.buffer.write(pickle.dumps(error))
