"""Other gains in flight: what may change there, and how the new regulator goes on from the old."""

from __future__ import annotations

from typing import Final

import numpy as np

from maglev_controller import sample_step as law
from maglev_controller.design.internal_model import FloatArray
from maglev_controller.parameters import ControllerParameters
from maglev_controller.sample_step import ControlArrays
from maglev_model.parameters import ParameterError, values

ON_THE_GROUND: Final = ('sample_time', 'law', 'inverse', 'input_delay', 'machine.', 'compensator.')
"""Parameters, and groups of them, that make other currents of the same w, or another kind of w."""

ModelMaps = tuple[FloatArray, ...]

_HORIZON = 400  # moments at which old and new internal model are compared
_STRIDE = 5  # samples between them


def check_retuning(old: ControllerParameters, new: ControllerParameters) -> None:
    """Raise :class:`ParameterError`, naming it, for a change that needs the platen on the ground.

    These are the model of the machine, the law with its inverse and timing, and which axes are
    controlled.
    """
    after = values(new)
    for name, value in values(old).items():
        fixed = name.startswith(ON_THE_GROUND) or name.endswith('.controlled')
        if fixed and after[name] != value:
            raise ParameterError(
                f"parameter '{name}' cannot change in flight (it is {value}, not "
                f'{after[name]}); land first'
            )


def model_maps(old: ControlArrays, new: ControlArrays) -> ModelMaps:
    """For each axis the matrix, (n_new, n_old), from the old internal model's state to the new's.

    Takes some milliseconds, so in real time it is made beforehand.
    """
    return tuple(_model_map(old, new, axis) for axis in range(5))


def carry_over(old: ControlArrays, new: ControlArrays, maps: ModelMaps) -> None:
    """Give ``new`` the state that makes it go on as ``old`` would; ``old`` is left alone.

    ``maps`` are those of :func:`model_maps` for the two. Internal models: the state whose output,
    left to itself, is the old one's over the next two seconds, exactly where the frequencies are
    the same, closest in the mean square otherwise. Rates: what one estimator knows is translated
    for the other. What the gains make of error and rate at the last sample differently goes into a
    share of w that fades.
    """
    new.telemetry[:] = old.telemetry
    for axis in range(5):
        mine, its = new.state[axis], old.state[axis]
        mine[: law.MODEL] = its[: law.MODEL]
        if its[law.FRESH] != 0.0:
            mine[law.MODEL :] = 0.0
            continue
        if old.settings[law.OBSERVER] != new.settings[law.OBSERVER]:
            _translate_rate(old, new, axis)
        mine[law.MODEL :] = maps[axis] @ its[law.MODEL :]
        mine[law.BUMP] += _wanted(old, axis) - _wanted(new, axis)


def _wanted(arrays: ControlArrays, axis: int) -> float:
    """w but for the share that fades, by the last sample's error and rate and ξ as it is now."""
    gain, own = arrays.law[axis, law.GAIN], arrays.state[axis]
    share = float(gain[2:] @ own[law.MODEL :])
    rate = float(arrays.telemetry[law.ERROR_RATE, axis])
    ahead = float(arrays.settings[law.FEED_FORWARD] * own[law.LAST_ACCELERATION])
    return float(gain[0] * own[law.LAST_ERROR] + gain[1] * rate) + share + ahead


def _translate_rate(old: ControlArrays, new: ControlArrays, axis: int) -> None:
    """The rate one estimator has, in the other's state for the next sample."""
    own, period = new.state[axis], float(new.settings[law.PERIOD])
    measured = float(old.telemetry[law.POSITION, axis])
    rate = float(old.telemetry[law.ERROR_RATE, axis]) + float(own[law.LAST_SPEED])
    push = float(old.telemetry[law.VIRTUAL_INPUT, axis])
    if new.settings[law.OBSERVER] != 0.0:
        own[law.ESTIMATE] = measured + period * (rate + 0.5 * period * push)
        own[law.ESTIMATE + 1] = rate + period * push
        own[law.PENDING] = push
    else:
        own[law.FILTER] = measured + period * rate - rate / float(new.settings[law.FILTER_GAIN])
        own[law.LAGGED] = own[law.LAST_SPEED]


def _model_map(old: ControlArrays, new: ControlArrays, axis: int) -> FloatArray:
    outputs = _outputs(new, axis)
    scale = np.max(np.abs(outputs), axis=0)
    scale[scale == 0.0] = 1.0
    found: FloatArray = np.linalg.pinv(outputs / scale, rcond=1e-10) @ _outputs(old, axis)
    return np.asarray(found / scale[:, None])


def _outputs(arrays: ControlArrays, axis: int) -> FloatArray:
    """What each state of an internal model, left to itself, adds to w at the moments compared."""
    own = arrays.law[axis]
    transition, output = own[law.TRANSITION :, :-2], own[law.GAIN, 2:]
    stride = np.linalg.matrix_power(transition, _STRIDE)
    rows = np.empty((_HORIZON, output.size))
    for row in rows:
        row[:] = output
        output = output @ stride
    return rows
