"""The regulator: encoder readings and a reference in, motor currents out, once a sample.

w = K (e, ė, ξ) + Γ ξ on every axis (16), the internal model (14) or (17) sampled exactly, then one
of the inverses. e and ė are an observer's position and rate less the reference's; with the paper's
derivative filter, ė is the filtered position's rate less the reference's velocity through the same
filter: the filtered rate of e, but for a jump of the set-point, which has no rate and so gives no
kick. With feed-forward, w also holds the reference's acceleration.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from maglev_controller import sample_step as law
from maglev_controller.design.gains import AxisDesign
from maglev_controller.design.margins import LoopMargins, all_margins, check_margins
from maglev_controller.design.observer import NO_OBSERVER
from maglev_controller.handover import ModelMaps, carry_over, check_retuning, model_maps
from maglev_controller.laws import control_law
from maglev_controller.parameters import ControllerParameters
from maglev_controller.sample_step import ControlArrays, control_step
from maglev_model.axes import AXES
from maglev_model.machine import machine_constants, machine_to_array

FloatArray = NDArray[np.float64]

FADING_TIME = 0.05
"""Time constant of the share of w that bridges a change of gains in flight [s]."""


class MeasurementFault(ValueError):  # noqa: N818
    """A measurement or reference cannot be used; the message says which value and why."""


class Regulator:
    """The regulator of all five axes; arrays in the paper's output order y, x, z, phi, theta.

    Readable after a step, (5,) each, in place: ``position`` [m, rad], ``error``, ``error_rate``,
    ``virtual_input`` w [m/s², rad/s²] and ``internal_model``, the internal model's share of w.
    """

    def __init__(self, parameters: ControllerParameters) -> None:
        """Design all axes. Raises ``ParameterError`` with the reason for what cannot be had."""
        self.parameters = parameters
        chosen = control_law(parameters)
        self.designs: tuple[AxisDesign, ...] = tuple(
            chosen.design(parameters, name) for name in AXES
        )
        self.margins: tuple[LoopMargins, ...] = all_margins(parameters, self.designs)
        for name, found, own in zip(AXES, self.margins, parameters.axes, strict=True):
            if own.controlled:
                check_margins(parameters, found, name)
        self._use(_control_arrays(parameters, self.designs))
        self.reset()

    def _use(self, arrays: ControlArrays) -> None:
        self._arrays = arrays
        telemetry = arrays.telemetry
        self.position = telemetry[law.POSITION]
        self.error = telemetry[law.ERROR]
        self.error_rate = telemetry[law.ERROR_RATE]
        self.virtual_input = telemetry[law.VIRTUAL_INPUT]
        self.internal_model = telemetry[law.INTERNAL_MODEL]

    def __getstate__(self) -> tuple[Any, ...]:
        """What goes to another process; the readable arrays are views and made again there."""
        return self.parameters, self.designs, self.margins, self._arrays

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        """Come back from another process."""
        self.parameters, self.designs, self.margins, arrays = state
        self._use(arrays)

    @property
    def arrays(self) -> ControlArrays:
        """The regulator's own arrays, for compiled loops that call ``law.control_step``."""
        return self._arrays

    def describe_loops(self) -> list[str]:
        """Margins and poles of the sampled closed loop, one line for each axis under control."""
        axes = zip(AXES, self.margins, self.parameters.axes, strict=True)
        return [found.text(name) for name, found, own in axes if own.controlled]

    def retuned(self, parameters: ControllerParameters) -> Regulator:
        """A regulator with other parameters that goes on in flight where this one is.

        This one stays as it is, to be replaced between two steps. Raises ``ParameterError`` for
        what cannot be had, and for what cannot change in flight.
        """
        check_retuning(self.parameters, parameters)
        successor = Regulator(parameters)
        successor.take_over(self)
        return successor

    def take_over(self, previous: Regulator, maps: ModelMaps | None = None) -> None:
        """Go on where ``previous`` is, without a jump of w; both designed for the same stage.

        With ``maps``, which :func:`maglev_controller.handover.model_maps` makes of the two, it is
        done within a fraction of a sample.
        """
        if maps is None:
            maps = model_maps(previous.arrays, self._arrays)
        carry_over(previous.arrays, self._arrays, maps)

    def reset(self) -> None:
        """Internal models at rest, observers and filters to start anew: do at every enable."""
        self._arrays.state[:] = 0.0
        self._arrays.state[:, law.FRESH] = 1.0
        self._arrays.telemetry[:] = 0.0

    def step(
        self,
        gap: FloatArray,
        x: float,
        z: float,
        position: FloatArray,
        velocity: FloatArray,
        acceleration: FloatArray,
        direct_out: FloatArray,
        quadrature_out: FloatArray,
    ) -> bool:
        """Currents for one measurement.

        ``gap`` (4,), ``x``, ``z`` [m] are the measurement; ``position``, ``velocity``,
        ``acceleration`` (5,) the reference. Writes i_d and i_q of motors 1..4 [A] to
        ``direct_out`` and ``quadrature_out`` (4,) and returns whether any was limited. All arrays
        float64.

        Raises :class:`MeasurementFault` when measurement or reference is not finite, out of the
        stops' range or contradicts itself; both outputs are then zero and the regulator's state is
        as before.
        """
        constants, gains, settings, state, telemetry, scratch = self._arrays
        code = control_step(
            constants,
            gains,
            settings,
            state,
            telemetry,
            scratch,
            gap,
            x,
            z,
            position,
            velocity,
            acceleration,
            direct_out,
            quadrature_out,
        )
        if code > law.SATURATED:
            raise MeasurementFault(self.describe(code, gap, x, z))
        return bool(code == law.SATURATED)

    def describe(self, code: int, gap: FloatArray, x: float, z: float) -> str:
        """What a fault code of ``law.control_step`` means for the measurement it came from."""
        if code == law.BAD_REFERENCE:
            return 'the reference is not finite, or far beyond any range'
        values = f'gap {np.array2string(gap, precision=6)} m, x {x:.6g} m, z {z:.6g} m'
        if code == law.NOT_FINITE:
            return f'the measurement is not finite: {values}'
        if code == law.WARPED:
            warp = gap[0] + gap[2] - gap[1] - gap[3]
            return (
                f'the four gaps contradict each other by {warp:.3g} m (at most '
                f'{self.parameters.measurement.warp:g} m): {values}'
            )
        return f'the measurement is out of range: {values}: {self._out_of_range()}'

    def _out_of_range(self) -> str:
        output = self._arrays.scratch[law.OUTPUT, :5]
        bounds = self._arrays.settings[law.RANGE : law.RANGE + 10].reshape(5, 2)
        for name, value, (low, high) in zip(AXES, output, bounds, strict=True):
            if not low <= value <= high:
                return f'{name} is {value:.6g}, the stops leave [{low:.6g}, {high:.6g}]'
        return 'a value left its range'


