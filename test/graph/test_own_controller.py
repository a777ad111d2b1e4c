"""The controller of docs/extending.md, as it stands there, in the place of the project's own."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from flight import BRISK, ELLIPSE, WATCHED, landed_without_current
from graph import Nodes, Observer

from maglev_model.contract.phases import Phase
from maglev_node.topics import CONTROLLER_PROGRESS, CONTROLLER_STATE, REFERENCE, TRUE_STATE

PAGE = Path(__file__).resolve().parents[2] / 'docs' / 'extending.md'


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The command that starts it."""
    text = PAGE.read_text(encoding='utf-8')
    module = re.search(r'```python\n# my_stage/node\.py\n(.*?)```', text, re.DOTALL)
    assert module is not None
    (tmp_path / 'my_stage').mkdir()
    (tmp_path / 'my_stage' / 'node.py').write_text(module[1], encoding='utf-8')
    path = os.pathsep.join((str(tmp_path), os.environ.get('PYTHONPATH', '')))
    monkeypatch.setenv('PYTHONPATH', path)
    return [sys.executable, '-m', 'my_stage.node']


@pytest.mark.parametrize('stage', ['plant', 'hw_bridge'])
def test_it_flies_the_ellipse_on_either_stage(
    nodes: Nodes, watching: Observer, own: list[str], stage: str
) -> None:
    files = ('benchmark.yaml', 'hw_bridge.yaml')[: 1 + (stage == 'hw_bridge')]
    nodes.start(stage, WATCHED, params=files)
    nodes.run('controller', own)
    reference = nodes.start(
        'reference',
        *(WATCHED, *BRISK, 'run_in:=0.5', 'duration:=1.0', 'exit_at_end:=true'),
        params=(ELLIPSE,),
        remap=(f'{CONTROLLER_PROGRESS}:={CONTROLLER_STATE}',),
    )
    assert reference.wait(90.0) == 0, reference.output
    topics = watching.look()
    wanted = {m.sequence: m.position[:3] for m in topics[REFERENCE] if m.phase == Phase.TRACK}
    true = {m.sequence: m.state[[0, 2, 4]] for m in topics[TRUE_STATE] if m.sequence in wanted}
    assert len(true) == 1000
    assert max(np.max(np.abs(true[n] - wanted[n])) for n in true) < 60e-6
    own_word = [m.error[:3] for m in topics[CONTROLLER_STATE] if m.sequence in wanted]
    assert len(own_word) > 100  # it waits for nobody who listens to it
    assert np.max(np.abs(own_word)) < 60e-6
    assert min(m.state[0] for m in topics[TRUE_STATE]) < 0.026
    watching.wait(lambda: landed_without_current(watching))
