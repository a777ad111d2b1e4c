"""What bridge and controller believe, and machines that differ from it, drawn by number."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.axes import AXES
from maglev_model.parameters import ParameterError, from_yaml, replace
from maglev_plant.parameters import OffsetParameters
from maglev_study.faults.programme import ROOM

STOP_INPUT = 0
ENABLE_OUTPUT = 1
NOMINAL = 0
"""The number of the machine that is what it is believed to be."""

_MODEL_ERROR = 0.1  # of every constant
_FRICTION = (0.2, 2.0)  # of the default
_MOST_OFFSET = 0.05  # of an amplifier, known to the bridge [V]
_MOST_NOISE = 2e-6  # of an encoder, before it counts [m]

_SQUARE_ERROR = 0.1  # of K_v2's own error

_STREAM = 7919  # keeps these draws apart from all others that have the same number

_COMMON: dict[str, object] = {
    'driver': 'emulated',
    'boards.memory': '',
    'boards.identifier': ('0', '1'),
    'homing.x': 0.0,
    'homing.z': 0.0,
    'boards.stop_input': STOP_INPUT,
    'boards.enable_output': ENABLE_OUTPUT,
}


class Believed(NamedTuple):
    """What the bridge and the controller take their machine for."""

    bridge: BridgeParameters
    controller: ControllerParameters


def believed(*files: Path) -> Believed:
    """From parameter files, the later winning; each may have sections of both nodes, and ``/**``.

    Currents answer the sample before, as in real time. Raises ParameterError for what is wrong in
    the files, and for a machine that cannot fly the programme.
    """
    bridge = from_yaml(BridgeParameters, 'hw_bridge', *files)
    controller = from_yaml(ControllerParameters, 'controller', *files)
    _check_room(bridge)
    if bridge.sample_time != controller.sample_time:
        raise ParameterError(
            f"parameter 'sample_time' of the bridge is {bridge.sample_time:g} s, the controller's"
            f' is {controller.sample_time:g} s: they must be the same'
        )
    late = {'input_delay': max(controller.input_delay, 1)}
    return Believed(bridge, replace(controller, late))


def _check_room(bridge: BridgeParameters) -> None:
    *gaps, x, z = bridge.encoder.resolution
    if len(set(gaps)) > 1 or x != z:
        raise ParameterError(
            "parameter 'encoder.resolution': the emulated machine has one of all gaps, and one of"
            ' x and z'
        )
    for name, (lower, upper) in ROOM.items():
        value = getattr(bridge.machine, name)
        if not lower <= value <= upper:
            raise ParameterError(
                f"parameter 'machine.{name}' is {value:g}: for the programme that is flown it must"
                f' lie in [{lower:g}, {upper:g}]'
            )
    for axis, locked in zip(AXES, bridge.emulation.guide.locked, strict=True):
        if locked and axis != 'phi':
            raise ParameterError(
                f"parameter 'emulation.guide.locked' locks {axis}, which the programme that is"
                ' flown moves'
            )


PLAIN = believed()
"""The default parameters of both."""


def machine(number: int, believed: Believed = PLAIN) -> BridgeParameters:
    """Parameters of the bridge, with those of the machine behind its boards, by number."""
    bridge = believed.bridge
    common = {**_COMMON, **_wired(bridge)}
    if number == NOMINAL:
        return replace(bridge, common)
    rng = np.random.default_rng([_STREAM, number])
    wrong = {
        name: float(1.0 + rng.uniform(-_MODEL_ERROR, _MODEL_ERROR))
        for name in OffsetParameters.__dataclass_fields__
    }
    wrong['K_v2'] = _coupling(wrong)
    coulomb = np.array(bridge.emulation.guide.coulomb) * rng.uniform(*_FRICTION, 5)
    offset = rng.uniform(-_MOST_OFFSET, _MOST_OFFSET, 12).tolist()
    return replace(
        bridge,
        {
            **common,
            **{f'emulation.offset.{name}': share for name, share in wrong.items()},
            'emulation.seed': number,
            'emulation.guide.coulomb': coulomb.tolist(),
            'emulation.encoder.gap_noise': float(rng.uniform(0.0, _MOST_NOISE)),
            'emulation.encoder.horizontal_noise': float(rng.uniform(0.0, _MOST_NOISE)),
            'emulation.wiring.encoder_start': rng.integers(-(10**5), 10**5, 6).tolist(),
            'emulation.wiring.offset': offset,
            'amplifier.offset': offset,
        },
    )


def _wired(bridge: BridgeParameters) -> dict[str, object]:
    """The machine behind the boards, wired as the bridge has it: it has been commissioned."""
    amplifier, encoder = bridge.amplifier, bridge.encoder
    wiring = {
        'phase_board': amplifier.board,
        'phase_channel': amplifier.channel,
        'phase_sign': amplifier.sign,
        'gain': amplifier.gain,
        'offset': amplifier.offset,
        'angle': bridge.commutation.offset,
        'encoder_board': encoder.board,
        'encoder_channel': encoder.channel,
        'encoder_direction': encoder.direction,
    }
    return {
        **{f'emulation.wiring.{name}': value for name, value in wiring.items()},
        'emulation.encoder.gap_resolution': encoder.resolution[0],
        'emulation.encoder.horizontal_resolution': encoder.resolution[4],
    }


def _coupling(wrong: dict[str, float]) -> float:
    """K_v2's share of the nominal one, that goes with those of K_v1 and K_v3.

    Attraction goes with the square of the field in the gap, so K_v2² is 4 K_v1 K_v3 but for what
    leaks. Were all three off by themselves, one machine in six could not get rid of half its weight
    at the smallest gap, and one in fifty not be held there by any current.
    """
    square = math.sqrt(wrong['K_v1'] * wrong['K_v3'])
    return square * (1.0 - _SQUARE_ERROR * abs(wrong['K_v2'] - 1.0))
