"""Internal models that match a repeated trajectory, as an overlay for all nodes.

    match scenario_square.yaml > matched_square.yaml
    match path.csv > matched_path.yaml

The fundamental is the trajectory's period; each output that moves gets the harmonics at which
friction would leave the largest errors, one after another, as long as their frequencies sum up to
no more than ``total``: the more of them there are and the higher they are, the less steep is the
friction with which standing still stays stable. The others keep what they have.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

import numpy as np

from maglev_model.axes import AXES
from maglev_model.parameters import ParameterError, from_yaml, replace
from maglev_model.programs.arguments import positive, whole_number
from maglev_model.programs.command import leave_with
from maglev_reference.accuracy import compliance, disturbance_lines
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.trajectories import course

_HIGHEST = 100  # multiple a controller takes
_NEGLIGIBLE = 1e-8  # acceleration by friction that is none [m/s^2, rad/s^2]
_COUNT = 6
_TOTAL = 125.0  # the default controller refuses some from 132 rad/s on


def matched(
    parameters: ReferenceParameters, count: int = _COUNT, total: float = _TOTAL
) -> tuple[float, dict[str, list[float]]]:
    """The fundamental [rad/s] and the multiples of each output that moves.

    Besides 0 these are up to ``count``, with frequencies of up to ``total`` [rad/s] in sum.
    Raises ParameterError for a trajectory without a period.
    """
    path = None if parameters.trajectory == 'steps' else course(parameters)
    if path is None or path.period is None:
        raise ParameterError(
            f"trajectory '{parameters.trajectory}' does not repeat: no internal model matches it"
        )
    fundamental = 2.0 * math.pi / path.period
    lines = disturbance_lines(path, parameters)[: _HIGHEST + 1]
    omega = fundamental * np.arange(1, len(lines), dtype=np.float64)
    sampling = parameters.internal_model.sampling
    multiples = {}
    for axis, (name, loop) in enumerate(zip(AXES, parameters.loops, strict=True)):
        size = np.where(lines[1:, axis] < _NEGLIGIBLE, 0.0, lines[1:, axis])
        held: list[float] = [0.0]
        for _ in range(count):
            frequencies = [fundamental * order for order in held]
            left = size * compliance(omega, frequencies, loop, sampling)
            left[omega + sum(frequencies) > total] = 0.0
            if not left.any():
                break
            held.append(float(np.argmax(left)) + 1.0)
        if len(held) > 1:
            multiples[name] = sorted(held)
    return fundamental, multiples


def overlay(fundamental: float, multiples: dict[str, list[float]]) -> str:
    """The parameter file that gives controller and reference these internal models."""
    text = ['/**:', '  ros__parameters:']
    text += ['    internal_model:', f'      fundamental: {fundamental!r}']
    for axis, values in multiples.items():
        text += [f'    {axis}:', f'      multiples: {values}']
    return '\n'.join(text) + '\n'


def main() -> NoReturn:
    """Entry point of the executable ``match``."""
    leave_with(run)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command: 0, or 2 with a line saying what is wrong."""
    parser = argparse.ArgumentParser(
        prog='match', description='Internal models for a repeated trajectory, as an overlay.'
    )
    parser.add_argument(
        'file',
        nargs='+',
        help='parameter files of the reference, the last wins; or a trajectory as .csv',
    )
    parser.add_argument(
        '--count',
        type=whole_number(1),
        default=_COUNT,
        help='oscillators of each output, at most (%(default)s)',
    )
    parser.add_argument(
        '--total',
        type=positive,
        default=_TOTAL,
        help='sum of their frequencies at most [rad/s] (%(default)s)',
    )
    given: Any = parser.parse_args(arguments)
    try:
        tables = [name for name in given.file if not name.endswith('.csv')]
        parameters = from_yaml(ReferenceParameters, 'reference', *tables)
        for path in (name for name in given.file if name.endswith('.csv')):
            followed = {'trajectory': 'file', 'file.path': path, 'file.repeat': True}
            parameters = replace(parameters, followed)
        print(overlay(*matched(parameters, given.count, given.total)), end='')
    except ParameterError as error:
        print(f'match: error: {error}', file=sys.stderr)
        return 2
    return 0


if __name__ == '__main__':
    main()
