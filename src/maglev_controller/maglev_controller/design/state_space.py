"""Linear systems with one input and one output, continuous or sampled, and the loop of two."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from maglev_model.axes import FloatArray

ComplexArray = NDArray[np.complex128]


class StateSpace(NamedTuple):
    """ẋ = A x + B u, or x⁺ = A x + B u when sampled; y = C x + D u. Shapes (n, n), (n,), (n,)."""

    state: FloatArray
    input: FloatArray
    output: FloatArray
    direct: float


def discretise(
    state: FloatArray, inputs: FloatArray, period: float
) -> tuple[FloatArray, FloatArray]:
    """Exact discretisation of ẋ = A x + B u, u held over ``period`` [s].

    ``state`` A (n, n), ``inputs`` B (n, m) → (exp(A T) (n, n), ∫₀ᵀ exp(A τ) dτ B (n, m)).
    """
    n, m = inputs.shape
    block = np.zeros((n + m, n + m))
    block[:n, :n], block[:n, n:] = state, inputs
    power = expm(block * period) if n else block
    return power[:n, :n], power[:n, n:]


def tustin(system: StateSpace, period: float) -> StateSpace:
    """The system sampled with ``s = 2 (z - 1) / (T (z + 1))``, ``period`` T [s]."""
    half = 0.5 * period * system.state
    unit = np.eye(system.input.size)
    before = np.linalg.inv(unit - half)
    driven = period * (before @ system.input)
    return StateSpace(
        before @ (unit + half),
        driven,
        system.output @ before,
        system.direct + 0.5 * float(system.output @ driven),
    )


def response(system: StateSpace, z: ComplexArray) -> ComplexArray:
    """Frequency response of a sampled system at ``z`` (m,)."""
    unit = np.eye(system.input.size)
    columns = np.linalg.solve(
        z[:, None, None] * unit - system.state, system.input.astype(np.complex128)[:, None]
    )
    return np.asarray(columns[:, :, 0] @ system.output + system.direct)


class Mode(NamedTuple):
    """A flexible mode: the encoder reads κ q more, q̈ + 2 ζ ω q̇ + ω² q = w."""

    frequency: float  # ω [rad/s]
    damping: float  # ζ
    gain: float  # κ, by the rigid axis' gain


def sampled_frequency(frequency: FloatArray, period: float) -> FloatArray:
    """Where a sample every ``period`` [s] shows each frequency (n,) [rad/s]: 0 to π / period."""
    return np.asarray(np.abs(np.angle(np.exp(1j * period * frequency))) / period)


def plant_system(
    period: float,
    delay: int = 0,
    *,
    stiffness: float = 0.0,
    friction: float = 0.0,
    modes: Sequence[Mode] = (),
) -> StateSpace:
    """What the inverse leaves of an axis, sampled with w held and ``delay`` samples late: w to e.

    ë = α e − κ ė + w with ``stiffness`` α [1/s²] and ``friction`` κ [1/s], and flexible modes
    beside it.
    """
    body = 2 + 2 * len(modes)
    continuous, read = np.zeros((body, body)), np.eye(1, body)[0]
    continuous[:2, :2] = [[0.0, 1.0], [stiffness, -friction]]
    for row, mode in zip(range(2, body, 2), modes, strict=True):
        damping = 2.0 * mode.damping * mode.frequency
        continuous[row : row + 2, row : row + 2] = [[0.0, 1.0], [-(mode.frequency**2), -damping]]
        read[row] = mode.gain
    pushed = np.tile([[0.0], [1.0]], (1 + len(modes), 1))
    moved, pushed = discretise(continuous, pushed, period)
    size = body + delay
    state, drive, output = np.zeros((size, size)), np.zeros(size), np.zeros(size)
    state[:body, :body], output[:body] = moved, read
    if delay == 0:
        drive[:] = pushed[:, 0]
    else:
        state[:body, body], drive[-1] = pushed[:, 0], 1.0
        state[body:-1, body + 1 :] = np.eye(delay - 1)
    return StateSpace(state, drive, output, 0.0)


def series(first: StateSpace, second: StateSpace) -> StateSpace:
    """The second system driven by what the first puts out; state: the first's, then its own."""
    n = first.input.size
    state = np.zeros((n + second.input.size,) * 2)
    state[:n, :n], state[n:, n:] = first.state, second.state
    state[n:, :n] = np.outer(second.input, first.output)
    return StateSpace(
        state,
        np.append(first.input, second.input * first.direct),
        np.append(second.direct * first.output, second.output),
        first.direct * second.direct,
    )


def spectral_radius(loop: FloatArray) -> float:
    """Largest |z| of the poles of a transition matrix."""
    return float(np.max(np.abs(np.linalg.eigvals(loop))))


def closed_loop(controller: StateSpace, plant: StateSpace) -> FloatArray:
    """The closed loop's transition matrix; state: the plant's, then the controller's."""
    n = plant.input.size
    loop = np.zeros((n + controller.input.size,) * 2)
    loop[:n, :n] = plant.state + controller.direct * np.outer(plant.input, plant.output)
    loop[:n, n:] = np.outer(plant.input, controller.output)
    loop[n:, :n] = np.outer(controller.input, plant.output)
    loop[n:, n:] = controller.state
    return loop
