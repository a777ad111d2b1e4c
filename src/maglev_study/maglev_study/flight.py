"""A whole flight in one call, from the lower stop and back to it, without ROS.

from maglev_study.flight import fly
print(fly('ellipse', duration=20.0).mean_error)
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from maglev_controller.foreign_law import Law
from maglev_controller.learning import IterativeLearning, iterative_learning
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.axes import AXES, FloatArray
from maglev_model.contract.phases import Phase
from maglev_model.parameters import ParameterError, from_yaml, replace
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_reference.parameters import TRAJECTORIES, ReferenceParameters
from maglev_reference.timeline import Timeline
from maglev_study.closed_loop import Run, run
from maglev_study.references import References

T = TypeVar('T')

ELLIPSE: Mapping[str, object] = {
    'trajectory': 'sinusoids',
    'sinusoids.y.amplitude': (0.005,),
    'sinusoids.y.phase': (-math.pi / 2,),
    'sinusoids.x.amplitude': (0.03,),
    'sinusoids.x.phase': (-math.pi / 2,),
    'sinusoids.z.amplitude': (0.03,),
}
"""The paper's ellipse (section IV-B), as parameters of the reference."""

ELLIPSE_4DOF: Mapping[str, object] = {**ELLIPSE, 'sinusoids.theta.amplitude': (0.01,)}
"""The paper's ellipse with a rotation about the Z axis."""

_NAMED = {'ellipse': ELLIPSE, 'ellipse_4dof': ELLIPSE_4DOF}


@dataclasses.dataclass(frozen=True)
class FlightRecord:
    """What happened in the n samples of a flight; row k is sample k.

    ``time`` (n,) [s]; ``phase`` (n,) of :class:`maglev_model.contract.phases.Phase`; ``reference``
    what was to be followed, (n, 5) each; ``run`` the true states and the currents; ``learning``
    what was learned, where ``learning.period`` of the controller asks for it.
    """

    time: FloatArray
    phase: NDArray[np.uint8]
    reference: References
    run: Run
    learning: IterativeLearning | None = None

    @property
    def output(self) -> FloatArray:
        """The true outputs y, x, z, phi, theta (n, 5) [m, rad]."""
        return self.run.output

    @property
    def error(self) -> FloatArray:
        """True outputs less reference (n, 5) [m, rad]."""
        return self.output - self.reference.position

    @property
    def measured(self) -> NDArray[np.bool_]:
        """The samples (n,) in which errors count: on the trajectory after its run-in, or steps."""
        return np.isin(self.phase, (Phase.TRACK, Phase.STEP))

    @property
    def mean_error(self) -> dict[str, float]:
        """Mean |e| by axis over the measured samples [m, rad]."""
        mean = np.abs(self.error[self.measured]).mean(axis=0)
        return {axis: float(value) for axis, value in zip(AXES, mean, strict=True)}


def fly(
    trajectory: str | None = None,
    *,
    duration: float | None = None,
    files: Sequence[str | Path] | str | Path = (),
    plant: PlantParameters | Mapping[str, object] | None = None,
    controller: ControllerParameters | Mapping[str, object] | None = None,
    reference: Mapping[str, object] | None = None,
    law: Law | None = None,
) -> FlightRecord:
    """Lift off, follow a trajectory, land: simulated stage, regulator and reference in lockstep.

    ``trajectory`` is ``ellipse``, ``ellipse_4dof`` or one of the reference's own; ``duration`` [s]
    the time that is measured. All parameters have the nodes' defaults, the benchmark plant among
    them. ``files`` are parameter files as the nodes take them, the later winning; what is given
    here by name wins over them, ``plant={'encoder.gap_noise': 1e-6}``; a whole table is taken as it
    is, and ``files`` do not change it. The reference has the controller's
    ``internal_model.fundamental``, which trajectories without a frequency of their own follow.
    ``law``, an object as in docs/extending.md, answers in place of the controller's own.

    Raises ParameterError naming what is wrong with a parameter or out of the reference's reach, and
    MeasurementFault when the regulator gives the platen up, LawFault when a law of your own fails,
    TypeError for a trajectory that is no name.
    """
    followed = _followed(trajectory)
    if duration is not None:
        followed['duration'] = duration
    stage_table = _table(PlantParameters, 'plant', files, plant)
    control_table = _table(ControllerParameters, 'controller', files, controller)
    shared = {'internal_model.fundamental': control_table.internal_model.fundamental}
    course = _table(
        ReferenceParameters, 'reference', files, {**shared, **followed, **(reference or {})}
    )
    for name, table in (('plant', stage_table), ('controller', control_table)):
        if table.sample_time != course.sample_time:
            raise ParameterError(
                f"parameter 'sample_time' of the {name} is {table.sample_time:g} s,"
                f" the reference's is {course.sample_time:g} s: they must be the same"
            )
    timeline = Timeline(course)
    assert timeline.end is not None
    block = timeline.block(0, timeline.end + 1)
    references = References(block.position, block.velocity, block.acceleration)
    learning = iterative_learning(control_table)
    outcome = run(
        Regulator(control_table, law),
        SimulatedStage(stage_table),
        references,
        learning=learning,
        follows=block.phase == Phase.TRACK,
    )
    time = course.sample_time * np.arange(block.phase.size, dtype=np.float64)
    return FlightRecord(time, block.phase, references, outcome, learning)


def _followed(trajectory: str | None) -> dict[str, object]:
    """The parameters of the reference that a trajectory's name stands for."""
    if trajectory is None:
        return {}
    if not isinstance(trajectory, str):
        raise TypeError(
            f"'trajectory' is a {type(trajectory).__name__}, it takes a name such as 'ellipse'; "
            'what belongs to it is given as reference={...}'
        )
    known = (*_NAMED, *TRAJECTORIES)
    if '.' not in trajectory and trajectory not in known:
        raise ParameterError(
            f"'trajectory' is '{trajectory}', it must be one of {', '.join(known)},"
            ' or the dotted path of a module'
        )
    return dict(_NAMED.get(trajectory, {'trajectory': trajectory}))


def _table(
    cls: type[T],
    node: str,
    files: Sequence[str | Path] | str | Path,
    given: T | Mapping[str, object] | None,
) -> T:
    if isinstance(given, cls):
        return given
    if given is not None and not isinstance(given, Mapping):
        raise TypeError(
            f"'{node}' is a {type(given).__name__}, it takes {cls.__name__}, or a dict of its "
            'parameters by name'
        )
    paths = (files,) if isinstance(files, str | Path) else files
    return replace(from_yaml(cls, node, *paths), given or {})
