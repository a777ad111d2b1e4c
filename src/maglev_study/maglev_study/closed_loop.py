"""The closed loop without ROS: regulator and simulated stage in one compiled loop."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from maglev_controller.learning import IterativeLearning
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import MeasurementFault, Regulator
from maglev_controller.step.arrays import ControlArrays, Currents, Reading, Reference
from maglev_controller.step.learning import NO_LEARNING, LearningArrays, learn, look_ahead
from maglev_controller.step.sample import FIRST_FAULT, control_step
from maglev_model.axes import PHI, FloatArray, Y
from maglev_model.compiled import borrowing
from maglev_model.compiled.records import Block
from maglev_model.geometry import outputs_of_gaps
from maglev_plant.arrays import StageArrays
from maglev_plant.dynamics import advance
from maglev_plant.encoder import encode
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.references import References

_AT_STOP = 1e-6  # of it [m, rad]


class LawFault(RuntimeError):  # noqa: N818
    """A law of somebody else's failed; the message says at which sample and how."""


@dataclasses.dataclass(frozen=True)
class Run:
    """What happened in n samples of the closed loop; row k is sample k.

    ``state`` (n, 10) true x1..x10 when the sample was taken; ``reading`` (n, 6) what the encoders
    read, gaps of motors 1..4, x, z [m], and ``own_length`` (n, 6) what these lengths are on their
    own scales, between the counts; ``direct_current``, ``quadrature_current`` (n, 4) commanded
    in answer [A]; ``limited_by`` (n,) what limited them, as bits of :mod:`maglev_model.inverse`;
    ``radius`` r of (5) [m].
    """

    state: FloatArray
    reading: FloatArray
    own_length: FloatArray
    direct_current: FloatArray
    quadrature_current: FloatArray
    limited_by: NDArray[np.int8]
    radius: float

    @property
    def saturated(self) -> NDArray[np.bool_]:
        """Whether some current was limited (n,)."""
        return np.asarray(self.limited_by != 0)

    @property
    def output(self) -> FloatArray:
        """The true outputs y, x, z, phi, theta (n, 5) [m, rad]."""
        return self.state[:, ::2]

    @property
    def measured(self) -> FloatArray:
        """The same as the encoders have them (n, 5) [m, rad]."""
        return _outputs(self.reading, self.radius)

    @property
    def own(self) -> FloatArray:
        """The same on the encoders' own scales, zeros and all, between the counts (n, 5)."""
        return _outputs(self.own_length, self.radius)


def _outputs(length: FloatArray, radius: float) -> FloatArray:
    return outputs_of_gaps(length[:, :4], length[:, 4], length[:, 5], radius)


@borrowing
def _keep(row: FloatArray, values: FloatArray) -> None:
    for i in range(row.size):
        row[i] = values[i]


class _Rows(NamedTuple):
    """Where the samples of a run are written, (n, ...) each."""

    state: FloatArray
    reading: FloatArray
    own: FloatArray
    current: FloatArray
    code: NDArray[np.int8]


@borrowing
def _loop(
    control: ControlArrays,
    block: Block,
    references: References,
    rows: _Rows,
    delayed: bool,
    learning: LearningArrays,
    follows: NDArray[np.bool_],
    answer: FloatArray,
) -> int:
    """All samples, or up to the first that the regulator refuses; returns how many went well."""
    stage: StageArrays = block[0]
    learns = follows.size > 0
    position, velocity, acceleration = references
    for k in range(position.shape[0]):
        _keep(rows.state[k], stage.state)
        encode(block)
        _keep(rows.reading[k], stage.reading)
        _keep(rows.own[k], stage.effects.sensor.own)
        if learns:
            look_ahead(learning, control, follows[k])
        rows.code[k] = control_step(
            control,
            Reading(stage.reading[:4], stage.reading[4], stage.reading[5]),
            Reference(position[k], velocity[k], acceleration[k]),
            Currents(answer[:4], answer[4:]),
        )
        if rows.code[k] >= FIRST_FAULT:
            return k
        if learns:
            learn(learning, control)
        if delayed:
            advance(block)
        for i in range(8):
            stage.command[i] = rows.current[k, i] = answer[i]
        if not delayed:
            advance(block)
    return int(position.shape[0])


