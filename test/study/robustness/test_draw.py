"""Machines drawn by number: each alone, within what is said of them, and refused where wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_model.parameters import ParameterError, from_yaml, to_yaml
from maglev_plant.parameters import PlantParameters
from maglev_study.robustness.draw import (
    CUT,
    NOMINAL,
    Distribution,
    Draw,
    check_draws,
    machine,
    read_draws,
)
from maglev_study.rough_flights import plant_of

PARAMS = Path(__file__).resolve().parents[3] / 'params'
DRAWS = read_draws(PARAMS / 'robustness.yaml')
PLANT, ROUGH = plant_of(PARAMS), plant_of(PARAMS, 'rough')


@settings(max_examples=50)
@given(
    kind=st.sampled_from(['normal', 'lognormal', 'uniform']),
    centre=st.floats(1e-3, 1e3),
    width=st.floats(0.0, 1.0),
    shares=st.lists(st.floats(0.0, 1.0), min_size=2, max_size=9),
)
def test_a_distribution_rises_between_its_ends(
    kind: str, centre: float, width: float, shares: list[float]
) -> None:
    one = Distribution(distribution=kind, centre=centre, width=width, source='')
    ends = {
        'normal': (centre - CUT * width, centre + CUT * width),
        'lognormal': (centre * np.exp(-CUT * width), centre * np.exp(CUT * width)),
        'uniform': (centre - width, centre + width),
    }[kind]
    low, middle, high = one.at(np.array([0.0, 0.5, 1.0]))
    assert (low, high) == pytest.approx(ends, rel=1e-9, abs=1e-9)
    assert middle == pytest.approx(centre, rel=1e-9)
    found = one.at(np.sort(shares))
    assert np.all(np.diff(found) >= 0.0)
    assert found.min() >= low
    assert found.max() <= high


def test_the_normal_one_spreads_by_its_width() -> None:
    one = Distribution(distribution='normal', centre=2.0, width=0.1, source='')
    found = one.at(np.random.default_rng(1).random(20000))
    assert found.mean() == pytest.approx(2.0, abs=0.003)
    assert found.std() == pytest.approx(0.1, rel=0.03)  # 1.3 % less by the cut


def test_a_machine_is_the_same_whatever_else_is_drawn() -> None:
    found = [machine(DRAWS, PLANT, 7, number) for number in (3, 1, 3)]
    assert found[0] == found[2]
    assert found[0].plant != found[1].plant
    assert found[0].plant.seed != found[1].plant.seed
    assert machine(DRAWS, PLANT, 8, 3).plant != found[0].plant
    (alone,) = (one for one in DRAWS if one.name == 'offset.mass_y')
    assert machine([alone], PLANT, 7, 3).drawn['offset.mass_y'] == (found[0].drawn['offset.mass_y'])
    assert machine(DRAWS, PLANT, 7, NOMINAL).plant == PLANT


def test_stronger_magnets_keep_the_fields_superposed() -> None:
    """K_v2² = 4 K_v1 K_v3 holds for the machine, so for every factor on it."""
    common = [one for one in DRAWS if one.name in ('magnets', 'windings')]
    found = machine(common, PLANT, 0, 5)
    offset, m, w = found.plant.offset, found.drawn['magnets'], found.drawn['windings']
    assert offset.K_v2**2 == pytest.approx(offset.K_v1 * offset.K_v3, rel=1e-12)
    assert (offset.K_v1, offset.K_h) == pytest.approx((m**2, m * w), rel=1e-12)
    assert m != 1.0


def test_effects_are_drawn_where_they_are_switched_on() -> None:
    plain, rough = machine(DRAWS, PLANT, 0, 1), machine(DRAWS, ROUGH, 0, 1)
    assert plain.plant.effects == PlantParameters().effects
    assert not [name for name in plain.drawn if name.startswith('effects.')]
    effects, had = rough.plant.effects, ROUGH.effects
    for group in ('friction', 'modes', 'motor', 'drive', 'winding', 'sensor', 'cable', 'heat'):
        assert getattr(effects, group) != getattr(had, group)
    assert effects.spring == had.spring
    name = 'guide.coulomb[theta]'
    assert rough.drawn[name] == plain.drawn[name]
    wanted = PLANT.guide.coulomb[4] * plain.drawn[name]
    assert plain.plant.guide.coulomb[4] == pytest.approx(wanted)


def test_what_replay_writes_is_the_machine(tmp_path: Path) -> None:
    plant = machine(DRAWS, ROUGH, 0, 2).plant
    path = tmp_path / 'machine.yaml'
    path.write_text(to_yaml(plant, 'plant'))
    assert from_yaml(PlantParameters, 'plant', path) == plant


LINE = '{distribution: normal, centre: 1.0, width: 0.1, source: J}'


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('factr: {magnets: %s}', "there is no 'factr.magnets.distribution' in it"),
        ('factor: {magnet: %s}', "no parameter 'magnet', did you mean 'magnets'"),
        ('value: {magnets: %s}', "'magnets' of robustness is a factor"),
        ('factor: {substeps: %s}', "'substeps' of robustness is integer, none to draw"),
        (
            'value: {offset: {K_h: {distribution: normal, centre: 1.0, width: -0.1, source: J}}}',
            "value 'offset.K_h': parameter 'width' is -0.1, it must lie in [0, 1e+09]",
        ),
        (
            'factor: {magnets: {distribution: normal, centre: 1.0, source: J}}',
            "factor 'magnets': parameter 'width' has no default and must be given",
        ),
        (
            'factor: {magnets: {distribution: flat, centre: 1.0, width: 0.1, source: J}}',
            "'distribution' is 'flat', it must be one of normal, lognormal, uniform",
        ),
        ('{factor: {offset.K_h: %s}, value: {offset.K_h: %s}}', 'as a factor and as a value'),
    ],
)
def test_what_cannot_be_drawn_is_refused(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / 'mine.yaml'
    content = text.replace('%s', LINE)
    body = content if content.startswith('{') else f'{{{content}}}'
    path.write_text(f'robustness: {{ros__parameters: {body}}}\n')
    with pytest.raises(ParameterError) as error:
        read_draws(path)
    assert words in str(error.value)


def test_an_overlay_changes_a_distribution_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / 'mine.yaml'
    path.write_text(
        '/**: {ros__parameters: {machine: {mass_y: 7.0}}}\n'
        'robustness: {ros__parameters: {factor: {magnets: {width: 0.5}}}}\n'
    )
    changed = read_draws(PARAMS / 'robustness.yaml', path)
    differ = [new.name for old, new in zip(DRAWS, changed, strict=True) if old != new]
    assert differ == ['magnets']


@pytest.mark.parametrize(
    ('name', 'kind', 'width', 'words'),
    [
        ('offset.K_h', 'uniform', 0.89, ''),
        ('offset.K_h', 'uniform', 0.91, "the least that is drawn: parameter 'offset.K_h' is 0.09"),
        ('guide.coulomb', 'lognormal', 0.36, ''),
        ('guide.coulomb', 'lognormal', 0.38, "the greatest that is drawn: parameter 'substeps'"),
    ],
)
def test_extremes_that_make_no_machine_are_refused_before_any_flies(
    name: str, kind: str, width: float, words: str
) -> None:
    """Two steps a sample bear a friction of 4000 1/s, which is 1.32 e^(3 0.369) / 0.001."""
    drawn = Draw(
        'factor', name, Distribution(distribution=kind, centre=1.0, width=width, source='')
    )
    if not words:
        check_draws([drawn], PLANT)
        return
    with pytest.raises(ParameterError) as error:
        check_draws([drawn], PLANT)
    assert words in str(error.value)
