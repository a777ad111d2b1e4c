"""A Gymnasium environment over the simulated stage, with the default law as its baseline.

``gymnasium.make('maglev_study.env:MaglevStage-v0')`` or :class:`StageEnv`. Needs gymnasium.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_controller.step.foreign_sample import (
    TOLD,
    close_with_currents,
    close_with_input,
    open_sample,
)
from maglev_controller.step.sample import FIRST_FAULT
from maglev_model.axes import FloatArray
from maglev_model.inverse import CurrentLimits
from maglev_model.parameters import ParameterError, replace
from maglev_model.programs.optional import needed
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.arguments import a_table
from maglev_study.closed_loop import at_stops
from maglev_study.inverses import inverse_of
from maglev_study.references import HOVER, References, held, joined, shaped

with needed('gymnasium', 'maglev_study.env'):
    import gymnasium
    from gymnasium.spaces import Box

ACCELERATION = np.array([10.0, 5.0, 5.0, 50.0, 50.0])
"""What an action of 1 asks for [m/s², rad/s²]."""

SCALES = np.repeat(np.array([5e-3, 0.1, 1e-3, 0.1, 5.0]), 5).reshape(5, 5)
"""What an observation of 1 is, by row of it [m, m/s, m, m/s, m/s², and the same with rad]."""

LARGEST = 100.0
"""What an observation is at most."""

_REACH = np.array([0.004, 0.03, 0.03, 0.001, 0.006])  # of set-points drawn, from HOVER [m, rad]

Course = Callable[[np.random.Generator, float, float], References]
"""Draws the reference of an episode: from a generator, its duration [s] and the sample time [s]."""


def moves(random: np.random.Generator, duration: float, period: float) -> References:
    """Half-second moves between set-points that are drawn, each held for as long."""
    place, parts = HOVER, [held(HOVER, 0.1, period)]
    for _ in range(int(np.ceil(duration))):
        goal = HOVER + _REACH * random.uniform(-1.0, 1.0, 5)
        parts.append(shaped(place, goal, 0.5, 0.5, period))
        place = goal
    return joined(*parts)


class StageEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """One episode is a hover that follows a reference for ``duration`` [s], a step one sample.

    ``action``: ``accelerations`` of y, x, z, phi, theta (5,), behind which the controller's inverse
    makes the currents; 1 is :data:`ACCELERATION`. Or ``currents``, i_d of motors 1..4, then i_q,
    (8,); 1 is the largest, ``limits.current``.

    The observation (25,) is, by axis, position less :data:`~maglev_study.references.HOVER`,
    velocity as the controller's observer has it, error, its rate, and the reference's
    acceleration, as multiples of :data:`SCALES`, all from what the encoders read.

    The reward of a step is ``1 / (1 + (e / 0.1 mm)²)``, e² the mean square error of the axes that
    are controlled, less ``penalty`` times the mean square of the action. An episode is terminated
    when the platen meets a stop or cannot be measured, and truncated after its duration.

    ``course`` draws the reference, :func:`moves` by default. :meth:`default_action` is what the
    default law would do. Raises ParameterError for another ``action`` and a ``duration`` without a
    sample, TypeError for what are no tables.
    """

    metadata: ClassVar[dict[str, Any]] = {'render_modes': []}

    def __init__(
        self,
        *,
        action: str = 'accelerations',
        duration: float = 2.0,
        penalty: float = 1e-3,
        course: Course = moves,
        plant: PlantParameters | None = None,
        controller: ControllerParameters | None = None,
        render_mode: str | None = None,
    ) -> None:
        if action not in ('accelerations', 'currents'):
            raise ParameterError(f"'action' is '{action}', it must be accelerations or currents")
        self.render_mode = render_mode
        self._plant = a_table(PlantParameters, plant, 'plant')
        if not self._plant.sample_time <= duration < math.inf:
            raise ParameterError(f"'duration' is {duration} s, it must last a sample or longer")
        self._regulator = Regulator(a_table(ControllerParameters, controller, 'controller'))
        if self._plant.sample_time != self._regulator.parameters.sample_time:
            raise ParameterError("parameter 'sample_time' of plant and controller are not the same")
        self._controlled = np.array([axis.controlled for axis in self._regulator.parameters.axes])
        self._by_currents = action == 'currents'
        limits = self._regulator.parameters.limits
        self._current = limits.current
        self._inverse = inverse_of(
            self._regulator.parameters,
            CurrentLimits(
                limits.current, limits.levitation_first, limits.least_attraction, 0.5, limits.tilt
            ),
        )
        self._duration, self._penalty, self._course = duration, penalty, course
        self._told = np.zeros((TOLD, 5))
        self._direct, self._quadrature = np.zeros(4), np.zeros(4)
        self.action_space = Box(-1.0, 1.0, (8 if self._by_currents else 5,), np.float32)
        self.observation_space = Box(-LARGEST, LARGEST, (25,), np.float32)
        self._at_stop = at_stops(self._plant)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin another episode, at rest where its reference begins."""
        super().reset(seed=seed)
        period = self._plant.sample_time
        references = self._course(self.np_random, self._duration, period)
        samples = round(self._duration / period) + 1
        if len(references.position) < samples:
            raise ValueError(
                f"'course' drew {len(references.position)} samples, an episode has {samples}"
            )
        self._references, self._left = references, samples - 1
        start = {'initial.position': tuple(references.position[0])}
        drawn = {'seed': int(self.np_random.integers(2**31 - 1))}
        self._stage = SimulatedStage(replace(self._plant, {**start, **drawn}))
        self._regulator.reset()
        self._sample = 0
        self._measure()
        return self._observation(), self._info()

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Answer a sample, and go on to the next.

        What is beyond the bounds of an action counts as these. Raises ValueError for another shape
        and for what is no number; nothing has moved then.
        """
        asked = np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0)
        if asked.shape != self.action_space.shape or np.isnan(asked).any():
            shape = self.action_space.shape
            raise ValueError(f"'action' is {action}, it must be numbers of shape {shape}")
        direct, quadrature, arrays = self._direct, self._quadrature, self._regulator.arrays
        if self._by_currents:
            direct[:], quadrature[:] = self._current * asked.reshape(2, 4)
            close_with_currents(*arrays, direct, quadrature)
        else:
            close_with_input(*arrays, ACCELERATION * asked, direct, quadrature)
        self._stage.write(direct, quadrature)
        self._sample += 1
        lost = not self._measure() or bool(self._at_stop(self._stage.state[::2]))
        reward = 0.0 if lost else self._reward(asked)
        truncated = not lost and self._sample >= self._left
        return self._observation(), reward, lost, truncated, self._info()

    def default_action(self) -> NDArray[np.float32]:
        """What the controller's own law, the default one unless given, would do now."""
        if not self._by_currents:
            return _single(self._regulator.virtual_input / ACCELERATION)
        currents = self._inverse(self._regulator.position, self._regulator.virtual_input)
        return _single(currents / self._current)

    def _measure(self) -> bool:
        """Read the next sample; whether it can be used."""
        gap, x, z = self._stage.read()
        position, velocity, acceleration = (part[self._sample] for part in self._references)
        code = open_sample(
            *self._regulator.arrays, gap, x, z, position, velocity, acceleration, self._told
        )
        return code < FIRST_FAULT

    def _error(self) -> FloatArray:
        return np.asarray(self._told[0] - self._told[2])

    def _reward(self, asked: FloatArray) -> float:
        square = float(np.mean(self._error()[self._controlled] ** 2)) / 1e-8
        return 1.0 / (1.0 + square) - self._penalty * float(np.mean(asked**2))

    def _observation(self) -> NDArray[np.float32]:
        position, velocity, _, reference_velocity, acceleration = self._told
        rows = (
            position - HOVER,
            velocity,
            self._error(),
            velocity - reference_velocity,
            acceleration,
        )
        scaled = np.clip((np.array(rows) / SCALES).ravel(), -LARGEST, LARGEST)
        return _single(scaled)

    def _info(self) -> dict[str, Any]:
        return {'true': self._stage.state[::2], 'error': self._error()}


def _single(values: FloatArray) -> NDArray[np.float32]:
    return np.asarray(values, dtype=np.float32)


gymnasium.register('MaglevStage-v0', entry_point=StageEnv)
