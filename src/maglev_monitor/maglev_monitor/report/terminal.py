"""The figures of a run as a table for the terminal. No ROS here."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from maglev_model.axes import AXES
from maglev_monitor.metrics.readable import (
    angle_or_length,
    holes,
    micro,
    number,
    saturation,
    seconds,
)


def as_text(figures: Mapping[str, Any]) -> str:
    """The content of ``metrics.json`` as lines of text."""
    lines = [
        _title(figures),
        *_tracking_lines(figures),
        *_step_lines(figures),
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


def _tracking_lines(figures: Mapping[str, Any]) -> Iterator[str]:
    axes = figures['axes']
    if axes['y']['mean_abs_error'] is None:
        return
    yield f'  {"tracking":<8}{"mean |e|":>16}{"rms e":>16}{"max |e|":>16}'
    for axis in AXES:
        row = axes[axis]
        names = ('mean_abs_error', 'rms_error', 'max_abs_error')
        yield f'  {axis:<8}' + ''.join(f'{micro(axis, row[name]):>16}' for name in names)


def _step_lines(figures: Mapping[str, Any]) -> Iterator[str]:
    if not figures['steps']:
        return
    yield f'  {"step":<8}{"from":>14}{"to":>14}{"overshoot":>12}{"t_s":>12}{"t_enc":>12}'
    for step in figures['steps']:
        axis = step['axis']
        yield (
            f'  {axis:<8}{angle_or_length(axis, step["from"]):>14}'
            f'{angle_or_length(axis, step["to"]):>14}{step["overshoot_percent"]:>10.1f} %'
            f'{seconds(step["settling_time"]):>12}{seconds(step["encoder_time"]):>12}'
        )


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
