"""Where the platen is and how it moves, by the force balance and the encoders that are believed.

An observer of position, rate and disturbance in all five outputs. It knows the phase currents that
were put out, so (1)-(7) foretell every encoder's next reading; what the machine differs in, within
some 10 %, and what the guides rub are its disturbance. An output that no believed encoder shows is
carried on by the model alone.
"""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.axes import PHI, THETA, FloatArray, X, Y, Z
from maglev_model.commutation import direct_quadrature_currents
from maglev_model.compiled import borrowing, compiled
from maglev_model.compiled.records import Record
from maglev_model.machine import machine_constants
from maglev_model.machine_array import MachineArray, machine_from_array
from maglev_model.platen import gaps_from_outputs, output_accelerations, outputs_from_gaps

Flags = NDArray[np.bool_]

SUPPORT = 2e-4
"""This near a stop it may carry the platen [m]."""

_SUPPORTED = 1.5  # what the weight and its support may then differ in from the model's [m/s²]
_LIFTED = 0.5  # as many times the friction where homing has found out what lifts it
_TILT_SUPPORT = 1e-4  # the same of the tilts [rad]


class ObserverArrays(Record):
    """Axes y, x, z, phi, theta; lengths are gaps 1..4, x, z [m]; phases a, b, c of motors 1..4."""

    machine: MachineArray
    period: float  # [s]
    wave: float  # electrical angle per displacement, pi / tau [rad/m]
    angle: Annotated[FloatArray, 4]  # of motors 1..4 at displacement 0 [rad]
    count: Annotated[FloatArray, 6]  # [m]
    gain: Annotated[FloatArray, 3]  # of position, rate [1/s], disturbance [1/s²]
    lower: Annotated[FloatArray, 5]  # stops [m, rad]
    upper: Annotated[FloatArray, 5]
    friction: Annotated[FloatArray, 5]  # what may hold the platen against the model [m/s², rad/s²]

    rises_at: float  # by the model, off the lower stop; not a number: not known [m/s²]
    rested: bool  # where that is known, and has not left the stop since
    position: Annotated[FloatArray, 5]  # [m, rad]
    rate: Annotated[FloatArray, 5]
    disturbance: Annotated[FloatArray, 5]  # acceleration that the model does not explain
    acceleration: Annotated[FloatArray, 5]  # since the last sample
    length: Annotated[FloatArray, 6]  # what the encoders should read [m]
    step: Annotated[FloatArray, 6]  # by how much that changed in the last sample [m]
    # By the model alone since the last count that told of an axis:
    model_rate: Annotated[FloatArray, 5]
    still_time: Annotated[FloatArray, 5]  # [s]
    disturbance_then: Annotated[FloatArray, 5]
    least_rate: Annotated[FloatArray, 5]  # what friction leaves of model_rate


def observer_fields(parameters: BridgeParameters) -> dict[str, Any]:
    """The constants of :class:`ObserverArrays`."""
    machine, commutation = parameters.machine, parameters.commutation
    period = parameters.sample_time
    pole = math.exp(-parameters.fault.bandwidth * period)
    return {
        'machine': machine_constants(machine),
        'period': period,
        'wave': math.pi / machine.pole_pitch,
        'angle': commutation.offset,
        'count': parameters.encoder.resolution,
        'gain': (
            1.0 - pole**3,
            1.5 * (1.0 - pole) ** 2 * (1.0 + pole) / period,
            (1.0 - pole) ** 3 / period**2,
        ),
        'lower': machine.lower_limit,
        'upper': machine.upper_limit,
        'friction': parameters.fault.friction,
        'rises_at': math.nan,
    }


@borrowing
def _foretell(o: ObserverArrays) -> None:
    """What the encoders should read where the platen is."""
    gaps_from_outputs(machine_from_array(o.machine), o.position, o.length[:4])
    o.length[4], o.length[5] = o.position[X], o.position[Z]


@borrowing
def _single(o: ObserverArrays) -> bool:
    """Whether the machine has one motor, and moves in y and x alone."""
    return bool(machine_from_array(o.machine).motors == 1.0)


