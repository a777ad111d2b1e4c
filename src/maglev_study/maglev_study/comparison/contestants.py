"""Who is compared: a control law with the stage it runs on, from parameter files."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from maglev_controller.laws import find_law
from maglev_controller.parameters import ControllerParameters
from maglev_model.axes import AXES, PHI, THETA
from maglev_model.parameters import ParameterError, from_yaml, replace
from maglev_plant.parameters import PlantParameters


@dataclasses.dataclass(frozen=True)
class Contestant:
    """One law: its regulator's parameters, and those of the stage it flies."""

    name: str
    controller: ControllerParameters
    plant: PlantParameters
    file: Path | None = None  # its own, with what it asks of other nodes

    @property
    def moves(self) -> tuple[bool, ...]:
        """By axis, whether it can be asked to move: it is controlled, and the stage frees it."""
        return tuple(
            getattr(self.controller, axis).controlled and not locked
            for axis, locked in zip(AXES, self.plant.guide.locked, strict=True)
        )

    @property
    def tilts(self) -> bool:
        """Whether both tilts move."""
        return self.moves[PHI] and self.moves[THETA]

    def stage(self, **overrides: object) -> PlantParameters:
        """The stage's parameters with further ones, whose dots are written as ``__``."""
        named = {name.replace('__', '.'): value for name, value in overrides.items()}
        return replace(self.plant, named)


def find_contestants(
    params: Path, names: Sequence[str] = (), overlays: Sequence[Path] = ()
) -> list[Contestant]:
    """The laws of a folder of parameters, or those named, on the benchmark plant.

    They come in the order of the paper's references, then others, the paper's own and the default.

    Each file of ``params/laws`` is one, and each that is named by its path, ``my_law.yaml``;
    ``paper`` is ``params/paper.yaml``, ``default`` has no file but ``params/controller.yaml``.
    ``overlays`` are parameter files over those of every law, the last one wins. Raises
    :class:`ParameterError` for a name that is none of them, and for a file that cannot be used.
    """
    files = {path.stem: path for path in sorted((params / 'laws').glob('*.yaml'))}
    files |= {'paper': params / 'paper.yaml', 'default': params / 'controller.yaml'}
    own = {name: Path(name) for name in names if name.endswith('.yaml')}
    files |= {path.stem: path for path in own.values()}
    names = [own[name].stem if name in own else name for name in names]
    found = (_contestant(params, name, path, overlays) for name, path in files.items())
    everyone = sorted(found, key=_place)
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


def _contestant(params: Path, name: str, path: Path, overlays: Sequence[Path]) -> Contestant:
    machine, over = params / 'machine.yaml', (path, *overlays)
    controller = machine, params / 'controller.yaml', *over
    plant = machine, params / 'benchmark.yaml', *over
    return Contestant(
        name,
        from_yaml(ControllerParameters, 'controller', *controller),
        from_yaml(PlantParameters, 'plant', *plant),
        path,
    )
