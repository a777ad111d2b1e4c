"""The parameter file with which the graph flies one machine of a campaign."""

from __future__ import annotations

from typing import Any

from maglev_model.axes import AXES
from maglev_model.parameters import read_yaml, ros_yaml, to_yaml
from maglev_monitor.metrics.run_parameters import NOT_CHECKED
from maglev_study.comparison.contestants import Contestant
from maglev_study.robustness.draw import Machine

_ELLIPSE = ('y', 'x', 'z', 'theta')  # what moves on it in 4DOF
_ERRORS = ('max_mean_error', 'max_error')  # limits, in the scenario's file for the default law


def sections(machine: Machine, contestant: Contestant) -> str:
    """Sections of the nodes, over those of the 4DOF ellipse and of the campaign's overlays.

    What the contestant does not move stays. A law but the default is allowed what errors its own
    file says, and any where that says none.
    """
    found = [to_yaml(machine.plant, 'plant'), to_yaml(contestant.controller, 'controller')]
    moves = dict(zip(AXES, contestant.moves, strict=True))
    still = {axis: {'amplitude': [0.0]} for axis in _ELLIPSE if not moves[axis]}
    if still:
        found.append(_section('reference', {'sinusoids': still}))
    if contestant.name != 'default':
        own = read_yaml(contestant.file, 'monitor') if contestant.file else {}
        limits = {name: own.get(f'limits.{name}', [NOT_CHECKED] * len(AXES)) for name in _ERRORS}
        found.append(_section('monitor', {'limits': limits}))
    return ''.join(found)


def _section(node: str, content: dict[str, Any]) -> str:
    return ros_yaml.dump({node: {'ros__parameters': content}})
