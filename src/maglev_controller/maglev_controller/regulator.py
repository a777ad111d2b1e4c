"""The regulator: encoder readings and a reference in, motor currents out, once a sample.

w = K (e, ė, ξ) + Γ ξ on every axis (16), the internal model (14) or (17) sampled exactly, then one
of the inverses. e and ė are an observer's position and rate less the reference's; with the paper's
derivative filter, ė is the filtered position's rate less the reference's velocity through the same
filter: the filtered rate of e, but for a jump of the set-point, which has no rate and so gives no
kick. With feed-forward, w also holds the reference's acceleration.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from maglev_controller.bumpless_transfer import ModelMaps, carry_over, check_retuning
from maglev_controller.checks import check_foreign
from maglev_controller.design.axis_design import AxisDesign
from maglev_controller.design.margins import LoopMargins, all_margins, check_margins
from maglev_controller.design.observer import NO_OBSERVER
from maglev_controller.foreign_law import ForeignLaw, Law
from maglev_controller.laws import control_law, find_law
from maglev_controller.parameters import ControllerParameters, RegulatorModelParameters
from maglev_controller.stage_parameters import EncoderParameters, FrictionParameters
from maglev_controller.step.arrays import (
    AXIS,
    INVERSES,
    MODEL,
    RECORDS,
    SAMPLE,
    ControlArrays,
)
from maglev_controller.step.estimation import DOUBT
from maglev_controller.step.foreign_sample import (
    TOLD,
    close_with_currents,
    close_with_input,
    open_sample,
    warm_up,
)
from maglev_controller.step.rest import FADING_TIME as REST_FADING_TIME
from maglev_controller.step.sample import (
    BAD_REFERENCE,
    FIRST_FAULT,
    NOT_FINITE,
    WARPED,
    answer_sample,
)
from maglev_controller.step.voltage import winding_settings
from maglev_model.axes import AXES, FloatArray
from maglev_model.machine import machine_constants
from maglev_model.machine_array import machine_to_array
from maglev_model.parameters import replace

FADING_TIME = 0.05
"""Time constant of the bump, the part of w that bridges a change of gains in flight [s]."""


class MeasurementFault(ValueError):  # noqa: N818
    """A measurement or reference cannot be used; the message says which value and why."""


class Regulator:
    """The regulator of all five axes; arrays in the paper's output order y, x, z, phi, theta.

    Readable after a step, (5,) each, in place: ``position`` [m, rad], ``error``, ``error_rate``,
    ``virtual_input`` w [m/s², rad/s²] and ``internal_model``, the internal model's part of w.

    Where the parameter ``law`` names an object of somebody else's, it is :attr:`foreign`, and its
    answers are taken in place of the regulator's own until it fails, or :meth:`fall_back`.
    """

    def __init__(self, parameters: ControllerParameters, law: Law | None = None) -> None:
        """Design all axes; with ``law`` that object answers, and what is designed lands.

        Raises ``ParameterError`` with the reason for what cannot be had.
        """
        self.parameters = parameters
        self._given = law
        chosen = control_law(parameters)
        if law is not None:
            check_foreign(parameters)
        # What runs along has to follow what acts in its place.
        if law is not None or chosen.make is not None:
            parameters = replace(parameters, {'internal_model.antiwindup': 'observer'})
        self.designs: tuple[AxisDesign, ...] = tuple(
            chosen.design(parameters, name) for name in AXES
        )
        self.margins: tuple[LoopMargins, ...] = all_margins(parameters, self.designs)
        for name, margins, axis in zip(AXES, self.margins, parameters.axes, strict=True):
            if axis.controlled:
                check_margins(parameters, margins, name)
        self._use(_control_arrays(parameters, self.designs))
        self.make_foreign()
        self.reset()

    def make_foreign(self) -> None:
        """Make :attr:`foreign` anew, None for a law of the regulator's own.

        Raises ``ParameterError`` when that cannot be made.
        """
        given, make = self._given, find_law(self.parameters.law).make
        self.foreign: ForeignLaw | None = None
        if given is not None:
            self.foreign = ForeignLaw(given, self.parameters, type(given).__name__)
        elif make is not None:
            self.foreign = ForeignLaw(make(self.parameters), self.parameters)
        if self.foreign is not None:
            warm_up(self.arrays, self.foreign.gives_currents)

    def _use(self, arrays: ControlArrays) -> None:
        self.arrays = arrays
        """The regulator's own, for compiled loops that call ``control_step``."""
        sample = arrays.sample
        self.position: FloatArray = sample['position']
        self.error: FloatArray = sample['error']
        self.error_rate: FloatArray = sample['error_rate']
        self.virtual_input: FloatArray = sample['virtual_input']
        self.internal_model: FloatArray = sample['internal_model']

    def __getstate__(self) -> tuple[Any, ...]:
        """What goes to another process; the readable arrays are views and made again there."""
        given = self._given, self.foreign
        return self.parameters, self.designs, self.margins, self.arrays, *given

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        """Come back from another process."""
        self.parameters, self.designs, self.margins, arrays, self._given, self.foreign = state
        self._use(arrays)

    def describe_loops(self) -> list[str]:
        """Margins and poles of the sampled closed loop, one line for each axis under control."""
        axes = zip(AXES, self.margins, self.parameters.axes, strict=True)
        lines = [] if self.foreign is None else [self.foreign.describe()]
        return lines + [margins.text(name) for name, margins, axis in axes if axis.controlled]

    @property
    def fault(self) -> str:
        """Why somebody else's law is not asked any more, or ''."""
        return '' if self.foreign is None else self.foreign.fault

    def fall_back(self, reason: str) -> None:
        """Answer by the regulator's own law from now on, until :meth:`reset`."""
        if self.foreign is not None and not self.foreign.fault:
            self.foreign.fault = reason

    def take_over(self, previous: Regulator, maps: ModelMaps) -> None:
        """Go on in flight where ``previous`` is, without a jump of w, in a fraction of a sample.

        ``maps`` are those that :func:`~maglev_controller.bumpless_transfer.model_maps` makes of the
        two. Raises ``ParameterError`` for what cannot change in flight.
        """
        check_retuning(previous.parameters, self.parameters)
        carry_over(previous.arrays, self.arrays, maps)
        self.foreign = previous.foreign
        if self.foreign is not None:
            self.foreign.parameters = self.parameters

    def reset(self, *, in_flight: bool = False) -> None:
        """Internal models at rest, observers and filters to start anew: do at every enable.

        With ``in_flight`` the currents of the last sample are not forgotten: they flow.
        """
        records = self.arrays.records
        asked = records['sample']['asked'] * in_flight
        records['axes'] = np.zeros((), AXIS)
        records['axes']['fresh'] = True
        records['axes']['friction'] = self.parameters.friction.initial
        records['sample'] = np.zeros((), SAMPLE)
        records['sample']['asked'] = asked
        self.arrays.xi[:] = 0.0
        if self.foreign is not None:
            self.foreign.reset()

    def save(self) -> tuple[Any, ...]:
        """What is remembered from sample to sample, for :meth:`restore`."""
        records = self.arrays.records[['axes', 'sample']]
        return records.copy(), self.arrays.xi.copy(), copy.deepcopy(self.foreign)

    def restore(self, saved: tuple[Any, ...]) -> None:
        """Go back to what was saved."""
        self.arrays.records[['axes', 'sample']], self.arrays.xi[:], foreign = saved
        self.foreign = copy.deepcopy(foreign)

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
    ) -> int:
        """Currents for one measurement.

        ``gap`` (4,), ``x``, ``z`` [m] are the measurement; ``position``, ``velocity``,
        ``acceleration`` (5,) the reference. Writes i_d and i_q of motors 1..4 [A] to
        ``direct_out`` and ``quadrature_out`` (4,) and returns what limited them, as bits of
        :mod:`maglev_model.inverse`, 0 for nothing. All arrays float64.

        Raises :class:`MeasurementFault` when measurement or reference is not finite, out of the
        stops' range or contradicts itself; both outputs are then zero and the regulator's state is
        as before. When somebody else's law fails, :attr:`fault` says so and the answer is the
        regulator's own.
        """
        if self.foreign is not None:
            reference = position, velocity, acceleration
            return self._ask(self.foreign, gap, x, z, reference, direct_out, quadrature_out)
        code = answer_sample(
            *self.arrays,
            gap,
            x,
            z,
            position,
            velocity,
            acceleration,
            direct_out,
            quadrature_out,
        )
        if code >= FIRST_FAULT:
            raise MeasurementFault(self.describe(code, gap, x, z))
        return code

    def _ask(
        self,
        law: ForeignLaw,
        gap: FloatArray,
        x: float,
        z: float,
        reference: tuple[FloatArray, FloatArray, FloatArray],
        direct: FloatArray,
        quadrature: FloatArray,
    ) -> int:
        """:meth:`step` with somebody else's law."""
        told = np.empty((TOLD, 5))
        code = open_sample(*self.arrays, gap, x, z, *reference, told)
        if code >= FIRST_FAULT:
            direct[:] = quadrature[:] = 0.0
            raise MeasurementFault(self.describe(code, gap, x, z))
        answer = law.ask(gap, x, z, told)
        if answer is not None and law.gives_currents:
            direct[:], quadrature[:] = answer
            return close_with_currents(*self.arrays, direct, quadrature)
        wanted = self.virtual_input if answer is None else answer
        return close_with_input(*self.arrays, wanted, direct, quadrature)

    def describe(self, code: int, gap: FloatArray, x: float, z: float) -> str:
        """What a fault code of ``control_step`` means for the measurement it came from."""
        if code == BAD_REFERENCE:
            return 'the reference is not finite, or far beyond any range'
        values = f'gap {np.array2string(gap, precision=6)} m, x {x:.6g} m, z {z:.6g} m'
        if code == NOT_FINITE:
            return f'the measurement is not finite: {values}'
        if code == WARPED:
            warp = gap[0] + gap[2] - gap[1] - gap[3]
            return (
                f'the four gaps contradict each other by {warp:.3g} m (at most '
                f'{self.parameters.measurement.warp:g} m): {values}'
            )
        return f'the measurement is out of range: {values}: {self._out_of_range(gap)}'

    def _out_of_range(self, gap: FloatArray) -> str:
        settings, sample = self.arrays.settings, self.arrays.sample
        outputs = zip(AXES, sample['output'], settings['lower'], settings['upper'], strict=True)
        for name, value, low, high in outputs:
            if not low <= value <= high:
                return f'{name} is {value:.6g}, the stops leave [{low:.6g}, {high:.6g}]'
        motor = int(np.argmin(gap))
        return f'the gap of motor {motor + 1} is {gap[motor]:.6g} m, it must be above 0'