def _control_arrays(
    parameters: ControllerParameters, designs: tuple[AxisDesign, ...]
) -> ControlArrays:
    states = max(1, *(design.model.order for design in designs))
    gains = np.zeros((5, law.TRANSITION + states, states + 2))
    for own, design in zip(gains, designs, strict=True):
        n = design.model.order
        own[law.GAIN, : n + 2] = design.total_gain
        own[law.DRIVE, :n] = design.drive
        own[law.ANTIWINDUP, :n] = design.antiwindup
        own[law.TRANSITION : law.TRANSITION + n, :n] = design.transition
    return ControlArrays(
        constants=machine_to_array(machine_constants(parameters.machine)),
        law=gains,
        settings=_settings_array(parameters, designs[0]),
        state=np.zeros((5, law.MODEL + states)),
        telemetry=np.zeros((5, 5)),
        scratch=np.zeros((5, max(5, states))),
    )


def _settings_array(parameters: ControllerParameters, design: AxisDesign) -> FloatArray:
    machine, limits = parameters.machine, parameters.limits
    settings = np.zeros(law.SETTINGS)
    settings[law.FILTER_GAIN], settings[law.FILTER_FORGET] = design.derivative
    settings[law.FEED_FORWARD] = parameters.feed_forward
    settings[law.INVERSE] = law.INVERSES.index(parameters.inverse)
    settings[law.EQUILIBRIUM] = parameters.compensator.equilibrium
    settings[law.PAPER_ANTIWINDUP] = parameters.internal_model.antiwindup == 'paper'
    settings[law.CURRENT] = limits.current
    settings[law.LEVITATION_FIRST] = limits.levitation_first
    settings[law.LEAST_ATTRACTION] = limits.least_attraction
    settings[law.WARP] = parameters.measurement.warp
    settings[law.CONTROLLED : law.CONTROLLED + 5] = [axis.controlled for axis in parameters.axes]
    margin = np.full(5, parameters.measurement.margin)
    margin[3:] /= machine.radius
    settings[law.RANGE : law.RANGE + 10 : 2] = np.array(machine.lower_limit) - margin
    settings[law.RANGE + 1 : law.RANGE + 10 : 2] = np.array(machine.upper_limit) + margin
    settings[law.PERIOD], settings[law.JUMP_TIME] = (
        parameters.sample_time,
        parameters.jumps.duration,
    )
    settings[law.JUMP_ACCELERATION : law.JUMP_ACCELERATION + 5] = parameters.jumps.acceleration
    settings[law.LARGEST_ERROR : law.SETTINGS] = math.inf
    if design.model.form != 'compensator':
        learned = parameters.internal_model.largest_error
        settings[law.LARGEST_ERROR : law.LARGEST_ERROR + 5] = learned
        settings[law.ERROR_LIMIT : law.ERROR_LIMIT + 5] = limits.error
    settings[law.OBSERVER] = design.observer != NO_OBSERVER
    settings[law.OBSERVER_POSITION], settings[law.OBSERVER_VELOCITY] = design.observer
    settings[law.AHEAD] = parameters.input_delay
    settings[law.FADE] = math.exp(-parameters.sample_time / FADING_TIME)
    return settings
