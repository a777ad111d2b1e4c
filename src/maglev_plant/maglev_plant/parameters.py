"""Every parameter of the simulated stage; the defaults are the benchmark plant."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from maglev_model.axes import AXES, PHI, FloatArray, Y
from maglev_model.guide import GuideParameters
from maglev_model.machine import MachineParameters
from maglev_model.parameters import ParameterError, group, parameter
from maglev_plant.effects.parameters import EffectParameters

_BY_AXIS = ', by axis y, x, z, phi, theta'

_LONGEST_STEP = 2.0
"""Longest integration step by how fast friction brakes (stable up to 2.78) or a spring swings (up
to 2.83)."""

_BRISTLES = 1.6
"""As many times shorter with bristles: what rests on them creeps with steps above 1.4."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class AmplifierParameters:
    """The three-phase amplifiers, one per motor."""

    bandwidth: float = parameter(
        2000.0,
        'corner frequency of the first-order current loop, 0 for no lag',
        unit='Hz',
        within=(0.0, 1e5),
    )
    peak_current: float = parameter(
        7.0, 'greatest current of a phase', unit='A', within=(0.1, 100.0)
    )
    continuous_current: float = parameter(
        5.0, 'current a phase carries for ever', unit='A', within=(0.1, 100.0)
    )
    thermal_time: float = parameter(
        2.0,
        'time constant of the thermal load, which follows (current / continuous)^2',
        unit='s',
        within=(0.01, 1e4),
    )
    thermal_recovery: float = parameter(
        0.9,
        'a phase that has spent its budget (load 1) gets its peak back below this load',
        within=(0.0, 1.0),
    )

    def __post_init__(self) -> None:
        """Refuse a continuous current above the peak."""
        if self.continuous_current > self.peak_current:
            raise ParameterError(
                f"parameter 'amplifier.continuous_current' is {self.continuous_current:g} A, it "
                f"must not exceed 'amplifier.peak_current' ({self.peak_current:g} A)"
            )


@dataclasses.dataclass(frozen=True, kw_only=True)
class EncoderParameters:
    """Four encoders on the vertical guides, which read the gaps, and two horizontal ones."""

    gap_resolution: float = parameter(
        10e-6, 'count of the gap encoders, 0 for none', unit='m', within=(0.0, 1e-3)
    )
    horizontal_resolution: float = parameter(
        10e-6, 'count of the x and z encoders, 0 for none', unit='m', within=(0.0, 1e-3)
    )
    gap_noise: float = parameter(
        0.0,
        'standard deviation of Gaussian noise before the gap encoders count',
        unit='m',
        within=(0.0, 1e-3),
    )
    horizontal_noise: float = parameter(
        0.0,
        'standard deviation of Gaussian noise before the x and z encoders count',
        unit='m',
        within=(0.0, 1e-3),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class StopParameters:
    """The vertical stops are seats around the centre; where they lie is in the machine's group."""

    seat_radius: float = parameter(
        0.1,
        'distance of the seats from the centre: y +- radius * tilt stays in the gap range, '
        'and a platen that rests is held level; 0 stops y alone, the radius to the movers '
        'stops each gap',
        unit='m',
        within=(0.0, 1.0),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class DisturbanceParameters:
    """Forces and torques by axis: constant + amplitude·sin(2π·frequency·t + phase)."""

    constant: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0, 0.0, 0.0),
        'constant part' + _BY_AXIS,
        unit='N, N m',
        within=(-1e4, 1e4),
        length=5,
    )
    amplitude: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0, 0.0, 0.0),
        'amplitude of the sinusoid' + _BY_AXIS,
        unit='N, N m',
        within=(-1e4, 1e4),
        length=5,
    )
    frequency: tuple[float, ...] = parameter(
        (0.75, 0.75, 0.75, 0.75, 0.75),
        'frequency of the sinusoid' + _BY_AXIS,
        unit='Hz',
        within=(0.0, 500.0),
        length=5,
    )
    phase: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0, 0.0, 0.0),
        'phase of the sinusoid at sample 0' + _BY_AXIS,
        unit='rad',
        within=(-10.0, 10.0),
        length=5,
    )


def _factor(name: str) -> Any:
    return parameter(1.0, f"the plant's {name} by the machine's", within=(0.1, 10.0))


@dataclasses.dataclass(frozen=True, kw_only=True)
class OffsetParameters:
    """How the true plant differs from the machine that the controller knows, as factors."""

    K_v1: float = _factor('K_v1')
    K_v2: float = _factor('K_v2')
    K_v3: float = _factor('K_v3')
    K_h: float = _factor('K_h')
    mass_x: float = _factor('mass_x')
    mass_z: float = _factor('mass_z')
    mass_y: float = _factor('mass_y')
    inertia: float = _factor('inertia')
    spring_phi: float = _factor('spring_phi')
    spring_theta: float = _factor('spring_theta')


