"""A seed stands for one run, for ever the same, and all cells come equally often."""

from __future__ import annotations

import json
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from maglev_hw_bridge.parameters import FaultParameters
from maglev_model.machine import MachineParameters, machine_constants
from maglev_model.motor import force_coefficients
from maglev_study.faults.catalogue import KINDS
from maglev_study.faults.draw import PER_MACHINE, cells, from_json, scenario, to_json
from maglev_study.faults.machines import machine
from maglev_study.faults.programme import PHASES, programme


def test_every_cell_comes_as_often_as_it_weighs_in_each_round() -> None:
    number = len(cells())
    for begin in (0, 3 * number):
        runs = [scenario(seed) for seed in range(begin, begin + number)]
        assert Counter((run.faults[0].kind, run.phase) for run in runs) == Counter(cells())


def test_every_kind_is_there_in_its_phases() -> None:
    assert {kind for kind, _ in cells()} == set(KINDS)
    for phase in PHASES:
        assert sum(where == phase for _, where in cells()) > 40


@pytest.mark.parametrize('double', [False, True])
def test_a_run_comes_back_from_a_file(double: bool) -> None:
    for seed in range(0, 4000, 7):
        run = scenario(seed, double=double)
        assert len(run.faults) == 1 + double
        assert run.machine == seed // PER_MACHINE
        assert all(0 <= fault.delay <= 500 for fault in run.faults)
        assert from_json(json.loads(json.dumps(to_json(run)))) == run


def test_what_is_no_run_is_refused() -> None:
    plain = to_json(scenario(0))
    for missing in plain:
        with pytest.raises(KeyError):
            from_json({key: value for key, value in plain.items() if key != missing})
    unhomed = {**plain, 'faults': [{**plain['faults'][0], 'kind': 'not homed'}]}
    with pytest.raises(ValueError, match='not homed'):
        from_json({**unhomed, 'phase': 'hover'})


def test_sizes_of_slips_are_1_to_50_counts_either_way() -> None:
    faults = [scenario(seed).faults[0] for seed in range(6 * len(cells()))]
    sizes = [fault.size for fault in faults if fault.kind.startswith('slip')]
    assert min(sizes) < -40
    assert max(sizes) > 40
    assert all(1 <= abs(size) <= 50 for size in sizes)


@pytest.mark.parametrize('number', [0, 1, 2, 3])
def test_a_programme_has_all_phases_one_after_another(number: int) -> None:
    course = programme(number, 0.031, 1e-3)
    spans = [course.spans[phase] for phase in PHASES[2:]]
    assert all(start < end for start, end in spans)
    assert all(before[1] <= after[0] for before, after in pairwise(spans))
    assert len(course.kind) == len(course.references.position) > spans[-1][1] + 2000
    for phase in PHASES:
        start, end = course.spans[phase]
        assert course.sample_of(phase, 0.0) == start
        assert course.sample_of(phase, 0.999999) == max(end - 1, start)


@pytest.mark.parametrize('period', [2.5e-4, 1.25e-3, 2e-3])
def test_a_programme_takes_as_long_whatever_its_samples(period: float) -> None:
    usual, course = programme(3, 0.031, 1e-3), programme(3, 0.031, period)
    for phase in PHASES:
        lasts = 1e-3 * np.array(usual.spans[phase])
        np.testing.assert_allclose(period * np.array(course.spans[phase]), lasts, atol=period)
    calm = 1e-3 * usual.spans['steps'][1] + 0.095
    assert course.jumps(round(calm / period))
    assert not course.jumps(round((calm + 0.01) / period))


def test_any_machine_can_be_held_by_its_currents_wherever_it_flies() -> None:
    """At the least gap in flight a fifth of the weight can be left to the magnets, or less."""
    believed = machine_constants(MachineParameters())
    k_1, k_2, k_3, _ = force_coefficients(believed, FaultParameters().lower[0])
    for number in range(1, 100):
        true = machine(number).emulation.offset
        least = true.K_v1 * k_1 - (true.K_v2 * k_2) ** 2 / (4.0 * true.K_v3 * k_3)
        weight = true.mass_y * believed.M_y * believed.G
        assert -1e-9 < 4.0 * least < 0.2 * weight
