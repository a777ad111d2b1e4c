"""What no bridge could see: stuck encoders while all stands still, by what friction may hold."""

from __future__ import annotations

import numpy as np
import pytest
from bridge_flight import Flight, hover

from maglev_model.machine import machine_constants
from maglev_model.platen import output_accelerations

SMOOTH, ROUGH = 0.2, 2.0  # friction by the default
COULOMB = np.array((0.303, 0.171, 0.149, 1.32, 1.32))
SHOWS = np.array([30] * 4 + [40] * 2)  # counts off the truth


def hovering(friction: float, stuck: tuple[int, ...]) -> Flight:
    flight = Flight(hover(0.025), {'emulation.guide.coulomb': (friction * COULOMB).tolist()})
    flight.run(400)
    flight.boards.stuck[list(stuck)] = True
    return flight


def pushes(flight: Flight, samples: int) -> np.ndarray:
    """What the model says that the currents push with, sample by sample, where encoders say."""
    machine, seen = machine_constants(flight.stage.parameters.machine), []
    true = flight.rig.counts()
    for _ in range(samples):
        flight.step()
        position = flight.stage.guard.arrays.position
        seen.append(
            output_accelerations(
                machine, position[0], position[3], position[4], flight._i_d, flight._i_q
            )
        )
        off = np.abs(flight.rig.counts() - true)[flight.boards.stuck]
        if flight.stage.fault is not None or np.any(off > SHOWS[flight.boards.stuck]):
            break
    return np.array(seen)


@pytest.mark.parametrize('stuck', [(4,), (5,), (2, 3), (0, 3)])
def test_until_it_shows_the_platen_could_as_well_be_held_by_friction(
    stuck: tuple[int, ...],
) -> None:
    flight = hovering(SMOOTH, stuck)
    seen = pushes(flight, 2000)
    off = np.abs(flight.rig.state[[2, 4]]) if stuck[0] >= 4 else flight.rig.state[0] - 0.025
    assert flight.stage.fault is None
    assert np.max(np.abs(off)) > 5e-5  # it has moved, and nobody knows
    may_hold = np.array(flight.stage.parameters.fault.friction)
    assert np.all(np.abs(np.mean(seen, axis=0)) < may_hold)