@dataclasses.dataclass(frozen=True, kw_only=True)
class InitialParameters:
    """Where the platen is at sample 0."""

    position: tuple[float, ...] = parameter(
        (0.031, 0.0, 0.0, 0.0, 0.0),
        'position' + _BY_AXIS,
        unit='m, rad',
        within=(-1.0, 1.0),
        length=5,
    )
    velocity: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0, 0.0, 0.0),
        'velocity' + _BY_AXIS,
        unit='m/s, rad/s',
        within=(-10.0, 10.0),
        length=5,
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class PlantParameters:
    """The simulated stage."""

    sample_time: float = parameter(1e-3, 'time between samples', unit='s', within=(1e-4, 1e-2))
    substeps: int = parameter(2, 'Runge-Kutta steps of fourth order per sample', within=(1, 1000))
    seed: int = parameter(0, 'seed of noise and of what is drawn', within=(0, 2**31 - 1))
    watchdog: float = parameter(
        0.05,
        'without fresh currents for this long in flight they are cut',
        unit='s',
        within=(0.002, 1.0),
    )
    machine: MachineParameters = group(MachineParameters)
    amplifier: AmplifierParameters = group(AmplifierParameters)
    encoder: EncoderParameters = group(EncoderParameters)
    guide: GuideParameters = group(GuideParameters)
    stop: StopParameters = group(StopParameters)
    disturbance: DisturbanceParameters = group(DisturbanceParameters)
    offset: OffsetParameters = group(OffsetParameters)
    initial: InitialParameters = group(InitialParameters)
    effects: EffectParameters = group(EffectParameters)

    def __post_init__(self) -> None:
        """Refuse a start outside the stops, a gap that closes, and steps that are too long."""
        self._check_initial()
        self._check_gaps()
        self._check_substeps()
        if self.machine.motors == 1 and not all(self.guide.locked[2:]):
            raise ParameterError(
                "parameter 'guide.locked' leaves z, phi or theta free, which a machine with a "
                'single motor cannot carry: lock all three'
            )

    def _check_initial(self) -> None:
        position = self.initial.position
        limits = zip(
            AXES, position, self.machine.lower_limit, self.machine.upper_limit, strict=True
        )
        for axis, value, lower, upper in limits:
            if not lower <= value <= upper:
                raise ParameterError(
                    f"parameter 'initial.position' puts {axis} at {value:g}, outside its stops "
                    f'[{lower:g}, {upper:g}]'
                )
        reach = self.stop.seat_radius * max(abs(position[3]), abs(position[4]))
        y = position[0]
        if y + reach > self.machine.gap_max or y - reach < self.machine.gap_min:
            raise ParameterError(
                f"parameter 'initial.position' tilts the platen into a vertical stop: y is {y:g} m "
                f'and its seats reach {reach:g} m further'
            )

    def _breaking(self, axis: int) -> float:
        """How much greater than Coulomb friction it is where an axis rests, tilted to the stops."""
        friction, tilt = self.effects.friction, math.hypot(*self.machine.upper_limit[PHI:])
        return friction.static_ratio * (1.0 + friction.tilt_load[axis] * tilt)

    def _guides(self) -> FloatArray:
        """Forces of the guides at the motors by what they accelerate, by axis [m/s², rad/s²]."""
        forces, machine, offset = self.effects.friction.vertical_guides, self.machine, self.offset
        lever = machine.radius**2 / (machine.inertia * offset.inertia)
        along_z, along_x = forces[0] + forces[2], forces[1] + forces[3]
        level = sum(forces) / (machine.mass_y * offset.mass_y)
        return np.array([level, 0.0, 0.0, lever * along_z, lever * along_x])

    def _rates(self) -> FloatArray:
        """How fast friction brakes each axis that begins to slide [1/s]."""
        guide, rates = self.guide, np.array(self.guide.viscous)
        if self.effects.friction.model == 'tanh':
            slope = np.array([self._breaking(axis) for axis in range(5)]) / guide.coulomb_velocity
            rates += slope * guide.coulomb + slope[Y] * self._guides()
        return rates

    def _swing(self) -> FloatArray:
        """How fast each axis swings on springs, cable and bristles, these damped [1/s].

        A bristle follows the platen's mean speed of a step: its damping wants shorter ones.
        """
        machine, offset, cable = self.machine, self.offset, self.effects.cable
        friction, growth = self.effects.friction, abs(self.effects.spring.growth)
        pull = cable.stiffness + cable.hysteresis / cable.reach
        masses = machine.mass_x * offset.mass_x, machine.mass_z * offset.mass_z
        springs = machine.spring_phi * offset.spring_phi, machine.spring_theta * offset.spring_theta
        stiff = np.array([0.0, *(pull / mass for mass in masses), *springs])
        stiff[PHI:] *= 1.0 + 0.5 * growth * (machine.gap_max - machine.gap_min)
        if friction.model != 'lugre':
            return np.asarray(np.sqrt(stiff))
        breakaway = np.array(friction.breakaway)
        stiff += self.guide.coulomb / breakaway + self._guides() / breakaway[Y]
        return np.asarray(_BRISTLES * (1.0 + 0.5 * friction.damping) * np.sqrt(stiff))

    def _check_substeps(self) -> None:
        rates = np.maximum(self._rates(), self._swing())
        needed = math.ceil(rates.max() * self.sample_time / _LONGEST_STEP)
        if self.substeps < needed:
            raise ParameterError(
                f"parameter 'substeps' is {self.substeps}, friction and springs of "
                f'{AXES[int(rates.argmax())]} need at least {needed}'
            )

    def _check_gaps(self) -> None:
        narrowest = self.motor_gaps[0]
        if narrowest <= 0.0:
            raise ParameterError(
                "parameters 'machine.phi_max' and 'machine.theta_max' let the platen tilt until "
                f'the gap of a motor is {1e3 * narrowest:.3g} mm, it must stay above 0'
            )

    @property
    def motor_gaps(self) -> tuple[float, float]:
        """The narrowest and the widest gap a motor can have between the stops [m], at most."""
        machine, seat, motor = self.machine, self.stop.seat_radius, self.effects.motor
        if machine.motors == 1:
            return machine.gap_min, machine.gap_max
        tilt = max(machine.phi_max, machine.theta_max)
        tilt = min(tilt, 0.5 * (machine.gap_max - machine.gap_min) / max(seat, 1e-9))
        lever = machine.radius + max(0.0, *motor.place_along)
        across = max(abs(place) for place in motor.place_across)
        reach = (max(0.0, lever - seat) + across) * tilt
        return machine.gap_min - reach, machine.gap_max + reach
