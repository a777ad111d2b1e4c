"""The user's own parameter files, laid over those of a scenario."""

from __future__ import annotations

import os
import site
import sys
from collections.abc import Sequence
from pathlib import Path

from runner.options import WrongUseError

ROOT = Path(__file__).resolve().parents[2]
PARAMS = ROOT / 'params'
_NODES = ('plant', 'hw_bridge', 'controller', 'reference', 'monitor', 'recorder', 'view', 'web')
SECTIONS = (*_NODES, '**')

DISTRIBUTIONS = 'robustness'
"""The section of what machines are drawn from, which no node hears."""


def overlay(option: str, name: str) -> str:
    """The path of a file in the current folder or in params/, there also without ``.yaml``."""
    for path in (Path(name), PARAMS / name, PARAMS / f'{name}.yaml'):
        if path.is_file():
            break
    else:
        raise WrongUseError(f"{option}: there is no file '{name}', here or in {PARAMS}")
    if not os.access(path, os.R_OK):
        raise WrongUseError(f"{option}: cannot read '{path}'")
    return str(path.resolve())


def check_overlay(path: str, namespace: str = '', sections: Sequence[str] = SECTIONS) -> None:
    """Refuse a file that no node would take, or that speaks to none. Needs the environment.

    :param namespace: that of the nodes, with which sections may name them too.
    :param sections: those that are heard; of nodes that are not there it may speak besides.
    """
    if sys.flags.no_site:
        site.main()
    import yaml

    from maglev_model.parameters import ParameterError, applies, read_yaml

    try:
        read_yaml(path, '')
    except ParameterError as error:
        raise WrongUseError(f'--params: {error}') from error
    loader = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
    content = yaml.compose(Path(path).read_text(encoding='utf-8'), Loader=loader)
    given = [key.value for key, _ in content.value] if content else []

    def heard(name: str, nodes: Sequence[str]) -> bool:
        return applies(name, [f'{where}/{node}' for node in nodes for where in ('', namespace)])

    some = any(heard(name, sections) for name in given)
    for name in given:
        if not heard(name, sections) and not (some and heard(name, (*SECTIONS, DISTRIBUTIONS))):
            raise WrongUseError(
                f"--params: '{path}' has parameters for '{name}',"
                f' which is no node here: {", ".join(sections)}'
            )
