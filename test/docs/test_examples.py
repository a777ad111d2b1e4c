"""The notebooks of examples/, as they stand there."""

from __future__ import annotations

import json
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest

from maglev_monitor.bag.errors import BagError

FOLDER = Path(__file__).resolve().parents[2] / 'examples'
NOTEBOOKS = sorted(path.stem for path in FOLDER.glob('*.ipynb'))


@pytest.fixture(autouse=True)
def _figures_are_closed() -> Iterator[None]:
    matplotlib.use('Agg')
    yield
    plt.close('all')


def cells(name: str) -> list[dict[str, Any]]:
    """The cells of a notebook."""
    found: list[dict[str, Any]] = json.loads((FOLDER / f'{name}.ipynb').read_text())['cells']
    return found


def executed(name: str, **parameters: object) -> types.SimpleNamespace:
    """What a notebook leaves; ``parameters`` stand for its cell with this tag."""
    given: dict[str, Any] = {'__name__': '__main__'}
    for cell in cells(name):
        if 'parameters' in cell['metadata'].get('tags', ()):
            given.update(parameters)
        elif cell['cell_type'] == 'code':
            exec(compile(''.join(cell['source']), name, 'exec'), given)
    return types.SimpleNamespace(**given)


def test_they_are_kept_without_outputs_and_all_run_here() -> None:
    assert NOTEBOOKS == [
        '1_first_flight',
        '2_your_own_controller',
        '3_from_a_bag_to_a_figure',
        '4_linear_analysis',
        '5_sweep_a_parameter',
    ]
    for name in NOTEBOOKS:
        for cell in cells(name):
            assert not cell.get('outputs')
            assert cell.get('execution_count') is None


def test_first_flight() -> None:
    left = executed('1_first_flight')
    assert left.flight.mean_error['y'] < left.noisy.mean_error['y'] < 1e-5


def test_your_own_controller(capsys: pytest.CaptureFixture[str]) -> None:
    left = executed('2_your_own_controller')
    assert left.default.mean_error['y'] < left.mine.mean_error['y'] < 5e-5
    assert 'the law Broken raised RuntimeError: afraid of heights' in capsys.readouterr().out


def test_from_a_bag_to_a_figure(bag: Path, tmp_path: Path) -> None:
    pytest.importorskip('pandas', reason='pandas comes with the test tools')
    left = executed('3_from_a_bag_to_a_figure', bag=bag, out=tmp_path / 'errors.pdf')
    assert (tmp_path / 'errors.pdf').read_bytes().startswith(b'%PDF')
    assert set(left.measured['phase']) <= {3, 4}
    assert len(left.errors['y']) > 0


def test_the_figure_goes_beside_the_newest_bag(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip('pandas', reason='pandas comes with the test tools')
    given, read = cells('3_from_a_bag_to_a_figure')[1:3]
    (tmp_path / 'examples').mkdir()
    monkeypatch.chdir(tmp_path / 'examples')
    left: dict[str, Any] = {}
    with pytest.raises(BagError, match='there is no bag'):
        exec(''.join(given['source'] + ['\n'] + read['source']), left)
    (tmp_path / 'runs' / 'flight' / 'bag').mkdir(parents=True)
    exec(''.join(given['source']), left)
    assert left['out'].resolve() == tmp_path / 'runs' / 'flight' / 'errors.pdf'


def test_linear_analysis() -> None:
    pytest.importorskip('control', reason='python-control comes with the test tools')
    left = executed('4_linear_analysis')
    assert left.stage.poles().real.max() > 10.0
    assert np.abs(left.response.states[0, -1] - 0.025) < 1e-5


def test_sweep_a_parameter(capsys: pytest.CaptureFixture[str]) -> None:
    left = executed('5_sweep_a_parameter')
    assert [bool(each.reason) for each in left.found] == [False] * 5 + [True]
    errors = [each.mean_error['y'] for each in left.flown]
    assert min(errors) < 0.95 * max(errors)
    assert not any(row.reason for row in left.rows)
    assert '60.0' in capsys.readouterr().out
