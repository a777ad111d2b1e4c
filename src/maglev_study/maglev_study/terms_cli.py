"""``terms``: the paper's Fig. 3, and which terms of (9) it is right to drop. No ROS here."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NoReturn

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.machine import Machine, MachineParameters, machine_constants
from maglev_model.programs.command import leave_with
from maglev_study.terms import (
    POWERS,
    Terms,
    TiltRange,
    condition_range,
    dropped,
    holding,
    hover_current,
    largest_terms,
    negligible_up_to,
)

SHARE = 0.05
"""Of the linear term: below it, a term is called negligible."""

_LEAST_GAP = 0.012  # so that no motor's gap closes at the largest tilts [m]
_ROWS, _POINTS = 5, 41


def main() -> NoReturn:
    """Entry point of the executable."""
    leave_with(run)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code: 0, or 2 with one line of error."""
    options = _parser().parse_args(arguments)
    parameters = MachineParameters()
    machine = machine_constants(parameters)
    tilts = TiltRange(phi=parameters.phi_max, theta=parameters.theta_max)
    low, high = options.gap
    if not _LEAST_GAP <= low < high <= 0.05:
        return _refuse(
            f'--gap is {low:g} {high:g}, it must be two air gaps [m], the smaller first, from'
            f' {_LEAST_GAP:g} to 0.05'
        )
    try:
        for line in report(machine, np.linspace(low, high, _ROWS), tilts):
            print(line)
        path = _draw(machine, np.linspace(low, high, _POINTS), tilts, options)
    except ValueError as error:
        return _refuse(f'{error}: choose another --gap')
    except OSError as error:
        return _refuse(f"cannot write to '{options.out}': {error.strerror}: choose another --out")
    print(f'\nfigure: {path}')
    return 0


def _refuse(reason: str) -> int:
    print(f'terms: error: {reason}', file=sys.stderr)
    return 2


def report(machine: Machine, gaps: FloatArray, tilts: TiltRange) -> Iterator[str]:
    """The tables, line by line; ``gaps`` [m]."""
    largest = largest_terms(machine, gaps, tilts)
    yield (
        f'Largest |a_i|, |b_j|, |c_k| over |phi| <= {1e3 * tilts.phi:g} mrad and |theta| <='
        f' {1e3 * tilts.theta:g} mrad, u_x = u_z = 0 (10); SI units per A, A²; * dropped in (11)'
    )
    yield _row('air gap', (f'{1e3 * gap:.1f} mm' for gap in gaps))
    for name in 'abc':
        for index, powers in enumerate(POWERS[name]):
            star = '*' if sum(powers) == 2 else ''
            values = largest[name][:, index]
            yield _row(f'{name}_{index + 1}{star} {_input(powers)}', (f'{v:.3f}' for v in values))
    yield ''
    yield from _currents(machine, gaps, tilts, largest)
    yield ''
    yield from _conditions(machine, gaps, tilts)


def _currents(
    machine: Machine, gaps: FloatArray, tilts: TiltRange, largest: Terms
) -> Iterator[str]:
    """Up to which current terms are negligible, and which current the platen needs."""
    hover = [abs(hover_current(machine, gap)) for gap in gaps]
    held = [holding(machine, gap, tilts) for gap in gaps]
    limits = negligible_up_to(largest, SHARE)
    yield (
        f'Negligible, below {SHARE:.0%} of the linear term (a_3, b_2, c_2), up to |i_d| of;'
        ' ! less than is needed to hold every tilt'
    )
    for name, index in dropped():
        cells = []
        for row, limit in enumerate(limits[name][:, index]):
            mark = '!' if limit < held[row].current else ''
            cells.append(f'{mark} > 7 A' if limit > 7.0 else f'{mark} {limit:.2f} A')
        yield _row(f'{name}_{index + 1} {_input(POWERS[name][index])}', cells)
    yield _row('needed: hover', (f'{current:.2f} A' for current in hover))
    yield _row('every tilt', (f'{one.current:.2f} A' for one in held))
    yield ''
    yield 'What (11) drops while the platen is held at any tilt, of what the linear terms give'
    for row, name in enumerate(('y', 'phi', 'theta')):
        unit = 'm/s²' if row == 0 else 'rad/s²'
        cells = [f'{one.dropped[row]:.2f} of {one.linear[row]:.2f}' for one in held]
        yield _row(f'{name} [{unit}]', cells)


def _conditions(machine: Machine, gaps: FloatArray, tilts: TiltRange) -> Iterator[str]:
    yield 'Condition number of the matrix in (12), least and greatest over the tilts'
    for title, at_motors in (('SI units', False), ('at the motors', True)):
        found = [condition_range(machine, gap, tilts, at_motors=at_motors) for gap in gaps]
        yield _row(title, (f'{least:.2f} to {most:.2f}' for least, most in found))


def _row(title: str, cells: Iterator[str] | Sequence[str]) -> str:
    return f'  {title:<20}' + ''.join(f'{cell:>16}' for cell in cells)


def _input(powers: Sequence[int]) -> str:
    """What a term multiplies, as ``v_phi v_y``."""
    parts = (
        name + ('²' if power == 2 else '')
        for name, power in zip(('v_y', 'v_φ', 'v_θ'), powers, strict=True)
        if power
    )
    return ' '.join(parts)


def _draw(
    machine: Machine, gaps: FloatArray, tilts: TiltRange, options: argparse.Namespace
) -> Path:
    from maglev_study.terms_plot import draw  # matplotlib takes a second to load

    options.out.mkdir(parents=True, exist_ok=True)
    path: Path = options.out / f'terms.{options.format}'
    draw(gaps, largest_terms(machine, gaps, tilts), path)
    return path


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='terms',
        description="The paper's Fig. 3: how large the terms of (9) are, and which are negligible.",
    )
    parser.add_argument(
        '--out', type=Path, default=Path(), metavar='DIR', help='where the figure goes (default .)'
    )
    parser.add_argument(
        '--format', choices=('png', 'svg'), default='png', help='of the figure (default png)'
    )
    parser.add_argument(
        '--gap',
        type=float,
        nargs=2,
        default=(0.020, 0.030),
        metavar=('LOW', 'HIGH'),
        help='range of air gaps [m] (default 0.020 0.030, as in the paper)',
    )
    return parser


if __name__ == '__main__':
    main()