def _asking_loop(
    regulator: Regulator, stage: StageArrays, references: References, rows: _Rows, delayed: bool
) -> None:
    """:func:`_loop` with a law of somebody else's, which Python asks for each sample."""
    block, reading, sensor = stage.block, stage.reading, stage.effects.sensor
    answer = np.zeros(8)
    for k, reference in enumerate(zip(*references, strict=True)):
        rows.state[k] = stage.state
        encode(block)
        rows.reading[k] = reading
        rows.own[k] = sensor.own
        gap, x, z = reading[:4], reading.item(4), reading.item(5)
        try:
            rows.code[k] = regulator.step(gap, x, z, *reference, answer[:4], answer[4:])
        except MeasurementFault as fault:
            raise MeasurementFault(f'sample {k}: {fault}') from fault
        if regulator.fault:
            raise LawFault(f'sample {k}: {regulator.fault}')
        if delayed:
            advance(block)
        stage.command[:] = rows.current[k] = answer
        if not delayed:
            advance(block)


def run(
    regulator: Regulator,
    stage: SimulatedStage,
    references: References,
    *,
    delayed: bool = False,
    learning: IterativeLearning | None = None,
    follows: NDArray[np.bool_] | None = None,
) -> Run:
    """Carry the stage along a reference, from the sample it stands at; both keep their states.

    With ``delayed`` the currents take effect one sample late, as in real time. Otherwise this is
    bit for bit what :meth:`Regulator.step` and the stage's ``read`` and ``write`` give in turn.
    ``learning`` learns at the samples that ``follows`` (n,) tells, by default all.
    Raises ValueError for references of another shape than (n, 5), and, naming the sample,
    :class:`MeasurementFault` when the regulator refuses one, :class:`LawFault` when a law of
    somebody else's fails: what nodes land upon.
    """
    references = References(*(np.ascontiguousarray(each, dtype=np.float64) for each in references))
    n = len(references.position)
    for name, array in references._asdict().items():
        if array.shape != (n, 5):
            raise ValueError(f'{name} must have shape ({n}, 5), not {array.shape}')
    lengths, arrays = (n, 6), stage.arrays
    rows = _Rows(
        np.empty((n, 10)),
        np.empty(lengths),
        np.empty(lengths),
        np.empty((n, 8)),
        np.zeros(n, dtype=np.int8),
    )
    if follows is None:
        follows = np.ones(n, dtype=np.bool_)
    if regulator.foreign is None:
        done = _loop(
            regulator.arrays,
            arrays.block,
            references,
            rows,
            delayed,
            NO_LEARNING if learning is None else learning.arrays,
            np.zeros(0, dtype=np.bool_) if learning is None else follows,
            np.zeros(8),
        )
        if done < n:
            gap, x, z = arrays.reading[:4], float(arrays.reading[4]), float(arrays.reading[5])
            told = regulator.describe(int(rows.code[done]), gap, x, z)
            raise MeasurementFault(f'sample {done}: {told}')
    else:
        _asking_loop(regulator, arrays, references, rows, delayed)
    state, reading, own, current, code = rows
    radius = stage.parameters.machine.radius
    return Run(state, reading, own, current[:, :4], current[:, 4:], code, radius)


def regulator_at_start(parameters: ControllerParameters) -> Regulator:
    """The regulator of a law, which begins anew: one for all its flights, which go one by one."""
    regulator = _designed(parameters)
    regulator.reset()
    return regulator


@functools.lru_cache(maxsize=8)
def _designed(parameters: ControllerParameters) -> Regulator:
    return Regulator(parameters)


def at_stops(plant: PlantParameters) -> Callable[[FloatArray], NDArray[np.bool_]]:
    """The function: true outputs (..., 5) [m, rad] to whether the platen meets a stop there (...).

    Of the axes that are not locked.
    """
    lower = np.array(plant.machine.lower_limit) + _AT_STOP
    upper = np.array(plant.machine.upper_limit) - _AT_STOP
    free = ~np.array(plant.guide.locked)
    return functools.partial(_meets, lower, upper, free, plant.stop.seat_radius)


def _meets(
    lower: FloatArray,
    upper: FloatArray,
    free: NDArray[np.bool_],
    radius: float,
    output: FloatArray,
) -> NDArray[np.bool_]:
    gap, reach = output[..., Y], radius * np.abs(output[..., PHI:]).max(axis=-1)
    seated = (gap - reach <= lower[Y]) | (gap + reach >= upper[Y])
    beyond = free & ((output <= lower) | (output >= upper))
    return np.asarray(seated | beyond.any(axis=-1))


def warm_up() -> None:
    """Compile all that the loop, the regulator and the stage need, or load it from the cache."""
    zero = np.zeros((2, 5))
    rest = zero + np.array([0.031, 0.0, 0.0, 0.0, 0.0])
    stage, regulator = SimulatedStage(PlantParameters()), Regulator(ControllerParameters())
    direct, quadrature = np.zeros(4), np.zeros(4)
    stage.write(direct, quadrature)
    sample = stage.read()
    run(regulator, stage, References(rest, zero, zero))
    regulator.step(*sample, rest[0], zero[0], zero[0], direct, quadrature)
