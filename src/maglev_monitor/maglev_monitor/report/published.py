"""What the paper measured of the same: its steps and its ellipses, found in a run. No ROS here."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from maglev_model.axes import PHI, THETA, X, Y, Z
from maglev_model.paper import ELLIPSE, STEPS, TRACKING, PublishedStep, PublishedTracking
from maglev_monitor.bag.analysis import Analysis
from maglev_monitor.metrics.curves import COLUMNS

_SAME = 1e-7  # [m, rad]
_ROUND = 1e-4  # of the speed, by which one may differ that differences give


def published_tracking(analysis: Analysis) -> PublishedTracking | None:
    """The paper's ellipse that is followed, by its shape and speed and not by a name; or None."""
    sequence, values = analysis.curves.tail
    reference = values[:, COLUMNS['reference']]
    if len(sequence) < 2 or not np.isfinite(reference).all():
        return None
    x, z, theta = reference[:, X], reference[:, Z], reference[:, THETA]
    time = np.diff(sequence) * analysis.run.sample_time
    chord = 2.0 * ELLIPSE.radius * np.sin(0.5 * ELLIPSE.frequency * time)
    way = np.hypot(np.diff(x), np.diff(z))
    shape = (
        np.hypot(x, z) - ELLIPSE.radius,
        reference[:, Y] - ELLIPSE.gap - ELLIPSE.climb * x,
        reference[:, PHI],
    )
    if max(np.abs(part).max() for part in shape) > _SAME or np.abs(way / chord - 1).max() > _ROUND:
        return None
    for name, tilt in (('ellipse', 0.0), ('ellipse_4dof', ELLIPSE.tilt)):
        if np.abs(theta - tilt * z).max() < _SAME:
            return TRACKING[name]
    return None


def published_step(step: Mapping[str, Any]) -> PublishedStep | None:
    """The paper's step that a step of ``metrics.json`` is; or None."""
    for known in STEPS:
        ends = (step['from'] - known.start, step['to'] - known.target)
        if step['axis'] == known.axis and max(map(abs, ends)) < _SAME:
            return known
    return None


def first_number(words: str) -> float:
    """The number in a figure that the paper gives in words, as ``about 5 s``."""
    found = re.search(r'[0-9]+(\.[0-9]+)?', words)
    assert found is not None
    return float(found[0])
