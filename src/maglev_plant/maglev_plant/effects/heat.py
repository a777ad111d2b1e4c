"""Warm magnets are weaker, warm copper resists more; both rise exponentially in time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from maglev_model.compiled import borrowing
from maglev_model.compiled.records import Record

if TYPE_CHECKING:
    from maglev_plant.parameters import PlantParameters

REMANENCE: Final = -1.1e-3
"""Of NdFeB magnets, as their makers give it [1/K]."""

COPPER: Final = 3.9e-3
"""Of copper's resistance [1/K]."""


class HeatArrays(Record):
    """Where the temperatures go."""

    on: bool
    magnets: float  # [K]
    copper: float  # [K]
    rate: float  # [1/s], 0: at once


def heat_arrays(parameters: PlantParameters) -> HeatArrays:
    """The rises of a stage."""
    heat = parameters.effects.heat
    return HeatArrays(
        on=heat.magnets != 0.0 or heat.copper != 0.0,
        magnets=heat.magnets,
        copper=heat.copper,
        rate=1.0 / heat.time if heat.time > 0.0 else 0.0,
    )


@borrowing
def warm_factors(heat: HeatArrays, time: float) -> tuple[float, float]:
    """Strength of the magnets and resistance at a time [s], by those of the cold machine."""
    share = -math.expm1(-heat.rate * time) if heat.rate > 0.0 else 1.0
    return 1.0 + REMANENCE * heat.magnets * share, 1.0 + COPPER * heat.copper * share
