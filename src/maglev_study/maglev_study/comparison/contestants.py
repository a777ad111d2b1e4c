"""Who is compared: a control law with the stage it runs on, from parameter files."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path

from maglev_controller.parameters import ControllerParameters
from maglev_model.parameters import ParameterError, build, read_yaml
from maglev_plant.parameters import PlantParameters

ORDER = (
    'jacobian_lead_lag',
    'feedback_lead_lag',
    'feedback_soi',
    'regulator_3dof',
    'paper',
    'default',
)
"""The approaches in the paper's order, the paper's own and the default last."""


@dataclasses.dataclass(frozen=True)
class Contestant:
    """One law: its regulator's parameters, and what they ask of the stage, by full name."""

    name: str
    controller: ControllerParameters
    plant: Mapping[str, object]

    @property
    def tilts(self) -> bool:
        """Whether it controls the tilts."""
        return self.controller.phi.controlled and self.controller.theta.controlled

    def stage(self, **overrides: object) -> PlantParameters:
        """The stage's parameters with further ones, whose dots are written as ``__``."""
        named = {name.replace('__', '.'): value for name, value in overrides.items()}
        return build(PlantParameters, {**self.plant, **named})


def find_contestants(params: Path, names: Sequence[str] = ()) -> list[Contestant]:
    """The laws of a folder of parameters, or those named, on the benchmark plant.

    Each file of ``params/laws`` is one; ``paper`` is ``params/paper.yaml``, ``default`` has no file
    but ``params/controller.yaml``. Raises :class:`ParameterError` for a name that is none of them,
    and for a file that cannot be used.
    """
    files = {path.stem: path for path in sorted((params / 'laws').glob('*.yaml'))}
    files |= {'paper': params / 'paper.yaml', 'default': params / 'controller.yaml'}
    known = sorted(files, key=lambda name: (ORDER.index(name) if name in ORDER else -1, name))
    for name in names:
        if name not in files:
            raise ParameterError(f"there is no law '{name}', there are: {', '.join(known)}")
    return [_contestant(params, name, files[name]) for name in known if not names or name in names]


def _contestant(params: Path, name: str, path: Path) -> Contestant:
    controller = {**read_yaml(params / 'controller.yaml', 'controller')}
    controller.update(read_yaml(path, 'controller'))
    plant = {**read_yaml(params / 'benchmark.yaml', 'plant'), **read_yaml(path, 'plant')}
    return Contestant(name, build(ControllerParameters, controller), plant)
