"""What no bridge could see: stuck encoders while all stands still, by what friction may hold."""

from __future__ import annotations

import numpy as np
import pytest
from bridge_flight import Flight, ellipse, hover

from maglev_model.machine import machine_constants
from maglev_model.platen import output_accelerations

SMOOTH = 0.2  # friction by the default
COULOMB = np.array((0.303, 0.171, 0.149, 1.32, 1.32))
SHOWS = np.array([30] * 4 + [40] * 2)  # counts off the truth


def hovering(friction: float, stuck: tuple[int, ...]) -> Flight:
    rubbing = {'emulation.guide.coulomb': (friction * COULOMB).tolist()}
    noise = {f'emulation.encoder.{which}_noise': 2e-6 for which in ('gap', 'horizontal')}
    never_asked = {'fault.gap_silence': 0.0}
    flight = Flight(hover(0.025, 5e-6, 5e-6), {**rubbing, **noise, **never_asked})
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


def moved_under(friction: np.ndarray, pushes: np.ndarray) -> np.ndarray:
    """How far a platen that friction holds is moved by pushes, (n, 5) at 1 ms; (5,) [m, rad]."""
    rate, place, farthest = np.zeros(5), np.zeros(5), np.zeros(5)
    for push in pushes:
        rate += 1e-3 * push
        rate = np.sign(rate) * np.maximum(np.abs(rate) - 1e-3 * friction, 0.0)
        place += 1e-3 * rate
        farthest = np.maximum(farthest, np.abs(place))
    return farthest


@pytest.mark.parametrize('stuck', [(4,), (5,), (2, 3), (0, 3)])
def test_until_it_shows_friction_could_as_well_hold_the_platen(stuck: tuple[int, ...]) -> None:
    flight = hovering(SMOOTH, stuck)
    true = flight.rig.counts()
    seen = pushes(flight, 2000)
    off = 1e-5 * np.abs(flight.rig.counts() - true)
    parameters = flight.stage.parameters
    moved = moved_under(np.array(parameters.fault.friction), seen)
    assert np.max(off[list(stuck)]) > 2.9e-4
    assert np.max(np.delete(off, stuck)) < 6e-5  # nobody else sees it
    assert np.max(moved[1:3]) < parameters.fault.stuck_horizontal
    assert moved[0] + parameters.machine.radius * np.max(moved[3:]) < parameters.fault.stuck_gap


def test_what_moves_a_platen_in_flight_friction_cannot_hold() -> None:
    flight = Flight(ellipse)
    flight.run(200)
    moved = moved_under(np.array(flight.stage.parameters.fault.friction), pushes(flight, 300))
    assert np.all(moved[[1, 2]] > flight.stage.parameters.fault.stuck_horizontal)