@borrowing
def start(o: ObserverArrays, length: FloatArray) -> None:
    """Begin at rest where the encoders (6,) [m] say."""
    machine = machine_from_array(o.machine)
    outputs_from_gaps(machine, length[:4], length[4], length[5], o.position)
    if _single(o):
        o.position[PHI] = o.position[THETA] = 0.0
    for axis in range(5):
        o.rate[axis] = o.disturbance[axis] = 0.0
        o.model_rate[axis] = o.least_rate[axis] = 0.0
        o.disturbance_then[axis] = o.still_time[axis] = 0.0
    o.rested = False
    if near_lower_stop(o):
        rest(o)
    _foretell(o)


@borrowing
def near_lower_stop(o: ObserverArrays) -> bool:
    """Whether the lower stop may carry the platen."""
    return bool(o.upper[Y] - o.position[Y] < SUPPORT)


@borrowing
def rest(o: ObserverArrays) -> None:
    """What the platen rises at, if homing has found out, is what the model is off by there."""
    o.rested = not math.isnan(o.rises_at)
    if o.rested:
        o.disturbance[Y] = o.disturbance_then[Y] = -o.rises_at


@compiled
def _push(o: ObserverArrays, current: FloatArray) -> tuple[float, float, float, float, float]:
    """Accelerations that phase currents (12,) [A] make where the platen is, (1)-(7)."""
    i_d, i_q = np.empty(4), np.empty(4)
    for motor in range(4):
        k = 3 * motor
        angle = o.angle[motor] + o.wave * o.position[Z if motor % 2 == 0 else X]
        i_d[motor], i_q[motor] = direct_quadrature_currents(
            current[k], current[k + 1], current[k + 2], angle
        )
    machine = machine_from_array(o.machine)
    return output_accelerations(
        machine, o.position[Y], o.position[PHI], o.position[THETA], i_d, i_q
    )


@borrowing
def supported(o: ObserverArrays, axis: int) -> bool:
    """Whether a stop may hold an axis."""
    near = SUPPORT if axis < 3 else _TILT_SUPPORT
    room = min(o.upper[axis] - o.position[axis], o.position[axis] - o.lower[axis])
    return bool(room < near)


@borrowing
def _stopped(o: ObserverArrays, axis: int) -> bool:
    """Whether the model would carry an axis into a stop that it is at."""
    end = o.upper[axis] if o.model_rate[axis] > 0.0 else o.lower[axis]
    return bool(abs(end - o.position[axis]) < SUPPORT)


@compiled
def predict(o: ObserverArrays, current: FloatArray) -> None:
    """Carry on over one sample in which phase currents (12,) [A] flowed."""
    push = _push(o, current)
    seated = supported(o, Y)
    o.rested = o.rested and seated
    _foretell(o)
    before = o.length.copy()
    for axis in range(5):
        held = turning = o.friction[axis]  # what is off may have been friction, which can turn
        if axis == Y and o.rested:
            held, turning = _LIFTED * held, 0.0
        elif axis == Y and seated:
            held += _SUPPORTED
        elif supported(o, axis) or (seated and axis >= PHI):
            held = math.inf
        _carry(o, axis, push[axis], held, turning)
    _foretell(o)
    for i in range(6):
        o.step[i] = o.length[i] - before[i]


@borrowing
def _carry(o: ObserverArrays, axis: int, push: float, held: float, turning: float) -> None:
    period = o.period
    acceleration = push + o.disturbance[axis]
    o.acceleration[axis] = acceleration
    position = o.position[axis] + period * (o.rate[axis] + 0.5 * period * acceleration)
    o.rate[axis] += period * acceleration
    o.position[axis] = min(max(position, o.lower[axis]), o.upper[axis])
    if o.position[axis] != position:
        o.rate[axis] = 0.0
    o.model_rate[axis] += period * (push + o.disturbance_then[axis])
    o.still_time[axis] += period
    along = math.copysign(1.0, o.model_rate[axis]) * o.disturbance_then[axis]
    held += min(max(along, 0.0), turning)
    left = abs(o.model_rate[axis]) - held * o.still_time[axis]
    if left > 0.0 and not _stopped(o, axis):
        o.least_rate[axis] = math.copysign(left, o.model_rate[axis])
    else:
        o.least_rate[axis] = o.model_rate[axis] = o.still_time[axis] = 0.0


