"""The flight in 3D from its bag; what it looks like is seen in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from bag_fixtures import bag, encoder, messages, run

from maglev_view.replay import run as make_replay

__all__ = ['bag', 'encoder', 'messages', 'run']


def test_a_bag_that_was_cut_off_is_shown_as_far_as_it_goes(
    bag: Path, tmp_path: Path, capsys: Any
) -> None:
    pytest.importorskip('viser', reason='viser comes with the test tools')
    (tmp_path / 'cut.mcap').write_bytes((bag / 'bag_0.mcap').read_bytes()[:-200_000])
    assert make_replay([str(tmp_path / 'cut.mcap')]) == 0
    assert (tmp_path / 'replay.html').is_file()
    (note,) = capsys.readouterr().err.splitlines()
    assert note.startswith("replay: 'cut.mcap' is not whole, it was cut off")
