"""Faults in words: what happened and what to do."""

from __future__ import annotations

import numpy as np

from maglev_hw_bridge import amplifiers
from maglev_hw_bridge.amplifiers import Amplifiers
from maglev_hw_bridge.landing import impact_of_push, impacts_of_cut
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing import guard
from maglev_hw_bridge.sensing.guard import Guard
from maglev_hw_bridge.signal_parameters import ENCODER_NAMES, PHASE_NAMES
from maglev_model.axes import AXES, FloatArray
from maglev_model.contract.stage import Fault

_RIGID = 5e-5  # what the gaps of a sound platen contradict each other by at most [m]


def range_fault(code: int, index: int, watched: Guard) -> tuple[str, str]:
    """Reason and remedy of a platen out of its soft range, by the code of ``watch``."""
    if code == guard.RANGE:
        name, value = AXES[index], watched.arrays.position[index]
        unit = 'mm' if index < 3 else 'mrad'
    else:
        name, value, unit = ENCODER_NAMES[index], watched.arrays.past[0, index], 'mm'
    return f'{name} is {value * 1e3:.3f} {unit}, outside its soft range', 'check the reference'


def encoder_fault(code: int, watched: Guard) -> tuple[str, str]:
    """Reason and remedy of encoders that cannot be believed, by the code of ``watch``."""
    if code == guard.RESIDUAL:
        reason = f'the gaps contradict each other by {watched.residual * 1e6:.0f} um'
        return reason, 'check the gap encoders, home again'
    names = ', '.join(ENCODER_NAMES[i] for i in watched.blamed)
    if code == guard.JUMP:
        return f'encoder {names} jumped', 'check its cable, home again'
    remedy = 'check its cable and the phases'
    if set(watched.blamed) >= {0, 1, 2, 3}:
        remedy += '; home again if the platen carries something else now'
    return f'encoder {names} is stuck, or its motors are', remedy


def command_fault(
    code: int, index: int, i_d: FloatArray, i_q: FloatArray, amplifier: Amplifiers
) -> tuple[str, str]:
    """Reason and remedy of what the amplifiers refused, by the code of ``drive``."""
    if code == amplifiers.NOT_FINITE:
        return (
            f'i_d, i_q of motor {index + 1} are {i_d[index]}, {i_q[index]}: they must be finite',
            'see to the controller',
        )
    if code == amplifiers.OVER_LIMIT:
        amplitude = float(np.hypot(i_d[index], i_q[index]))
        return f'motor {index + 1} was commanded {amplitude:.1f} A', 'see to the controller'
    if code == amplifiers.OVER_CURRENT:
        current = float(amplifier.arrays.wanted[index])
        return f'{PHASE_NAMES[index]} was to carry {current:.1f} A', 'see to the controller'
    return (
        f'{PHASE_NAMES[index]} has spent its I2t budget (load {amplifier.load:.2f})',
        'let the amplifiers cool',
    )


def stale_fault(age: float) -> tuple[str, str]:
    """Reason and remedy of a controller that has been silent for so long [s]."""
    return f'no fresh currents for {age * 1e3:.0f} ms', 'start the controller again'


def zero_fault(watched: Guard) -> tuple[str, str]:
    """Reason and remedy of zero currents in flight."""
    height = watched.arrays.position[0]
    return f'zero currents were commanded at y = {height * 1e3:.2f} mm', 'see to the controller'


def overrun_fault(late: float) -> tuple[str, str]:
    """Reason and remedy of a sample that was read so late [s]."""
    return f'a sample was read {late * 1e3:.1f} ms late', 'free the machine of other load'


def consequence_of_cut(parameters: BridgeParameters, watched: Guard) -> str:
    """What to add to the reason of a fault that cuts the currents in flight.

    What turns may rise with its fastest corner, and past the balance where it else would fall.
    """
    y, rate = watched.arrays.position[0], watched.arrays.rate
    turning = parameters.machine.radius * float(np.max(np.abs(rate[3:])))
    impacts = impacts_of_cut(parameters, y, rate[0] - turning)
    impacts |= impacts_of_cut(parameters, y, rate[0])
    hardest = sorted(impacts.items(), key=lambda one: -one[1])
    parts = [f'the {stop} stop at about {speed:.2f} m/s' for stop, speed in hardest]
    return f'; the platen strikes {" or ".join(parts)}'


