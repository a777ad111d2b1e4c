"""The default regulator's figures on the benchmark plant, from scratch, without ROS.

Both ellipses, every step, unknown mismatches between model and plant, disturbances, standstill, and
all of it with the currents a sample late, on the compiled closed loop. Prints one table with what
each row must show, and exits with 1 when a row falls short.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import MeasurementFault, Regulator
from maglev_model.axes import AXES, FloatArray
from maglev_model.motor import force_coefficients
from maglev_model.parameters import build, from_yaml, read_yaml, replace
from maglev_plant.arrays import true_machine
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import Run, run
from maglev_study.references import HOVER, References, ellipse, held, joined, shaped

PARAMS = Path(__file__).parents[1] / 'params'
PERIOD = 1e-3
COUNT = np.array([10e-6, 10e-6, 10e-6, 20e-6, 20e-6])
"""The encoders' resolution [m, rad]."""
ELLIPSE_LIMIT = np.array([4e-6, 4e-6, 4e-6, 5e-6, 12e-6])
DISTURBED_LIMIT = np.array([5e-6, 5e-6, 5e-6, 12e-6, 12e-6])
OVERSHOOT, SETTLING, ENCODER = 1.0, 0.25, 0.6  # [%], [s], [s]
SHAPING = 0.2  # time in which the reference shapes a step [s], but for its largest acceleration:
ACCELERATION = np.array([5.5, 5.5, 5.5, 20.0, 20.0])  # [m/s^2, rad/s^2]

STEPS: dict[str, tuple[dict[str, float], dict[str, float]]] = {
    'y 20 to 27 mm': ({'y': 0.020}, {'y': 0.027}),
    'y 30 to 25 mm': ({'y': 0.030}, {'y': 0.025}),
    'y 25 to 30 mm': ({'y': 0.025}, {'y': 0.030}),
    'y 30 to 20 mm': ({'y': 0.030}, {'y': 0.020}),
    'x 0 to 30 mm': ({'x': 0.0}, {'x': 0.030}),
    'z 0 to 30 mm': ({'z': 0.0}, {'z': 0.030}),
    'x -30 to 30 mm': ({'x': -0.030}, {'x': 0.030}),
    'z -30 to 30 mm': ({'z': -0.030}, {'z': 0.030}),
    'theta 0 to 5 mrad': ({'theta': 0.0}, {'theta': 0.005}),
    'theta 0 to 10 mrad': ({'theta': 0.0}, {'theta': 0.010}),
    'theta -10 to 10 mrad': ({'theta': -0.010}, {'theta': 0.010}),
    'all five at once': (
        {'y': 0.020, 'x': 0.0, 'z': 0.0, 'phi': -0.001, 'theta': 0.0},
        {'y': 0.027, 'x': 0.030, 'z': 0.030, 'phi': 0.001, 'theta': 0.010},
    ),
}


class Condition(NamedTuple):
    """What a run is done on: plant parameters, and whether the currents come a sample late."""

    name: str
    plant: Mapping[str, object]
    delayed: bool = False
    allowance: float = 1.0  # figures may be this many times those of the benchmark plant


class Row(NamedTuple):
    """One line of the table; ``share`` is the worst figure by its limit, at most 1 to pass."""

    name: str
    figures: str
    share: float


def regulator(overlays: Sequence[Path] = (), **overrides: object) -> Regulator:
    """The default regulator, or with parameter files and single parameters over it."""
    return Regulator(replace(from_yaml(ControllerParameters, 'controller', *overlays), overrides))


def stage(position: FloatArray, plant: Mapping[str, object]) -> SimulatedStage:
    """The benchmark plant at rest at ``position`` (5,), with parameters by name over it."""
    found = {**read_yaml(PARAMS / 'benchmark.yaml', 'plant'), **plant}
    found['initial.position'] = tuple(position)
    return SimulatedStage(build(PlantParameters, found))


def fly(reg: Regulator, condition: Condition, references: References) -> Run:
    """One run from rest at the reference's start."""
    reg.reset()
    plant = stage(references.position[0], condition.plant)
    return run(reg, plant, references, delayed=condition.delayed)


def mean_error(reg: Regulator, condition: Condition, references: References, last: float) -> Row:
    """Mean |e| of the true position over the last seconds, against the ellipse's limit."""
    outcome = fly(reg, condition, references)
    n = round(last / PERIOD)
    error = np.abs(outcome.output - references.position)[-n:].mean(axis=0)
    return Row('', _micro(error), float(np.max(error / ELLIPSE_LIMIT)) / condition.allowance)


