"""What a reference is checked against besides its limits: the machine, and the controller's model.

Figures, not code: the reference knows neither the plant nor the controller. For another machine or
another controller give theirs.
"""

from __future__ import annotations

import dataclasses

from maglev_model.parameters import ParameterError, parameter
from maglev_reference.trajectory_parameters import OMEGA_0, same_length


@dataclasses.dataclass(frozen=True, kw_only=True)
class MachineParameters:
    """What currents follow from: each motor's forces by air gap, (1)-(4), masses and friction."""

    gap: tuple[float, ...] = parameter(
        (0.018, 0.021, 0.024, 0.027, 0.03, 0.033),
        description='air gaps at which the forces of a motor are given, rising',
        unit='m',
        lower=1e-3,
        upper=0.2,
    )
    attraction: tuple[float, ...] = parameter(
        (60.385, 41.683, 29.148, 20.564, 14.599, 10.408),
        description='K_v1 L_v1, attraction without current, at each gap',
        unit='N',
        lower=1e-3,
        upper=1e5,
    )
    attraction_current: tuple[float, ...] = parameter(
        (7.8094, 7.3475, 7.0439, 6.8454, 6.7176, 6.6379),
        description='K_v3 L_v3, attraction of the current squared, at each gap',
        unit='N/A^2',
        lower=1e-3,
        upper=1e5,
    )
    thrust: tuple[float, ...] = parameter(
        (37.015, 31.204, 26.388, 22.363, 18.979, 16.122),
        description='K_h L_h, horizontal force of i_q, at each gap',
        unit='N/A',
        lower=1e-3,
        upper=1e5,
    )
    mass: tuple[float, ...] = parameter(
        (6.9, 10.6, 8.6),
        description='M_y, M_x, M_z',
        unit='kg',
        lower=0.1,
        upper=1000.0,
        length=3,
    )
    inertia: float = parameter(
        0.5268, description='I_x = I_z', unit='kg m^2', lower=1e-3, upper=1000.0
    )
    spring: tuple[float, ...] = parameter(
        (4000.0, 900.0), description='k_s_phi, k_s_theta', unit='1/s^2', lower=0.0, length=2
    )
    gravity: float = parameter(9.81, description='G', unit='m/s^2', lower=0.0, upper=30.0)
    coulomb: tuple[float, ...] = parameter(
        (0.303, 0.171, 0.149, 1.32, 1.32),
        description='Coulomb friction of each output',
        unit='m/s^2, rad/s^2',
        lower=0.0,
        upper=100.0,
        length=5,
    )
    viscous: tuple[float, ...] = parameter(
        (0.5, 0.5, 0.5, 0.5, 0.5),
        description='viscous friction of each output',
        unit='1/s',
        lower=0.0,
        upper=1000.0,
        length=5,
    )

    def __post_init__(self) -> None:
        names = ('gap', 'attraction', 'attraction_current', 'thrust')
        same_length('machine', names, [len(getattr(self, name)) for name in names])
        if any(low >= high for low, high in zip(self.gap, self.gap[1:], strict=False)):
            raise ParameterError(f"parameter 'machine.gap' is {list(self.gap)}, it must rise")


def _multiples(axis: str) -> tuple[float, ...]:
    found: tuple[float, ...] = parameter(
        (0.0, 1.0, 2.0, 3.0, 4.0, 5.0),
        description=f'frequencies held for {axis}, in fundamentals',
        lower=0.0,
        upper=100.0,
    )
    return found


@dataclasses.dataclass(frozen=True, kw_only=True)
class InternalModelParameters:
    """The controller's internal models (14): what repeats at their frequencies is learnt.

    ``bandwidth`` W, ``integration`` i and ``learning`` m are what its LQR weights were made of: W^4
    on e^2, 2 W^2 on the error rate squared, W^4 i^2 on the integrator and W^4 m^2 on the states of
    the oscillators. ``sampling`` belongs to them, to the sample time and to the observer.
    """

    fundamental: float = parameter(
        OMEGA_0, description='frequency of the reference', unit='rad/s', lower=1e-3, upper=1e3
    )
    y: tuple[float, ...] = _multiples('y')
    x: tuple[float, ...] = _multiples('x')
    z: tuple[float, ...] = _multiples('z')
    phi: tuple[float, ...] = _multiples('phi')
    theta: tuple[float, ...] = _multiples('theta')
    bandwidth: float = parameter(
        200.0, description='of the feedback, W', unit='rad/s', lower=0.1, upper=1e4
    )
    integration: float = parameter(
        90.0, description='how fast its integrator learns, i', unit='rad/s', lower=1e-3, upper=1e4
    )
    learning: float = parameter(
        10.0, description='how fast its oscillators learn, m', unit='rad/s', lower=1e-3, upper=1e4
    )
    sampling: float = parameter(
        2.05,
        description='error with sampling and observer, by that of the same weights without',
        lower=1.0,
        upper=100.0,
    )

    def frequencies(self) -> tuple[tuple[float, ...], ...]:
        """The frequencies held [rad/s], by output."""
        lists = (self.y, self.x, self.z, self.phi, self.theta)
        return tuple(tuple(self.fundamental * k for k in multiples) for multiples in lists)
