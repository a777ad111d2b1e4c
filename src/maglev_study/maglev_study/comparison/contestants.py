"""Who is compared: a control law with the stage it runs on, from parameter files."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path

from maglev_controller.laws import find_law
from maglev_controller.parameters import ControllerParameters
from maglev_model.parameters import ParameterError, build, read_yaml
from maglev_plant.parameters import PlantParameters


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

    They come in the order of the paper's references, then others, the paper's own and the default.

    Each file of ``params/laws`` is one; ``paper`` is ``params/paper.yaml``, ``default`` has no file
    but ``params/controller.yaml``. Raises :class:`ParameterError` for a name that is none of them,
    and for a file that cannot be used.
    """
    files = {path.stem: path for path in sorted((params / 'laws').glob('*.yaml'))}
    files |= {'paper': params / 'paper.yaml', 'default': params / 'controller.yaml'}
    everyone = sorted((_contestant(params, *item) for item in files.items()), key=_place)
    for name in names:
        if name not in files:
            known = ', '.join(one.name for one in everyone)
            raise ParameterError(f"there is no law '{name}', there are: {known}")
    return [one for one in everyone if not names or one.name in names]


def _place(contestant: Contestant) -> tuple[bool, tuple[int, ...], int, str]:
    references = find_law(contestant.controller.law).references
    last = ('paper', 'default')
    rank = 1 + last.index(contestant.name) if contestant.name in last else 0
    return not references, references, rank, contestant.name


def _contestant(params: Path, name: str, path: Path) -> Contestant:
    controller = {**read_yaml(params / 'controller.yaml', 'controller')}
    controller.update(read_yaml(path, 'controller'))
    plant = {**read_yaml(params / 'benchmark.yaml', 'plant'), **read_yaml(path, 'plant')}
    return Contestant(name, build(ControllerParameters, controller), plant)
