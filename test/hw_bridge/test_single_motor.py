"""A machine with a single motor behind the bridge: guides keep it level, every gap shows y."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from bridge_flight import Flight, Target, hover

from maglev_controller.parameters import ControllerParameters
from maglev_hw_bridge.stage import Mode
from maglev_model.axes import FloatArray
from maglev_model.parameters import from_yaml, read_yaml
from maglev_study.closed_loop import regulator_at_start

PARAMS = Path(__file__).resolve().parents[2] / 'params'
HOVER = 0.025


def airborne(target: Target, **overrides: object) -> Flight:
    """Above its lower stop for 0.6 s; dots of names as ``__``."""
    machine = read_yaml(PARAMS / 'single_motor.yaml', 'hw_bridge')
    known = {name: value for name, value in machine.items() if not name.startswith('guide')}
    named = {name.replace('__', '.'): value for name, value in overrides.items()}
    flight = Flight(target, {**known, **named})
    files = PARAMS / 'controller.yaml', PARAMS / 'single_motor.yaml'
    flight.regulator = regulator_at_start(from_yaml(ControllerParameters, 'controller', *files))
    flight.regulator.reset()
    flight.run(600)
    assert flight.stage.mode is Mode.FOLLOWING, flight.stage.fault
    return flight


def swinging(time: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """2 mm up and down, level."""
    y = np.array([2e-3, 0.0, 0.0, 0.0, 0.0])
    angle = 6.0 * time
    position = np.array([HOVER, 0.0, 0.0, 0.0, 0.0]) + y * np.sin(angle)
    return position, 6.0 * y * np.cos(angle), -36.0 * y * np.sin(angle)


def test_gaps_that_count_apart_are_no_tilt() -> None:
    """The model knows of none: taken for one it would never be made up for, and run away."""
    flight = airborne(
        swinging, effects__sensor__random_phase=True, effects__sensor__quadrature_error=1e-6
    )
    flight.run(1500)
    assert flight.stage.fault is None, flight.stage.fault
    apart = np.ptp(flight.stage.encoders.arrays.length[:4])
    assert 0.0 < apart < 3e-5
    assert not flight.stage.guard.arrays.position[3:].any()


@pytest.mark.parametrize('stuck', [[0, 1], [0, 2], [0, 1, 2], [0, 1, 2, 3]])
def test_gaps_that_are_stuck_in_a_hover_are_found_out_before_it_is_far_off(
    stuck: list[int],
) -> None:
    flight = airborne(hover(HOVER))
    flight.rig.forget_impact()
    flight.boards.stuck[stuck] = True
    flight.run(1000)
    assert flight.stage.fault is not None
    assert 'is stuck' in flight.stage.fault.reason
    flight.until_no_current()
    assert flight.rig.impact < (0.25 if len(stuck) == 4 else 0.05)


def test_sound_gaps_are_asked_softly() -> None:
    """One of them that answers is enough."""
    flight = airborne(hover(HOVER), effects__sensor__random_phase=True)
    flight.run(400)  # since it came to rest
    away = []
    for _ in range(3000):
        flight.run(1)
        away.append(abs(flight.rig.state[0] - HOVER))
    assert flight.stage.fault is None, flight.stage.fault
    assert max(away) < 8e-6