def _control_arrays(
    parameters: ControllerParameters, designs: Sequence[AxisDesign]
) -> ControlArrays:
    states = max(1, *(design.order for design in designs))
    records = np.zeros(1, RECORDS)
    for name, value in _settings(parameters, designs).items():
        records['settings'][name] = value
    for name, value in winding_settings(parameters).items():
        records['settings']['winding'][name] = value
    models, transition = np.zeros((5, states), MODEL), np.zeros((5, states, states))
    for index, design in enumerate(designs):
        n = design.order
        records['settings']['notches'][0, index] = len(design.notches)
        for k, notch in enumerate(design.notches):
            records['settings']['notch'][0, index, k] = notch
        models['output'][index, :n] = design.gain[2:]
        models['drive'][index, :n] = design.drive
        models['antiwindup'][index, :n] = design.antiwindup
        if design.fades and design.model is not None:
            models['oscillates'][index, :n] = design.model.oscillating
        transition[index, :n, :n] = design.transition
        for row in range(n):
            there = np.flatnonzero(design.transition[row])
            if there.size:
                models['first'][index, row] = there[0]
                models['end'][index, row] = there[-1] + 1
    return ControlArrays(records, models, transition, xi=np.zeros((5, states)))


def _settings(
    parameters: ControllerParameters, designs: Sequence[AxisDesign]
) -> dict[str, ArrayLike]:
    machine, limits = parameters.machine, parameters.limits
    lower, upper = parameters.reach
    gains = np.array([design.gain[:2] for design in designs])
    filters = np.array([design.derivative for design in designs])
    observers = np.array([design.observer for design in designs])
    limited = [design.limits_errors for design in designs]
    return {
        'machine': machine_to_array(machine_constants(machine)),
        'period': parameters.sample_time,
        'learns': parameters.learning.period > 0.0,
        'controlled': [axis.controlled for axis in parameters.axes],
        'lower': lower,
        'upper': upper,
        'warp': parameters.measurement.warp,
        'inverse': INVERSES.index(parameters.inverse),
        'equilibrium': parameters.compensator.equilibrium,
        'current': limits.current,
        'levitation_first': limits.levitation_first,
        'least_attraction': limits.least_attraction,
        'tilt': limits.tilt,
        'jump_time': parameters.jumps.duration,
        'jump_acceleration': parameters.jumps.acceleration,
        'feed_forward': parameters.feed_forward,
        'error_gain': gains[:, 0],
        'rate_gain': gains[:, 1],
        'error_limit': np.where(limited, limits.error, math.inf),
        **_within_counts(parameters.internal_model, designs),
        'learned_error': np.where(limited, parameters.internal_model.largest_error, math.inf),
        'filter_gain': filters[:, 0],
        'filter_forget': filters[:, 1],
        'observed': [design.observer != NO_OBSERVER for design in designs],
        'observer_position': observers[:, 0],
        'observer_velocity': observers[:, 1],
        'late': parameters.input_delay > 0,
        'paper_antiwindup': parameters.internal_model.antiwindup == 'paper',
        'fade': math.exp(-parameters.sample_time / FADING_TIME),
        'rest_fades': any(design.fades for design in designs),
        'doubt': DOUBT if any(design.fades for design in designs) else 0.0,
        'waking': -math.expm1(-parameters.sample_time / REST_FADING_TIME),
        **_counts(parameters.encoder),
        **_friction(parameters.friction, parameters.sample_time),
    }


def _within_counts(
    model: RegulatorModelParameters, designs: Sequence[AxisDesign]
) -> dict[str, ArrayLike]:
    """What axes do within a count at rest: x and z, of which one encoder tells."""
    fades = np.array([design.fades for design in designs])
    share = np.where(fades, (1.0, model.within_count, model.within_count, 1.0, 1.0), 1.0)
    return {'within_count': share, 'slide_speed': (0.0, *model.slide_speed, 0.0, 0.0)}


def _counts(encoder: EncoderParameters) -> dict[str, ArrayLike]:
    return {
        'half_gap': 0.5 * encoder.gap_resolution,
        'half_horizontal': 0.5 * encoder.horizontal_resolution,
        'floored': encoder.rounding == 'floor',
    }


def _friction(friction: FrictionParameters, sample_time: float) -> dict[str, ArrayLike]:
    time = friction.adaptation_time
    return {
        'friction_gain': -math.expm1(-sample_time / time) if time > 0.0 else 0.0,
        'friction_way': friction.way,
        'friction_limit': friction.largest,
    }
