"""The machine as a library: ``import maglev_study as maglev``. No ROS, and no part of a flight.

``simulate`` runs the plant under a function, ``fly`` a whole flight, ``sweep`` one for each value
of a parameter, ``batch`` one for each of many machines over the cores; ``read`` gives the run in a
bag, ``linearise`` and ``nonlinear_plant`` what python-control works on. See docs/library.md. What a
name needs is imported when it is first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from maglev_controller.parameters import ControllerParameters as ControllerParameters
    from maglev_model.parameters import build as build
    from maglev_monitor import read as read
    from maglev_plant.parameters import PlantParameters as PlantParameters
    from maglev_reference.parameters import ReferenceParameters as ReferenceParameters
    from maglev_study.flight import FlightRecord as FlightRecord
    from maglev_study.flight import fly as fly
    from maglev_study.library import Swept as Swept
    from maglev_study.library import batch as batch
    from maglev_study.library import simulate as simulate
    from maglev_study.library import sweep as sweep
    from maglev_study.linear import hover_currents as hover_currents
    from maglev_study.linear import linearise as linearise
    from maglev_study.linear import nonlinear_plant as nonlinear_plant

_MODULES = {
    'ControllerParameters': 'maglev_controller.parameters',
    'FlightRecord': 'maglev_study.flight',
    'PlantParameters': 'maglev_plant.parameters',
    'ReferenceParameters': 'maglev_reference.parameters',
    'Swept': 'maglev_study.library',
    'batch': 'maglev_study.library',
    'build': 'maglev_model.parameters',
    'fly': 'maglev_study.flight',
    'hover_currents': 'maglev_study.linear',
    'linearise': 'maglev_study.linear',
    'nonlinear_plant': 'maglev_study.linear',
    'read': 'maglev_monitor',
    'simulate': 'maglev_study.library',
    'sweep': 'maglev_study.library',
}

__all__ = tuple(_MODULES)


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module 'maglev_study' has no attribute '{name}'")
    found = getattr(importlib.import_module(_MODULES[name]), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_MODULES})
