"""What flies holds no memory for each sample that it has flown."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from bridge_flight import Flight, hover

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_hw_bridge.stage import Mode
from maglev_model.parameters import from_yaml, read_yaml, replace
from maglev_plant.simulation import SimulatedStage
from maglev_study.references import HOVER
from maglev_study.rough_flights import plant_of

PARAMS = Path(__file__).resolve().parents[2] / 'params'
SAMPLES = 1000
MOST = 50.0  # a sample [bytes]: fewer than an array has


class _Mallinfo2(ctypes.Structure):
    """Of malloc.h."""

    _fields_ = (('figures', 10 * ctypes.c_size_t),)


def held() -> int:
    """What malloc has given and not got back [bytes]: ``hblkhd`` and ``uordblks``."""
    library = ctypes.CDLL(None)
    if not hasattr(library, 'mallinfo2'):
        pytest.skip('this C library does not say what it has given')
    library.mallinfo2.restype = _Mallinfo2
    figures = library.mallinfo2().figures
    return int(figures[4] + figures[7])


def grows(one_sample: Callable[[], object]) -> float:
    """Bytes that each sample leaves behind."""
    for _ in range(SAMPLES):
        one_sample()
    before = held()
    for _ in range(SAMPLES):
        one_sample()
    return (held() - before) / SAMPLES


@pytest.mark.parametrize(
    'changed',
    [
        {},
        {'effects.friction.model': 'coulomb'},
        {'effects.friction.model': 'tanh', 'effects.winding.voltage': 0.0},
    ],
)
@pytest.mark.parametrize('overlays', [(), ('rough',), ('contactless',)])
def test_a_simulated_stage(overlays: tuple[str, ...], changed: Mapping[str, object]) -> None:
    plant = replace(plant_of(PARAMS, *overlays), {'initial.position': tuple(HOVER), **changed})
    stage, none = SimulatedStage(plant), np.zeros(4)

    def one_sample() -> None:
        stage.read()
        stage.write(none, none)

    assert grows(one_sample) < MOST


@pytest.mark.parametrize(
    'overlays',
    [
        (),
        ('rough',),
        ('contactless',),
        ('fastest',),
        ('learning',),
        ('paper',),
        ('paper', 'paper_exact'),
        *((f'laws/{path.stem}',) for path in sorted((PARAMS / 'laws').glob('*.yaml'))),
    ],
)
def test_a_law(overlays: tuple[str, ...]) -> None:
    files = [PARAMS / f'{name}.yaml' for name in ('controller', *overlays)]
    regulator = Regulator(from_yaml(ControllerParameters, 'controller', *files))
    gap, direct, quadrature, none = np.full(4, 0.025), np.zeros(4), np.zeros(4), np.zeros(5)

    def one_sample() -> None:
        regulator.step(gap, 2e-5, -2e-5, HOVER, none, none, direct, quadrature)

    assert grows(one_sample) < MOST


@pytest.mark.parametrize('overlays', [(), ('rough',)])
def test_the_bridge_on_emulated_boards(overlays: tuple[str, ...]) -> None:
    given: dict[str, object] = {}
    for name in overlays:
        given.update(read_yaml(PARAMS / f'{name}.yaml', 'hw_bridge'))
    flight = Flight(hover(*HOVER), given)
    assert grows(flight.step) < MOST
    assert flight.stage.mode is Mode.FOLLOWING
