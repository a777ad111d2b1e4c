"""The simulated stage: reads like the machine's encoders, takes the currents of its motors."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from maglev_model.axes import FloatArray
from maglev_model.compiled import borrowing
from maglev_model.compiled.records import Block
from maglev_model.contract.stage import STOPPED_SINCE, EncoderSample, Fault, Truth, motor_currents
from maglev_plant.arrays import StageArrays, stage_arrays
from maglev_plant.dynamics import advance
from maglev_plant.encoder import encode
from maglev_plant.parameters import PlantParameters

_DIRECT, _QUADRATURE = 'direct_current', 'quadrature_current'


class Trajectory(NamedTuple):
    """A simulated run, one row per sample."""

    time: FloatArray  # (n,) [s]
    state: FloatArray  # (n, 10) x1..x10
    measured: FloatArray  # (n, 6) gaps of motors 1..4, x, z [m]
    direct_current: FloatArray  # (n, 4) flowing [A]
    quadrature_current: FloatArray  # (n, 4) flowing [A]


@borrowing
def _read(block: Block, first: bool) -> None:
    if not first:
        advance(block)
    encode(block)


@borrowing
def _hold(i_d: FloatArray, i_q: FloatArray, command: FloatArray) -> bool:
    """Take over finite currents as the command, or leave it and return false."""
    for i in range(4):
        if not (np.isfinite(i_d[i]) and np.isfinite(i_q[i])):
            return False
    for i in range(4):
        command[i] = i_d[i]
        command[4 + i] = i_q[i]
    return True


class SimulatedStage:
    """The :class:`~maglev_model.contract.stage.Stage` in simulation, one sample per :meth:`read`.

    The first ``read`` gives sample 0 at the initial state. Each further one carries the plant over
    one sample time with the currents last written held, and gives what the encoders read then.
    Before anything is written no current flows. It is ready once it is made.
    """

    late = 0.0
    paced = False
    restartable = False

    def __init__(self, parameters: PlantParameters | None = None) -> None:
        self.parameters = parameters or PlantParameters()
        self.sample_time = self.parameters.sample_time
        self.watchdog = self.parameters.watchdog
        self.fault: Fault | None = None
        self._stopped_since = ''  # why, while a fault was latched
        self._arrays = stage_arrays(self.parameters)
        self._first = True
        self._landed = False
        self._age = 0  # samples since the last fresh currents

    @property
    def arrays(self) -> StageArrays:
        """The stage's own arrays, for compiled loops that call ``advance`` and ``encode``."""
        return self._arrays

    @property
    def sequence(self) -> int:
        """Number of the sample the plant stands at."""
        return self._arrays.sample

    @property
    def flying(self) -> bool:
        """Whether currents are held."""
        return any(self._arrays.command.tolist())

    @property
    def state(self) -> FloatArray:
        """True x1..x10 [m, m/s, rad, rad/s], shape (10,), a copy."""
        return np.array(self._arrays.state)

    @property
    def direct_current(self) -> FloatArray:
        """i_d flowing in motors 1..4 [A], shape (4,), a copy."""
        return np.array(self._arrays.flowing[:4])

    @property
    def quadrature_current(self) -> FloatArray:
        """i_q flowing in motors 1..4 [A], shape (4,), a copy."""
        return np.array(self._arrays.flowing[4:])

    @property
    def thermal_load(self) -> FloatArray:
        """Used share of the thermal budget of motors 1..4, each its hottest phase, shape (4,)."""
        return np.array([max(phases) for phases in self._arrays.load.reshape(4, 3).tolist()])

    def truth(self) -> Truth:
        """The true state of the sample the plant stands at."""
        return Truth(
            self.state,
            self.direct_current,
            self.quadrature_current,
            self.thermal_load,
            np.array(self._arrays.effects.sensor.own),
        )

    def configure(self) -> None:
        """Go to sample 0 and the initial state, without current or fault, amplifiers cold.

        Whatever a sample needs is compiled, or loaded, before.
        """
        for _ in range(2):
            self.read()
            _hold(np.zeros(4), np.zeros(4), self._arrays.command)
        self._arrays.block[:] = stage_arrays(self.parameters).block
        self._first = True
        self.fault = None
        self.activate()

    def activate(self) -> None:
        """Follow currents from now on; none flows yet."""
        self._arrays.command[:] = 0.0
        self._landed, self._age = False, 0

    def read(self) -> EncoderSample:
        """The next sample; see the class."""
        _read(self._arrays.block, self._first)
        reading = self._arrays.reading.copy()
        self._first = False
        return EncoderSample(reading[:4], reading.item(4), reading.item(5))

    def write(self, direct_current: ArrayLike, quadrature_current: ArrayLike, age: int = 0) -> None:
        """Hold these currents until the next write; none while a fault is latched or it has landed.

        ``direct_current`` i_d, ``quadrature_current`` i_q of motors 1..4 [A], shape (4,) each, for
        the sample ``age`` before this one: a fault in flight when that is beyond the watchdog. Zero
        currents in flight are obeyed, as it has no law to land by. Raises ValueError, and holds
        what was written before, when a shape is wrong or a current is not finite.
        """
        i_d = motor_currents(_DIRECT, direct_current)
        i_q = motor_currents(_QUADRATURE, quadrature_current)
        if not _hold(i_d, i_q, self._arrays.command):
            raise ValueError(_not_finite(i_d, i_q))
        self._age = age
        if self._landed or self.fault is not None:
            self.deactivate()
        elif age:
            self._watch_age()

    def hold(self) -> None:
        """No fresh currents for this sample; a fault when they are older than the watchdog."""
        self._age += 1
        self._watch_age()

    def _watch_age(self) -> None:
        age = self._age * self.sample_time
        if age > self.watchdog and self.flying:
            self._latch(
                'stale', f'no fresh currents for {age * 1e3:.0f} ms', 'start the controller again'
            )

    def land(self, why: str) -> None:
        """End the currents, for it has no law to land by: what flies drops, whatever ``why``."""
        self._landed = True
        self.deactivate()

    def stop(self, why: str = 'emergency stop', kind: str = 'stop', remedy: str = '') -> None:
        """Cut the currents and latch a fault with that reason.

        Where one is latched already, the next reset is refused: who asks for it may not know.
        """
        if kind == 'stop' and self.fault is not None:
            self._stopped_since = why
        self._latch(kind, why, remedy or 'see to what made it necessary')

    def reset(self) -> tuple[bool, str]:
        """Clear the latched fault and follow currents again; whether it did."""
        if self._stopped_since:
            why, self._stopped_since = self._stopped_since, ''
            return False, STOPPED_SINCE.format(why)
        fault, landed = self.fault, self._landed
        self.fault, self._landed = None, False
        if fault is not None:
            return True, f'cleared: {fault.reason}'
        return landed, 'follows the controller again' if landed else 'there is no fault'

    def deactivate(self) -> None:
        """Take the currents away."""
        self._arrays.command[:] = 0.0

    def close(self) -> None:
        """Take the currents away."""
        self.deactivate()

    def _latch(self, kind: str, reason: str, remedy: str) -> None:
        if self.fault is None:
            self.fault = Fault(kind, reason, remedy, cut=True)
        self.deactivate()


