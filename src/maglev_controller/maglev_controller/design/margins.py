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
from scipy.linalg import eigvals

from maglev_controller.design.axis_design import AxisDesign, controller_system, resting
from maglev_controller.design.modes import variants
from maglev_controller.design.state_space import (
    ComplexArray,
    Mode,
    StateSpace,
    closed_loop,
    plant_system,
    response,
    series,
    spectral_radius,
)
from maglev_controller.parameters import ControllerParameters, MarginParameters
from maglev_controller.step.estimation import DOUBT
from maglev_model.axes import AXES, FloatArray
from maglev_model.parameters import ParameterError

_GRID = 1500  # frequencies looked at
_RINGING = 0.8  # |z| of a pole that may ring
_BESIDE = 1.0 + np.array([-1e-4, -1e-7, 1e-7, 1e-4])  # of a crossover
_TURNED = (
    '; oscillators that are turned for friction at rest want an integrator that is faster than they'
    " learn: set its learning well below its integration, or 'internal_model.rest' to 'hold'"
)
_SLOPES = tuple(np.geomspace(1.0, 1e6, 25))  # of friction against velocity [1/s]


@dataclasses.dataclass(frozen=True)
class LoopMargins:
    """Poles and margins of one axis, as :func:`loop_margins` computes them.

    ``poles`` (m,) of the sampled closed loop, z; ``crossover`` [rad/s], the highest; ``phase``
    margin [deg], the smallest at any crossover; gain margins as factors, ``gain_up`` (inf for
    none) and ``gain_down`` (0 for none); ``sensitivity``, the peak of |1 / (1 + L)|; ``friction``,
    the least slope against velocity [1/s] with which the loop hunts where the reference rests: inf
    for none, nan where oscillators hold and it is not looked at. With ``modes``, all is the worst
    wherever they are within the ``tolerance``; ``unstable_mode`` [rad/s] is one that alone makes
    the loop unstable, or nan.
    """

    poles: ComplexArray
    period: float
    crossover: float
    phase: float
    gain_up: float
    gain_down: float
    sensitivity: float
    friction: float
    modes: tuple[Mode, ...] = ()
    tolerance: float = 0.0
    unstable_mode: float = math.nan

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
        for mode in self.modes:
            friction += f', with a mode at {mode.frequency / (2.0 * math.pi):.4g} Hz'
        if self.modes:
            friction += f' ± {100.0 * self.tolerance:g} %'
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
    design: AxisDesign,
    period: float,
    *,
    delay: int = 0,
    designed: int = 0,
    modes: Sequence[Mode] = (),
) -> LoopMargins:
    """Poles and margins of one axis at sample time ``period`` [s].

    ``delay`` [samples] is what the currents come late, ``designed`` what the controller was
    designed for; ``modes`` flexible ones of the plant.
    """
    controller = controller_system(design, period, designed)
    plant = plant_system(period, delay, stiffness=design.stiffness, modes=modes)
    poles = np.linalg.eigvals(closed_loop(controller, plant)).astype(np.complex128)
    omega = _frequencies(poles, controller, plant, period)
    z = np.exp(1j * omega * period)
    loop = -response(controller, z) * response(plant, z)
    crossover, phase = _crossover(omega, loop)
    up, down = _gain_margins(loop)
    return LoopMargins(
        poles=poles,
        period=period,
        crossover=crossover,
        phase=phase,
        gain_up=up,
        gain_down=down,
        sensitivity=float(np.max(1.0 / np.abs(1.0 + loop))),
        friction=_friction(design, period, delay, designed) if design.fades else math.nan,
    )


def _frequencies(
    poles: ComplexArray, controller: StateSpace, plant: StateSpace, period: float
) -> FloatArray:
    """Those looked at [rad/s]: all over, around poles that ring, and either side of crossovers."""
    omega = np.geomspace(0.05, math.pi / period * (1.0 - 1e-9), _GRID)
    ringing = poles[np.abs(poles) > _RINGING]
    width = np.abs(np.log(np.abs(ringing)))[:, None] * np.linspace(-5.0, 5.0, 101)
    near = (np.angle(ringing)[:, None] + width).ravel() / period
    beside = np.angle(_unit_gains(series(controller, plant)))[:, None] / period * _BESIDE
    near = np.concatenate([near, beside.ravel()])
    return np.union1d(omega, near[(near > omega[0]) & (near < omega[-1])])


def _unit_gains(loop: StateSpace) -> ComplexArray:
    """The z where L(z) L(1/z) = 1, those of the unit circle the crossovers: none is too narrow.

    Eigenvalues of the pencil of ``x⁺ = A x + B u``, ``λ = Aᵀ λ⁺ + Cᵀ y``, ``u = Bᵀ λ⁺ + D y``.
    """
    state, drive, output, direct = loop
    n = drive.size
    left, right = np.zeros((2, 2 * n + 1, 2 * n + 1))
    left[:n, :n], left[:n, -1] = state, drive
    left[n:, :n] = np.vstack([np.outer(output, output), direct * output])
    left[n:, -1] = np.append(direct * output, direct**2 - 1.0)
    left[n:-1, n:-1] = -np.eye(n)
    right[:n, :n] = np.eye(n)
    right[n:, n:-1] = -np.vstack([state.T, drive])
    found = eigvals(left, right)
    return np.asarray(found[np.isfinite(found)])


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
        if max(map(spectral_radius, loops)) >= 1.0:
            return float(slope)
    return math.inf


