"""What the graph is told of one machine, and of axes that are locked."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from maglev_model.axes import AXES, FloatArray, Z
from maglev_model.parameters import from_yaml, read_yaml
from maglev_reference.parameters import ReferenceParameters
from maglev_study.comparison.experiments import tracking
from maglev_study.comparison.flight import Flight
from maglev_study.robustness.draw import NOMINAL
from maglev_study.robustness.fleet import make_plan
from maglev_study.robustness.fly import FLOWN, fly
from maglev_study.robustness.main import run

PARAMS = Path(__file__).resolve().parents[3] / 'params'
ERRORS = ('limits.max_mean_error', 'limits.max_error')


@pytest.fixture
def locked(tmp_path: Path) -> Path:
    """An overlay for a stage whose z is locked."""
    path = tmp_path / 'locked.yaml'
    body = '{guide: {locked: [false, false, true, false, false]}}'
    path.write_text(f'/**: {{ros__parameters: {body}}}\n', encoding='utf-8')
    return path


def test_a_locked_axis_is_not_asked_to_move(locked: Path) -> None:
    plan = make_plan(PARAMS, 1, overlays=[locked])
    (law,) = plan.contestants
    assert [axis for axis, moves in zip(AXES, law.moves, strict=True) if not moves] == ['z']
    found = plan.experiments(law)
    free = make_plan(PARAMS, 1)
    for one, before in zip(found, free.experiments(free.contestants[0]), strict=True):
        others = np.arange(len(AXES)) != Z
        for part, whole in zip(one.references, before.references, strict=True):
            assert not part[:, Z].any()
            assert np.array_equal(part[:, others], whole[:, others])
    (flown,) = fly(plan.draw(law, NOMINAL), law, ['ellipse'])
    assert flown.verdict == FLOWN
    assert flown.mean[Z] == 0.0


def test_nor_by_the_comparison(locked: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[FloatArray] = []

    def follow(_: Flight, references: Any) -> None:
        asked.append(references.position[:, Z])

    monkeypatch.setattr(Flight, 'follow', follow)
    (law,) = make_plan(PARAMS, 1, overlays=[locked]).contestants
    assert tracking(law, 1.0)
    assert asked
    assert not np.concatenate(asked).any()


def written(tmp_path: Path, *arguments: str) -> Path:
    """The file of machine 1."""
    assert run(['--params', str(PARAMS), '--out', str(tmp_path), '--replay', '1', *arguments]) == 0
    return tmp_path / 'machine-1.yaml'


def test_nor_by_the_graph(locked: Path, tmp_path: Path) -> None:
    files = PARAMS / 'scenario_ellipse_4dof.yaml', written(tmp_path, '--overlay', str(locked))
    course = from_yaml(ReferenceParameters, 'reference', *files).sinusoids
    assert (course.z.amplitude, course.x.amplitude) == ((0.0,), (0.03,))


def test_the_limits_of_the_default_law_are_no_other_law_s(tmp_path: Path) -> None:
    assert not read_yaml(written(tmp_path), 'monitor')
    found = read_yaml(written(tmp_path, '--law', 'feedback_soi'), 'monitor')
    assert found == dict.fromkeys(ERRORS, [-1.0] * len(AXES))
    mine = tmp_path / 'mine.yaml'
    bound = [1e-3, 2e-3, 3e-3, 4e-3, 5e-3]
    own = f'{{max_error: {bound}, max_overshoot: 3.0}}'
    mine.write_text(f'monitor: {{ros__parameters: {{limits: {own}}}}}\n', encoding='utf-8')
    found = read_yaml(written(tmp_path, '--law', str(mine)), 'monitor')
    assert found == dict(zip(ERRORS, ([-1.0] * len(AXES), bound), strict=True))
