"""The stage contract: what a simulated and a real stage have in common. No ROS here."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from maglev_model.axes import FloatArray


class EncoderSample(NamedTuple):
    """What the six encoders read at one sample."""

    gap: FloatArray  # air gap at motors 1..4 [m], shape (4,)
    x: float  # displacement along X [m]
    z: float  # displacement along Z [m]


class Truth(NamedTuple):
    """What is behind a sample, where the stage knows it: a simulated one does."""

    state: FloatArray  # x1..x10 [m, m/s, rad, rad/s], shape (10,)
    direct_current: FloatArray  # i_d flowing in motors 1..4 [A], shape (4,)
    quadrature_current: FloatArray  # i_q flowing in motors 1..4 [A], shape (4,)
    thermal_load: FloatArray  # used share of the budget of each motor's hottest phase, shape (4,)
    own_length: FloatArray  # gaps 1..4, x, z on the encoders' own scales [m], shape (6,)


class Fault(NamedTuple):
    """A latched fault."""

    kind: str  # a word
    reason: str  # what happened
    remedy: str  # what to do
    cut: bool  # whether the current was cut at once

    def __str__(self) -> str:
        action = 'currents cut' if self.cut else 'landed by the stage'
        return f'{self.reason} ({action}); {self.remedy}, then call ~/reset'


class StageError(RuntimeError):
    """The stage cannot go on; the message says why and what to do."""


STOPPED_SINCE = 'stopped since the fault: {}; see to that, and reset again'
"""What a reset that is refused for a later stop says, with why that came."""


class Stage(Protocol):
    """A stage: encoders to read and motors to give currents to, once a sample.

    :meth:`configure` and :meth:`activate` it; then per sample :meth:`read` and one of :meth:`write`
    and :meth:`hold`; to end, :meth:`land` and go on with :meth:`hold` until it is not
    :attr:`flying`, :meth:`deactivate`, :meth:`close`. Deactivated, it can be activated again.
    """

    @property
    def sample_time(self) -> float:
        """Time between samples [s]."""
        ...

    @property
    def paced(self) -> bool:
        """Whether, in real time, :meth:`read` waits for a clock of the stage's own."""
        ...

    @property
    def restartable(self) -> bool:
        """Whether :meth:`reset` can bring back a stage that cannot go on."""
        ...

    @property
    def late(self) -> float:
        """How late the sample read last was, by the stage's own clock [s]."""
        ...

    @property
    def flying(self) -> bool:
        """Whether currents flow, or are to."""
        ...

    @property
    def fault(self) -> Fault | None:
        """What is latched until :meth:`reset`; meanwhile no currents are followed."""
        ...

    def configure(self) -> None:
        """Get hold of the hardware, with no current flowing. Raises StageError."""
        ...

    def activate(self) -> None:
        """Be ready for the first sample and follow currents. Raises StageError."""
        ...

    def read(self) -> EncoderSample:
        """The next sample's encoders. Raises StageError."""
        ...

    def write(
        self, direct_current: FloatArray, quadrature_current: FloatArray, age: int = 0
    ) -> None:
        """Follow i_d and i_q of motors 1..4 [A], (4,) each, fresh from the controller.

        They answer the measurement that was read ``age`` samples before the last one. Too old ones
        are not followed but a fault, as when none come; so are, on a stage that can land by itself,
        currents that are all zero while the platen is off its stop. Raises ValueError for currents
        that have another shape or are not finite, which are not followed, and StageError.
        """
        ...

    def hold(self) -> None:
        """No fresh currents came for this sample: the last ones stay, for a while.

        In flight that is a fault when they get too old. Raises StageError.
        """
        ...

    def land(self, why: str) -> None:
        """Come down without a controller and follow no currents until :meth:`reset`."""
        ...

    def stop(self, why: str = 'emergency stop', kind: str = 'stop', remedy: str = '') -> None:
        """Latch a fault, by default without a remedy of its own, and land or cut the currents."""
        ...

    def reset(self) -> tuple[bool, str]:
        """Clear the fault if its cause is gone, and follow currents again; whether, and a text.

        Refused once after a :meth:`stop` of kind 'stop' that came while a fault was latched.
        """
        ...

    def deactivate(self) -> None:
        """No current; may be activated again. Raises StageError."""
        ...

    def close(self) -> None:
        """Release everything with no current flowing; may be called twice."""
        ...

    def truth(self) -> Truth | None:
        """The true state of the sample read last, or None where it cannot be known."""
        ...


def motor_currents(name: str, value: Any) -> FloatArray:
    """Currents of motors 1..4 [A] as a contiguous array (4,); the same one where it is that.

    Raises ValueError, with ``name`` in it, for what is not four numbers.
    """
    if type(value) is np.ndarray and value.dtype == np.float64 and value.shape == (4,):
        return value if value.flags.c_contiguous else value.copy()
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f'{name} must be four numbers [A], not {value!r}') from error
    if array.shape != (4,):
        raise ValueError(f'{name} must have shape (4,), one current per motor, not {array.shape}')
    return np.ascontiguousarray(array)
