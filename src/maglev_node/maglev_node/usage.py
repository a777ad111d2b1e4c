"""What ``--help`` prints of a node: its place on the graph and its parameters."""

from __future__ import annotations

import dataclasses
import textwrap
import typing
from typing import Any

from maglev_model.parameters import Spec, specs
from maglev_node.node import MaglevNode

_OWN = {'diagnostics': 'published: its state, at 1 Hz'}
_WIDTH = 96


def usage(node: type[MaglevNode[Any]], name: str) -> str:
    """The text for a node class run as executable ``name``."""
    graph = [f'  {topic:<20} {text}' for topic, text in {**node.interface, **_OWN}.items()]
    known = specs(_parameter_table(node)).values()
    return '\n'.join(
        [
            f'usage: {name} [--help] [--ros-args [-p NAME:=VALUE]... [--params-file FILE]...'
            ' [-r FROM:=TO]...]',
            '',
            *_paragraphs(node.__doc__ or ''),
            'topics and services, relative to its namespace, ~ for its own name:',
            *graph,
            '',
            'parameters, with type and unit, default and bounds:',
            *(line for spec in known for line in _lines(spec)),
        ]
    )


def _parameter_table(node: type[MaglevNode[Any]]) -> type:
    """The table that a node class names, ``PlantNodeParameters`` in ``StageNode[Plant…, …]``."""
    for base in getattr(node, '__orig_bases__', ()):
        for argument in typing.get_args(base):
            if dataclasses.is_dataclass(argument) and isinstance(argument, type):
                return argument
    raise TypeError(f'{node.__name__} names no table of parameters')


def _paragraphs(text: str) -> list[str]:
    lines = []
    for paragraph in text.replace('``', '').split('\n\n'):
        lines += [*textwrap.wrap(' '.join(paragraph.split()), _WIDTH), '']
    return lines


def _lines(spec: Spec) -> list[str]:
    kind = spec.type_name + (f' [{spec.unit}]' if spec.unit else '')
    parts = [f'  {spec.name}: {kind}']
    if spec.default is not dataclasses.MISSING:
        parts.append(f'default {_text(spec.default)}')
    if spec.bounds_text:
        parts.append(spec.bounds_text)
    return [', '.join(parts), *textwrap.wrap(spec.description, _WIDTH, **_INDENT)]


_INDENT: dict[str, Any] = {'initial_indent': ' ' * 6, 'subsequent_indent': ' ' * 6}


def _text(value: object) -> str:
    """A default as it is written in a parameter file."""
    if isinstance(value, tuple):
        return '[' + ', '.join(_text(element) for element in value) + ']'
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, str) else str(value)