def consequence_of_push(parameters: BridgeParameters, watched: Guard) -> str:
    """What to add to the reason of a fault for which a platen that nobody sees is pushed down."""
    speed = impact_of_push(parameters, watched.arrays.position[0], watched.arrays.rate[0])
    return f'; pushed down unseen, the platen strikes the lower stop at about {speed:.2f} m/s'


def astray_fault(watched: Guard) -> tuple[str, str]:
    """Reason and remedy of a platen that left its stop while no current was commanded."""
    gap = watched.arrays.length[:4]
    most = int(np.argmin(gap))
    reason = (
        f'the platen left its stop, to {gap[most] * 1e3:.2f} mm at gap {most + 1}, '
        'though no current was commanded'
    )
    if abs(watched.residual) > _RIGID:
        reason += f'; the gaps contradict each other by {watched.residual * 1e6:.0f} um'
    return reason, 'check the amplifiers, one may be stuck on, and the gap encoders'


def askew_fault(watched: Guard) -> tuple[str, str]:
    """Reason and remedy of a platen that tilts where it was to be lifted a little."""
    tilt = 1e3 * np.max(np.abs(watched.arrays.position[3:]))
    reason = f'the platen tilted by {tilt:.2f} mrad in the lift, pulled by what was not commanded'
    return reason, 'check the amplifiers, one may be stuck on, and the gap encoders'


def slide_fault() -> tuple[str, str]:
    """Reason and remedy of a platen that moved along on its stop while no current was commanded."""
    reason = 'the platen slid along on its stop, though no current was commanded'
    return reason, 'check the amplifiers, one may be stuck on; or somebody pushed it'


def motor_fault(axis: int, watched: Guard) -> tuple[str, str]:
    """Reason and remedy of a platen that the motors move otherwise than commanded."""
    unit = 'm/s^2' if axis < 3 else 'rad/s^2'
    amount = watched.arrays.disturbance[axis]
    return (
        f'the currents commanded do not explain {amount:.1f} {unit} of {AXES[axis]}',
        'check motors, amplifiers and the cables between them',
    )


def stray_fault() -> tuple[str, str]:
    """Reason and remedy of a landing that is given up, as the amplifiers do not hold the platen."""
    reason = 'the platen left its way down, pulled by what was not commanded'
    return reason, 'check the amplifiers, one may be stuck on, and the encoders'


def then(first: Fault, second: Fault) -> Fault:
    """A fault with which another one ended: both are said, and an encoder may be homed."""
    return Fault(
        first.kind if first.kind == 'encoder' else second.kind,
        f'{first.reason}; then {second.reason}',
        f'{first.remedy}; {second.remedy}',
        second.cut,
    )


def landing_fault(
    code: int, index: int, i_d: FloatArray, i_q: FloatArray, amplifier: Amplifiers
) -> tuple[str, str]:
    """Reason and remedy of a landing whose own currents were refused, by the code of ``drive``."""
    reason, _ = command_fault(code, index, i_d, i_q, amplifier)
    return f'the landing is given up: {reason}', 'check landing.* and the encoders'


def overlong_fault(parameters: BridgeParameters) -> tuple[str, str]:
    """Reason and remedy of a landing that an emergency stop does not wait for any longer."""
    limit = parameters.boards.stop_time
    reason = f'the platen is not down {limit:g} s after the emergency stop'
    return reason, 'check boards.stop_time and landing.*, and what failed meanwhile'


def lost_counts(parameters: BridgeParameters, watched: Guard) -> str:
    """Why the encoders do not tell any more where the platen is, or nothing."""
    if watched.failed:
        names = ', '.join(ENCODER_NAMES[i] for i in watched.failed)
        return f'encoder {names} lost counts: home again'
    if abs(watched.residual) > parameters.fault.residual:
        return f'g1 + g3 - g2 - g4 is {watched.residual * 1e6:.0f} um: home again'
    return ''
