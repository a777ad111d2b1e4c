"""The figures of a run as a table for the terminal. No ROS here."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from maglev_monitor.metrics.readable import (
    holes,
    number,
    saturation,
)
from maglev_monitor.report import tables


def as_text(figures: Mapping[str, Any]) -> str:
    """The content of ``metrics.json`` as lines of text."""
    lines = [
        _title(figures),
        *_lines('tracking', tables.ERRORS.values(), tables.errors(figures)),
        *_lines('ISO 230-2', tables.REPEATED, tables.repeatability(figures)),
        *_lines('steps', tables.STEPS, tables.steps(figures)),
        *_other_lines(figures),
    ]
    word = f'verdict: {figures["verdict"]}'
    if figures['currents']['saturated_samples']:
        word += f', {saturation(figures["currents"])}'
    lines.append(word)
    lines += [f'  {reason}' for reason in figures['reasons']]
    return '\n'.join(lines)


def _title(figures: Mapping[str, Any]) -> str:
    words = [figures[key] for key in ('scenario', 'stage', 'mode') if figures[key]]
    name = ', '.join(words) or 'run'
    return (
        f'{name}: {figures["duration"]:g} s measured, {figures["samples"]} samples,'
        f' {figures["error_source"]} position'
    )


def _lines(
    what: str, heads: Iterable[str], found: Iterable[tuple[str, list[list[str]]]]
) -> Iterator[str]:
    for whose, rows in found:
        yield f'  {f"{what}, {whose}":<32}' + ''.join(f'{head:>16}' for head in heads)
        for axis, *cells in rows:
            yield f'  {axis:<32}' + ''.join(f'{cell:>16}' for cell in cells)


def _other_lines(figures: Mapping[str, Any]) -> Iterator[str]:
    currents, timing = figures['currents'], figures['timing']
    rms = ' '.join(f'{value:.2f}' for value in currents['rms'])
    yield (
        f'  currents: peak phase {currents["peak_phase"]:.2f} A, rms {rms} A,'
        f' {currents["saturated_samples"]} samples saturated'
    )
    if timing['tick_p50'] is not None:
        factor = timing['real_time_factor']
        yield (
            f'  timing: {number(factor) if factor else "–"} x real time, tick'
            f' {timing["tick_p50"] * 1e6:.0f} µs median, {timing["tick_p99"] * 1e6:.0f} µs p99,'
            f' {timing["late_samples"]} samples late'
        )
    for name, further in figures.get('further', {}).items():
        shown = ', '.join(f'{key} {"–" if v is None else number(v)}' for key, v in further.items())
        yield f'  {name}: {shown}'
    missing = ', '.join(
        f'{count} {key}' for key, count in figures['missing_by_topic'].items() if count
    )
    yield f'  missing samples: {figures["missing_samples"]}' + (f' ({missing})' if missing else '')
    if missing:
        yield f'  {holes(figures["holes"])}'
