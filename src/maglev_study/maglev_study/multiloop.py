"""All five axes as one sampled loop, broken where currents go in and where encoders read.

What each axis' own margins do not show: what happens when several amplifiers or encoders are off at
once. A disk margin α guarantees stability for every gain and phase within its disk, in each of the
channels by itself and all at the same time: with skew 0, P. Seiler, A. Packard and P. Gahinet, "An
introduction to disk margins", IEEE Control Syst. Mag., vol. 40, no. 5, 2020.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag

from maglev_controller.design.axis_design import controller_system, resting
from maglev_controller.design.state_space import ComplexArray, StateSpace, discretise
from maglev_controller.parameters import ControllerParameters
from maglev_model.axes import AXES, FloatArray
from maglev_model.machine import machine_constants
from maglev_model.parameters import ParameterError
from maglev_model.platen import gaps_from_outputs, outputs_from_gaps
from maglev_plant.parameters import PlantParameters
from maglev_study.arguments import a_table
from maglev_study.linear import StageAt, inverse_slopes, linear_law, slopes
from maglev_study.references import HOVER

_FREQUENCIES = (80, 30)  # over the whole range, then beside the worst of them
_LEAST = 1.0  # of them [rad/s]
_SWEEPS, _DESCENT = 8, 25  # of the search for scalings
_TINY = 1e-12

Broken = Callable[[ComplexArray, ComplexArray], ComplexArray]
"""From the responses of plant and controller to that of their loop, broken somewhere."""


class Part(NamedTuple):
    """x⁺ = A x + B u, y = C x + D u, of several inputs and outputs."""

    state: FloatArray
    input: FloatArray
    output: FloatArray
    direct: FloatArray


class Guarantee(NamedTuple):
    """What a disk margin guarantees, in every channel at once."""

    disk: float  # α, 0 where the loop itself is unstable
    gain: float  # up and down [dB]
    phase: float  # [deg]


NOTHING = Guarantee(0.0, 0.0, 0.0)


class MultiLoop(NamedTuple):
    """Plant, with hold and delay, and controller: currents to readings and back, (8) and (6)."""

    plant: Part
    controller: Part
    period: float

    def closed(self, gains: FloatArray | float = 1.0) -> FloatArray:
        """The closed loop's transition matrix; ``gains`` (8,) are those of the amplifiers."""
        plant, law = self.plant, self.controller
        driven = plant.input * gains
        return np.block(
            [
                [plant.state + driven @ law.direct @ plant.output, driven @ law.output],
                [law.input @ plant.output, law.state],
            ]
        )

    def stable(self, gains: FloatArray | float = 1.0) -> bool:
        """Whether it is, with amplifiers of these gains."""
        return bool(np.max(np.abs(np.linalg.eigvals(self.closed(gains)))) < 1.0)

    def guarantees(self) -> tuple[Guarantee, Guarantee]:
        """At the currents, and at the readings, the least over all frequencies."""
        if not self.stable():
            return NOTHING, NOTHING
        at_the_currents = self._guarantee(lambda plant, controller: -controller @ plant)
        return at_the_currents, self._guarantee(lambda plant, controller: -plant @ controller)

    def _guarantee(self, broken: Broken) -> Guarantee:
        """Of the loop broken there, for negative feedback: looked for finer about the worst."""
        low, high, most = _LEAST, math.pi / self.period, 0.0
        for number in _FREQUENCIES:
            omega = np.geomspace(low, high, number)
            z = np.exp(1j * omega * self.period)
            bound = _bound(broken(_response(self.plant, z), _response(self.controller, z)))
            worst = int(bound.argmax())
            low, high = omega[max(worst - 1, 0)], omega[min(worst + 1, number - 1)]
            most = max(most, float(bound[worst]))
        half = min(0.5 / most, 1.0)
        gain = 20.0 * math.log10((1.0 + half) / (1.0 - half)) if half < 1.0 else math.inf
        return Guarantee(1.0 / most, gain, 2.0 * math.degrees(math.atan(half)))


def _response(part: Part, z: ComplexArray) -> ComplexArray:
    """The frequency response (m, outputs, inputs) at ``z`` (m,)."""
    unit = np.eye(len(part.state))
    inside = np.linalg.solve(z[:, None, None] * unit - part.state, part.input[None])
    return np.asarray(part.output @ inside + part.direct)


def _bound(loop: ComplexArray) -> FloatArray:
    """On the structured singular value of (S - T) / 2, of a loop's frequency response (m, n, n)."""
    unit = np.eye(loop.shape[1])
    return structured_bound(0.5 * (unit - loop) @ np.linalg.inv(unit + loop))


