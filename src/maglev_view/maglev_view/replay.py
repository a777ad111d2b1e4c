"""A flight in 3D that plays, scrubs and changes speed in any browser: one page. No ROS here.

    replay runs/ellipse-…

The page holds the flight and the player; nothing is fetched.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import NoReturn

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.programs.command import leave_with
from maglev_model.programs.progress import Progress
from maglev_monitor.bag.analysis import Analysis, analyse
from maglev_monitor.bag.errors import BagError, refuse
from maglev_monitor.bag.reader import run_folder
from maglev_monitor.metrics.curves import COLUMNS
from maglev_monitor.metrics.result_file import write_whole
from maglev_monitor.report.page import REPLAY
from maglev_view.frames import Vector, platen_pose

MAGNIFIED = 10.0
"""How many times the tilts are shown."""

WRONG, NO_VISER = 2, 3
"""Exit codes: no page, for the reason that is said; and because viser is not installed."""

_MISSING = "a flight in 3D needs viser: 'MAGLEV_SETUP=view source setup.sh' installs it"


def replay(analysis: Analysis) -> str:
    """The page of a flight, as HTML. Needs viser."""
    from maglev_view.web.scene import StageScene
    from maglev_view.web.server import FITTING, serve, stop

    whole, run, source = analysis.curves.whole_run, analysis.run, analysis.result['error_source']
    outputs, wanted = whole.first[:, COLUMNS[source]], whole.first[:, COLUMNS['reference']]
    currents = np.hypot(
        whole.first[:, COLUMNS['direct_current']], whole.first[:, COLUMNS['quadrature_current']]
    )
    step = whole.width * run.sample_time
    server = serve('127.0.0.1', 0)
    try:
        scene = StageScene(server.scene, run.machine)
        scene.draw(_path(outputs), _path(wanted))
        scene.say(f'tilts {MAGNIFIED:g} times as large')
        recording = server.get_scene_serializer()
        for here, there, amplitudes in zip(outputs, wanted, currents, strict=True):
            scene.place(_known(here), _known(there), MAGNIFIED)
            scene.colour(np.nan_to_num(amplitudes) / run.metrics.peak_current)
            recording.insert_sleep(step)
        page: str = recording.as_html()
    finally:
        stop(server)
    return page.replace('<head>', f'<head><script>{{{FITTING}}}</script>', 1)


def _known(outputs: FloatArray) -> FloatArray | None:
    return outputs if np.isfinite(outputs).all() else None


def _path(outputs: FloatArray) -> list[Vector]:
    return [platen_pose(row)[0] for row in outputs[np.isfinite(outputs).all(axis=1)]]


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command: 0, or one of the codes above with a line that says why."""
    parser = argparse.ArgumentParser(prog='replay', description='A recorded flight in 3D.')
    parser.add_argument('bag', type=Path, metavar='BAG', help="a run's folder, a bag, or its file")
    parser.add_argument(
        '--out', type=Path, metavar='DIR', help=f'where {REPLAY} goes (default: beside the bag)'
    )
    given = parser.parse_args(arguments)
    if find_spec('viser') is None:
        return refuse('replay', _MISSING, NO_VISER)
    page = (given.out or run_folder(given.bag)) / REPLAY
    try:
        analysis = analyse(given.bag, Progress('replay', '%', lines=False))
        write_whole(page, replay(analysis))
    except BagError as error:
        return refuse('replay', error, WRONG)
    except OSError as error:
        return refuse('replay', f"cannot write to '{page.parent}': {error.strerror}", WRONG)
    for note in analysis.notes:
        print(f'replay: {note}', file=sys.stderr)
    print(f'replay: {page}')
    return 0


def main() -> NoReturn:
    """Entry point of the executable ``replay``."""
    leave_with(run)


if __name__ == '__main__':
    main()
