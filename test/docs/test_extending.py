"""The examples of docs/extending.md, as they stand there."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage
from maglev_model.parameters import ParameterError, build
from maglev_monitor.bag.analysis import analyse
from maglev_monitor.bag.reader import Bag
from maglev_monitor.metrics.joiner import Joiner
from maglev_monitor.metrics.run_metrics import RunMetrics
from maglev_monitor.metrics.run_parameters import RunParameters
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_reference.parameters import ReferenceParameters
from maglev_study.flight import fly

MODULES = (
    'law.py',
    'node.py',
    'sliding.py',
    'lqr.py',
    'boards.py',
    'path.py',
    'effort.py',
    'models.py',
)
TEXT = (Path(__file__).resolve().parents[2] / 'docs' / 'extending.md').read_text(encoding='utf-8')


@pytest.fixture(autouse=True)
def my_stage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A package with the modules of the page."""
    folder = tmp_path / 'my_stage'
    folder.mkdir()
    for block in re.findall(r'```python\n# my_stage/(\w+\.py)\n(.*?)```', TEXT, re.DOTALL):
        (folder / block[0]).write_text(block[1], encoding='utf-8')
    monkeypatch.syspath_prepend(str(tmp_path))
    yield folder
    for name in [name for name in sys.modules if name.startswith('my_stage')]:
        del sys.modules[name]


def test_every_module_of_the_page_is_there(my_stage: Path) -> None:
    names = {path.name for path in my_stage.iterdir()}
    assert names == set(MODULES)


def test_a_law_flies() -> None:
    overlay = re.search(r'```yaml\n(.*?)```', TEXT, re.DOTALL)
    assert overlay is not None
    given = yaml.safe_load(overlay[1])['controller']['ros__parameters']
    flight = fly('ellipse', duration=3.0, controller=given)
    default = fly('ellipse', duration=3.0)
    assert 1e-6 < flight.mean_error['y'] < 1e-4
    assert flight.mean_error['y'] != default.mean_error['y']


@pytest.mark.parametrize('law', ['sliding', 'lqr'])
def test_any_object_flies(law: str) -> None:
    """Both kinds on the benchmark plant, from the stop and back to it."""
    flight = fly('ellipse_4dof', duration=3.0, controller={'law': f'my_stage.{law}'})
    for axis in ('y', 'x', 'z', 'theta'):
        assert 1e-6 < flight.mean_error[axis] < 2e-4
    assert flight.output[-1, 0] == pytest.approx(0.031, abs=1e-5)


def test_a_driver_carries_the_bridge(tmp_path: Path) -> None:
    given = {'driver': 'my_stage.boards', 'boards.memory': str(tmp_path / 'bench.json')}
    stage = BridgeStage(build(BridgeParameters, given))
    stage.configure()
    stage.home(vouched=True)  # nothing could be lifted
    time.sleep(0.5)  # nothing is known of these amplifiers: they count as hot
    stage.activate()
    sample = stage.read()
    assert sample.gap == pytest.approx([0.031] * 4)
    stage.write(np.full(4, -0.1), np.zeros(4))
    assert np.any(stage.driver.volts)  # type: ignore[attr-defined]
    stage.close()
    assert not np.any(stage.driver.volts)  # type: ignore[attr-defined]


def test_models_of_ones_own_make_the_plant() -> None:
    overlays = re.findall(r'```yaml\n(.*?)```', TEXT, re.DOTALL)
    given = next(yaml.safe_load(text) for text in overlays if 'effects' in text)
    groups = given['/**']['ros__parameters']['effects']
    hanging = {'initial.position': (0.025, 0.0, 0.0, 0.0, 0.0)}
    models = {f'effects.{group}.model': value['model'] for group, value in groups.items()}
    stage = SimulatedStage(build(PlantParameters, {**hanging, **models}))
    for _ in range(4):
        sample = stage.read()
    assert stage.state[1] == pytest.approx((9.81 - 4.0 * 25.0 / 6.9) * 3e-3, rel=0.1)
    assert sample.gap[0] == pytest.approx(stage.state[0], abs=20e-6)
    counts = sample.gap[0] / 1e-6
    assert counts == pytest.approx(round(counts), abs=1e-6)


def test_a_trajectory_is_checked_and_flown() -> None:
    flight = fly('my_stage.path', duration=3.0)
    gap = flight.reference.position[:, 0]
    assert gap.min() == pytest.approx(0.023, abs=1e-6)
    assert flight.mean_error['y'] < 1e-5


def test_a_trajectory_that_is_none_is_refused() -> None:
    with pytest.raises(ParameterError, match="'trajectory' is 'elipse', it must be one of hold"):
        build(ReferenceParameters, {'trajectory': 'elipse'})
    with pytest.raises(ParameterError, match=r"'my_stage\.nothing', which cannot be imported"):
        fly('my_stage.nothing', duration=1.0)


def test_a_metric_is_computed(bag: Path) -> None:
    run = build(RunParameters, {'metrics.modules': ('my_stage.effort',)})
    metrics, joiner = RunMetrics(run), Joiner()
    plain = analyse(bag)
    rows = []

    for batch in Bag(bag).batches():
        for key, records in batch.samples.items():
            joiner.add(key, records)
    for block in joiner.finish():
        rows.append(metrics.add(block))
    result = metrics.result()
    joined = np.concatenate(rows)
    wanted = np.square(joined['direct_current'][joined['has_currents']]).sum(axis=1).mean()
    effort = result['further']['my_stage.effort']['direct_effort']
    assert effort == pytest.approx(wanted)
    assert result['axes'] == plain.result['axes']
