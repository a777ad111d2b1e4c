"""The platen's mass matrix when its centre of mass is not in the middle of the motors' plane.

With the centre ``(a, b)`` aside along X and Z and h below, and the geometry of (5) linearised, the
mass M_y moves with ``(ẏ + a θ̇ - b φ̇, ẋ - h θ̇, ż + h φ̇)``. M_x and M_z exceed M_y by what moves
along without tilting, and ``inertia`` is about the middle of the plane. The weight then turns the
platen with M_y G (a - h θ) about θ and M_y G (-b - h φ) about φ, as a pendulum.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import numpy as np

from maglev_model.axes import PHI, THETA, FloatArray, X, Y, Z
from maglev_model.compiled import borrowing
from maglev_model.compiled.records import Record
from maglev_model.machine import Machine
from maglev_model.parameters import ParameterError

if TYPE_CHECKING:
    from maglev_plant.parameters import PlantParameters


class BalanceArrays(Record):
    """Masses and weight."""

    mass: Annotated[FloatArray, 5]  # M_y, M_x, M_z, I_x, I_z [kg, kg m²]
    inverse: Annotated[FloatArray, 5, 5]  # of the mass matrix of the free axes
    torque: Annotated[FloatArray, 5]  # of the weight, level [N, N m]
    pendulum: float  # M_y G h [N m]
    coupled: bool  # whether tilts and displacements are
    slide_x: float  # that x takes on by theta where nothing else pushes it, M_x,theta / M_x [m]
    slide_z: float  # z by phi


def mass_matrix(parameters: PlantParameters, machine: Machine) -> FloatArray:
    """The mass matrix of y, x, z, phi, theta, shape (5, 5); raises ParameterError."""
    balance, m = parameters.effects.balance, machine.M_y
    a, b, h = balance.aside_x, balance.aside_z, balance.below
    matrix = np.diag([machine.M_y, machine.M_x, machine.M_z, machine.I_x, machine.I_x])
    for one, other, value in (
        (Y, THETA, m * a),
        (Y, PHI, -m * b),
        (X, THETA, -m * h),
        (Z, PHI, m * h),
        (PHI, THETA, -m * a * b),
    ):
        matrix[one, other] = matrix[other, one] = value
    if np.linalg.eigvalsh(matrix)[0] <= 0.0:
        raise ParameterError(
            "parameters 'effects.balance' put the centre of mass where the inertia about the "
            f"motors' plane, {machine.I_x:g} kg m^2, cannot be: nearer"
        )
    return matrix


def balance_arrays(parameters: PlantParameters, machine: Machine) -> BalanceArrays:
    """Masses of a stage."""
    balance, weight = parameters.effects.balance, machine.M_y * machine.G
    matrix, inverse = mass_matrix(parameters, machine), np.zeros((5, 5))
    free = np.flatnonzero(np.logical_not(parameters.guide.locked))
    inverse[np.ix_(free, free)] = np.linalg.inv(matrix[np.ix_(free, free)])
    return BalanceArrays(
        mass=np.diag(matrix),
        inverse=inverse,
        torque=np.array([weight, 0.0, 0.0, -weight * balance.aside_z, weight * balance.aside_x]),
        pendulum=weight * balance.below,
        coupled=bool(np.any(inverse != np.diag(np.diag(inverse)))),
        slide_x=0.0 if parameters.guide.locked[X] else matrix[X, THETA] / matrix[X, X],
        slide_z=0.0 if parameters.guide.locked[Z] else matrix[Z, PHI] / matrix[Z, Z],
    )


@borrowing
def add_weight(balance: BalanceArrays, state: FloatArray, force: FloatArray) -> None:
    """Add the weight and its torques to ``force`` (5,)."""
    for axis in range(5):
        force[axis] += balance.torque[axis]
    force[3] -= balance.pendulum * state[6]
    force[4] -= balance.pendulum * state[8]
