"""Wiring and electrical angles of any machine, wherever it stands, told by its phases alone."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import pytest

from maglev_hw_bridge.amplifiers import Amplifiers
from maglev_hw_bridge.commissioning.angles import TOLERANCE
from maglev_hw_bridge.commissioning.operators import Act, EmulatedPerson
from maglev_hw_bridge.commissioning.phases import prove_phases
from maglev_hw_bridge.commissioning.proof import WrongError
from maglev_hw_bridge.commissioning.response import Pulses
from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.encoders import Encoders
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import build

PEAK = 1.5
OTHER_MACHINE = {
    'emulation.guide.coulomb': [0.4, 0.22, 0.12, 1.6, 1.1],
    'emulation.offset.K_h': 0.95,
    'emulation.offset.K_v1': 1.05,
}


class Beside(EmulatedPerson):
    """Whose middle of the guides is not quite there [m]."""

    def __init__(self, boards: EmulatedBoards, x: float, z: float) -> None:
        super().__init__(boards, lambda _step: None)
        self._aside = np.array([0.0, x, z, 0.0, 0.0])

    def act(self, what: Act) -> None:
        super().act(what)
        self._boards.place(self._boards.rig.state[::2] + self._aside)


def prove(
    angles: list[float],
    believed: list[float],
    aside: tuple[float, float] = (0.0, 0.0),
    own: Mapping[str, object] = MappingProxyType({}),
    **given: object,
) -> list[str]:
    """What is told of a machine with such electrical angles; its phases are pulsed.

    ``own``: of the machine alone, which the parameters do not tell.
    """
    claimed = {name.replace('__', '.'): value for name, value in given.items()}
    claimed |= {'homing.x': 0.0, 'homing.z': 0.0, 'commutation.offset': believed}
    true = {**claimed, **OTHER_MACHINE, **own, 'emulation.wiring.angle': angles}
    parameters, boards = (
        build(BridgeParameters, claimed),
        EmulatedBoards(build(BridgeParameters, true)),
    )
    driver = QuanserDriver(parameters, boards, boards.now, boards.sleep)
    encoders, amplifiers = Encoders(parameters), Amplifiers(parameters)
    counts = np.zeros((2, 6), dtype=np.int32)
    told: list[str] = []

    def read() -> np.ndarray:
        driver.counts(counts[0])
        return encoders.decode(counts[0]).copy()

    boards.place(np.array([0.031, 0.0, 0.0, 0.0, 0.0]))
    driver.open()
    driver.counts(counts[0])
    encoders.start(counts[0])
    encoders.home(counts[[0, 0]])
    pulses = Pulses(parameters, driver, encoders, amplifiers, PEAK)
    try:
        prove_phases(parameters, PEAK, Beside(boards, *aside), read, pulses.phase, told.append)
    finally:
        driver.close()
    return told


WELL = '  every phase and every encoder is as the parameters say'
SUIT = re.compile(r'(-?[\d.]+) for element (\d) of commutation\.offset')
ANYWHERE = [0.07, 2.83, -2.24, 1.82]


def test_a_right_machine_passes_in_the_middle() -> None:
    *pulsed, well, angles = prove([0.0] * 4, [0.0] * 4)
    assert len(pulsed) == 12
    assert well == WELL
    assert angles == '  electrical angles are as believed within 0.2 rad'


@pytest.mark.parametrize('aside', [(0.003, 0.003), (-0.009, -0.009)])
def test_where_two_explanations_look_alike_the_platen_is_moved(aside: tuple[float, float]) -> None:
    told = prove([0.0] * 4, [0.0] * 4, aside)
    assert told[12].startswith('  either: all is well; or: motor ')
    assert len(told) > 25
    assert WELL in told


def test_a_right_machine_passes_whatever_its_angles_are() -> None:
    assert WELL in prove(ANYWHERE, ANYWHERE, (0.003, -0.002))


def test_angles_that_nobody_knows_are_told() -> None:
    with pytest.raises(WrongError) as wrong:
        prove(ANYWHERE, [0.0] * 4)
    suiting = [0.0] * 4
    for angle, motor in SUIT.findall(str(wrong.value)):
        suiting[int(motor)] = float(angle)
    off = [math.remainder(a - b, 2.0 * math.pi) for a, b in zip(ANYWHERE, suiting, strict=True)]
    assert max(map(abs, off)) < TOLERANCE
    assert WELL in prove(ANYWHERE, suiting)


@pytest.mark.parametrize('motor', range(4))
@pytest.mark.parametrize('off', [-0.35, 0.35])
def test_the_one_angle_that_is_off_is_told(motor: int, off: float) -> None:
    believed = [off if i == motor else 0.0 for i in range(4)]
    with pytest.raises(WrongError) as wrong:
        prove([0.0] * 4, believed)
    ((angle, element),) = SUIT.findall(str(wrong.value))
    assert int(element) == motor
    assert float(angle) == pytest.approx(0.0, abs=0.15)
    assert f'({off:g}) would suit' in str(wrong.value)


def test_a_tenth_of_a_radian_is_no_matter() -> None:
    assert WELL in prove([0.0] * 4, [0.1, -0.1, 0.1, -0.1])


@pytest.mark.parametrize('index', [1, 8])
def test_a_wrong_sign_is_told_whatever_the_angles_are(index: int) -> None:
    sign = [-1 if i == index else 1 for i in range(12)]
    with pytest.raises(WrongError, match=rf'sign of element {index} of amplifier\.sign'):
        prove(ANYWHERE, ANYWHERE, amplifier__sign=sign)


@pytest.mark.parametrize(('gap', 'horizontal'), [(1e-6, 1e-5), (1e-6, 1e-6), (2e-5, 5e-6)])
def test_a_right_machine_passes_whatever_its_counts_are_worth(
    gap: float, horizontal: float
) -> None:
    encoder = {'gap_resolution': gap, 'horizontal_resolution': horizontal}
    own = {f'emulation.encoder.{name}': value for name, value in encoder.items()}
    resolution = [gap] * 4 + [horizontal] * 2
    assert WELL in prove([0.0] * 4, [0.0] * 4, own=own, encoder__resolution=resolution)


def test_no_angle_is_named_for_what_it_does_not_explain() -> None:
    direction = [1, 1, 1, 1, -1, -1]
    with pytest.raises(WrongError, match='no single error explains this'):
        prove(ANYWHERE, [0.0] * 4, encoder__direction=direction)
