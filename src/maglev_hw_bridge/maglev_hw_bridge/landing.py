"""Landing without a controller: brake, level, descend, and end the current on the lower stop.

A simple law that needs nothing but the encoders: proportional and rate feedback on a smooth way
down, and the exact inverse of (1), (2) with gravity and the springs of (7). A platen whose air gap
no encoder shows is pushed down. Also what a cut would do: the speed at which the platen then
strikes a stop.
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing.observer import Flags
from maglev_model.axes import PHI, THETA, FloatArray, X, Z
from maglev_model.compiled import borrowing, compiled
from maglev_model.compiled.records import Block, Record
from maglev_model.inverse import Answer, CurrentLimits, exact_inverse
from maglev_model.machine import Machine, machine_constants
from maglev_model.machine_array import MachineArray, machine_from_array
from maglev_model.platen import output_accelerations
from maglev_model.quintic import braking_times, quintic_to_zero

_ACROSS = np.array([False, True, True, False, False])
_PLACE, _REST = 2e-5, 2e-3  # so near x or z may be, and so slow, not to be pushed [m], [m/s]

LEAST_ATTRACTION = 0.1
"""Share of the weight that is always carried, so that the tilts keep authority."""

SEEING: Flags = np.zeros(5, np.bool_)
"""No axis is blind."""

_CARRY = np.array([0.0, -2.0, 2.0, -1.0, 1.0])
"""By blind axis, whether motors 1 and 3 are to carry (1) or motors 2 and 4 (-1).

