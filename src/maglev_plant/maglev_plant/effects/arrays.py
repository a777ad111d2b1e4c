"""All effects of a stage in one record."""

from __future__ import annotations

from typing import TYPE_CHECKING

from maglev_model.compiled.records import Record
from maglev_model.machine import Machine
from maglev_plant.effects.balance import BalanceArrays, balance_arrays
from maglev_plant.effects.drive import DriveArrays, drive_arrays
from maglev_plant.effects.floor import FloorArrays, floor_arrays
from maglev_plant.effects.friction import FrictionArrays, friction_arrays
from maglev_plant.effects.heat import HeatArrays, heat_arrays
from maglev_plant.effects.modes import ModeArrays, mode_arrays
from maglev_plant.effects.motors import MotorArrays, motor_arrays, motor_places
from maglev_plant.effects.parameters import EffectParameters
from maglev_plant.effects.sensor import SensorArrays, sensor_arrays
from maglev_plant.effects.winding import WindingArrays, winding_arrays

if TYPE_CHECKING:
    from maglev_plant.parameters import PlantParameters

_OFF = EffectParameters()


class EffectArrays(Record):
    """One record an effect; ``moving`` whether one acts on the platen, currents included."""

    moving: bool
    by_phases: bool  # whether phase currents flow, instead of i_d and i_q as commanded
    friction: FrictionArrays
    modes: ModeArrays
    motors: MotorArrays
    balance: BalanceArrays
    drive: DriveArrays
    winding: WindingArrays
    sensor: SensorArrays
    floor: FloorArrays
    heat: HeatArrays
    cable: float  # stiffness along x and z [N/m]
    spring_growth: float  # of the torsional springs with the gap [1/m]
    spring_gap: float  # where they are as in (7) [m]


def effect_arrays(parameters: PlantParameters, machine: Machine, step: float) -> EffectArrays:
    """The effects of a stage at sample 0, for steps of ``step`` [s]; raises ParameterError."""
    effects = parameters.effects
    balance = balance_arrays(parameters, machine)
    return EffectArrays(
        moving=any(
            getattr(effects, name) != getattr(_OFF, name)
            for name in (
                'friction',
                'modes',
                'motor',
                'balance',
                'spring',
                'cable',
                'floor',
                'heat',
            )
        )
        or effects.drive != _OFF.drive
        or effects.winding.voltage > 0.0,
        by_phases=any((*effects.motor.commutation, *effects.motor.angle))
        or effects.drive != _OFF.drive
        or effects.winding.voltage > 0.0,
        friction=friction_arrays(parameters, balance.mass, motor_places(parameters)),
        modes=mode_arrays(parameters, step),
        motors=motor_arrays(parameters, machine),
        balance=balance,
        drive=drive_arrays(parameters),
        winding=winding_arrays(parameters, machine, step),
        sensor=sensor_arrays(parameters),
        floor=floor_arrays(parameters, step),
        heat=heat_arrays(parameters),
        cable=effects.cable.stiffness,
        spring_growth=effects.spring.growth,
        spring_gap=0.5 * (parameters.machine.gap_min + parameters.machine.gap_max),
    )