def _not_finite(i_d: FloatArray, i_q: FloatArray) -> str:
    for name, values in ((_DIRECT, i_d), (_QUADRATURE, i_q)):
        for motor, value in enumerate(values, start=1):
            if not np.isfinite(value):
                return f'{name} of motor {motor} is {value}, it must be finite'
    return 'currents must be finite'


def simulate(
    parameters: PlantParameters,
    law: Callable[[EncoderSample], tuple[ArrayLike, ArrayLike]],
    duration: float,
) -> Trajectory:
    """Run the stage in closed loop with a control law, from sample 0 for ``duration`` [s].

    ``law`` takes an :class:`EncoderSample` and returns i_d and i_q of motors 1..4 [A], shape (4,)
    each. Row k of the result is sample k; its currents flowed at the instant it was taken.
    """
    stage = SimulatedStage(parameters)
    samples = round(duration / parameters.sample_time) + 1
    run = Trajectory(
        time=np.arange(samples, dtype=np.float64) * parameters.sample_time,
        state=np.empty((samples, 10)),
        measured=np.empty((samples, 6)),
        direct_current=np.empty((samples, 4)),
        quadrature_current=np.empty((samples, 4)),
    )
    for k in range(samples):
        sample = stage.read()
        run.state[k] = stage.state
        run.measured[k, :4] = sample.gap
        run.measured[k, 4:] = sample.x, sample.z
        run.direct_current[k] = stage.direct_current
        run.quadrature_current[k] = stage.quadrature_current
        direct, quadrature = law(sample)
        stage.write(direct, quadrature)
    return run