def step(
    reg: Regulator, condition: Condition, name: str, *, raw: bool = False, hold: float = 10.6
) -> Row:
    """A step from rest, shaped by the reference, or raw, which the controller itself rounds off.

    The share is of the worst of overshoot, t_s, t_enc (which "go and stay", to the end of the run)
    and of the other axes' errors from 0.4 s after the move on, 10 s long.
    """
    start, end = (_position(part) for part in STEPS[name])
    peak = 10.0 / math.sqrt(3.0) * np.abs(end - start) / ACCELERATION  # times duration squared
    time = max(SHAPING, math.sqrt(float(np.max(peak))))
    way = held(end, time + hold, PERIOD) if raw else shaped(start, end, time, hold, PERIOD)
    outcome = fly(reg, condition, joined(held(start, 2.0, PERIOD), way))
    output = outcome.output[2000:]
    moving = start != end
    distance = (end - start)[moving]
    error = np.abs(output - end)
    overshoot = 100.0 * max(0.0, float(np.max((output - end)[:, moving] / distance)))
    bound = np.full(5, 1e-4)
    settling = _last_above(error[:, moving], bound[moving])
    encoder = _last_above(error[:, moving], COUNT[moving])
    settled = round((time + 0.4) / PERIOD)
    rest = np.max(error[settled:], axis=0)[~moving] / COUNT[~moving]
    shares = (overshoot / OVERSHOOT, settling / SETTLING, encoder / ENCODER)
    worst = max(max(shares) / condition.allowance, float(np.max(rest, initial=0.0)))
    figures = f'{overshoot:5.2f} %  t_s {settling:5.3f} s  t_enc {encoder:5.3f} s'
    return Row(name, figures, worst)


def standstill(reg: Regulator, condition: Condition, places: int = 12) -> Row:
    """Largest error in the last 10 s at places between the encoders' counts, reached in 1 s."""
    rng = np.random.default_rng(5)
    span = np.array([0.003, 0.02, 0.02, 0.001, 0.006])
    worst = np.zeros(5)
    for _ in range(places):
        goal = HOVER + span * rng.uniform(-1.0, 1.0, 5)
        outcome = fly(reg, condition, shaped(HOVER, goal, 1.0, 15.0, PERIOD))
        worst = np.maximum(worst, np.abs(outcome.output - goal)[-10_000:].max(axis=0))
    share = float(np.max(worst / COUNT))
    return Row('standstill', _micro(worst), share)


def disturbed(reg: Regulator, condition: Condition, references: References, name: str) -> Row:
    """Mean |e| over the whole run, the disturbance's onset at its start included."""
    outcome = fly(reg, condition, references)
    error = np.abs(outcome.output - references.position).mean(axis=0)
    return Row(name, _micro(error), float(np.max(error / DISTURBED_LIMIT)) / condition.allowance)


def disturbances() -> Iterator[tuple[str, dict[str, object]]]:
    """10 N constant, 5 N sinusoidal at ω0, on each input and on all; N m by the motors' lever."""
    lever = np.array([1.0, 1.0, 1.0, 0.397, 0.397])
    for index in (*range(5), -1):
        chosen = np.ones(5) if index < 0 else np.eye(5)[index]
        where = 'all' if index < 0 else AXES[index]
        constant, amplitude = tuple(10.0 * lever * chosen), tuple(5.0 * lever * chosen)
        yield f'10 N on {where}', {'disturbance.constant': constant}
        yield f'5 N sine on {where}', {'disturbance.amplitude': amplitude}
        both: dict[str, object] = {
            'disturbance.constant': constant,
            'disturbance.amplitude': amplitude,
        }
        yield f'both on {where}', both


def mismatches(mixed: int = 16) -> Iterator[Condition]:
    """Each factor off by itself, both ways, and ``mixed`` draws of all at their extremes."""
    names = ('K_v1', 'K_v2', 'K_v3', 'K_h', 'mass_y', 'mass_x', 'mass_z', 'inertia')
    size = {**dict.fromkeys(names, 0.1), 'spring_phi': 0.3, 'spring_theta': 0.3}
    for (name, part), sign in itertools.product(size.items(), (1.0, -1.0)):
        yield Condition(
            f'{name} {100 * sign * part:+.0f} %', {f'offset.{name}': 1.0 + sign * part}, False, 2.0
        )
    rng = np.random.default_rng(11)
    for number in range(1, mixed + 1):
        signs = rng.choice([-1.0, 1.0], len(size))
        plant: dict[str, object] = {
            f'offset.{name}': 1.0 + sign * part
            for (name, part), sign in zip(size.items(), signs, strict=True)
        }
        yield Condition(f'mixed {number}', plant, False, 2.0)


