"""The nodes of the graph: their programs and arguments, the order in which they start and end."""

from __future__ import annotations

import json
import shlex
import sys
from pathlib import Path
from typing import NamedTuple

from runner.overlays import PARAMS
from runner.process import program

START_ORDER = ('watchers', 'stage', 'controller', 'reference')
STOP_ORDER = tuple(reversed(START_ORDER))
"""First no current flows, then the stage ends, then who watches: recorder and monitor."""
VIEWS = ('view', 'web')
"""Who only shows: they start last, end last, and the run does not depend on them."""

_WATCHERS = ('monitor', 'recorder')
_PACKAGES = {'watchers': 'maglev_monitor', 'web': 'maglev_view'}


def text_value(name: str, text: str) -> str:
    """A parameter of any text for ``-p``, whose values are read as YAML."""
    return f'{name}:={json.dumps(text, ensure_ascii=False)}'


class Scenario(NamedTuple):
    """What is flown: parameter files of params/ over the nodes' own, arguments of the reference.

    ``offer`` is a file of params/ with internal models to match, for who has not chosen it.
    """

    name: str
    files: tuple[str, ...]
    reference: tuple[str, ...] = ()
    offer: str = ''


class Flight(NamedTuple):
    """A scenario as the user wants it.

    ``duration`` is a text [s], empty for the scenario's own; ``namespace`` an absolute name, empty
    for none; ``as_json`` prints the outcome; ``views`` are those of :data:`VIEWS` that are wanted.
    """

    scenario: Scenario
    out: Path
    stage: str = 'plant'
    mode: str = 'lockstep'
    duration: str = ''
    overlays: tuple[str, ...] = ()
    namespace: str = ''
    as_json: bool = False
    views: tuple[str, ...] = ('view',)

    def program(self, node: str) -> list[str]:
        """How to run a node; raises WrongUseError when it is not built."""
        name = self._name(node)
        return program(_PACKAGES.get(name, f'maglev_{name}'), name)

    def arguments(self, node: str) -> list[str]:
        """What a node is told: parameter files, each over the one before, then single values."""
        name = self._name(node)
        nodes = _WATCHERS if name == 'watchers' else (name,)
        files = [
            *(str(PARAMS / file) for file in ('machine.yaml', *(f'{each}.yaml' for each in nodes))),
            *(str(PARAMS / file) for file in self.scenario.files),
            *self.overlays,
        ]
        arguments = ['--ros-args', '--disable-external-lib-logs']
        if self.namespace:
            arguments += ['-r', f'__ns:={self.namespace}']
        for file in files:
            if Path(file).is_file():
                arguments += ['--params-file', file]
        for each in nodes:
            own = text_value('effective_parameters', f'{self.out}/params/{each}.yaml')
            for value in (own, *self._values(each)):
                arguments += ['-p', f'{each}:{value}' if len(nodes) > 1 else value]
        return arguments

    def _name(self, node: str) -> str:
        return self.stage if node == 'stage' else node

    def _values(self, node: str) -> list[str]:
        if node == 'recorder':
            asked = shlex.join([f'{sys.argv[1]}.sh', *sys.argv[2:]])
            return [text_value('output', f'{self.out}/bag'), text_value('command', asked)]
        if node in VIEWS:
            return []
        mode = f'mode:={self.mode}'
        if node == 'monitor':
            output = text_value('output', f'{self.out}/metrics.json')
            scenario = f'scenario:={self.scenario.name}'
            return ['exit_at_end:=false', output, scenario, f'stage:={self.stage}', mode]
        values = [mode, f'watchers:=[{",".join(map(repr, _WATCHERS))}]']
        if node == 'reference':
            values += ['autostart:=true', 'exit_at_end:=false']
            if self.mode == 'realtime':
                values.append('lead:=0.128')  # for when the machine holds it up
            values += self.scenario.reference
            if self.duration:
                values.append(f'duration:={self.duration}')
        return values
