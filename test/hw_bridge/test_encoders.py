"""Counts to lengths, roll-over, homing."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_hw_bridge.encoders import Encoders, HomingError
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import ParameterError, build

RESOLUTION = (1e-5, 2e-5, 5e-6, 1e-5, 1e-5, 2e-6)
DIRECTION = (1, -1, 1, -1, -1, 1)


def encoders(**overrides: object) -> Encoders:
    names = {f'encoder.{name}': value for name, value in overrides.items()}
    return Encoders(build(BridgeParameters, names))


def as_counts(total: list[int]) -> np.ndarray:
    return np.array([(value + 2**31) % 2**32 - 2**31 for value in total], dtype=np.int32)


@settings(max_examples=60)
@given(
    start=st.lists(st.integers(-(2**31), 2**31 - 1), min_size=6, max_size=6),
    steps=st.lists(
        st.lists(st.integers(-(2**31), 2**31 - 1), min_size=6, max_size=6), min_size=1, max_size=8
    ),
)
def test_lengths_follow_any_motion_through_roll_over(
    start: list[int], steps: list[list[int]]
) -> None:
    unit = encoders(resolution=RESOLUTION, direction=DIRECTION)
    unit.start(as_counts(start))
    total = list(start)
    for step in steps:
        total = [a + b for a, b in zip(total, step, strict=True)]
        length = unit.decode(as_counts(total))
        expected = [d * r * t for d, r, t in zip(DIRECTION, RESOLUTION, total, strict=True)]
        assert length == pytest.approx(expected, rel=1e-14, abs=1e-15)


@settings(max_examples=30)
@given(st.lists(st.integers(-(2**31), 2**31 - 1), min_size=6, max_size=6))
def test_homing_puts_the_platen_home(counts: list[int]) -> None:
    parameters = build(
        BridgeParameters, {'encoder.direction': DIRECTION, 'homing.x': -0.05, 'homing.z': 0.05}
    )
    unit = Encoders(parameters)
    unit.start(as_counts(counts))
    unit.home(np.tile(as_counts(counts), (20, 1)))
    assert unit.arrays.length == pytest.approx([0.031] * 4 + [-0.05, 0.05], abs=1e-12)
    moved = as_counts([count + 100 for count in counts])
    change = unit.decode(moved) - np.array([0.031] * 4 + [-0.05, 0.05])
    assert change == pytest.approx(1e-3 * np.array(DIRECTION), abs=1e-9)


def test_homing_wants_a_platen_at_rest() -> None:
    unit = encoders()
    unit.start(np.zeros(6, dtype=np.int32))
    readings = np.zeros((20, 6), dtype=np.int32)
    readings[7:, 4] = 4
    with pytest.raises(HomingError, match='encoder x moves by 40 um'):
        unit.home(readings)
    assert not unit.homed
    readings[7:, 4] = 1
    spread = unit.arrays.scale[4]
    unit._homing = dataclasses.replace(unit._homing, spread=0.9 * spread)
    with pytest.raises(HomingError):
        unit.home(readings)
    unit._homing = dataclasses.replace(unit._homing, spread=spread)
    unit.home(readings)


@pytest.mark.parametrize('counter', [0, 2**30, -(2**30), 2**31, -(2**31)])
def test_it_is_homed_where_it_was_read_last_wherever_the_counters_stand(counter: int) -> None:
    """A counter that rolls over meanwhile has not moved by its whole range."""
    unit = encoders()
    readings = np.array([as_counts([counter + step] * 6) for step in (0, -1, -1, 0, 1)])
    unit.start(readings[0])
    unit.home(readings)
    home = [0.031] * 4 + [-0.05] * 2
    assert unit.arrays.length == pytest.approx(home, abs=1e-12)
    assert unit.home(readings) == pytest.approx([0.0] * 6, abs=1e-9)
    for away in (-30, 30):
        moved = unit.decode(as_counts([counter + 1 + away] * 6)) - home
        assert moved == pytest.approx(away * unit.arrays.scale, abs=1e-11)
        unit.home(np.tile(as_counts([counter + 1] * 6), (3, 1)))


@pytest.mark.parametrize('encoder', range(6))
@pytest.mark.parametrize('side', ['lower', 'upper'])
def test_what_reads_half_a_millimetre_beyond_a_stop_is_named(encoder: int, side: str) -> None:
    parameters = BridgeParameters()
    fault, machine = parameters.fault, parameters.machine
    gaps = {'lower': fault.gap_lower, 'upper': fault.gap_upper}
    reach = {'lower': -1.0, 'upper': 1.0}[side]
    stop = (*[gaps[side]] * 4, reach * machine.x_max, reach * machine.z_max)[encoder]
    unit, middle = Encoders(parameters), [0.025] * 4 + [0.0] * 2
    unit.arrays.length[:] = middle
    assert unit.beyond_stops() == ''
    unit.arrays.length[encoder] = stop + reach * 0.0005
    assert unit.beyond_stops() == ''
    unit.arrays.length[encoder] += reach * 1e-6
    name = ('gap 1', 'gap 2', 'gap 3', 'gap 4', 'x', 'z')[encoder]
    assert unit.beyond_stops().startswith(f'encoder {name} reads {1e3 * stop + reach * 0.5:.2f} mm')


def test_a_second_homing_elsewhere_is_refused() -> None:
    unit = encoders()
    rest = np.zeros((20, 6), dtype=np.int32)
    unit.start(rest[0])
    assert unit.home(rest) == pytest.approx([0.031] * 4 + [-0.05] * 2)
    assert unit.home(rest + np.int32(20)) == pytest.approx([-2e-4] * 6)
    lost = rest.copy()
    lost[:, 2] = 120
    with pytest.raises(HomingError, match='gap 3 reads'):
        unit.home(lost)
    assert unit.arrays.zero[2] == pytest.approx(0.031 - 2e-4)


@pytest.mark.parametrize(
    ('name', 'value', 'text'),
    [
        ('encoder.direction', (1, 1, 0, 1, 1, 1), 'must be 1 or -1'),
        ('encoder.channel', (0, 1, 2, 2, 4, 5), 'elements 2 and 3'),
        ('encoder.resolution', (1e-5,) * 5, 'takes 6'),
        ('encoder.resolution', (10.0,) * 6, 'must lie in'),
        ('encoder.channel', (0, 1, 2, 3, 4, 8), 'must lie in'),
        ('amplifier.sign', (1,) * 11 + (0,), 'must be 1 or -1'),
        ('amplifier.gain', (float('nan'),) * 12, 'finite'),
        ('amplifier.continuous_current', 8.0, 'must not exceed'),
        ('amplifier.warn_load', 0.9, 'must rise'),
        ('boards.watchdog', 0.0015, 'must lie in'),
        ('fault.stale', 0.001, 'two sample times'),
        ('fault.lower', (0.04, -1.0, -1.0, -1.0, -1.0), 'less than'),
        ('fault.command_limit', 1.0, 'at least'),
        ('fault.over_current', 1.5, r"'landing\.current' is 5 A.*'fault\.over_current' \(1\.5 A\)"),
        ('landing.current', 10.6, r"'landing\.current' is 10\.6 A, it must not exceed"),
        ('landing.blind_descent_time', 4.8, r'stop_time.* is 5 s, a landing takes 5\.05 s'),
        ('landing.adrift_descent_time', 60.0, r'stop_time.* is 5 s, a landing takes 60\.25 s'),
        ('homing.wrong', 1.0, 'no parameter'),
        ('emulation.encoder.gap_resolution', 5e-2, 'must lie in'),
    ],
)  # fmt: skip
def test_wrong_parameters_are_refused(name: str, value: object, text: str) -> None:
    with pytest.raises(ParameterError, match=text):
        build(BridgeParameters, {name: value})