@compiled
def correct(o: ObserverArrays, length: FloatArray, used: Flags, counted: Flags) -> None:
    """Take in what the encoders read: ``length`` (6,) [m], of which ``used`` (6,) are believed.

    ``counted`` (6,): which of them changed.
    """
    innovation = np.zeros(6)
    for i in range(6):
        if used[i]:
            innovation[i] = _told(length[i] - o.length[i], o.count[i], counted[i])
    _correct_vertical(o, innovation, used)
    for axis in (X, Z):
        if used[3 + axis]:
            _amend(o, axis, innovation[3 + axis])
        else:
            _coast(o, axis)
    along_z, along_x = counted[0] or counted[2], counted[1] or counted[3]
    told = (along_z or along_x, counted[4], counted[5], along_z, along_x)
    for axis in range(5):
        if told[axis]:
            restart_model(o, axis)


@borrowing
def restart_model(o: ObserverArrays, axis: int) -> None:
    """Let the model alone carry on from what is known of an axis now."""
    o.model_rate[axis], o.still_time[axis] = o.rate[axis], 0.0
    o.disturbance_then[axis], o.least_rate[axis] = o.disturbance[axis], 0.0


@borrowing
def _correct_vertical(o: ObserverArrays, innovation: FloatArray, used: Flags) -> None:
    """Correct y and the tilts by the gaps.

    Two gaps of one pair tell y and their tilt; with less, phi, which its spring keeps near zero, is
    left to the model first. Of a machine with a single motor guides keep the tilts.
    """
    r = machine_from_array(o.machine).r
    along_z, along_x = int(used[0]) + int(used[2]), int(used[1]) + int(used[3])
    mean_z, mean_x = innovation[0] + innovation[2], innovation[1] + innovation[3]
    if along_z == 2 and along_x == 2:
        y = 0.25 * (mean_z + mean_x)
    elif along_z == 2 or (along_z == 1 and along_x != 2):
        y = mean_z / along_z
    else:
        y = mean_x / max(along_x, 1)
    tilt_z, tilt_x = innovation[2] - innovation[0], innovation[1] - innovation[3]
    if along_z == 1:
        tilt_z += y if used[0] else -y
    if along_x == 1:
        tilt_x += -y if used[1] else y
    _amend(o, Y, y)
    if _single(o):
        return
    if along_z == 2 or (along_z == 1 and along_x == 2):
        _amend(o, PHI, tilt_z / (along_z * r))
    if along_x == 2 or (along_x == 1 and along_z > 0):
        _amend(o, THETA, tilt_x / (along_x * r))


@borrowing
def _told(innovation: float, count: float, counted: bool) -> float:
    """What an encoder tells: one that stands still, only that its count has not changed."""
    if counted:
        return innovation
    return math.copysign(max(abs(innovation) - count, 0.0), innovation)


@borrowing
def _amend(o: ObserverArrays, axis: int, error: float) -> None:
    o.position[axis] += o.gain[0] * error
    o.rate[axis] += o.gain[1] * error
    if axis in (X, Z) or not supported(o, Y):
        o.disturbance[axis] += o.gain[2] * error


@borrowing
def _coast(o: ObserverArrays, axis: int) -> None:
    """Let friction hold an axis that nothing shows once it has come to rest."""
    before = o.rate[axis] - o.period * o.acceleration[axis]
    if before * o.rate[axis] <= 0.0 and abs(o.acceleration[axis]) < o.friction[axis]:
        o.rate[axis] = o.disturbance[axis] = 0.0


@borrowing
def alone(o: ObserverArrays, axis: int) -> None:
    """Take an axis to have moved since its last count as the model alone says."""
    o.rate[axis], o.disturbance[axis] = o.model_rate[axis], o.disturbance_then[axis]


@borrowing
def take_at_its_word(o: ObserverArrays, axis: int, position: float) -> None:
    """Begin anew, at rest, with an axis that was thought to move: its encoder counts after all.

    What friction held was taken for a disturbance, and the way that the model went alone since
    would be taken for a much larger one.
    """
    o.position[axis] = o.length[3 + axis] = position
    o.rate[axis] = 0.0
    o.disturbance[axis] = o.disturbance_then[axis]
    bound_disturbance(o, axis)


@borrowing
def bound_disturbance(o: ObserverArrays, axis: int) -> None:
    """Of an axis that nothing may show any more only friction is believed, of a tilt nothing."""
    bound = o.friction[axis] if axis < PHI else 0.0
    o.disturbance[axis] = min(max(o.disturbance[axis], -bound), bound)
