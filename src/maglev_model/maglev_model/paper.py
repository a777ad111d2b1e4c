"""What the paper measured on its machine (section IV): figures to set beside a run's. No ROS."""

from __future__ import annotations

import math
from typing import NamedTuple


class PublishedStep(NamedTuple):
    """A step and what the paper says of it, in its words: of the step itself in Figs. 4 and 5,
    elsewhere Table III for its axis. Set-points in [m] or [rad]."""

    axis: str
    start: float
    target: float
    overshoot: str = '< 30 %'
    settling_time: str = '< 3 s'
    encoder_time: str = '< 10 s'


class PublishedTracking(NamedTuple):
    """An ellipse: its name and mean |e| over 60 s by axis [m, rad]; axes not named were not
    published."""

    title: str
    mean_error: dict[str, float]


class Ellipse(NamedTuple):
    """The ellipse of section IV-B: a circle in x and z, on which y and theta follow x and z."""

    radius: float  # [m]
    frequency: float  # [rad/s]
    gap: float  # y where x is 0 [m]
    climb: float  # of y over x
    tilt: float  # of theta over z, in 4DOF [rad/m]


ELLIPSE = Ellipse(radius=0.03, frequency=1.5 * math.pi, gap=0.025, climb=1.0 / 6.0, tilt=1.0 / 3.0)

STEPS = (
    PublishedStep('y', 0.020, 0.027, '14.3 %', '< 3 s', 'about 5 s'),
    PublishedStep('y', 0.030, 0.025),
    PublishedStep('y', 0.025, 0.030),
    PublishedStep('x', 0.0, 0.03),
    PublishedStep('z', 0.0, 0.03),
    PublishedStep('theta', 0.0, 0.005),
    PublishedStep('theta', 0.0, 0.01, '22 %', '< 5 s', '< 10 s'),
)
"""The steps of Table III, Figs. 4 and 5."""

TRACKING = {
    'ellipse': PublishedTracking('ellipse, 3DOF', {'y': 33.04e-6, 'x': 78.33e-6, 'z': 68.25e-6}),
    'ellipse_4dof': PublishedTracking(
        'ellipse, 4DOF', {'y': 47.03e-6, 'x': 77.98e-6, 'z': 76.85e-6, 'theta': 123.9e-6}
    ),
}
"""The ellipses of section IV-B, Figs. 6 to 8, by scenario."""

SCENARIOS = ('steps', *TRACKING)
"""The scenarios in which the paper's experiments are run."""

WINDOW = 60.0
"""The time over which the paper takes mean errors [s]."""
