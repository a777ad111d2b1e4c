"""The stage and its loops for python-control: linearised, and the nonlinear plant.

Signals carry names: outputs and positions ``y``, ``x``, ``z``, ``phi``, ``theta`` [m, rad],
``y_rate`` and so on [m/s, rad/s], currents ``i_d1`` to ``i_d4`` and ``i_q1`` to ``i_q4`` [A].
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from maglev_controller.design.axis_design import AxisDesign, feedback_system
from maglev_controller.design.notch import notch_system
from maglev_controller.design.state_space import discretise
from maglev_controller.laws import ControlLaw, control_law
from maglev_controller.parameters import ControllerParameters
from maglev_model.axes import AXES, FloatArray
from maglev_model.compiled import compiled
from maglev_model.compiled.records import Block
from maglev_model.currents import exact_currents
from maglev_model.inverse import NO_LIMITS
from maglev_model.machine import Machine
from maglev_model.machine_array import machine_from_array
from maglev_model.parameters import ParameterError
from maglev_model.platen import output_accelerations
from maglev_model.programs.optional import needed
from maglev_plant.arrays import StageArrays, stage_arrays, true_machine
from maglev_plant.dynamics import derivative
from maglev_plant.parameters import PlantParameters
from maglev_study.arguments import a_table, positions
from maglev_study.inverses import inverse_of
from maglev_study.references import HOVER

if TYPE_CHECKING:
    import control

RATES = tuple(f'{axis}_rate' for axis in AXES)
CURRENTS = tuple(f'i_{way}{motor}' for way in 'dq' for motor in (1, 2, 3, 4))

_STEP = 1e-6  # of central differences: [m, rad], [m/s, rad/s], [A], [m/s², rad/s²]
_NEWTON = 20
_HELD = 1e-6  # acceleration of what is held, at most [m/s², rad/s²]


@compiled
def _rates(block: Block, time: float, state: FloatArray, current: FloatArray) -> FloatArray:
    stage: StageArrays = block[0]
    rate = np.empty(10)
    derivative(stage, machine_from_array(stage.machine), time, state, current, rate)
    return rate


class StageAt:
    """The plant between its stops ``at`` y, x, z, phi, theta, and the currents that hold it there.

    Where ``speed`` is not 0, every axis passes there at that rate [m/s, rad/s], so that friction
    has the slope it has then.
    """

    def __init__(self, parameters: PlantParameters, at: ArrayLike, speed: float = 0.0) -> None:
        self.arrays = stage_arrays(parameters)
        if self.arrays.effects.moving:
            raise ParameterError(
                "parameters 'effects.*' of the plant give it dynamics of their own, which only the "
                'simulator integrates: leave them at their defaults'
            )
        self.lag = 2.0 * np.pi * parameters.amplifier.bandwidth
        self.position = positions('at', at, parameters.machine)
        self.state = np.zeros(10)
        self.state[::2], self.state[1::2] = self.position, speed
        self.current = self._holding(true_machine(parameters))

    def _holding(self, machine: Machine) -> FloatArray:
        """The currents (8,): those of the exact inverse, put right where K's are off Table I's."""
        wanted, (y, _, _, phi, theta) = -self.arrays.constant, self.position
        i_d, i_q, _ = exact_currents(machine, self.position[None], wanted[None])
        found: FloatArray = np.concatenate((i_d[0], i_q[0]))

        def missing(current: FloatArray) -> FloatArray:
            made = output_accelerations(machine, y, phi, theta, current[:4], current[4:])
            return np.where(self.arrays.locked, 0.0, wanted - made)

        for _ in range(_NEWTON):
            found -= np.linalg.lstsq(slopes(missing, found), missing(found), rcond=None)[0]
        if not np.max(np.abs(missing(found))) < _HELD:
            raise ParameterError(f"no currents hold the platen 'at' {self.position.tolist()}")
        return found

    def rates(self, time: float, state: FloatArray, current: FloatArray) -> FloatArray:
        """Rate of change of x1..x10 (10,) with currents that flow (8,)."""
        found: FloatArray = _rates(self.arrays.block, time, state, current)
        return found

    def slopes(self, flowing: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        """Of the rates by state (10, 10) and by current (10, 8), where currents (8,) flow."""
        there = self.current if flowing is None else flowing
        return (
            slopes(lambda state: self.rates(0.0, state, there), self.state),
            slopes(lambda current: self.rates(0.0, self.state, current), there),
        )

    def lagging_slopes(self, flowing: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        """The same by asked currents; with a lag, those that flow are eight more states."""
        by_state, by_current = self.slopes(flowing)
        if not self.lag:
            return by_state, by_current
        lag = self.lag * np.eye(8)
        by_state = np.block([[by_state, by_current], [np.zeros((8, 10)), -lag]])
        return by_state, np.vstack((np.zeros((10, 8)), lag))


def slopes(function: Callable[[FloatArray], FloatArray], at: FloatArray) -> FloatArray:
    """Derivatives (m, n) of a function of (n,) that gives (m,)."""
    steps = _STEP * np.eye(at.size)
    columns = [(function(at + step) - function(at - step)) / (2.0 * _STEP) for step in steps]
    return np.stack(columns, axis=1)


def hover_currents(parameters: PlantParameters | None = None, at: ArrayLike = HOVER) -> FloatArray:
    """The currents (8,) [A], i_d of motors 1..4, then i_q, that hold the platen ``at`` (5,).

    Raises ParameterError where there are none.
    """
    return StageAt(a_table(PlantParameters, parameters, 'plant'), at).current


def nonlinear_plant(parameters: PlantParameters | None = None) -> control.NonlinearIOSystem:
    """The plant between its stops as a ``control.NonlinearIOSystem``: currents to outputs.

    (6), (7) with guides, locks and disturbances, and the amplifiers' lag, but without their limits,
    encoders or stops. States are x1..x10 of Table II and, with a lag, the eight currents that flow.

    Raises ParameterError for ``effects.*``, which only the simulator integrates, and
    MissingLibraryError without python-control.
    """
    with needed('control', 'nonlinear_plant'):
        import control
    stage = StageAt(a_table(PlantParameters, parameters, 'plant'), HOVER)
    lag = stage.lag

    def update(time: float, state: FloatArray, current: FloatArray, _: object) -> FloatArray:
        flowing = state[10:] if lag else current
        rates = stage.rates(time, np.array(state[:10]), np.array(flowing))
        return np.append(rates, lag * (current - flowing)) if lag else rates

    return control.NonlinearIOSystem(
        update,
        lambda _time, state, _current, _parameters: state[:10:2],
        inputs=list(CURRENTS),
        outputs=list(AXES),
        states=_state_names(lag > 0.0),
        name='stage',
    )


def _state_names(lag: bool) -> list[str]:
    names = [name for pair in zip(AXES, RATES, strict=True) for name in pair]
    return names + [f'flowing_{current}' for current in CURRENTS] * lag


def linearise(
    parameters: PlantParameters | None = None,
    at: ArrayLike = HOVER,
    *,
    axis: str | None = None,
    controller: ControllerParameters | None = None,
) -> control.StateSpace:
    """The stage about a hover ``at`` y, x, z, phi, theta [m, rad] as a ``control.StateSpace``.

    Without ``axis`` the open loop, in continuous time: currents to outputs, states as of
    :func:`nonlinear_plant`, all less those of the hover. Friction is that about rest, where it is
    steepest.

    With ``axis`` the closed loop of that one, the others held, sampled as it runs: the feedback as
    designed of ``controller`` and its inverse, linearised too, so that it counts what that does not
    know of the plant. Inputs are a set-point ``reference`` without velocity, a ``disturbance``
    [m/s², rad/s²] and ``noise`` of the reading [m, rad]; outputs the axis, its ``error`` and ``w``.
    It holds for small errors, while the reference moves (``internal_model.rest``), and but for the
    friction that is fed forward.

    Raises ParameterError where nothing holds the platen, for ``effects.*`` of the plant, for an
    axis that is not controlled, and for a law that is no linear one; MissingLibraryError without
    python-control.
    """
    with needed('control', 'linearise'):
        import control
    given = a_table(PlantParameters, parameters, 'plant')
    stage = StageAt(given, at)
    if axis is not None:
        table = a_table(ControllerParameters, controller, 'controller')
        matrices, names = _axis_loop(stage, given, table, axis)
        inputs, outputs = ['reference', 'disturbance', 'noise'], [axis, 'error', 'w']
        return control.ss(
            *matrices,
            table.sample_time,
            inputs=inputs,
            outputs=outputs,
            states=names,
            name=f'loop of {axis}',
        )
    by_state, by_current = stage.lagging_slopes()
    return control.ss(
        by_state,
        by_current,
        np.eye(10, len(by_state))[::2],
        np.zeros((5, 8)),
        inputs=list(CURRENTS),
        outputs=list(AXES),
        states=_state_names(stage.lag > 0.0),
        name='stage',
    )


_Loop = tuple[tuple[FloatArray, FloatArray, FloatArray, FloatArray], list[str]]
"""A, B, C, D of a closed loop and the names of its states."""


def _axis_loop(
    stage: StageAt, given: PlantParameters, controller: ControllerParameters, axis: str
) -> _Loop:
    if axis not in AXES:
        raise ParameterError(f"'axis' is '{axis}', it must be one of {', '.join(AXES)}")
    index = AXES.index(axis)
    if not controller.axes[index].controlled:
        raise ParameterError(f"parameter '{axis}.controlled' is false: there is no such loop")
    law = linear_law(given, controller)
    inverse = inverse_slopes(stage, controller)
    by_state, by_current = stage.slopes(inverse.flowing)
    own, row = by_state[2 * index + 1, 2 * index : 2 * index + 2], by_current[2 * index + 1]
    sampled, driven = _sampled_axis(own, stage.lag, controller.sample_time)
    stiffness, gain = float(row @ inverse.by_output[:, index]), float(row @ inverse.by_w[:, index])
    return _closed(
        law.design(controller, axis), controller, (sampled, driven), (stiffness, gain), axis
    )


def linear_law(given: PlantParameters, controller: ControllerParameters) -> ControlLaw:
    """The law of a controller for a plant; raises ParameterError where it is no linear one."""
    if given.sample_time != controller.sample_time:
        raise ParameterError(
            f"parameter 'sample_time' of the plant is {given.sample_time:g} s, the controller's is "
            f'{controller.sample_time:g} s: they must be the same'
        )
    law = control_law(controller)
    if law.make is not None:
        raise ParameterError(
            f"parameter 'law' is '{controller.law}', an object: it has no linear model"
        )
    return law


def _sampled_axis(row: FloatArray, lag: float, period: float) -> tuple[FloatArray, FloatArray]:
    """An axis between two samples: position, rate and, with a lag, the acceleration that flows.

    Driven by the acceleration that the currents are to make, and by a disturbance; ``row`` (2,) is
    the slope of its acceleration by position and rate, ``lag`` the currents' [rad/s], 0 for none.
    """
    if not lag:
        return discretise(np.array([[0.0, 1.0], row]), np.array([[0.0, 0.0], [1.0, 1.0]]), period)
    state = np.array([[0.0, 1.0, 0.0], [*row, 1.0], [0.0, 0.0, -lag]])
    return discretise(state, np.array([[0.0, 0.0], [0.0, 1.0], [lag, 0.0]]), period)


class InverseSlopes(NamedTuple):
    """A controller's inverse linearised: its currents by the outputs and by w, (8, 5) each.

    ``flowing`` (8,) are those with which the stage does not accelerate.
    """

    by_output: FloatArray
    by_w: FloatArray
    flowing: FloatArray


def inverse_slopes(stage: StageAt, controller: ControllerParameters) -> InverseSlopes:
    """The inverse of a controller where a stage is."""
    currents = inverse_of(controller, NO_LIMITS)
    free = np.flatnonzero([axis.controlled for axis in controller.axes])

    def made(wanted: FloatArray) -> FloatArray:
        return stage.rates(0.0, stage.state, currents(stage.position, wanted))[1::2]

    wanted = np.zeros(5)
    for _ in range(_NEWTON):
        wanted[free] -= np.linalg.lstsq(
            slopes(made, wanted)[np.ix_(free, free)], made(wanted)[free], rcond=None
        )[0]
    return InverseSlopes(
        slopes(lambda output: currents(output, wanted), stage.position),
        slopes(lambda w: currents(stage.position, w), wanted),
        currents(stage.position, wanted),
    )


def _closed(
    design: AxisDesign,
    controller: ControllerParameters,
    axis_system: tuple[FloatArray, FloatArray],
    inverse: tuple[float, float],
    axis: str,
) -> _Loop:
    """The loop of one axis; a signal is a row over states, reference, disturbance and noise."""
    sampled, driven = axis_system
    delay = controller.input_delay
    inner = feedback_system(design, controller.sample_time, delay)
    filters = notch_system(design.notches)
    sizes = (len(sampled), delay, inner.error_input.size, filters.input.size)
    size = sum(sizes)
    rows = np.eye(size + 3)
    body, waiting, states, notches = np.split(rows[:size], np.cumsum(sizes)[:-1])
    reference, disturbance, noise = rows[size:]
    measured = body[0] + noise
    error_gain = design.gain[0]
    w = inner.output @ states + inner.direct * measured - error_gain * reference
    filtered = filters.output @ notches + filters.direct * w
    asked = inverse[0] * measured + inverse[1] * filtered
    acting = waiting[0] if delay else asked
    learned = np.zeros(inner.error_input.size)
    learned[: design.order] = design.drive
    after = np.vstack(
        (
            sampled @ body + np.outer(driven[:, 0], acting) + np.outer(driven[:, 1], disturbance),
            asked[None] if delay else np.empty((0, size + 3)),
            inner.state @ states
            + np.outer(inner.error_input, measured)
            - np.outer(learned, reference)
            + np.outer(inner.acting_input, filtered),
            filters.state @ notches + np.outer(filters.input, w),
        )
    )
    read = np.vstack((body[0], body[0] - reference, filtered))
    names = [axis, f'{axis}_rate', f'{axis}_acceleration'][: len(sampled)] + ['waiting'] * delay
    names += [f'feedback_{k}' for k in range(sizes[2])] + [f'notch_{k}' for k in range(sizes[3])]
    return (after[:, :size], after[:, size:], read[:, :size], read[:, size:]), names
