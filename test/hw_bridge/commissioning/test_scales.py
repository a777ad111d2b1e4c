"""What a count is worth is seen when the platen is moved by hand."""

from __future__ import annotations

import numpy as np
import pytest

from maglev_hw_bridge.commissioning.operators import EmulatedPerson
from maglev_hw_bridge.commissioning.proof import WrongError
from maglev_hw_bridge.commissioning.scales import prove_scales
from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.encoders import Encoders
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import build

COUNT = 1e-5
NAMES = ('gap 1', 'gap 2', 'gap 3', 'gap 4', 'x', 'z')


def prove(*, across: bool = False, **given: object) -> EmulatedBoards:
    """A machine with counts of 10 µm, homed in the middle, and what is said of it.

    ``across``: whether x is to see what z should, and the other way round.
    """
    claimed = {'homing.x': 0.0, 'homing.z': 0.0}
    claimed |= {name.replace('__', '.'): value for name, value in given.items()}
    parameters = build(BridgeParameters, claimed)
    boards = EmulatedBoards(parameters)
    driver = QuanserDriver(parameters, boards, boards.now, boards.sleep)
    encoders, counts = Encoders(parameters), np.zeros((2, 6), dtype=np.int32)

    def read() -> np.ndarray:
        driver.counts(counts[0])
        return encoders.decode(counts[0]).copy()

    driver.open()
    driver.counts(counts[0])
    encoders.start(counts[0])
    encoders.home(counts[[0, 0]])
    assert prove_scales(parameters, EmulatedPerson(boards, lambda _step: None), read) == across
    driver.close()
    return boards


def but(index: int, value: float) -> list[float]:
    """The resolution of each encoder, but of one another."""
    return [value if i == index else COUNT for i in range(6)]


def test_what_is_right_passes_and_rests_on_its_stop() -> None:
    assert prove().rig.state[0] == 0.031


@pytest.mark.parametrize('encoder', range(6))
@pytest.mark.parametrize('factor', [0.1, 0.5, 0.8, 1.2, 2.0, 10.0])
def test_a_wrong_resolution_is_told_of_each_encoder(encoder: int, factor: float) -> None:
    wrong = rf'encoder {NAMES[encoder]} saw .* element {encoder} of encoder\.resolution'
    with pytest.raises(WrongError, match=wrong):
        prove(encoder__resolution=but(encoder, factor * COUNT))


@pytest.mark.parametrize('encoder', range(6))
@pytest.mark.parametrize('factor', [0.9, 1.1])
def test_shims_and_guides_need_not_be_exact(encoder: int, factor: float) -> None:
    prove(encoder__resolution=but(encoder, factor * COUNT))


@pytest.mark.parametrize('pair', [(0, 3), (1, 4), (4, 5)])
def test_exchanged_encoders_are_left_to_the_phases(pair: tuple[int, int]) -> None:
    channel = list(range(6))
    channel[pair[0]], channel[pair[1]] = channel[pair[1]], channel[pair[0]]
    prove(encoder__channel=channel, across=pair == (4, 5))


@pytest.mark.parametrize('encoder', range(6))
def test_so_is_an_encoder_that_counts_the_other_way(encoder: int) -> None:
    prove(encoder__direction=[-1 if i == encoder else 1 for i in range(6)])


@pytest.mark.parametrize('axis', ['x', 'z'])
def test_a_platen_that_was_not_where_it_was_homed_is_told(axis: str) -> None:
    index = NAMES.index(axis)
    wrong = rf'{axis} reads -50\.0 mm in the middle.*homing\.{axis}, .* element {index} of'
    with pytest.raises(WrongError, match=wrong):
        prove(**{f'homing__{axis}': -0.05})
    prove(**{f'homing__{axis}': 0.004})
