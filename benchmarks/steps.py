"""Steps as fast as the currents allow, beside the least time that any profile could take.

On the benchmark plant with ``params/fastest.yaml``: how long the reference takes, t_enc, the time
after which every output stays within 10 µm or 20 µrad, overshoot, the bound, and t_enc by it. The
bound is computed apart from the profiles: at every place of the straight way how much it can be
sped up and slowed down with attractions and thrusts (2), (6), (7) that currents of 7 A give, the
platen carried as the law carries it at least, with friction; then the largest squared speeds b(s)
with -2 d <= db/ds <= 2 u, a linear program. It bounds the time from rest to rest: t_enc need not
have the last millisecond or two of it.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scipy.optimize import linprog

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.axes import FloatArray
from maglev_model.machine import Machine, machine_constants
from maglev_model.motor import attraction_coefficients
from maglev_model.parameters import from_yaml, replace
from maglev_model.platen import gaps_from_outputs
from maglev_plant.simulation import SimulatedStage
from maglev_reference.fastest import Fastest
from maglev_reference.parameters import ReferenceParameters
from maglev_study.closed_loop import run
from maglev_study.references import HOVER, References, held, joined
from maglev_study.rough_flights import plant_of

PARAMS = Path(__file__).resolve().parents[1] / 'params'
MOVES: Mapping[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
    'y, 20 to 27 mm': ((0.020, 0.0, 0.0, 0.0, 0.0), (0.027, 0.0, 0.0, 0.0, 0.0)),
    'x, 30 mm': (tuple(HOVER), (0.025, 0.03, 0.0, 0.0, 0.0)),
    'z, 30 mm': (tuple(HOVER), (0.025, 0.0, 0.03, 0.0, 0.0)),
    'theta, 10 mrad': (tuple(HOVER), (0.025, 0.0, 0.0, 0.0, 0.010)),
    'all five': ((0.020, 0.0, 0.0, 0.0, 0.0), (0.027, 0.03, 0.03, 0.003, 0.010)),
}
BOUND = np.array([1e-5, 1e-5, 1e-5, 2e-5, 2e-5])
CURRENT, LEAST = 7.0, 0.1
PLACES, HALVINGS, ROUNDS = 121, 40, 3
SETTLE, AFTER = 3.0, 1.0  # [s]


def pull_range(machine: Machine, gap: float, quadrature: float) -> FloatArray:
    """Least and greatest attraction of a motor (2,) [N] at a gap [m] with an i_q [A]."""
    a, b, _ = attraction_coefficients(machine, gap)
    room = b * math.sqrt(max(CURRENT**2 - quadrature**2, 0.0))
    return np.array([max(a - room, 0.0) ** 2, (a + room) ** 2]) + (b * quadrature) ** 2


def possible(machine: Machine, output: FloatArray, wanted: FloatArray) -> bool:
    """Whether some currents give accelerations (5,) at outputs (5,)."""
    gap = np.empty(4)
    gaps_from_outputs(machine, output, gap)
    thrust = [attraction_coefficients(machine, g)[2] for g in gap]
    along_z = machine.M_z * wanted[2] / (thrust[0] + thrust[2])
    along_x = machine.M_x * wanted[1] / (thrust[1] + thrust[3])
    if max(abs(along_x), abs(along_z)) > CURRENT:
        return False
    pulls = [pull_range(machine, g, (along_z, along_x)[m % 2]) for m, g in enumerate(gap)]
    total = machine.M_y * (machine.G - wanted[0])
    turn = machine.M_y / machine.k_rot
    # pairs (1, 3) and (4, 2): P_1 - P_3 and P_4 - P_2 are given, the sums are free
    phi = turn * (wanted[3] + machine.k_s_phi * output[3])
    theta = turn * (wanted[4] + machine.k_s_theta * output[4])
    least = most = 0.0
    for one, other, difference in ((0, 2, phi), (3, 1, theta)):
        low = 2.0 * max(pulls[one][0] - 0.5 * difference, pulls[other][0] + 0.5 * difference)
        high = 2.0 * min(pulls[one][1] - 0.5 * difference, pulls[other][1] + 0.5 * difference)
        if low > high:
            return False
        least, most = least + low, most + high
    return bool(max(least, LEAST * machine.M_y * machine.G) <= total <= most)


def least_time(start: FloatArray, target: FloatArray, parameters: ReferenceParameters) -> float:
    """The bound [s]."""
    way, moves = target - start, target != start
    top = float(np.min(np.array(parameters.limits.velocity)[moves] / np.abs(way[moves])))
    speed = np.full(PLACES, top)
    for _ in range(ROUNDS):  # each from above: viscous friction brakes no more than this
        speed = fastest(start, way, speed, parameters)
    return float(np.sum(2.0 / (PLACES - 1) / (speed[1:] + speed[:-1])))


def fastest(
    start: FloatArray, way: FloatArray, speed: FloatArray, parameters: ReferenceParameters
) -> FloatArray:
    """The largest speeds (n,) [1/s] along the way, none of them above ``speed``."""
    machine, guide = machine_constants(parameters.machine), parameters.guide
    place = np.linspace(0.0, 1.0, PLACES)
    limits = np.empty((2, PLACES))
    for row, sign in enumerate((1.0, -1.0)):
        for k, s in enumerate(place):
            friction = np.array(guide.coulomb) * np.sign(way)
            if sign < 0.0:
                friction += np.array(guide.viscous) * way * speed[k]
            low, high = 0.0, 1e5
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                fits = possible(machine, start + s * way, sign * middle * way + friction)
                low, high = (middle, high) if fits else (low, middle)
            limits[row, k] = low
    spacing = place[1]
    rise = 2.0 * spacing * np.maximum(limits[:, 1:], limits[:, :-1])
    step = np.diff(np.eye(PLACES), axis=0)
    bounds = [(0.0, 0.0), *((0.0, top**2) for top in speed[1:-1]), (0.0, 0.0)]
    found = linprog(
        -np.ones(PLACES),
        np.vstack([step, -step]),
        np.concatenate([rise[0], rise[1]]),
        bounds=bounds,
    )
    return np.asarray(np.sqrt(np.maximum(found.x, 0.0)))


def flown(
    start: FloatArray, target: FloatArray, overlays: list[Path]
) -> tuple[float, float, float]:
    """Time of the reference, t_enc [s] and overshoot, the largest of the outputs that move."""
    wanted = from_yaml(ReferenceParameters, 'reference', *overlays)
    table = from_yaml(ControllerParameters, 'controller', *overlays)
    period, move = wanted.sample_time, Fastest(start, target, wanted)
    moving = References(*move.evaluate(np.arange(0.0, move.duration + AFTER, period)))
    stage = SimulatedStage(replace(plant_of(PARAMS), {'initial.position': tuple(start)}))
    references = joined(held(start, SETTLE, period), moving)
    output = run(Regulator(table), stage, references).output[round(SETTLE / period) :]
    outside = np.flatnonzero(np.any(np.abs(output - target) > BOUND, axis=1))
    way = target - start
    beyond = np.max((output - target)[:, way != 0.0] / way[way != 0.0])
    return move.duration, period * (outside[-1] + 1), float(max(beyond, 0.0))


def main() -> int:
    """Print the table in Markdown."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    overlays = [PARAMS / 'controller.yaml', PARAMS / 'fastest.yaml']
    wanted = from_yaml(ReferenceParameters, 'reference', *overlays)
    print(
        '| step | reference | t_enc | overshoot | bound | t_enc by it |\n|:--|--:|--:|--:|--:|--:|'
    )
    worst = 0.0
    for name, (start, target) in MOVES.items():
        ends = np.array(start), np.array(target)
        bound = least_time(*ends, wanted)
        took, time, beyond = flown(*ends, overlays)
        worst = max(worst, time / bound)
        row = f'{took:.3f} s | {time:.3f} s | {100 * beyond:.2f} % | {bound:.3f} s'
        print(f'| {name} | {row} | {time / bound:.2f} |', flush=True)
    return int(worst > 1.4)


if __name__ == '__main__':
    sys.exit(main())