x and z come first: along them the platen runs off to a stop 50 mm away, in a tilt to one 2 mm away.
"""

_PATIENCE = 2.0  # times as far x and z may be off their way where a cut would throw it up
_SOFT = 2e-4  # so near its stop what turns is not waited for [m]
_TURNING = 0.08  # that fast it is pulled over the stop's edge [rad/s]
_TILT = 0.95  # share of the attraction that tilts may take there
_BRAKING_UPWARD = 0.1  # of y [s]
_PUSH = 4.0  # downwards, of a platen whose gap nothing shows [m/s²]
_SURELY_DOWN = 1e-3  # so near the lower stop the model must have it by then [m]
_HOLD = 2.0  # what holds it there then would give it at the balance, downwards [m/s²]
_HOLDING, _LONGEST_PUSH = 0.15, 0.5  # [s]
_SEATED = 5e-5  # so near the lower stop a cut is soft [m]
_FREE_STEP = 1e-4  # of the motion without current [s]
_LONGEST_FALL = 10.0  # [s]
_SPEED_UNKNOWN, _SPEED_DOUBT = 0.1, 5e-3  # by how much the rate of y may be off [m/s]
_PLACE_DOUBT = 2e-4  # and y [m]
_SHARE_IN_DOUBT = 0.1  # of the magnets' pull and of the rate


class LandingArrays(Record):
    """The way down, and the law that follows it; axes y, x, z, phi, theta."""

    machine: MachineArray
    current_limit: float  # of a motor [A]
    along_z: float  # share of the attraction that motors 1 and 3 have
    stiffness: Annotated[FloatArray, 5]  # [1/s²]
    damping: Annotated[FloatArray, 5]  # [1/s]
    offset: Annotated[FloatArray, 5]  # of the start from where braking ends [m, rad]
    speed: Annotated[FloatArray, 5]  # at the start
    braking: Annotated[FloatArray, 5]  # [s]
    level: Annotated[FloatArray, 5]  # where braking ends [m, rad]
    elapsed: float  # [s]
    descent_start: float  # [s]
    descent_time: float  # [s]
    settle_time: float  # [s]
    floor: float  # air gap on the lower stop [m]
    aim: float  # of the descent [m]
    end: float  # air gap at which it is over whatever the time, or infinite [m]
    period: float  # [s]
    balance: float  # air gap below which the magnets pull it up [m]
    stray: Annotated[FloatArray, 5]  # farther from it the platen is not held any more [m, rad]
    astray: bool  # it is, a result
    unseen: bool  # no encoder shows y
    held: float  # for which time, where y is unseen [s]
    direct: Annotated[FloatArray, 4]  # i_d of motors 1..4 [A], the result
    quadrature: Annotated[FloatArray, 4]  # i_q


@compiled
def land(block: Block, position: FloatArray, rate: FloatArray, disturbance: FloatArray) -> bool:
    """Write the currents of the next sample of the way down; true when the landing is over.

    ``position``, ``rate`` and ``disturbance`` (5,) [m, rad] and by s and s². No motor gets more
    than the limit, and what carries comes first.
    """
    landing: LandingArrays = block[0]
    landing.elapsed += landing.period
    thrown_up = position[0] < landing.balance  # by a cut
    place, wanted = position.copy(), np.empty(5)
    _follow(landing, position, rate, disturbance, thrown_up, wanted)
    if landing.unseen:
        _push(landing, position, rate, disturbance, place, wanted)
    tilt = _TILT if thrown_up else 0.5
    exact_inverse(
        machine_from_array(landing.machine),
        CurrentLimits(landing.current_limit, 1.0, LEAST_ATTRACTION, landing.along_z, tilt),
        np.ones(5),
        place,
        wanted,
        Answer(landing.direct[:], landing.quadrature[:], np.empty(5), np.empty(2)),
    )
    if landing.unseen:
        return bool(landing.held > _HOLDING or landing.elapsed > _LONGEST_PUSH)
    longest = landing.descent_start + landing.descent_time + landing.settle_time
    return landing.elapsed > longest or position[0] > landing.end


@borrowing
def _follow(
    landing: LandingArrays,
    position: FloatArray,
    rate: FloatArray,
    disturbance: FloatArray,
    thrown_up: bool,
    wanted: FloatArray,
) -> None:
    """The accelerations, ``wanted`` (5,), that keep the platen on its way; whether it has left it.

    Along x and z what stands still is not pushed, and no friction made up for, which would grow
    with the push: should the encoder be stuck, the platen would at last slide off unseen.
    """
    time = landing.elapsed
    down = position[0] > landing.floor - _SOFT
    for axis in range(5):
        left, velocity, acceleration = quintic_to_zero(
            landing.offset[axis], landing.speed[axis], 0.0, landing.braking[axis], time
        )
        target = landing.level[axis] + left
        if axis == 0 and time >= landing.descent_start:
            left, velocity, acceleration = quintic_to_zero(
                landing.level[0] - landing.aim,
                0.0,
                0.0,
                landing.descent_time,
                time - landing.descent_start,
            )
            target = landing.aim + left
        patience = _PATIENCE if _ACROSS[axis] and thrown_up else 1.0
        if abs(target - position[axis]) > patience * landing.stray[axis]:
            landing.astray = True
        if down and axis >= PHI and abs(velocity - rate[axis]) > _TURNING:
            landing.astray = True
        wanted[axis] = (
            acceleration
            + landing.damping[axis] * (velocity - rate[axis])
            + landing.stiffness[axis] * (target - position[axis])
        )
        if axis not in (X, Z):
            wanted[axis] -= disturbance[axis]
        elif abs(target - position[axis]) < _PLACE and abs(velocity) + abs(rate[axis]) < _REST:
            wanted[axis] = 0.0


@borrowing
def _push(
    landing: LandingArrays,
    position: FloatArray,
    rate: FloatArray,
    disturbance: FloatArray,
    place: FloatArray,
    wanted: FloatArray,
) -> None:
    """Push down, in place of a way down, a platen that only the model tells of.

    Changes y of ``wanted`` (5,) and of ``place`` (5,), where the inverse is to be taken.
    What the model is off by doubles in some 20 ms, so nobody knows when the platen arrives, and
    what brakes it then lifts one that has arrived already. Once the model has it down it is held by
    currents that push it down even from where the magnets just carry it.
    """
    landing.astray = False
    arrived = position[0] > landing.floor - _SURELY_DOWN and rate[0] >= 0.0
    if arrived or landing.held > 0.0:
        landing.held += landing.period
        place[0] = landing.balance
    wanted[0] = (_HOLD if landing.held > 0.0 else _PUSH) - disturbance[0]


class Landing:
    """One landing after another: :meth:`begin`, then :meth:`step` once a sample until done."""

    def __init__(self, parameters: BridgeParameters) -> None:
        landing, machine, fault = parameters.landing, parameters.machine, parameters.fault
        self._lower = np.maximum(np.array(machine.lower_limit), np.array(fault.lower))
        self._upper = np.minimum(np.array(machine.upper_limit), np.array(fault.upper))
        self._parameters = landing
        self._floor = machine.gap_max
        self.arrays = LandingArrays(
            machine=machine_constants(machine),
            current_limit=landing.current,
            along_z=0.5,
            stiffness=landing.stiffness,
            damping=landing.damping,
            settle_time=landing.settle_time,
            floor=machine.gap_max,
            aim=machine.gap_max + landing.depth,
            stray=landing.stray,
            balance=_balance(parameters),
            period=parameters.sample_time,
        )

    @property
    def astray(self) -> bool:
        """Whether the platen has left the way down, pulled by what was not commanded."""
        return self.arrays.astray

    @property
    def direct_current(self) -> FloatArray:
        """i_d of motors 1..4 [A], shape (4,), that the last step computed."""
        return self.arrays.direct

    @property
    def quadrature_current(self) -> FloatArray:
        """i_q of motors 1..4 [A], shape (4,), likewise."""
        return self.arrays.quadrature

    def begin(self, position: FloatArray, rate: FloatArray, blind: Flags = SEEING) -> None:
        """Start where the platen is: (5,) [m, rad] and per second; ``blind`` (5,): seen by nothing.

        Where the model alone tells of an axis it is over sooner, soonest where that is x or z:
        motors push off what they do not see, the more the farther it is. For that, currents end on
        the stop itself, but for a theta that is not known either: it may be on an edge.

        A motor whose displacement is not known pushes along it unless its i_d is small or negative,
        and the magnets undo the springs of a tilt that is not known the less its motors pull: that
        decides which pair carries.
        """
        way, landing = self.arrays, self._parameters
        adrift = bool(blind[X] or blind[Z])
        rate = np.where(_ACROSS & (np.abs(rate) < _REST), 0.0, rate)
        way.descent_start, way.descent_time = landing.braking_time, landing.descent_time
        if np.any(blind):
            way.descent_start = landing.blind_braking_time
            way.descent_time = landing.blind_descent_time
        if adrift:
            way.descent_time = landing.adrift_descent_time
        way.end = self._floor - _SEATED if adrift and not blind[THETA] else math.inf
        way.along_z = 0.5 + 0.5 * float(np.clip(_CARRY @ blind, -1.0, 1.0))
        way.braking[:] = braking_times(position, rate, self._lower, self._upper, way.descent_start)
        if rate[0] < 0.0:  # towards the motors, where a tilt still takes room
            way.braking[0] = min(way.braking[0], _BRAKING_UPWARD)
        way.level[:] = np.clip(position + 0.5 * way.braking * rate, self._lower, self._upper)
        way.level[3:] = 0.0
        way.offset[:] = position - way.level
        way.speed[:] = rate
        way.elapsed, way.astray, way.held = 0.0, False, 0.0
        way.unseen = bool(blind[0])

    def step(self, position: FloatArray, rate: FloatArray, disturbance: FloatArray) -> bool:
        """Compute the currents of the next sample; true when the landing is over."""
        return land(self.arrays.block, position, rate, disturbance)


def _balance(parameters: BridgeParameters) -> float:
    """Air gap at which the magnets just carry the platen [m]; a stop where there is none."""
    machine = machine_constants(parameters.machine)
    low, high = parameters.machine.gap_min, parameters.machine.gap_max
    zero = np.zeros(4)
    while high - low > 1e-6:
        middle = 0.5 * (low + high)
        if output_accelerations(machine, middle, 0.0, 0.0, zero, zero)[0] < 0.0:
            low = middle
        else:
            high = middle
    return low


@compiled
def _fall(
    machine: Machine, pull: float, y: float, speed: float, upper_stop: float, lower_stop: float
) -> tuple[float, float]:
    zero = np.zeros(4)
    time = 0.0
    while upper_stop < y < lower_stop and time < _LONGEST_FALL:
        middle = y + 0.5 * _FREE_STEP * speed
        acceleration = output_accelerations(machine, middle, 0.0, 0.0, zero, zero)[0]
        speed += _FREE_STEP * (machine.G + pull * (acceleration - machine.G))
        y += _FREE_STEP * speed
        time += _FREE_STEP
    return y, speed


def impact_of_cut(
    parameters: BridgeParameters, y: float, speed: float, pull: float = 1.0
) -> tuple[float, str]:
    """Speed [m/s] at which the platen strikes a stop when currents are cut, and which stop.

    From the air gap ``y`` [m] and its rate [m/s], level, without guide friction; ``pull``: how much
    stronger per weight the magnets are than believed.
    """
    machine = parameters.machine
    stops = machine.gap_min, machine.gap_max
    end, speed = _fall(
        machine_constants(machine), pull, min(max(y, stops[0]), stops[1]), speed, *stops
    )
    return abs(speed), 'upper' if end <= machine.gap_min else 'lower'


def impact_of_push(parameters: BridgeParameters, y: float, speed: float) -> float:
    """Speed [m/s] at which a platen that is pushed down strikes its lower stop; arguments as above.

    That is what the push would give the model; of one that is not known to be anywhere the most.
    """
    machine = parameters.machine
    height = machine.gap_max - (max(y, machine.gap_min) if math.isfinite(y) else machine.gap_min)
    begun = speed if math.isfinite(speed) else 0.0
    return math.sqrt(begun**2 + 2.0 * _PUSH * max(height, 0.0))


def _fastest(parameters: BridgeParameters) -> float:
    """Speed that no free fall between the stops reaches [m/s]: nowhere is the pull harder."""
    machine, zero = parameters.machine, np.zeros(4)
    constants = machine_constants(machine)
    pull, *_ = output_accelerations(constants, machine.gap_min, 0.0, 0.0, zero, zero)
    room = machine.gap_max - machine.gap_min
    return math.sqrt(2.0 * room * max(abs(pull), machine.gravity))


def impacts_of_cut(parameters: BridgeParameters, y: float, speed: float) -> dict[str, float]:
    """Speed [m/s] by each stop that a cut may end at, the harder first; arguments as above.

    Near the balance either may be: the estimate is off by what encoders and observer are, and as
    old as the watchdog allows, and the magnets by up to 10 %. A speed that no platen has says
    nothing.
    """
    if not (math.isfinite(speed) and abs(speed) < _fastest(parameters)):
        speed, doubt = 0.0, _SPEED_UNKNOWN
    else:
        doubt = _SPEED_DOUBT + _SHARE_IN_DOUBT * abs(speed)
    if not math.isfinite(y):
        y = 0.5 * (parameters.machine.gap_min + parameters.machine.gap_max)
    away = _PLACE_DOUBT + (abs(speed) + doubt) * parameters.boards.watchdog
    falls = [
        impact_of_cut(
            parameters, y + side * away, speed + side * doubt, 1.0 - side * _SHARE_IN_DOUBT
        )
        for side in (-1.0, 1.0)
    ]
    likely, stop = impact_of_cut(parameters, y, speed)
    found = {stop: speed for speed, stop in falls} | {stop: likely}
    return dict(sorted(found.items(), key=lambda one: -one[1]))


def push_is_softer(parameters: BridgeParameters, y: float, speed: float) -> bool:
    """Whether a platen that nobody sees is to be pushed down; a cut may strike harder then."""
    hardest = max(impacts_of_cut(parameters, y, speed).values())
    return impact_of_push(parameters, y, speed) < hardest
