"""The verdict on a run: its figures against its limits. No ROS here."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from maglev_model.axes import AXES
from maglev_model.parameters import values
from maglev_monitor.metrics.readable import angle_or_length, holes, number
from maglev_monitor.metrics.run_parameters import RunLimits, RunParameters

_MISSING = 'number of missing samples'
_NANOSECOND = 1e-9  # to which the stage rounds [s]


def verdict(
    figures: Mapping[str, Any], run: RunParameters, *, whole: bool, ended: bool
) -> dict[str, Any]:
    """The last part of ``metrics.json``: verdict, its reasons and the limits that were checked.

    Errors are those on the encoders' own scales, where the stage tells them; where it tells the
    true position alone, of that; and where only counts are known, of these, with half a count more.

    :param figures: figures, as :meth:`~.run_metrics.RunMetrics.result` gathers them.
    :param run: with the limits and the counts.
    :param whole: whether it is known from its lift-off on; ``ended``: whether it reached its end.
        Otherwise it is ``incomplete`` or a failure.
    """
    limits = run.limits
    reasons = [f'fault in {fault}' for fault in figures['faults']]
    if left := figures['left']:
        where = f'{left["mode"]} from sample {left["sample"]} on, in {left["phase"]}'
        reasons.append(f'the controller left the run: {where}')
    for name, why in figures.get('further_failed', {}).items():
        reasons.append(f'the further metric {name} raised {why}')
    reasons += [*_axis_reasons(figures, run), *_step_reasons(figures, limits)]
    reasons += [*_sample_time_reason(figures, run), *_other_reasons(figures, limits)]
    if figures['faults'] or (whole and ended and reasons):
        word = 'fail'
    else:
        word = 'pass' if whole and ended else 'incomplete'
    if not whole and figures['run_samples']:
        reasons.append('what is known of the run begins in flight')
    if not ended:
        reasons.append('the run did not reach its end')
    return {'verdict': word, 'reasons': reasons, 'limits': checked_limits(limits)}


def checked_limits(limits: RunLimits) -> dict[str, Any]:
    """The limits that are checked, by name; limits by axis as a mapping."""
    checked: dict[str, Any] = {}
    for name, value in values(limits).items():
        if isinstance(value, tuple):
            by_axis = {axis: bound for axis, bound in zip(AXES, value, strict=True) if bound >= 0}
            if by_axis:
                checked[name] = by_axis
        elif value >= 0 and not (name.startswith('min_') and value == 0):
            checked[name] = value
    return checked


def _beyond(value: float, bound: float) -> bool:
    """Whether a figure is above its limit, and not by its rounding."""
    return value > bound * (1.0 + 1e-9) + 1e-12


def _axis_reasons(figures: Mapping[str, Any], run: RunParameters) -> Iterator[str]:
    rows = (
        ('mean_abs_error', 'mean |e|', run.limits.max_mean_error),
        ('max_abs_error', 'largest |e|', run.limits.max_error),
    )
    axes = figures['own_axes'] or figures['axes']
    counts = figures['error_source'] == 'measured'
    tracked = axes['y']['mean_abs_error'] is not None
    for name, title, bounds in rows:
        for axis, given, count in zip(AXES, bounds, run.metrics.encoder_bound, strict=True):
            value, bound = axes[axis][name], given + 0.5 * count * counts
            if not tracked and figures['steps']:
                continue  # a run of steps tracks nothing
            if given < 0 or (value is not None and not _beyond(value, bound)):
                continue
            if value is None:
                why = 'its gaps cannot be' if tracked else 'no tracking'
                yield f'{title} of {axis} was not measured: {why}'
            else:
                shown, allowed = angle_or_length(axis, value), angle_or_length(axis, bound)
                yield f'{title} of {axis} is {shown}, allowed is {allowed}'


def _step_reasons(figures: Mapping[str, Any], limits: RunLimits) -> Iterator[str]:
    for step in figures['own_steps'] or figures['steps']:
        axis = step['axis']
        start, target = angle_or_length(axis, step['from']), angle_or_length(axis, step['to'])
        name = f'step of {axis} from {start} to {target}'
        if limits.max_overshoot >= 0 and _beyond(step['overshoot_percent'], limits.max_overshoot):
            overshoot, allowed = number(step['overshoot_percent']), number(limits.max_overshoot)
            yield f'{name}: overshoot is {overshoot} %, allowed is {allowed} %'
        for key, symbol, bound in (
            ('settling_time', 't_s', limits.max_settling_time),
            ('encoder_time', 't_enc', limits.max_encoder_time),
        ):
            value = step[key]
            if bound < 0 or (value is not None and not _beyond(value, bound)):
                continue
            shown = f'{number(value)} s' if value is not None else 'never reached'
            yield f'{name}: {symbol} is {shown}, allowed is {number(bound)} s'


def _sample_time_reason(figures: Mapping[str, Any], run: RunParameters) -> Iterator[str]:
    """Each figure in seconds is wrong where the monitor has not been told how the stage samples."""
    stage, told = figures['timing']['sample_time'], run.sample_time
    if stage is not None and abs(stage - told) > _NANOSECOND:
        yield (
            f'the stage samples every {number(1e3 * stage)} ms, but sample_time is'
            f' {number(1e3 * told)} ms: all times here are by the latter'
        )


def _other_reasons(figures: Mapping[str, Any], limits: RunLimits) -> Iterator[str]:
    if count := figures['currents']['not_finite_samples']:
        yield f'number of samples whose currents are no finite numbers is {count}, allowed is none'
    factor = figures['timing']['real_time_factor'] or 0.0
    upper = (
        ('peak phase current', figures['currents']['peak_phase'], limits.max_phase_current, ' A'),
        (_MISSING, figures['missing_samples'], limits.max_missing_samples, ''),
        ('number of late samples', figures['timing']['late_samples'], limits.max_late_samples, ''),
    )
    for title, value, bound, unit in upper:
        if bound >= 0 and _beyond(value, bound):
            where = f': {holes(figures["holes"])}' if title == _MISSING else ''
            yield f'{title} is {number(value)}{unit}, allowed is {number(bound)}{unit}{where}'
    lower = (
        ('real-time factor', factor, limits.min_real_time_factor),
        ('number of measured samples', figures['samples'], limits.min_samples),
        ('number of measured steps', len(figures['steps']), limits.min_steps),
    )
    for title, value, bound in lower:
        if value < bound:
            yield f'{title} is {number(value)}, at least {number(bound)} is wanted'