def structured_bound(matrices: ComplexArray) -> FloatArray:
    """An upper bound on the structured singular value of each of ``matrices`` (m, n, n), (m,).

    For n complex numbers that perturb: the least largest singular value of D M D⁻¹ that is found,
    D diagonal, from Osborne's balancing down the gradient. Whatever D, it is a bound.
    """
    scaled = matrices.copy()
    for _ in range(_SWEEPS):
        for k in range(scaled.shape[1]):
            others = np.arange(scaled.shape[1]) != k
            row = np.linalg.norm(scaled[:, k, others], axis=1)
            column = np.linalg.norm(scaled[:, others, k], axis=1)
            factor = np.sqrt((column + _TINY) / (row + _TINY))[:, None]
            scaled[:, k] *= factor
            scaled[:, :, k] /= factor
    least = np.full(len(scaled), np.inf)
    for number in range(_DESCENT):
        left, size, right = np.linalg.svd(scaled)
        least = np.minimum(least, size[:, 0])
        slope = np.abs(left[:, :, 0]) ** 2 - np.abs(right[:, 0]) ** 2
        factors = np.exp(-slope / (1.0 + 0.3 * number))
        scaled = factors[:, :, None] * scaled / factors[:, None]
    return least


def multiloop(
    parameters: PlantParameters | None = None,
    at: ArrayLike = HOVER,
    *,
    speed: float = 0.0,
    delay: int = 0,
    controller: ControllerParameters | None = None,
) -> MultiLoop:
    """The loop of all axes about ``at`` y, x, z, phi, theta [m, rad], for small errors.

    Where every axis moves at ``speed`` [m/s, rad/s], which counts for friction; at 0 the law is the
    one of rest. Currents are held over a sample and come ``delay`` samples late.

    Raises ParameterError where nothing holds the platen, for ``effects.*`` of the plant, for a
    speed or delay that is none, and for a law that is no linear one.
    """
    given = a_table(PlantParameters, parameters, 'plant')
    known = a_table(ControllerParameters, controller, 'controller')
    law = linear_law(given, known)
    if not math.isfinite(speed):
        raise ParameterError(f"'speed' is {speed}, it must be finite")
    if delay < 0:
        raise ParameterError(f"'delay' is {delay} samples, it must not be negative")
    stage = StageAt(given, at, speed)
    inverse = inverse_slopes(stage, known)
    read, outputs = _encoders(given, stage.position)
    free = [index for index, axis in enumerate(known.axes) if axis.controlled]
    moves = stage.arrays.locked == 0
    moves[free] = True
    plant = _plant(stage, inverse.flowing, read, moves, known.sample_time, delay)
    systems = []
    for index in free:
        design = law.design(known, AXES[index])
        if design.fades and speed == 0.0:
            design = resting(design, 0.0)
        systems.append(controller_system(design, known.sample_time, known.input_delay))
    made = _feedback(systems, outputs[free], inverse.by_w[:, free])
    made = made._replace(direct=made.direct + inverse.by_output @ outputs)
    return MultiLoop(plant, made, known.sample_time)


def _encoders(given: PlantParameters, position: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What is read by outputs (6, 5), and the outputs by what is read (5, 6), about a position."""
    machine = machine_constants(given.machine)

    def read(output: FloatArray) -> FloatArray:
        lengths = np.append(np.empty(4), output[1:3])
        gaps_from_outputs(machine, output, lengths[:4])
        return lengths

    def told(lengths: FloatArray) -> FloatArray:
        output = np.empty(5)
        outputs_from_gaps(machine, lengths[:4], lengths[4], lengths[5], output)
        return output

    return slopes(read, position), slopes(told, read(position))


def _plant(
    stage: StageAt,
    flowing: FloatArray,
    read: FloatArray,
    moves: NDArray[np.bool_],
    period: float,
    delay: int,
) -> Part:
    """Currents, held over a sample and ``delay`` samples late, to readings, by what ``moves`` (5,).

    An axis that is locked would be an integrator, which passes for a loop that is not stable.
    """
    by_state, by_current = stage.lagging_slopes(flowing)
    output = np.zeros((6, len(by_state)))
    output[:, :10:2] = read
    kept = np.ones(len(by_state), dtype=np.bool_)
    kept[:10] = np.repeat(moves, 2)
    state, driven = discretise(by_state[np.ix_(kept, kept)], by_current[kept], period)
    output = output[:, kept]
    for _ in range(delay):
        state = np.block([[state, driven], [np.zeros((8, len(state) + 8))]])
        driven = np.vstack((np.zeros((len(state) - 8, 8)), np.eye(8)))
        output = np.hstack((output, np.zeros((6, 8))))
    return Part(state, driven, output, np.zeros((6, 8)))


def _feedback(systems: Sequence[StateSpace], known_by: FloatArray, by_w: FloatArray) -> Part:
    """Readings to the currents of w; a system and a row of ``known_by`` for each axis."""
    drive = block_diag(*(one.input[:, None] for one in systems))
    output = block_diag(*(one.output[None] for one in systems))
    direct = np.diag([one.direct for one in systems])
    return Part(
        block_diag(*(one.state for one in systems)),
        drive @ known_by,
        by_w @ output,
        by_w @ direct @ known_by,
    )
