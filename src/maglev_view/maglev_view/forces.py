"""The forces of the motors and how near their currents are to the limit. No ROS here."""

from __future__ import annotations

import math
from typing import NamedTuple

from maglev_model.axes import FloatArray
from maglev_model.geometry import motor_gaps
from maglev_model.machine import Machine, MachineParameters, machine_constants
from maglev_model.motor import force_coefficients, forces_of_currents
from maglev_view.frames import Motor, Vector, motors, mover_position


class Force(NamedTuple):
    """What a motor does to its mover: from where in ``stage_link`` [m], the force [N], and the
    amplitude of its phase currents [A].
    """

    motor: Motor
    position: Vector
    newtons: Vector
    current: float


class Forces:
    """The forces of a machine's motors, by (1), (2)."""

    def __init__(self, parameters: MachineParameters) -> None:
        self._motors = motors(parameters)
        self._machine: Machine = machine_constants(parameters)

    def at(self, outputs: FloatArray, i_d: FloatArray, i_q: FloatArray) -> list[Force]:
        """The force of each motor whose gap is one.

        :param outputs: y, x, z, phi, theta, shape (5,) [m, rad].
        :param i_d: direct currents of motors 1 to 4, shape (4,) [A]; ``i_q`` likewise.
        """
        gaps = motor_gaps(outputs, self._machine.r)
        return [
            self._force(motor, outputs, gaps, i_d, i_q)
            for motor in self._motors
            if gaps[motor.number - 1] > 0.0
        ]

    def _force(
        self, motor: Motor, outputs: FloatArray, gaps: FloatArray, i_d: FloatArray, i_q: FloatArray
    ) -> Force:
        index = motor.number - 1
        gap, direct, quadrature = float(gaps[index]), float(i_d[index]), float(i_q[index])
        coefficients = force_coefficients(self._machine, gap)
        down, push = forces_of_currents(coefficients, direct, quadrature)
        x, y, _ = motor.direction
        newtons = (push * x, push * y, -down)
        return Force(motor, mover_position(motor, outputs), newtons, math.hypot(direct, quadrature))
