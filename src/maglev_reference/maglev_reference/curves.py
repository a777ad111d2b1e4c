"""Closed curves and sweeps: sums of sinusoids, conical helix, rounded square, chirp.

Each is a motion for any time t, before zero too, with continuous acceleration.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev

from maglev_model.axes import AXES, FloatArray, X, Y, Z
from maglev_model.parameters import ParameterError
from maglev_model.quintic import minimum_jerk
from maglev_reference.motion import Kinematics, Stand
from maglev_reference.trajectory_parameters import (
    ChirpParameters,
    CircleParameters,
    HelixParameters,
    LissajousParameters,
    SinusoidParameters,
    SquareParameters,
)

_DEGREE = 32  # of the polynomials of a corner; their error is below 1e-15 of its length


class Term(NamedTuple):
    """amplitude sin(frequency t + phase) of one output; [m, rad], [rad/s], [rad]."""

    axis: int
    amplitude: float
    frequency: float
    phase: float


class Sinusoids:
    """Each output follows its offset (5,) and its terms, for any time t."""

    def __init__(self, offset: FloatArray, terms: Sequence[Term]) -> None:
        self._offset = Stand(offset)
        self.terms = tuple(term for term in terms if term.amplitude != 0.0)

    @classmethod
    def sums(cls, parameters: SinusoidParameters, fundamental: float) -> Sinusoids:
        """The group ``sinusoids``; a frequency of 0 is the ``fundamental`` [rad/s]."""
        axes = parameters.axes()
        return cls(
            np.array([axis.offset for axis in axes]),
            [
                Term(index, amplitude, frequency or fundamental, phase)
                for index, axis in enumerate(axes)
                for amplitude, frequency, phase in zip(
                    axis.amplitude, axis.frequency, axis.phase, strict=True
                )
            ],
        )

    @classmethod
    def circle(
        cls, parameters: CircleParameters, home: FloatArray, fundamental: float
    ) -> Sinusoids:
        """The group ``circle``, about ``home`` (5,); a frequency of 0 is the ``fundamental``."""
        radius, frequency = parameters.radius, parameters.frequency or fundamental
        return cls(
            home, [Term(X, radius, frequency, 0.0), Term(Z, radius, frequency, 0.5 * math.pi)]
        )

    @classmethod
    def lissajous(
        cls, parameters: LissajousParameters, home: FloatArray, fundamental: float
    ) -> Sinusoids:
        """The group ``lissajous``, about ``home`` (5,); its fundamental may be 0 likewise."""
        omega = parameters.fundamental or fundamental
        rows = zip(parameters.amplitude, parameters.multiple, parameters.phase, strict=True)
        return cls(
            home,
            [
                Term(axis, amplitude, multiple * omega, phase)
                for axis, (amplitude, multiple, phase) in enumerate(rows)
            ],
        )

    def evaluate(self, time: FloatArray) -> Kinematics:
        """Position, velocity and acceleration at each time (n,) [s]."""
        samples = self._offset.evaluate(time)
        for axis, amplitude, frequency, phase in self.terms:
            angle = frequency * time + phase
            sine = amplitude * np.sin(angle)
            samples.position[:, axis] += sine
            samples.velocity[:, axis] += amplitude * frequency * np.cos(angle)
            samples.acceleration[:, axis] -= frequency**2 * sine
        return samples


class Helix:
    """Circles in x and z about ``home`` (5,) while gap and radius go to and fro on a cone.

    From one end to the other both change evenly with the angle; within a quarter of a turn of an
    end they come to rest and turn round. It repeats after ``period`` [s] and begins at the first
    end. A frequency of 0 is the ``fundamental`` [rad/s].
    """

    def __init__(self, parameters: HelixParameters, home: FloatArray, fundamental: float) -> None:
        self._home = Stand(home)
        self._frequency = parameters.frequency or fundamental
        turn = 2.0 * math.pi / self._frequency
        self._half = parameters.turns * turn
        self.period = 2.0 * self._half
        self._rounding = 0.25 * turn
        self._rate = 1.0 / (self._half - 0.625 * self._rounding)  # from 0 to 1 in half a period
        self._ends = np.array([parameters.gap, parameters.radius])

    def evaluate(self, time: FloatArray) -> Kinematics:
        """Position, velocity and acceleration at each time (n,) [s]."""
        samples = self._home.evaluate(time)
        progress, rate, change = self._progress(time)
        (gap_0, gap_1), (radius_0, radius_1) = self._ends
        samples.position[:, Y] = gap_0 + (gap_1 - gap_0) * progress
        samples.velocity[:, Y] = (gap_1 - gap_0) * rate
        samples.acceleration[:, Y] = (gap_1 - gap_0) * change
        radius = radius_0 + (radius_1 - radius_0) * progress
        growth, bend = (radius_1 - radius_0) * rate, (radius_1 - radius_0) * change
        omega = self._frequency
        for axis, phase in ((X, 0.0), (Z, 0.5 * math.pi)):
            sine, cosine = np.sin(omega * time + phase), np.cos(omega * time + phase)
            samples.position[:, axis] += radius * sine
            samples.velocity[:, axis] = growth * sine + radius * omega * cosine
            samples.acceleration[:, axis] = (
                bend - radius * omega**2
            ) * sine + 2.0 * growth * omega * cosine
        return samples

    def _progress(self, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """How far from the first end, 0 to 1, with its two derivatives [1/s, 1/s^2]."""
        shifted = np.mod(time + self._half, self.period) - self._half
        way = np.abs(shifted)
        far = way > 0.5 * self._half
        near = np.where(far, self._half - way, way)  # time to the nearer end
        rate, b = self._rate, self._rounding
        s = 0.5 + 0.5 * np.minimum(near / b, 1.0)
        eased = s**4 * (2.5 + s * (-3.0 + s))  # integral of the smooth step from -1 to 1
        progress = 2.0 * b * rate * (2.0 * eased - s + 0.34375) + rate * np.maximum(near - b, 0.0)
        step, slope, _ = minimum_jerk(s)
        speed = rate * (2.0 * step - 1.0)
        change = rate / b * slope
        progress, change = np.where(far, 1.0 - progress, progress), np.where(far, -change, change)
        return progress, speed * np.sign(shifted), change


class Square:
    """A rounded square in x and z about ``home`` (5,), at constant speed.

    In a corner the heading follows the minimum-jerk profile over the way, so that curvature, hence
    acceleration, sets in smoothly. It begins in the middle of the side of least z, towards
    greater x, and repeats after ``period`` [s]. Raises ParameterError when the corners take more
    than the sides have.
    """

    def __init__(self, parameters: SquareParameters, home: FloatArray) -> None:
        self._home = Stand(home)
        self._speed = parameters.speed
        self._side = parameters.side
        self._corner = 15.0 * math.pi / 16.0 * parameters.corner  # its length
        self._along = _integral(lambda u: np.cos(_heading(u)))
        self._across = _integral(lambda u: np.sin(_heading(u)))
        reach = self._corner * float(self._along(1.0))  # of a corner, along either side
        self._straight = 0.5 * self._side - reach  # from the middle of a side to its corner
        if self._straight < 0.0:
            largest = parameters.corner * 0.5 * self._side / reach
            raise ParameterError(
                f"parameter 'square.corner' is {parameters.corner:g} m, it must be at most "
                f"{largest:.4g} m for a 'square.side' of {self._side:g} m"
            )
        self._quarter = 2.0 * self._straight + self._corner
        self.period = 4.0 * self._quarter / self._speed

    def evaluate(self, time: FloatArray) -> Kinematics:
        """Position, velocity and acceleration at each time (n,) [s]."""
        samples = self._home.evaluate(time)
        way = self._speed * time
        quarter = np.floor(way / self._quarter)
        way = way - quarter * self._quarter
        u = np.clip((way - self._straight) / self._corner, 0.0, 1.0)
        before = np.minimum(way, self._straight)
        after = np.maximum(way - self._straight - self._corner, 0.0)
        along = before + self._corner * self._along(u)
        across = after + self._corner * self._across(u) - 0.5 * self._side
        heading = _heading(u)
        bend = 0.5 * math.pi * self._speed**2 * minimum_jerk(u)[1] / self._corner
        sine, cosine = np.sin(heading), np.cos(heading)
        side = quarter.astype(np.int64) % 4
        for values, forward, sideward in zip(
            samples,
            (along, self._speed * cosine, -bend * sine),
            (across, self._speed * sine, bend * cosine),
            strict=True,
        ):
            values[:, X] += np.choose(side, (forward, -sideward, -forward, sideward))
            values[:, Z] += np.choose(side, (sideward, forward, -sideward, -forward))
        return samples


class Chirp:
    """A sinusoid of one output about ``home`` (5,), its frequency changing evenly.

    Position -amplitude cos(angle); the sweep takes ``length`` [s], whole half periods, so that it
    begins and ends where the velocity is zero and the acceleration stays continuous.
    """

    def __init__(self, parameters: ChirpParameters, home: FloatArray) -> None:
        self._home = Stand(home)
        self.axis = AXES.index(parameters.axis)
        self._amplitude = parameters.amplitude
        self._start, self._end = parameters.frequency
        mean = 0.5 * (self._start + self._end)
        self.length = max(1, round(mean * parameters.time / math.pi)) * math.pi / mean
        self._rise = (self._end - self._start) / self.length

    def evaluate(self, time: FloatArray) -> Kinematics:
        """Position, velocity and acceleration at each time (n,) [s]."""
        samples = self._home.evaluate(time)
        swept = np.clip(time, 0.0, self.length)
        after = np.maximum(time - self.length, 0.0)
        frequency = self._start + self._rise * swept
        before = np.minimum(time, 0.0)
        angle = (self._start + 0.5 * self._rise * swept) * swept
        angle += self._start * before + self._end * after
        rise = np.where((time >= 0.0) & (time < self.length), self._rise, 0.0)
        sine, cosine = self._amplitude * np.sin(angle), self._amplitude * np.cos(angle)
        samples.position[:, self.axis] -= cosine
        samples.velocity[:, self.axis] = frequency * sine
        samples.acceleration[:, self.axis] = frequency**2 * cosine + rise * sine
        return samples


def _integral(function: Callable[[FloatArray], FloatArray]) -> Chebyshev:
    """The integral of a smooth function from 0 on, up to 1."""
    interpolant = Chebyshev.interpolate(function, _DEGREE, domain=[0.0, 1.0])
    integral: Chebyshev = interpolant.integ(lbnd=0.0)
    return integral


def _heading(u: FloatArray) -> FloatArray:
    """Direction in a corner [rad] at ``u`` of its length, 0 to 1."""
    return 0.5 * math.pi * minimum_jerk(u)[0]
