"""What view and web take. No ROS here."""

from __future__ import annotations

import dataclasses

from maglev_model.machine import MachineParameters
from maglev_model.parameters import group, parameter


@dataclasses.dataclass(frozen=True, kw_only=True)
class StageParameters:
    """What is looked at."""

    machine: MachineParameters = group(MachineParameters)
    peak_current: float = parameter(
        7.0, 'amplitude at which a motor is drawn in red', unit='A', within=(0.01, 1000.0)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class ViewParameters(StageParameters):
    """How often and how the standard topics are published."""

    rate: float = parameter(
        50.0, 'of joints, frames and poses, in stage time', unit='Hz', within=(0.1, 200.0)
    )
    marker_rate: float = parameter(
        10.0, 'of the force arrows, in stage time', unit='Hz', within=(0.1, 200.0)
    )
    path_period: float = parameter(
        1.0, 'from path to path, in stage time', unit='s', within=(0.1, 60.0)
    )
    path_points: int = parameter(1000, 'longest path of the reference', within=(2, 100_000))
    path_step: float = parameter(
        2e-4, 'least distance of two points of the path', unit='m', within=(1e-6, 1.0)
    )
    force_scale: float = parameter(
        4e-3, 'length of an arrow over its force', unit='m/N', within=(1e-6, 1.0)
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class WebParameters(StageParameters):
    """Where the page is served and what it shows."""

    host: str = parameter(
        '127.0.0.1', 'address to serve the page at; 0.0.0.0: to everybody', read_only=True
    )
    port: int = parameter(
        8080, 'port of the page, or the next one that is free', within=(0, 65535), read_only=True
    )
    sample_time: float = parameter(
        1e-3, 'stage time from sample to sample', unit='s', within=(1e-5, 1.0), read_only=True
    )
    rate: float = parameter(
        25.0, 'how often the page is told where the platen is', unit='Hz', within=(1.0, 60.0)
    )
    window: float = parameter(
        10.0, 'what the plots show, in stage time', unit='s', within=(0.5, 600.0)
    )
    bins: int = parameter(
        500, 'points of a curve, each the least and the greatest of its bin', within=(50, 5000)
    )
    path_points: int = parameter(400, 'longest path', within=(2, 5000))
    path_step: float = parameter(
        5e-4, 'least distance of two points of a path', unit='m', within=(1e-6, 1.0)
    )
