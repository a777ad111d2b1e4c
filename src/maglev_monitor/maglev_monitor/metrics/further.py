"""Metrics of one's own: what they find, and that a mistake in one costs the run nothing else.

No ROS here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from numbers import Real
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from maglev_model.parameters import ParameterError
from maglev_model.parameters.plugins import describe_error, plugin_function
from maglev_monitor.metrics.decoding import Records
from maglev_monitor.metrics.run_parameters import RunParameters

_NEEDED = ('add', 'result')


class Metric(Protocol):
    """A further metric, as the function ``metric(run)`` of a module makes it.

    ``metrics.modules`` names the module; what it finds is ``further.MODULE`` of metrics.json.
    """

    def add(self, rows: Records, position: NDArray[np.float64]) -> None:
        """Take the run's next rows (n,) of :data:`.joiner.ROW`, in order; both are read-only.

        ``position`` (n, 3, 5): outputs, true, measured and on the encoders' own scales [m, rad],
        NaN where unknown.
        """

    def result(self) -> Mapping[str, float | None]:
        """Its figures by name, in SI units."""


class Further:
    """The metrics of ``metrics.modules``; one that fails is not asked again.

    Raises ParameterError for a module that makes none.
    """

    def __init__(self, run: RunParameters) -> None:
        self.failed: dict[str, str] = {}
        """Why, by module."""
        self._metrics = {name: _made(name, run) for name in run.metrics.modules}

    def add(self, rows: Records, position: NDArray[np.float64]) -> None:
        """Show each the run's next rows."""
        if self._metrics:
            rows, position = rows.view(), position.view()
            rows.flags.writeable = position.flags.writeable = False
        for name, metric in self._metrics.items():
            self._ask(name, metric.add, rows, position)

    def result(self) -> dict[str, dict[str, float | None]]:
        """What each found, by module."""
        found = {name: self._ask(name, _figures, one) for name, one in self._metrics.items()}
        return {name: figures for name, figures in found.items() if figures is not None}

    def _ask(self, name: str, call: Callable[..., Any], *given: Any) -> Any:
        """None where it has failed."""
        if name not in self.failed:
            try:
                return call(*given)
            except Exception as error:
                self.failed[name] = describe_error(error)
        return None


def _made(name: str, run: RunParameters) -> Metric:
    metric: Metric = plugin_function('metrics.modules', name, 'metric')(run)
    if missing := [needed for needed in _NEEDED if not callable(getattr(metric, needed, None))]:
        raise ParameterError(
            f"parameter 'metrics.modules' names '{name}', a metric without {', '.join(missing)}"
        )
    return metric


def _figures(metric: Metric) -> dict[str, float | None]:
    found = dict(metric.result())
    for name, value in found.items():
        if not (value is None or isinstance(value, Real)):
            raise TypeError(f'{name!r} of its result is no number: {type(value).__name__}')
    return {str(name): None if value is None else float(value) for name, value in found.items()}
