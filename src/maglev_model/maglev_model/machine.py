"""The machine: Table I as parameters, and the constants the equations of motion are written with.

Where the paper leaves a value open (σ_m, µ_rec, k_w1, G, the torsional springs) or prints it
wrongly (K_v2), the default is the one that makes the force model consistent: with
``K_v2 = 3·√2·L_A·p_m·W·k_w1/p`` the fields of magnets and winding superpose and
``K_v2² = 4·K_v1·K_v3``.
"""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

from maglev_model.parameters import ParameterError, parameter

VACUUM_PERMEABILITY = 4e-7 * math.pi
"""µ0 [H/m]."""

PEAK_PER_AMPERE = {'amplitude': 1.0, 'rms': math.sqrt(2.0)}
"""Amplitude of a phase current per ampere, by what is meant by that."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class MachineParameters:
    """Table I, the torsional springs of (7), gravity, and the range the stops leave."""

    slot_width: float = parameter(12.7e-3, 'stator slot width b_0', unit='m', within=(1e-3, 0.1))
    slot_pitch: float = parameter(19.05e-3, 'stator slot pitch t_1', unit='m', within=(1e-3, 0.1))
    turns: int = parameter(900, 'turns per phase W', within=(1, 10_000))
    winding_factor: float = parameter(
        1.0, 'winding factor of the first harmonic k_w1', within=(0.1, 1.0)
    )
    dq_scaling: str = parameter(
        'amplitude',
        'whether K_v2, K_v3 and K_h are those of amplitudes or of RMS values of the phase '
        'currents; i_d and i_q are amplitudes everywhere',
        choices=tuple(PEAK_PER_AMPERE),
    )
    pole_pairs: int = parameter(3, 'stator pole pairs p per motor', within=(1, 100))
    pole_pitch: float = parameter(57.15e-3, 'pole pitch tau', unit='m', within=(5e-3, 0.5))
    magnet_height: float = parameter(5e-3, 'magnet height h_m', unit='m', within=(1e-4, 0.1))
    magnet_length: float = parameter(50e-3, 'magnet length L_A', unit='m', within=(1e-3, 1.0))
    magnet_width: float = parameter(28.58e-3, 'magnet width tau_p', unit='m', within=(1e-3, 0.5))
    magnets: int = parameter(4, 'number of magnets p_m per motor', within=(1, 100))
    magnet_charge: float = parameter(
        875_400.0,
        'magnetic surface charge sigma_m, here the coercivity H_c',
        unit='A/m',
        within=(1e5, 2e6),
    )
    recoil_permeability: float = parameter(
        1.05, 'relative recoil permeability mu_rec of the magnets', within=(1.0, 2.0)
    )
    motors: int = parameter(
        4,
        '4, or 1: motor 2 alone, the machine of refs. [10], [11], moving in y and x',
        within=(1, 4),
    )
    mass_x: float = parameter(10.6, 'moving mass M_x along X', unit='kg', within=(0.1, 1000.0))
    mass_z: float = parameter(8.6, 'moving mass M_z along Z', unit='kg', within=(0.1, 1000.0))
    mass_y: float = parameter(6.9, 'moving mass M_y along Y', unit='kg', within=(0.1, 1000.0))
    radius: float = parameter(
        0.397, 'platen centre to mover centres r', unit='m', within=(0.01, 5.0)
    )
    inertia: float = parameter(
        0.5268,
        'moment of inertia about the X and the Z axis, I_x = I_z',
        unit='kg m^2',
        within=(1e-3, 1000.0),
    )
    gravity: float = parameter(9.81, 'acceleration of gravity G', unit='m/s^2', within=(0.0, 30.0))
    spring_phi: float = parameter(
        4000.0, 'torsional spring k_s_phi', unit='1/s^2', within=(0.0, 1e6)
    )
    spring_theta: float = parameter(
        900.0, 'torsional spring k_s_theta', unit='1/s^2', within=(0.0, 1e6)
    )
    gap_min: float = parameter(0.018, 'air gap y at the upper stop', unit='m', within=(1e-3, 0.2))
    gap_max: float = parameter(
        0.031, 'air gap y at the lower stop (at rest)', unit='m', within=(1e-3, 0.2)
    )
    x_max: float = parameter(
        0.05, 'stops along X at plus and minus this', unit='m', within=(1e-4, 1.0)
    )
    z_max: float = parameter(
        0.05, 'stops along Z at plus and minus this', unit='m', within=(1e-4, 1.0)
    )
    phi_max: float = parameter(
        0.003, 'stops of phi at plus and minus this', unit='rad', within=(1e-5, 0.1)
    )
    theta_max: float = parameter(
        0.014, 'stops of theta at plus and minus this', unit='rad', within=(1e-5, 0.1)
    )

    def __post_init__(self) -> None:
        """Refuse what each value alone cannot show to be wrong."""
        if self.motors not in (1, 4):
            raise ParameterError(f"parameter 'machine.motors' is {self.motors}, it must be 1 or 4")
        for small, large in (
            ('gap_min', 'gap_max'),
            ('slot_width', 'slot_pitch'),
            ('magnet_width', 'pole_pitch'),
        ):
            low, high = getattr(self, small), getattr(self, large)
            if low >= high:
                raise ParameterError(
                    f"parameter 'machine.{small}' is {low:g} m, it must be less than "
                    f"'machine.{large}' ({high:g} m)"
                )

    @property
    def lower_limit(self) -> tuple[float, float, float, float, float]:
        """Least reachable y, x, z, phi, theta [m, m, m, rad, rad]."""
        return (self.gap_min, -self.x_max, -self.z_max, -self.phi_max, -self.theta_max)

    @property
    def upper_limit(self) -> tuple[float, float, float, float, float]:
        """Greatest reachable y, x, z, phi, theta [m, m, m, rad, rad]."""
        return (self.gap_max, self.x_max, self.z_max, self.phi_max, self.theta_max)


class Machine(NamedTuple):
    """Constants of (1)-(7), floats in SI units; one argument of compiled functions."""

    K_v1: float  # (3)
    K_v2: float
    K_v3: float
    K_h: float  # (4)
    b_0: float
    t_1: float
    tau: float
    h_m: float
    mu_rec: float
    B_0: float  # B_pmy1(g) sinh(pi (h_m + g) / tau) [T]
    r: float
    M_x: float
    M_y: float
    M_z: float
    I_x: float  # = I_z
    k_rot: float  # r M_y / I_x, (7)
    k_s_phi: float
    k_s_theta: float
    G: float
    motors: float  # 4, or 1 for motor 2 alone


def machine_constants(parameters: MachineParameters) -> Machine:
    """The constants of (3), (4), (6), (7) for one set of parameters."""
    p = parameters
    L_A, p_m, k_w1 = p.magnet_length, p.magnets, p.winding_factor
    W = p.turns / PEAK_PER_AMPERE[p.dq_scaling]  # for constants per ampere of amplitude
    tau, mu_0 = p.pole_pitch, VACUUM_PERMEABILITY
    magnet_shape = math.sinh(math.pi * p.magnet_height / tau) * math.sin(
        math.pi * p.magnet_width / (2.0 * tau)
    )
    K_v1 = L_A * p_m * tau / (4.0 * mu_0)
    K_v2 = 3.0 * math.sqrt(2.0) * L_A * p_m * W * k_w1 / p.pole_pairs
    K_v3 = 18.0 * L_A * p_m * W**2 * k_w1**2 * mu_0 / (tau * p.pole_pairs**2)
    magnets = 12.0 * math.sqrt(2.0) * W * k_w1 * p_m * L_A * p.magnet_charge * mu_0
    K_h = magnets * magnet_shape / (math.pi * p.pole_pairs)
    return Machine(
        K_v1=K_v1,
        K_v2=K_v2,
        K_v3=K_v3,
        K_h=K_h,
        b_0=p.slot_width,
        t_1=p.slot_pitch,
        tau=tau,
        h_m=p.magnet_height,
        mu_rec=p.recoil_permeability,
        B_0=4.0 / math.pi * mu_0 * p.magnet_charge * magnet_shape,
        r=p.radius,
        M_x=p.mass_x,
        M_y=p.mass_y,
        M_z=p.mass_z,
        I_x=p.inertia,
        k_rot=p.radius * p.mass_y / p.inertia,
        k_s_phi=p.spring_phi,
        k_s_theta=p.spring_theta,
        G=p.gravity,
        motors=float(p.motors),
    )
