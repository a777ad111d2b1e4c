"""Which run a seed stands for: machine, phase, instant and faults, with all cells equally often."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any

import numpy as np

from maglev_model.parameters import ParameterError
from maglev_study.faults.catalogue import KINDS
from maglev_study.faults.fly import Scenario
from maglev_study.faults.kinds import Fault

PER_MACHINE = 60
"""Runs that one machine's programme is flown for."""

MOST_SEED = PER_MACHINE * 2**31 - 1
"""The greatest: a machine's number seeds its noise, which takes 31 bits."""

_LATEST = 500  # of a second fault after the first [ms]


@functools.cache
def cells() -> tuple[tuple[str, str], ...]:
    """Kind of fault and phase; one that stands for several occurs more than once."""
    return tuple(
        (name, phase)
        for name, kind in KINDS.items()
        for phase in kind.phases
        for _ in range(kind.weight)
    )


@functools.lru_cache(maxsize=8)
def _order(round_: int) -> tuple[int, ...]:
    return tuple(np.random.default_rng([271828, round_]).permutation(len(cells())).tolist())


def scenario(seed: int, *, double: bool = False) -> Scenario:
    """The run of a seed; ``double``: with a second fault up to 0.5 s after the first.

    Raises ParameterError beyond :data:`MOST_SEED`.
    """
    if seed > MOST_SEED:
        raise ParameterError(f'there is no run of seed {seed}: seeds go from 0 to {MOST_SEED}')
    table = cells()
    name, phase = table[_order(seed // len(table))[seed % len(table)]]
    rng = np.random.default_rng([161803, seed])
    instant = float(rng.random())
    faults = [KINDS[name].draw(rng)]
    while double and len(faults) < 2:
        other = KINDS[table[int(rng.integers(len(table)))][0]]
        if phase in other.phases and other.name != 'none':
            second = other.draw(rng)
            later = int(rng.integers(0, _LATEST + 1))
            faults.append(dataclasses.replace(second, delay=later))
    return Scenario(seed // PER_MACHINE, phase, instant, tuple(faults), seed)


def to_json(run: Scenario) -> dict[str, Any]:
    """A run as plain values, for a file."""
    faults = [{**fault.__dict__, 'targets': list(fault.targets)} for fault in run.faults]
    return {**run._asdict(), 'faults': faults}


def from_json(plain: Mapping[str, Any]) -> Scenario:
    """Back from a file. Raises KeyError, TypeError, ValueError for what is no run."""
    faults = tuple(
        Fault(
            str(one['kind']),
            tuple(int(target) for target in one['targets']),
            float(one['size']),
            str(one['call']),
            int(one['delay']),
        )
        for one in plain['faults']
    )
    for fault in faults:
        if plain['phase'] not in KINDS[fault.kind].phases:
            raise ValueError(f"there is no '{fault.kind}' in phase '{plain['phase']}'")
    return Scenario(
        int(plain['machine']),
        str(plain['phase']),
        float(plain['instant']),
        faults,
        int(plain['seed']),
    )
