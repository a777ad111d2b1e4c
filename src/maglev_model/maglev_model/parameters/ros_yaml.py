"""YAML with scalars as ROS takes them: 1e-3 is a number, 2026-01-31 and 12:30 are texts."""

from __future__ import annotations

import re
from collections.abc import Hashable
from typing import Any

import yaml

_NUMBERS = {
    'int': r'^[-+]?(0x[0-9a-fA-F]+|0[0-7]*|[1-9]\d*)$',
    'float': r'^[-+]?(\d+\.\d*|\.\d+|\d+(?=[eE]))([eE][-+]?\d+)?$|^[-+]?\.(inf|Inf|INF)$'
    r'|^\.(nan|NaN|NAN)$',
}
"""What is written for a number, by YAML's name of the type."""


def load(text: str) -> Any:
    """What a text says; raises yaml.YAMLError, also for a mapping that names a key twice."""
    try:
        return yaml.load(text, Loader=_Loader)
    except (ValueError, RecursionError) as error:  # of a number or a depth beyond Python's
        raise yaml.YAMLError(str(error)) from error


def dump(content: object) -> str:
    """The text that ROS and :func:`load` read as ``content``."""
    return str(yaml.dump(content, Dumper=_Dumper, sort_keys=False, default_flow_style=None))


class _Loader(yaml.SafeLoader):
    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """Raises yaml.YAMLError with an alias and its line."""
        if self.check_event(yaml.AliasEvent):  # type: ignore[no-untyped-call]
            alias = self.peek_event()  # type: ignore[no-untyped-call]
            line = alias.start_mark.line + 1
            raise yaml.YAMLError(f"'*{alias.anchor}' in line {line}: ROS follows no aliases")
        return super().compose_node(parent, index)  # type: ignore[no-untyped-call, no-any-return]

    def construct_sequence(self, node: yaml.SequenceNode, deep: bool = False) -> list[Any]:
        """Raises yaml.YAMLError with the line of a list of several types."""
        types = sorted({each.tag.rpartition(':')[2] for each in node.value})
        if len(types) > 1:
            line = node.start_mark.line + 1
            mixed = ' and '.join(types)
            raise yaml.YAMLError(f'the list in line {line} mixes {mixed}: ROS takes one type')
        return super().construct_sequence(node, deep)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Raises yaml.YAMLError with the key that is none, merges, or is given twice; its line."""
        seen: set[Any] = set()
        for key_node, _ in node.value:
            line = key_node.start_mark.line + 1
            if key_node.tag == 'tag:yaml.org,2002:merge':
                raise yaml.YAMLError(f"'<<' in line {line}: ROS does not merge mappings")
            key = self.construct_object(key_node, deep=True)  # type: ignore[no-untyped-call]
            if not isinstance(key, Hashable):
                raise yaml.YAMLError(f'{key} in line {line} is no name')
            if key in seen:
                raise yaml.YAMLError(f"'{key}' is given twice, again in line {line}")
            seen.add(key)
        return super().construct_mapping(node, deep)


class _Dumper(yaml.SafeDumper):
    """Quotes the strings that ROS, unlike PyYAML, takes for booleans or numbers: y, n and 1e3."""


_Dumper.add_implicit_resolver('tag:yaml.org,2002:bool', re.compile('^[yYnN]$'), list('yYnN'))
_Loader.yaml_implicit_resolvers = {
    first: [each for each in resolvers if each[0].split(':')[-1] not in ('timestamp', *_NUMBERS)]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
for _kind, _pattern in _NUMBERS.items():
    for _each in (_Loader, _Dumper):
        _each.add_implicit_resolver(
            f'tag:yaml.org,2002:{_kind}', re.compile(_pattern), list('-+.0123456789')
        )
