"""The parameters of a run: its machine, how it is measured and what it must keep. No ROS here."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

from maglev_model.machine import MachineParameters
from maglev_model.parameters import ParameterError, build, group, parameter, values

RUN_KEY = 'run'
"""Key of the value in the monitor's diagnostics that carries the parameters of the run."""

FAULT_LEVEL = 2
"""Diagnostic level from which on a node's message counts as a fault (REP-107: ERROR)."""

_FORMER_NAMES = {
    'metrics.radius': 'machine.radius',
    'metrics.pole_pitch': 'machine.pole_pitch',
    'metrics.sample_time': 'sample_time',
}

NOT_CHECKED = -1.0
"""A limit below zero is not checked."""


def _limit(description: str, unit: str = '') -> Any:
    return parameter(NOT_CHECKED, f'{description}; below 0: not checked', unit=unit, lower=-1.0)


def _axis_limits(description: str) -> Any:
    return parameter(
        (NOT_CHECKED,) * 5,
        f'{description}, for y, x, z, phi, theta; below 0: not checked',
        unit='m, m, m, rad, rad',
        lower=-1.0,
        length=5,
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class MetricsParameters:
    """How the metrics are computed."""

    peak_current: float = parameter(
        7.0, "the amplifiers' peak, for the report", unit='A', within=(0.0, 100.0)
    )
    continuous_current: float = parameter(
        5.0, "the amplifiers' rating, for the report", unit='A', within=(0.0, 100.0)
    )
    settling_bound: tuple[float, ...] = parameter(
        (1e-4, 1e-4, 1e-4, 1e-4, 1e-4),
        't_s counts until |e| stays within this, for y, x, z, phi, theta',
        unit='m, m, m, rad, rad',
        within=(1e-9, 1.0),
        length=5,
    )
    encoder_bound: tuple[float, ...] = parameter(
        (1e-5, 1e-5, 1e-5, 2e-5, 2e-5),
        't_enc counts until |e| stays within this, for y, x, z, phi, theta',
        unit='m, m, m, rad, rad',
        within=(1e-9, 1.0),
        length=5,
    )
    modules: tuple[str, ...] = parameter(
        (), 'further metrics: dotted paths of modules with a function metric(run)'
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class RunLimits:
    """What a run must keep to pass."""

    max_mean_error: tuple[float, ...] = _axis_limits(
        "mean |e| over the tracking window, on the encoders' own scales; where only counts are "
        'known half of encoder_bound more'
    )
    max_error: tuple[float, ...] = _axis_limits('largest |e| over the tracking window, likewise')
    max_overshoot: float = _limit('overshoot of every step', '%')
    max_settling_time: float = _limit('t_s of every step', 's')
    max_encoder_time: float = _limit('t_enc of every step', 's')
    max_phase_current: float = _limit('peak of any phase current', 'A')
    min_real_time_factor: float = _limit('stage time over wall time')
    max_missing_samples: int = parameter(
        0, 'samples lost on any topic; below 0: not checked', lower=-1
    )
    max_late_samples: int = parameter(
        -1, 'samples with late currents; below 0: not checked', lower=-1
    )
    min_samples: int = parameter(0, 'samples that must have been measured', lower=0)
    min_steps: int = parameter(0, 'steps that must have been measured', lower=0)


@dataclasses.dataclass(frozen=True, kw_only=True)
class RunParameters:
    """What a run is called, its machine, how it is measured and what it must keep."""

    scenario: str = parameter('', 'name of the scenario, for the metrics')
    stage: str = parameter('', 'the stage that runs: plant or hw_bridge')
    mode: str = parameter('', 'lockstep or realtime')
    sample_time: float = parameter(
        1e-3, 'stage time from sample to sample', unit='s', within=(1e-5, 1.0)
    )
    machine: MachineParameters = group(MachineParameters)
    metrics: MetricsParameters = group(MetricsParameters)
    limits: RunLimits = group(RunLimits)


def run_to_json(run: RunParameters) -> str:
    """The table as one line of JSON, as the monitor leaves it in its diagnostics for the bag."""
    named: dict[str, object] = {}
    for field in dataclasses.fields(RunParameters):
        value = getattr(run, field.name)
        if dataclasses.is_dataclass(value):
            named.update({f'{field.name}.{key}': inner for key, inner in values(value).items()})
        else:
            named[field.name] = value
    return json.dumps(named, separators=(',', ':'))


def run_from_json(text: str) -> RunParameters:
    """Invert :func:`run_to_json`, also for bags in which parameters had their former names.

    Raises ParameterError for anything else.
    """
    try:
        content: object = json.loads(text)
    except ValueError as error:
        raise ParameterError(f'the parameters of the run are no JSON: {error}') from error
    if not isinstance(content, dict):
        raise ParameterError('the parameters of the run are no JSON object')
    named = {str(_FORMER_NAMES.get(name, name)): value for name, value in content.items()}
    return build(RunParameters, named)
