"""Laws that are no linear compensators: any Python object, asked once a sample.

Its module has a function ``make(parameters)`` that returns the object; see :class:`Law`. What it
answers is checked before it acts, and with its first mistake it is not asked again until the next
:meth:`ForeignLaw.reset`: the regulator's own law, which runs along with it, takes over in that very
sample, and the controller lands. It cannot be interrupted, though: one that never returns is left
to the stage, which lands, or cuts the currents, when no currents come.
"""

from __future__ import annotations

import time
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from maglev_controller.parameters import ControllerParameters
from maglev_model.axes import AXES, FloatArray
from maglev_model.parameters import ParameterError
from maglev_model.parameters.plugins import describe_error

LARGEST: Final = 1e6
"""Magnitude of an answer from which on it is none [A, m/s², rad/s²]."""

VIRTUAL_INPUT: Final = (5,)
CURRENTS: Final = (2, 4)


class Measurement(NamedTuple):
    """What a law is told of a sample; the arrays are its own to keep.

    ``velocity`` is that of the regulator's observer, or of its derivative filter. In lockstep,
    where the stage waits for the answer, nothing is late.
    """

    gap: FloatArray  # (4,) of motors 1..4, as the encoders read it [m]
    x: float  # [m]
    z: float  # [m]
    position: FloatArray  # y, x, z, phi, theta (5,), from these [m, rad]
    velocity: FloatArray  # (5,) [m/s, rad/s]
    time: float  # that it may take for its answer [s]
    late: float  # that it took too long for the last one [s]


class Reference(NamedTuple):
    """Where y, x, z, phi, theta shall be, (5,) each; jumps are rounded off as ``jumps.*`` say."""

    position: FloatArray  # [m, rad]
    velocity: FloatArray
    acceleration: FloatArray


class Law(Protocol):
    """What ``make(parameters)`` of a law's module returns."""

    def reset(self) -> None:
        """Begin anew: before every lift-off."""

    def step(self, measurement: Measurement, reference: Reference) -> ArrayLike:
        """Answer a sample: by currents, or by the accelerations that an inverse makes currents of.

        Currents are i_d and i_q of motors 1..4, (2, 4) [A]; accelerations those of y, x, z, phi,
        theta, the virtual inputs w, (5,) [m/s², rad/s²]. Always the same of the two.
        """
        ...


class ForeignLaw:
    """A law of somebody else's, asked once a sample and watched.

    ``fault`` says why it is not asked any more, and is empty while it is; ``samples``, ``late`` and
    ``worst`` [s] how often it was asked since the reset, how often it took too long, and its
    longest time. ``hurried``: the stage does not wait, so too long is late, and often late a fault.
    """

    def __init__(
        self,
        law: Law,
        parameters: ControllerParameters,
        name: str = '',
    ) -> None:
        """Ask the law once, at rest. Raises ParameterError when that fails."""
        self.law = law
        self.name = name or parameters.law
        self.parameters = parameters
        self.hurried = False
        given = f"parameter 'law' is '{self.name}'"
        self.reset()
        rest = np.zeros((5, 5))
        rest[0, 0] = rest[2, 0] = parameters.machine.gap_max
        answer = self._asked(np.full(4, rest[0, 0]), 0.0, 0.0, rest)
        if self.fault:
            raise ParameterError(f'{given}, and at rest {self.fault}')
        self.shape = answer.shape
        if self.shape not in (VIRTUAL_INPUT, CURRENTS):
            raise ParameterError(
                f'{given}, whose step returns an array of shape {self.shape}: it must be {CURRENTS}'
                f', currents i_d and i_q of the motors, or {VIRTUAL_INPUT}, accelerations of '
                f'{", ".join(AXES)}'
            )

    @property
    def gives_currents(self) -> bool:
        """Whether it answers by currents."""
        return self.shape == CURRENTS

    def describe(self) -> str:
        """What it is, in a line."""
        gives = 'currents' if self.gives_currents else 'accelerations'
        return (
            f'the law {self.name} gives {gives} and may take '
            f'{1e3 * self.parameters.foreign.time:g} ms for a sample; the margins of what lands '
            'when it fails:'
        )

    def reset(self) -> None:
        """Begin anew, and believe it again."""
        self.fault = ''
        self.samples = self.late = self._late_in_a_row = 0
        self.worst = self._took = 0.0
        try:
            self.law.reset()
        except BaseException as error:
            self._fail(error)

    def ask(self, gap: FloatArray, x: float, z: float, told: FloatArray) -> NDArray[Any] | None:
        """Its answer, checked; None, with the reason in ``fault``, when there is none.

        ``told`` (5, 5) as :func:`~maglev_controller.step.foreign_sample.open_sample` writes it.
        """
        if self.fault:
            return None
        answer = self._asked(gap.copy(), x, z, told.copy())
        if self.fault:
            return None
        if answer.shape != self.shape:
            self.fault = f'the law {self.name} returned shape {answer.shape}, not {self.shape}'
        elif not float(np.abs(answer).max()) < LARGEST:  # nor when one is not a number
            index = int(np.argmin(np.abs(answer.ravel()) < LARGEST))
            self.fault = (
                f'the law {self.name} returned {answer.ravel()[index]} for {self._of(index)}'
            )
        return None if self.fault else answer

    def _asked(self, gap: FloatArray, x: float, z: float, told: FloatArray) -> NDArray[Any]:
        may_take = self.parameters.foreign.time
        over = max(self._took - may_take, 0.0) if self.hurried else 0.0
        measurement = Measurement(gap, x, z, told[0], told[1], may_take, over)
        answer: NDArray[Any] = np.empty(0)
        began = time.perf_counter()
        try:
            given = self.law.step(measurement, Reference(told[2], told[3], told[4]))
            answer = np.array(given, dtype=np.float64)
        except BaseException as error:
            self._fail(error)
        self._note(time.perf_counter() - began)
        return answer

    def _note(self, took: float) -> None:
        """Take the time it took into account."""
        foreign = self.parameters.foreign
        self._took = took
        self.samples += 1
        self.worst = max(self.worst, took)
        if took <= foreign.time:
            self._late_in_a_row = 0
            return
        self.late += 1
        self._late_in_a_row += 1
        if self.hurried and self._late_in_a_row > foreign.late_samples and not self.fault:
            self.fault = (
                f'the law {self.name} took too long {self._late_in_a_row} times in a row, at last '
                f'{1e3 * took:.2f} ms of the {1e3 * foreign.time:g} ms it may take'
            )

    def _of(self, index: int) -> str:
        """What an element of its answer is."""
        if not self.gives_currents:
            return f'the acceleration of {AXES[index]}'
        return f'{("i_d", "i_q")[index // 4]} of motor {index % 4 + 1}'

    def _fail(self, error: BaseException) -> None:
        if isinstance(error, KeyboardInterrupt):
            raise error
        self.fault = f'the law {self.name} raised {describe_error(error)}'
