"""Each phase alone: whether wiring and electrical angles are as the parameters say."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from maglev_hw_bridge.commissioning.angles import TOLERANCE, Angles, PhaseResponses
from maglev_hw_bridge.commissioning.diagnosis import diagnose
from maglev_hw_bridge.commissioning.operators import Act, Operator
from maglev_hw_bridge.commissioning.proof import WrongError
from maglev_hw_bridge.commissioning.response import Twins, friction_variants
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.signal_parameters import ENCODER_NAMES, PHASE_NAMES, PHASES
from maglev_model.axes import FloatArray

_PLACES = (Act.MIDDLE, Act.BESIDE, Act.BETWEEN)


def prove_phases(
    parameters: BridgeParameters,
    peak: float,
    operator: Operator,
    read: Callable[[], FloatArray],
    pulse: Callable[[int], FloatArray],
    tell: Callable[[str], None],
) -> None:
    """Compare what each phase moves with what it should, on a platen that rests near the middle.

    ``read`` gives the lengths (6,) [m], ``pulse`` what a phase moves with up to ``peak`` [A] one
    way and the other, (2, 6) [m]. Where two explanations look alike the operator moves the platen
    on, for elsewhere they do not. Raises WrongError, and what ``pulse`` raises.
    """
    twins = Twins(friction_variants(parameters), peak)
    looks = []
    for act in _PLACES:
        operator.act(act)
        _near_the_middle(parameters, read()[4:])
        looks.append([_look(phase, twins, read, pulse, tell) for phase in range(PHASES)])
        seen = np.transpose([[one.seen for one in look] for look in looks], (1, 2, 0, 3))
        foretold = np.transpose([[one.foretold for one in look] for look in looks], (2, 1, 3, 0, 4))
        places = np.transpose([[one.place for one in look] for look in looks], (1, 0, 2))
        responses = PhaseResponses(parameters, peak, seen, places)
        finding = diagnose(seen, foretold)
        if finding.explanations != 1 and (angles := responses.anywhere()).explain:
            _refuse_angles(parameters, angles)
        if finding.explanations != 2:
            break
        tell(f'  {finding.text}')
    if not finding.fine:
        raise WrongError(finding.text)
    tell(f'  {finding.text}')
    _refuse_angles(parameters, responses.near(foretold))
    tell(f'  electrical angles are as believed within {TOLERANCE:g} rad')


class _Look(NamedTuple):
    """What one phase moved at one place, and what it should have."""

    place: FloatArray  # x, z (2,) [m]
    seen: FloatArray  # (2, 6) [m]
    foretold: FloatArray  # by each twin (n, 2, 6) [m]


def _look(
    phase: int,
    twins: Twins,
    read: Callable[[], FloatArray],
    pulse: Callable[[int], FloatArray],
    tell: Callable[[str], None],
) -> _Look:
    place = read()[4:]
    foretold = twins.phase(phase, place)
    seen = pulse(phase)
    tell(f'  {PHASE_NAMES[phase]}: {_in_words(seen)}')
    return _Look(place, seen, foretold)


def _near_the_middle(parameters: BridgeParameters, place: FloatArray) -> None:
    machine = parameters.machine
    if np.max(np.abs(place)) > 0.5 * min(machine.x_max, machine.z_max):
        raise WrongError(
            f'the encoders have the platen at x = {place[0] * 1e3:.1f} mm, z = '
            f'{place[1] * 1e3:.1f} mm, too far from the middle: move it, or check encoder '
            'x and z (resolution, direction, cable)'
        )


def _refuse_angles(parameters: BridgeParameters, angles: Angles) -> None:
    """Raises WrongError where one is further off than it may seem."""
    believed = parameters.commutation.offset
    texts = [
        f"motor {motor + 1}'s electrical angle seems off by {off:+.2f} rad: "
        f'{math.remainder(believed[motor] + off, 2.0 * math.pi):.2f} for element {motor} of '
        f'commutation.offset ({believed[motor]:g}) would suit'
        for motor, off in enumerate(angles.off)
        if abs(off) > TOLERANCE
    ]
    if texts:
        raise WrongError('; '.join(texts))


def _in_words(response: FloatArray) -> str:
    """What one phase's pulses moved."""
    texts = []
    for sign, moved in zip('+-', response, strict=True):
        parts = [
            f'{name} {move * 1e6:+.0f} um'
            for name, move in zip(ENCODER_NAMES, moved, strict=True)
            if abs(move) > 3e-5
        ]
        texts.append(f'{sign}: {", ".join(parts) or "nothing moves"}')
    return '; '.join(texts)
