"""Friction, motor and sensor models from outside the package."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rough import ONLY_X, ZERO, ideal_stage, states

from maglev_model.parameters import ParameterError

MODULE = """
import math

SLIP = 0.001


def force(velocity, level, step, memory):
    memory[0] += 1.0
    return level * math.tanh(velocity / SLIP)


def forces(gap, i_d, i_q, out):
    out[0] = -20.0 + 100.0 * (gap - 0.025) + 30.0 * i_d
    out[1] = -40.0 * i_q


def reading(length, channel, sample, memory):
    memory[0] = 0.5 * memory[0] + 0.5 * length if sample > 0 else length
    return memory[0]
"""


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    package = tmp_path / f'of_{tmp_path.name}'
    package.mkdir()
    (package / '__init__.py').touch()
    (package / 'models.py').write_text(MODULE)
    monkeypatch.syspath_prepend(str(tmp_path))
    return f'{package.name}.models'


def test_a_friction_of_ones_own(module: str) -> None:
    sliding = {
        'guide__locked': ONLY_X,
        'guide__coulomb': (0.0, 0.2, 0.0, 0.0, 0.0),
        'initial__velocity': (0.0, 0.02, 0.0, 0.0, 0.0),
        'substeps': 20,
    }
    own = ideal_stage(effects__friction__model=module, **sliding)
    ours = ideal_stage(**sliding)
    assert states(own, 90) == pytest.approx(states(ours, 90), abs=2e-6)
    assert own.arrays.effects.friction.memory[1, 0] == 89 * 20
    assert not own.arrays.effects.friction.memory[0].any()


def test_a_motor_of_ones_own(module: str) -> None:
    stage = ideal_stage(
        guide__locked=(False, False, True, True, True),
        effects__motor__model=module,
        amplifier__bandwidth=0.0,
    )
    stage.write([0.1] * 4, [0.0, 0.5, 0.0, 0.5])
    stage.read()
    stage.read()
    assert stage.state[3] == pytest.approx(-2.0 * 20.0 / 10.6 * 1e-3, rel=1e-6)
    assert stage.state[1] == pytest.approx((9.81 - 4.0 * 17.0 / 6.9) * 1e-3, rel=1e-3)


def test_a_sensor_of_ones_own(module: str) -> None:
    stage = ideal_stage(guide__locked=ONLY_X, effects__sensor__model=module)
    stage.write(ZERO, [0.0, 1.0, 0.0, 1.0])
    smooth = 0.0
    for _ in range(30):
        sample = stage.read()
        smooth = 0.5 * (smooth + stage.state[2])
        assert sample.x == pytest.approx(smooth, abs=1e-18)
    assert np.allclose(sample.gap, 0.025)


@pytest.mark.parametrize('rounding', ['nearest', 'floor'])
def test_a_sensor_of_ones_own_has_no_zero_within_a_count(rounding: str, module: str) -> None:
    """It takes the place of the counts, so where they would begin is nowhere."""
    stage = ideal_stage(
        initial__position=(0.025, 3e-6, 0.0, 0.0, 0.0),
        encoder__gap_resolution=10e-6,
        encoder__horizontal_resolution=10e-6,
        effects__sensor__model=module,
        effects__sensor__rounding=rounding,
        effects__sensor__phase=(0.3,) * 6,
        effects__sensor__random_phase=True,
    )
    sample = stage.read()
    own = stage.truth().own_length
    assert list(own) == [*sample.gap, sample.x, sample.z]


@pytest.mark.parametrize('group', ['friction', 'motor', 'sensor'])
def test_what_is_no_model_is_refused_by_its_name(group: str, module: str) -> None:
    where = rf'effects\.{group}\.model'
    with pytest.raises(ParameterError, match=where):
        ideal_stage(**{f'effects__{group}__model': 'nowhere.at_all'})
    with pytest.raises(ParameterError, match=where):
        ideal_stage(**{f'effects__{group}__model': 'math.floor'})


@pytest.mark.parametrize(
    ('text', 'why'),
    [
        ('(velocity, level, step, memory):\n    return open("/dev/null")', "name 'open'"),
        ('(velocity, level):\n    return level', 'TypeError: too many positional arguments'),
        ('(velocity, level, step, memory):\n    memory[0] = 1.0', 'No conversion from none to'),
    ],
)
def test_one_that_does_not_compile_is_refused(
    text: str, why: str, module: str, tmp_path: Path
) -> None:
    package = module.partition('.')[0]
    (tmp_path / package / 'broken.py').write_text(f'def force{text}\n')
    with pytest.raises(ParameterError, match=f"whose 'force' cannot be compiled: .*{why}"):
        ideal_stage(effects__friction__model=f'{package}.broken')


FAILS = """
import math


def force(velocity, level, step, memory):
    return {force}


def forces(gap, i_d, i_q, out):
    {forces}


def reading(length, channel, sample, memory):
    return {reading}
"""


@pytest.mark.parametrize(
    ('group', 'body', 'why'),
    [
        ('friction', 'level / velocity', "'force' raised ZeroDivisionError: division by zero"),
        ('friction', 'memory[4]', "'force' raised IndexError: index is out of bounds"),
        ('motor', 'out[0] = 1.0', r"'forces' gives \[ 1\. nan\] at rest"),
        ('motor', 'out[2] = 0.0', "'forces' raised IndexError: index is out"),
        ('sensor', 'math.inf', "'reading' gives inf at rest"),
    ],
)
def test_one_that_fails_at_rest_is_refused(
    group: str, body: str, why: str, module: str, tmp_path: Path
) -> None:
    package = module.partition('.')[0]
    bodies = {'force': '0.0', 'forces': 'out[:] = 0.0', 'reading': 'length'}
    bodies[{'friction': 'force', 'motor': 'forces', 'sensor': 'reading'}[group]] = body
    (tmp_path / package / 'fails.py').write_text(FAILS.format(**bodies))
    with pytest.raises(ParameterError, match=rf"effects\.{group}\.model' is .*{why}"):
        ideal_stage(**{f'effects__{group}__model': f'{package}.fails'})


@pytest.mark.parametrize('group', ['friction', 'motor', 'sensor'])
def test_one_that_fails_in_flight_is_no_force_of_0(group: str, module: str, tmp_path: Path) -> None:
    package = module.partition('.')[0]
    bodies = {
        'force': '1.0 / (0.0 if velocity < 0.0 else 1.0)',
        'forces': 'out[:] = 1.0 / (0.0 if i_q > 0.0 else 1.0)',
        'reading': 'length / (0.0 if sample > 0 else 1.0)',
    }
    (tmp_path / package / 'falls.py').write_text(FAILS.format(**bodies))
    stage = ideal_stage(
        guide__coulomb=(0.0, 0.2, 0.0, 0.0, 0.0),
        guide__locked=ONLY_X,
        **{f'effects__{group}__model': f'{package}.falls'},
    )
    assert np.isfinite(stage.read().x)
    stage.write(ZERO, [0.0, 1.0, 0.0, 1.0])
    for _ in range(5):
        sample = stage.read()
    assert np.isnan(sample.x)


def test_a_model_is_compiled_once_and_kept(module: str) -> None:
    stages = [ideal_stage(effects__friction__model=module) for _ in range(2)]
    first, second = (stage.arrays.effects.friction.address for stage in stages)
    assert first == second
