"""The sampled closed loop of one axis as it runs: poles, margins, sensitivity, friction at rest.

The controller is one linear system from e to w, internal model (or compensator), rate estimate and
delay included; the plant is what the inverse leaves of the axis, (13), with w held over a sample.
All is computed once, at configuration.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from maglev_controller.design.axis_design import AxisDesign, controller_system, resting
from maglev_controller.design.state_space import (
    ComplexArray,
    closed_loop,
    plant_system,
    response,
)
from maglev_controller.estimation import DOUBT
from maglev_controller.parameters import ControllerParameters, MarginParameters
from maglev_model.axes import FloatArray
from maglev_model.parameters import ParameterError

_GRID = 1500  # frequencies looked at
_SLOPES = tuple(np.geomspace(1.0, 1e6, 25))  # of friction against velocity [1/s]


@dataclasses.dataclass(frozen=True)
class LoopMargins:
    """Poles and margins of one axis, as :func:`loop_margins` computes them.

    ``poles`` (m,) of the sampled closed loop, z; ``crossover`` [rad/s], the highest; ``phase``
    margin [deg], the smallest at any crossover; gain margins as factors, ``gain_up`` (inf for
    none) and ``gain_down`` (0 for none); ``sensitivity``, the peak of |1 / (1 + L)|; ``friction``,
    the least slope against velocity [1/s] with which the loop hunts where the reference rests: inf
    for none, nan where oscillators hold and it is not looked at.
    """

    poles: ComplexArray
    period: float
    crossover: float
    phase: float
    gain_up: float
    gain_down: float
    sensitivity: float
    friction: float

    @property
    def spectral_radius(self) -> float:
        """Largest |z| of the poles."""
        return float(np.max(np.abs(self.poles)))

    @property
    def natural_poles(self) -> ComplexArray:
        """The poles as ln z / T [rad/s], the slowest first, of a pair the upper; fast ones too."""
        poles = np.log(self.poles.astype(np.complex128) + 0.0) / self.period
        upper = poles[poles.imag >= -1e-9]
        return np.asarray(upper[np.argsort(-upper.real)])

    def text(self, axis: str) -> str:
        """One line for the log."""
        friction = ''
        if self.friction == math.inf:
            friction = ', at rest stable with any friction'
        elif self.friction > 0.0:
            friction = f', at rest stable with friction flatter than {self.friction:.3g} 1/s'
        poles = ' '.join(_pole_text(pole) for pole in self.natural_poles)
        return (
            f'{axis}: crossover {self.crossover:.0f} rad/s, phase margin {self.phase:.1f} deg, '
            f'gain margin {_decibel(self.gain_up)} up, {_decibel(self.gain_down)} down, '
            f'sensitivity peak {self.sensitivity:.2f}{friction}; poles [rad/s] {poles}'
        )


def _pole_text(pole: complex) -> str:
    return f'{pole.real:.3g}' + (f'±{pole.imag:.3g}i' if pole.imag > 1e-6 else '')


def _decibel(factor: float) -> str:
    return f'{abs(20.0 * math.log10(factor)):.1f} dB' if 0.0 < factor < math.inf else 'any'


def loop_margins(
    design: AxisDesign, period: float, *, delay: int = 0, designed: int = 0
) -> LoopMargins:
    """Poles and margins of one axis at sample time ``period`` [s].

    ``delay`` [samples] is what the currents come late, ``designed`` what the controller was
    designed for.
    """
    controller = controller_system(design, period, designed)
    plant = plant_system(period, delay, stiffness=design.stiffness)
    omega = np.geomspace(0.05, math.pi / period * (1.0 - 1e-9), _GRID)
    z = np.exp(1j * omega * period)
    loop = -response(controller, z) * response(plant, z)
    crossover, phase = _crossover(omega, loop)
    up, down = _gain_margins(loop)
    return LoopMargins(
        poles=np.asarray(np.linalg.eigvals(closed_loop(controller, plant)), dtype=np.complex128),
        period=period,
        crossover=crossover,
        phase=phase,
        gain_up=up,
        gain_down=down,
        sensitivity=float(np.max(1.0 / np.abs(1.0 + loop))),
        friction=_friction(design, period, delay, designed) if design.fades else math.nan,
    )


def _crossover(omega: FloatArray, loop: ComplexArray) -> tuple[float, float]:
    """Highest frequency where |L| is 1, and the smallest phase margin [deg] where it is."""
    size = np.log(np.abs(loop))
    k = np.nonzero(np.sign(size[:-1]) != np.sign(size[1:]))[0]
    if k.size == 0:
        return 0.0, 180.0
    part = size[k] / (size[k] - size[k + 1])
    at = loop[k] * (loop[k + 1] / loop[k]) ** part
    crossovers = omega[k] * (omega[k + 1] / omega[k]) ** part
    return float(crossovers[-1]), float(np.min(np.abs(np.degrees(np.angle(-at)))))


def _gain_margins(loop: ComplexArray) -> tuple[float, float]:
    """Smallest factor above 1, and largest below, that puts ``loop`` on −1."""
    before, after = loop[:-1], loop[1:]
    crossing = (np.sign(before.imag) != np.sign(after.imag)) & (before.real < 0.0)
    part = before.imag[crossing] / (before.imag - after.imag)[crossing]
    real = before.real[crossing] + part * (after.real - before.real)[crossing]
    factors = -1.0 / real[real < 0.0]
    up, down = factors[factors > 1.0], factors[factors < 1.0]
    return float(np.min(up, initial=math.inf)), float(np.max(down, initial=0.0))


def _friction(design: AxisDesign, period: float, delay: int, designed: int) -> float:
    """The least slope of friction, of those looked at, with which the loop hunts at rest, or inf.

    Whether the observer believes the counts or doubts them.
    """
    controllers = [
        controller_system(resting(design, doubt), period, designed) for doubt in (0.0, DOUBT)
    ]
    for slope in _SLOPES:
        plant = plant_system(period, delay, stiffness=design.stiffness, friction=slope)
        loops = [closed_loop(controller, plant) for controller in controllers]
        if max(np.max(np.abs(np.linalg.eigvals(loop))) for loop in loops) >= 1.0:
            return float(slope)
    return math.inf


def all_margins(
    parameters: ControllerParameters, designs: Sequence[AxisDesign]
) -> tuple[LoopMargins, ...]:
    """The margins of all axes; of axes designed alike only once."""
    delay = parameters.input_delay
    known: dict[object, LoopMargins] = {}
    keys = [_key(design) for design in designs]
    for key, design in zip(keys, designs, strict=True):
        if key not in known:
            known[key] = loop_margins(design, parameters.sample_time, delay=delay, designed=delay)
    return tuple(known[key] for key in keys)


def _key(design: AxisDesign) -> object:
    """All that the margins depend on."""
    arrays = tuple(array.tobytes() for array in (design.gain, design.transition, design.drive))
    return arrays, design.derivative, design.observer, design.stiffness, design.fades


def check_margins(parameters: ControllerParameters, margins: LoopMargins, axis: str) -> None:
    """Refuse a loop that is unstable, or short of the least margins unless they are overridden.

    Raises :class:`ParameterError`, naming the axis, the figure and what would help.
    """
    if not margins.spectral_radius < 1.0:
        worst = margins.poles[np.argmax(np.abs(margins.poles))]
        raise ParameterError(
            f'{axis}: with these gains and this rate estimate the loop is unstable at a sample '
            f'time of {margins.period:g} s (largest pole |z| = {margins.spectral_radius:.4f} at '
            f'{abs(np.angle(worst)) / margins.period:.4g} rad/s)'
        )
    if parameters.margins.override:
        return
    short = _shortfall(parameters.margins, margins)
    if short:
        raise ParameterError(
            f'{axis}: {short}; make the axis slower (its bandwidth, LQR weights or poles), '
            "or take it as it is with 'margins.override'"
        )
    if margins.friction < math.inf:
        raise ParameterError(
            f'{axis}: standing still hunts with friction of a slope of {margins.friction:.3g} 1/s; '
            'make the axis faster or its integrator slower (its integration or weight_model), or '
            "set 'internal_model.rest' to 'hold'"
        )


def _shortfall(least: MarginParameters, margins: LoopMargins) -> str:
    if margins.phase < least.phase:
        return (
            f"the phase margin is {margins.phase:.1f} deg, 'margins.phase' asks for {least.phase:g}"
        )
    gain = min(margins.gain_up, 1.0 / margins.gain_down if margins.gain_down > 0.0 else math.inf)
    if gain < least.gain:
        return f"the gain margin is a factor {gain:.2f}, 'margins.gain' asks for {least.gain:g}"
    if margins.sensitivity > least.sensitivity:
        return (
            f"the sensitivity peaks at {margins.sensitivity:.2f}, 'margins.sensitivity' allows "
            f'{least.sensitivity:g}'
        )
    return ''