def all_margins(
    parameters: ControllerParameters, designs: Sequence[AxisDesign], late: int = 0
) -> tuple[LoopMargins, ...]:
    """The margins of all axes, of axes designed alike only once; with currents ``late`` [samples].

    Raises :class:`ParameterError` for a loop that double precision cannot hold.
    """
    known: dict[object, LoopMargins] = {}
    given = [parameters.modes.of(axis) for axis in AXES]
    keys = [(_key(design), modes) for design, modes in zip(designs, given, strict=True)]
    for axis, key, design, modes in zip(AXES, keys, designs, given, strict=True):
        if key in known:
            continue
        try:
            known[key] = _worst(parameters, design, modes, late)
        except np.linalg.LinAlgError as error:
            raise ParameterError(
                f'{axis}: the loop with these gains is too ill-conditioned for its margins '
                f"({error}); of two forms of internal model 'modal' is the better conditioned"
            ) from error
    return tuple(known[key] for key in keys)


def _worst(
    parameters: ControllerParameters, design: AxisDesign, modes: tuple[Mode, ...], late: int
) -> LoopMargins:
    """The margins as they are at least, wherever the modes are."""
    delay, tolerance = parameters.input_delay, parameters.modes.tolerance
    each = [
        loop_margins(
            design, parameters.sample_time, delay=delay + late, designed=delay, modes=variant
        )
        for variant in variants(modes, tolerance)
    ]
    worst = max(each, key=lambda margins: margins.spectral_radius)
    return dataclasses.replace(
        worst,
        phase=min(margins.phase for margins in each),
        gain_up=min(margins.gain_up for margins in each),
        gain_down=max(margins.gain_down for margins in each),
        sensitivity=max(margins.sensitivity for margins in each),
        modes=modes,
        tolerance=tolerance,
        unstable_mode=_unstable_mode(parameters, design, modes),
    )


def _unstable_mode(
    parameters: ControllerParameters, design: AxisDesign, modes: tuple[Mode, ...]
) -> float:
    """Frequency [rad/s] of the first mode that alone makes the loop unstable, or nan."""
    period, delay = parameters.sample_time, parameters.input_delay
    controller = controller_system(design, period, delay)
    for mode in modes:
        for variant in variants((mode,), parameters.modes.tolerance):
            plant = plant_system(period, delay, stiffness=design.stiffness, modes=variant)
            if variant and spectral_radius(closed_loop(controller, plant)) >= 1.0:
                return mode.frequency
    return math.nan


def _key(design: AxisDesign) -> object:
    """All that the margins depend on."""
    arrays = tuple(array.tobytes() for array in (design.gain, design.transition, design.drive))
    estimate = design.derivative, design.observer
    return arrays, design.notches, estimate, design.stiffness, design.fades


def check_margins(parameters: ControllerParameters, margins: LoopMargins, axis: str) -> None:
    """Refuse a loop that is unstable, or short of the least margins unless they are overridden.

    Raises :class:`ParameterError`, naming the axis, the figure and what would help.
    """
    if math.isfinite(margins.unstable_mode):
        raise ParameterError(
            f'{axis}: the flexible mode at {margins.unstable_mode / (2.0 * math.pi):.4g} Hz makes '
            'the loop unstable, and no notch and speed of the axis were found that bear it: make '
            "the axis slower, or the mode better known ('modes.tolerance')"
        )
    if not margins.spectral_radius < 1.0:
        worst = margins.poles[np.argmax(np.abs(margins.poles))]
        frequency = abs(np.angle(worst)) / margins.period
        raise ParameterError(
            f'{axis}: with these gains and this rate estimate the loop is unstable at a sample '
            f'time of {margins.period:g} s (largest pole |z| = {margins.spectral_radius:.4f} at '
            f'{frequency:.4g} rad/s){_what_turns(parameters, margins, axis, frequency)}'
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


def _what_turns(
    parameters: ControllerParameters, margins: LoopMargins, axis: str, frequency: float
) -> str:
    """What to add where a loop swings at a ``frequency`` [rad/s] where turned oscillators act."""
    multiples = getattr(parameters, axis).multiples
    highest = parameters.internal_model.fundamental * max(multiples, default=0.0)
    fades = not math.isnan(margins.friction)
    return _TURNED if fades and frequency < highest else ''


def check_in_real_time(parameters: ControllerParameters, designs: Sequence[AxisDesign]) -> None:
    """Refuse a loop that is short of the least margins where currents come a sample late.

    As they do in real time, which a longer sample makes worse; an ``input_delay`` of 1 counts with
    it. Raises :class:`ParameterError`, naming the axis and the figure.
    """
    if parameters.input_delay > 0 or parameters.margins.override:
        return
    late = all_margins(parameters, designs, late=1)
    for axis, margins, table in zip(AXES, late, parameters.axes, strict=True):
        short = _shortfall(parameters.margins, margins)
        if not margins.spectral_radius < 1.0:
            short = 'the loop is unstable'
        if short and table.controlled:
            raise ParameterError(
                f"parameter 'input_delay' is 0, but in real time currents come a 'sample_time' "
                f'({margins.period:g} s) late, and then {short} ({axis}): set it to 1, shorten the '
                "sample time, or take it as it is with 'margins.override'"
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
