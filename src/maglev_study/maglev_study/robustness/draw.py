"""Machines drawn from distributions about the one that the law believes in, each by its number."""

from __future__ import annotations

import dataclasses
import functools
import math
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri

from maglev_model.axes import AXES, FloatArray
from maglev_model.parameters import (
    ParameterError,
    build,
    for_others,
    parameter,
    read_yaml,
    replace,
    specs,
    unknown_parameter,
    values,
)
from maglev_plant.effects.parameters import EffectParameters
from maglev_plant.parameters import PlantParameters

NOMINAL = 0
"""The number of the machine that is as its parameter files have it; the drawn ones count from 1."""

NODE = 'robustness'
"""The section of parameter files that holds the distributions."""

CUT = 3.0
"""Widths from the centre at which normal and lognormal distributions end."""

COMMON: Mapping[str, Mapping[str, int]] = {
    'magnets': {'offset.K_v1': 2, 'offset.K_v2': 1, 'offset.K_h': 1},
    'windings': {'offset.K_v2': 1, 'offset.K_v3': 2, 'offset.K_h': 1},
}
"""Strengths on which several constants depend, each with the power given: the fields superpose."""

_EFFECTS_OFF = EffectParameters()
_SPECS = specs(PlantParameters)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Distribution:
    """What one parameter, or one of :data:`COMMON`, is drawn from; every element by itself."""

    distribution: str = parameter(
        description='normal and lognormal are cut at three widths',
        choices=('normal', 'lognormal', 'uniform'),
    )
    centre: float = parameter(description='mean, or median of the lognormal', within=(-1e9, 1e9))
    width: float = parameter(
        description='standard deviation, of the logarithm for the lognormal; half of the range',
        within=(0.0, 1e9),
    )
    source: str = parameter(description='where the width comes from')

    def at(self, share: FloatArray) -> FloatArray:
        """The values below which these shares, from 0 to 1, of all draws are."""
        if self.distribution == 'uniform':
            return self.centre + self.width * (2.0 * share - 1.0)
        lowest = ndtr(-CUT)
        normal = self.width * ndtri(lowest + share * (1.0 - 2.0 * lowest))
        found = (
            self.centre + normal if self.distribution == 'normal' else self.centre * np.exp(normal)
        )
        return np.asarray(found, dtype=np.float64)


@dataclasses.dataclass(frozen=True)
class Draw:
    """A distribution and what it is of: ``by`` a ``factor`` on it, or a ``value`` in its place."""

    by: str
    name: str
    of: Distribution


@dataclasses.dataclass(frozen=True)
class Machine:
    """One machine: its number, its parameters, and what was drawn, by the names of the columns."""

    number: int
    plant: PlantParameters
    drawn: Mapping[str, float]


def read_draws(*paths: str | Path) -> tuple[Draw, ...]:
    """The distributions in the section ``robustness`` of parameter files, the later winning.

    Raises :class:`ParameterError` naming what is unknown, missing, of the wrong type or out of its
    bounds.
    """
    given: dict[tuple[str, str], dict[str, object]] = {}
    for path in paths:
        for full, value in read_yaml(path, NODE).items():
            by, _, rest = full.partition('.')
            name, _, field = rest.rpartition('.')
            if by not in ('factor', 'value'):
                if for_others(full, ()):
                    continue
                raise ParameterError(
                    f"'{path}': {NODE} has factor and value, there is no '{full}' in it"
                )
            given.setdefault((by, name), {})[field] = value
    draws = tuple(_draw(by, name, fields) for (by, name), fields in given.items())
    twice = {one.name for one in draws if one.by == 'factor'} & {
        one.name for one in draws if one.by == 'value'
    }
    if twice:
        raise ParameterError(f"'{min(twice)}' of {NODE} is drawn as a factor and as a value")
    return draws


def _draw(by: str, name: str, fields: Mapping[str, object]) -> Draw:
    if name not in COMMON:
        if name not in _SPECS:
            raise unknown_parameter(name, [*_SPECS, *COMMON])
        if _SPECS[name].kind is not float:
            raise ParameterError(f"'{name}' of {NODE} is {_SPECS[name].type_name}, none to draw")
    elif by == 'value':
        raise ParameterError(f"'{name}' of {NODE} is a factor, it has no value of its own")
    try:
        return Draw(by, name, build(Distribution, fields))
    except ParameterError as error:
        raise ParameterError(f"{NODE}, {by} '{name}': {error}") from error


def check_draws(draws: Iterable[Draw], plant: PlantParameters) -> None:
    """Raise :class:`ParameterError` where the least or the greatest draws make no machine."""
    draws = tuple(draws)
    for word, share in (('least', 0.0), ('greatest', 1.0)):
        try:
            _machine(draws, plant, functools.partial(_all_at, share))
        except ParameterError as error:
            raise ParameterError(f'{NODE}, the {word} that is drawn: {error}') from error


def _all_at(share: float, _: str, size: int) -> FloatArray:
    return np.full(size, share)


def machine(draws: Sequence[Draw], plant: PlantParameters, seed: int, number: int) -> Machine:
    """The machine of a number, about ``plant``, in the campaign of a seed.

    The same whatever other machines are drawn; each of its parameters is the same whatever else is
    drawn. Number :data:`NOMINAL` is ``plant`` itself. Raises :class:`ParameterError` for what the
    plant refuses.
    """
    if number == NOMINAL:
        return Machine(number, plant, {})

    def share(name: str, size: int) -> FloatArray:
        return _generator(seed, number, name).random(size)

    try:
        changed, drawn = _machine(draws, plant, share)
    except ParameterError as error:
        raise ParameterError(f'machine {number}: {error}') from error
    own = int(_generator(seed, number, 'seed').integers(2**31))
    return Machine(number, replace(changed, {'seed': own}), drawn)


def _generator(seed: int, number: int, name: str) -> np.random.Generator:
    child = np.random.SeedSequence(seed, spawn_key=(number, zlib.crc32(name.encode())))
    return np.random.default_rng(child)


def _machine(
    draws: Sequence[Draw], plant: PlantParameters, share: Callable[[str, int], FloatArray]
) -> tuple[PlantParameters, dict[str, float]]:
    have = values(plant)
    changed: dict[str, Any] = {}
    drawn: dict[str, float] = {}
    for one in draws:
        if not _counts(one.name, plant):
            continue
        old = 1.0 if one.name in COMMON else have[one.name]
        found = one.of.at(share(one.name, np.size(old)))
        drawn.update(zip(_columns(one.name, old), found.tolist(), strict=True))
        if one.name in COMMON:
            for name, power in COMMON[one.name].items():
                changed[name] = changed.get(name, have[name]) * math.pow(found.item(), power)
        elif one.by == 'value':
            changed[one.name] = found if isinstance(old, tuple) else found.item()
        else:
            new = np.asarray(changed.get(one.name, old)) * found
            changed[one.name] = new if isinstance(old, tuple) else new.item()
    return replace(plant, changed), drawn


def _counts(name: str, plant: PlantParameters) -> bool:
    """Whether a parameter is of no effect, or of one that is switched on."""
    first, _, rest = name.partition('.')
    group = rest.partition('.')[0]
    return first != 'effects' or getattr(plant.effects, group) != getattr(_EFFECTS_OFF, group)


def _columns(name: str, value: object) -> list[str]:
    if not isinstance(value, tuple):
        return [name]
    labels = AXES if len(value) == len(AXES) else range(1, len(value) + 1)
    return [f'{name}[{label}]' for label in labels]
