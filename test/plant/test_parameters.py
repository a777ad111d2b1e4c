"""The plant's parameters and its parameter files."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from maglev_model.machine import machine_constants
from maglev_model.parameters import ParameterError, build, from_yaml, read_yaml, specs, values
from maglev_plant.arrays import true_machine
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage

PARAMS = Path(__file__).resolve().parents[2] / 'params'


def test_the_files_list_every_parameter_with_its_default() -> None:
    listed = {
        **read_yaml(PARAMS / 'machine.yaml', 'plant'),
        **read_yaml(PARAMS / 'plant.yaml', 'plant'),
    }
    defaults = values(PlantParameters())
    missing = set(defaults) - set(listed)
    assert not missing
    of_the_plant = {name: value for name, value in listed.items() if name in defaults}
    assert build(PlantParameters, of_the_plant) == PlantParameters()


def test_the_files_write_doubles_as_ros_wants_them() -> None:
    table = specs(PlantParameters)
    for path in ('machine.yaml', 'plant.yaml', 'benchmark.yaml', 'ideal.yaml'):
        listed = read_yaml(PARAMS / path, 'plant')
        for name in set(listed) & set(table):
            value = listed[name]
            elements = value if isinstance(value, list) else [value]
            assert {type(element) for element in elements} == {table[name].kind}, (path, name)


def test_benchmark_is_the_default() -> None:
    assert from_yaml(PlantParameters, 'plant', PARAMS / 'benchmark.yaml') == PlantParameters()


def test_ideal_has_no_friction_counts_or_lag() -> None:
    ideal = from_yaml(PlantParameters, 'plant', PARAMS / 'ideal.yaml')
    assert ideal.guide.coulomb == ideal.guide.viscous == (0.0,) * 5
    assert ideal.encoder.gap_resolution == ideal.encoder.horizontal_resolution == 0.0
    assert ideal.amplifier.bandwidth == 0.0
    changed = set(read_yaml(PARAMS / 'ideal.yaml', 'plant'))
    assert all(name.startswith(('guide.', 'encoder.', 'amplifier.bandwidth')) for name in changed)


@pytest.mark.parametrize(
    ('name', 'value', 'match'),
    [
        ('encoder.gap_resolution', 10.0, 'encoder.gap_resolution'),
        ('guide.coulomb', (0.3, 0.1), 'guide.coulomb'),
        ('guide.coulomb', (0.3, 0.1, math.nan, 1.0, 1.0), 'guide.coulomb'),
        ('gide.coulomb', (0.0,) * 5, "did you mean 'guide.coulomb'"),
        ('sample_time', 1.0, 'sample_time'),
        ('amplifier.continuous_current', 8.0, 'continuous_current.*peak_current'),
        ('initial.position', (0.025, 0.06, 0.0, 0.0, 0.0), r'initial.position.* x '),
        ('initial.position', (0.031, 0.0, 0.0, 0.0, 0.01), 'initial.position.*vertical stop'),
        ('guide.coulomb_velocity', (1e-5,) * 5, 'substeps.*at least'),
        ('machine.dq_scaling', 'peak', 'dq_scaling'),
        ('machine.theta_max', 0.08, r"'machine.theta_max'.* gap of a motor is -.* mm"),
    ],
)
def test_refused(name: str, value: object, match: str) -> None:
    with pytest.raises(ParameterError, match=match):
        build(PlantParameters, {name: value})


@pytest.mark.parametrize(
    'stiff',
    [
        {'guide.coulomb_velocity': (1e-5,) * 5},
        {'effects.friction.vertical_guides': (20.0,) * 4},
        {'effects.friction.vertical_guides': (0.0, 40.0, 0.0, 40.0)},
        {'effects.friction.vertical_guides': (2.0,) * 4, 'offset.mass_y': 0.2},
        {'guide.coulomb': (0.0, 2.9, 0.0, 0.0, 0.0), 'effects.friction.static_ratio': 2.0},
        {
            'guide.coulomb': (0.0, 2.9, 0.0, 0.0, 0.0),
            'effects.friction.tilt_load': (0.0, 70.0, 0.0, 0.0, 0.0),
        },
    ],
)
def test_the_substeps_asked_for_are_enough(stiff: dict[str, object]) -> None:
    with pytest.raises(ParameterError) as refusal:
        build(PlantParameters, stiff)
    needed = int(str(refusal.value).rsplit(' ', 1)[1])
    assert build(PlantParameters, {**stiff, 'substeps': needed}).substeps == needed
    other = {'effects.friction.model': 'lugre'}
    assert build(PlantParameters, {**stiff, **other}).effects.friction.model == 'lugre'


def test_with_the_substeps_asked_for_smooth_friction_brings_to_rest_what_slides() -> None:
    sliding = {
        'guide.coulomb': (0.0, 2.9, 0.0, 0.0, 0.0),
        'guide.locked': (True, False, True, True, True),
        'effects.friction.static_ratio': 3.0,
        'initial.position': (0.025, 0.0, 0.0, 0.0, 0.0),
        'initial.velocity': (0.0, 0.02, 0.0, 0.0, 0.0),
    }
    with pytest.raises(ParameterError, match=r'substeps.* x .*at least') as refusal:
        build(PlantParameters, sliding)
    needed = int(str(refusal.value).rsplit(' ', 1)[1])
    stage = SimulatedStage(build(PlantParameters, {**sliding, 'substeps': needed}))
    for _ in range(200):
        stage.read()
    assert stage.state[2] > 0.0
    assert abs(stage.state[3]) < 1e-12


@pytest.mark.parametrize(
    'springy',
    [
        {'machine.spring_theta': 1e5, 'sample_time': 0.01, 'substeps': 1}
        | {'guide.coulomb': (0.0,) * 5},
        {'effects.friction.model': 'lugre', 'effects.friction.breakaway': (3e-8,) * 5},
        {'effects.friction.model': 'lugre', 'effects.friction.vertical_guides': (0.0, 30.0) * 2}
        | {'effects.friction.breakaway': (5e-8,) * 5},
    ],
)
def test_with_the_substeps_asked_for_no_spring_gives_energy(springy: dict[str, object]) -> None:
    swinging = {
        'guide.locked': (True, True, True, True, False),
        'initial.position': (0.025, 0.0, 0.0, 0.0, 0.0),
        'initial.velocity': (0.0, 0.0, 0.0, 0.0, 0.05),
        'machine.spring_theta': 4000.0,
        **springy,
    }
    with pytest.raises(ParameterError, match=r'substeps.*springs.*at least') as refusal:
        build(PlantParameters, swinging)
    needed = int(str(refusal.value).rsplit(' ', 1)[1])
    stage = SimulatedStage(build(PlantParameters, {**swinging, 'substeps': needed}))
    fastest = []
    for _ in range(600):
        stage.read()
        fastest.append(abs(stage.state[9]))
    assert max(fastest) == fastest[0]
    assert max(fastest[300:]) < 1e-6


def test_a_cable_may_be_too_stiff_for_the_steps() -> None:
    with pytest.raises(ParameterError, match=r'substeps.* z .*at least'):
        build(
            PlantParameters,
            {'effects.cable.hysteresis': 100.0, 'effects.cable.reach': 1e-6, 'sample_time': 2e-3},
        )


def test_offsets_change_the_true_plant_only() -> None:
    nominal = machine_constants(PlantParameters().machine)
    assert true_machine(PlantParameters()) == nominal
    names = [name for name in values(PlantParameters()) if name.startswith('offset.')]
    plant = build(PlantParameters, dict.fromkeys(names, 1.1))
    assert machine_constants(plant.machine) == nominal
    true = true_machine(plant)
    for field in (
        'K_v1',
        'K_v2',
        'K_v3',
        'K_h',
        'M_x',
        'M_y',
        'M_z',
        'I_x',
        'k_s_phi',
        'k_s_theta',
    ):
        assert getattr(true, field) == pytest.approx(1.1 * getattr(nominal, field)), field
    for field in ('k_rot', 'G', 'tau', 'r'):
        assert getattr(true, field) == pytest.approx(getattr(nominal, field)), field
