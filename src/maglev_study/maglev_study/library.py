"""The plant under a function; one flight for each value of a parameter, or for each machine."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import MeasurementFault
from maglev_model.axes import AXES
from maglev_model.contract.stage import EncoderSample
from maglev_model.parameters import ParameterError, specs, unknown_parameter
from maglev_plant import simulation
from maglev_plant.parameters import PlantParameters
from maglev_reference.parameters import ReferenceParameters
from maglev_study.arguments import a_table
from maglev_study.closed_loop import LawFault
from maglev_study.flight import FlightRecord, fly
from maglev_study.workers import results

NODES = {
    'plant': PlantParameters,
    'controller': ControllerParameters,
    'reference': ReferenceParameters,
}


def simulate(
    law: Callable[[EncoderSample], tuple[ArrayLike, ArrayLike]],
    duration: float,
    *,
    plant: PlantParameters | None = None,
) -> simulation.Trajectory:
    """The simulated stage under a function of yours, from sample 0 for ``duration`` [s].

    ``law`` takes what the encoders read, ``gap`` (4,), ``x`` and ``z`` [m], and returns i_d and i_q
    of motors 1..4 [A], (4,) each. Row k of what comes back is sample k. Raises TypeError for what
    is no function or no :class:`PlantParameters`, ValueError for a duration that is none and for
    currents that are not finite or not four.
    """
    if not callable(law):
        raise TypeError(
            f"'law' is a {type(law).__name__}, it takes a function of the encoders' reading that "
            'returns i_d and i_q; parameters are given as plant=PlantParameters(...)'
        )
    parameters = a_table(PlantParameters, plant, 'plant')
    if not (math.isfinite(duration) and duration > 0.0):
        raise ValueError(f"'duration' is {duration} s, it must be finite and above 0")
    return simulation.simulate(parameters, law, duration)


@dataclasses.dataclass(frozen=True)
class Swept:
    """One flight of a sweep or batch: the parameter's ``value``, or the machine, and how it went.

    ``mean_error`` and ``largest_error`` by axis over the measured samples [m, rad]; ``saturated``
    the share of all samples with a limited current. Where it did not fly, these are NaN and
    ``reason`` says why; it is empty otherwise.
    """

    value: Any
    mean_error: dict[str, float]
    largest_error: dict[str, float]
    saturated: float
    reason: str = ''


def sweep(
    parameter: str,
    values: Iterable[Any],
    trajectory: str | None = None,
    *,
    duration: float | None = None,
    jobs: int = 1,
    **given: Any,
) -> list[Swept]:
    """Fly once for each of ``values`` of a parameter, which is named with its node.

    ``sweep('controller.y.bandwidth', (100.0, 200.0), 'ellipse', duration=5.0)``; all else is given
    as to :func:`~maglev_study.flight.fly`. In processes of their own with more than one of
    ``jobs``. A value that is refused, or with which the platen is given up or the law fails, has
    its reason in the result. Raises ParameterError for a name that no parameter of a node has, and
    for ``jobs`` that are no whole number from 1 to 512.
    """
    node, dot, name = parameter.partition('.')
    if node not in NODES or not dot:
        raise ParameterError(
            f"'{parameter}' names no node, it must begin with one of "
            f'{", ".join(f"{node}." for node in NODES)} as in controller.y.bandwidth'
        )
    known = specs(NODES[node])
    if name not in known:
        raise unknown_parameter(name, known)
    shared = given.pop(node, None) or {}
    if not isinstance(shared, Mapping):
        raise TypeError(f"'{node}' is swept over, so it takes a dict of parameters by name")
    given |= {'trajectory': trajectory, 'duration': duration}
    return _fly_each([(value, {**given, node: {**shared, name: value}}) for value in values], jobs)


def batch(
    machines: Iterable[PlantParameters | Mapping[str, object]],
    trajectory: str | None = None,
    *,
    duration: float | None = None,
    jobs: int | None = None,
    **given: Any,
) -> list[Swept]:
    """Fly each of many machines once, over the cores; in their order, how it went.

    ``batch([{'offset.mass_y': 1.05}, {'offset.K_h': 0.95}], 'ellipse', duration=5.0)``; a machine
    is what :func:`~maglev_study.flight.fly` takes for ``plant``, and all else is given as to it.
    ``jobs`` processes, by default one for each core; equal calls give equal results, bit for bit,
    however many. A machine that is refused, or given up, or on which the law fails, has its reason
    in the result. Raises TypeError for what is no machine, ParameterError for ``jobs`` as
    :func:`sweep` does.
    """
    if 'plant' in given:
        raise TypeError("'plant' is what the machines are")
    given |= {'trajectory': trajectory, 'duration': duration}
    wanted = [(machine, {**given, 'plant': machine}) for machine in machines]
    return _fly_each(wanted, (os.cpu_count() or 1) if jobs is None else jobs)


def _fly_each(wanted: Sequence[tuple[Any, Mapping[str, Any]]], jobs: int) -> list[Swept]:
    tasks = [(place, value, given) for place, (value, given) in enumerate(wanted)]
    found = dict(results(_fly_one, tasks, jobs=jobs))
    return [found[place] for place in range(len(tasks))]


def _fly_one(place: int, value: Any, given: Mapping[str, Any]) -> tuple[int, Swept]:
    try:
        return place, _swept(value, fly(**given))
    except (ParameterError, MeasurementFault, LawFault) as error:
        nothing = dict.fromkeys(AXES, math.nan)
        return place, Swept(value, nothing, dict(nothing), math.nan, str(error))


def _swept(value: Any, flight: FlightRecord) -> Swept:
    largest = np.abs(flight.error[flight.measured]).max(axis=0)
    return Swept(
        value,
        flight.mean_error,
        {axis: float(most) for axis, most in zip(AXES, largest, strict=True)},
        float(flight.run.saturated.mean()),
    )