def least_attraction(condition: Condition, gap: float) -> tuple[float, float]:
    """The least attraction that any i_d leaves at ``gap`` [m], by (2), and the weight [N]."""
    machine = true_machine(build(PlantParameters, condition.plant))
    k_1, k_2, k_3, _ = force_coefficients(machine, gap)
    return 4.0 * (k_1 - k_2 * k_2 / (4.0 * k_3)), machine.M_y * machine.G


def _position(parts: Mapping[str, float]) -> FloatArray:
    return np.array([parts.get(axis, HOVER[i]) for i, axis in enumerate(AXES)])


def _last_above(error: FloatArray, bound: FloatArray) -> float:
    above = np.nonzero(np.any(error > bound, axis=1))[0]
    return PERIOD * float(above[-1] + 1) if above.size else 0.0


def _micro(error: FloatArray) -> str:
    return ' '.join(f'{axis} {1e6 * value:5.2f}' for axis, value in zip(AXES, error, strict=True))


def rows_of(reg: Regulator, condition: Condition, seconds: float = 60.0) -> Iterator[Row]:
    """Ellipses and steps in one condition."""
    for theta, name in ((0.0, 'ellipse 3DOF'), (0.010, 'ellipse 4DOF')):
        found = mean_error(reg, condition, ellipse(seconds + 8.0, theta, PERIOD), seconds)
        yield found._replace(name=name)
    for name in STEPS:
        yield step(reg, condition, name)


def table(reg: Regulator, quick: bool = False) -> Iterator[Row | str]:
    """All rows, with headings between them."""
    nominal = Condition('benchmark', {})
    late = Condition('a sample late', {}, True, 1.5)
    yield 'benchmark plant'
    yield from rows_of(reg, nominal)
    for name in STEPS:
        found = step(reg, nominal, name, raw=True)
        yield found._replace(name=f'raw {name}')
    yield standstill(reg, nominal)
    yield 'currents a sample late (within 1.5 times)'
    yield from rows_of(reg, late)
    yield standstill(reg, late)
    yield 'disturbances (mean error while they act), standing and on the 4DOF ellipse'
    for where, plant in disturbances():
        condition = Condition(where, plant)
        yield disturbed(reg, condition, held(HOVER, 20.0, PERIOD), where)
    for where, plant in disturbances():
        if 'all' in where:
            found = disturbed(reg, Condition(where, plant), ellipse(20.0, 0.010, PERIOD), where)
            yield found._replace(name=f'{where}, ellipse')
    yield 'model and plant apart (within 2 times): worst row of ellipses and steps'
    for condition in mismatches(4 if quick else 16):
        least, weight = least_attraction(condition, 0.020)
        if least > weight:
            text = f'at 20 mm no current makes it less than {least:.1f} N, it weighs {weight:.1f} N'
            yield Row(condition.name, f'cannot be flown: {text}', 0.0)
            continue
        try:
            rows = list(rows_of(reg, condition, 12.0))
            worst = max(rows, key=lambda row: row.share)
            yield Row(condition.name, f'{worst.name}: {worst.figures}', worst.share)
        except MeasurementFault as fault:
            yield Row(condition.name, str(fault)[:60], math.inf)


def main() -> int:
    """Fly, print, judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--params', type=Path, action='append', default=[], help='overlay')
    parser.add_argument('--quick', action='store_true', help='fewer mismatches')
    arguments = parser.parse_args()
    reg = regulator(arguments.params)
    failed = 0
    for row in table(reg, arguments.quick):
        if isinstance(row, str):
            print(f'\n{row}', flush=True)
            continue
        verdict = '' if row.share <= 1.0 else '  FALLS SHORT'
        failed += bool(verdict)
        print(f'  {row.name:24s} {row.figures:70s} {row.share:5.2f}{verdict}', flush=True)
    print(f'\n{failed} rows fall short' if failed else '\nevery row is within its limits')
    return 1 if failed else 0


if __name__ == '__main__':
    sys.exit(main())
