"""Bumpless transfer: how a regulator takes over from another in flight, without a jump of w.

And what cannot change in flight.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_controller.step.arrays import ControlArrays
from maglev_model.axes import FloatArray
from maglev_model.parameters import ParameterError, values

ON_THE_GROUND: Final = ('sample_time', 'law', 'inverse', 'input_delay', 'machine.', 'compensator.')
"""Parameters, and groups of them, that make other currents of the same w, or another kind of w."""

ModelMaps = tuple[FloatArray, ...]

_HORIZON = 2.0  # over which old and new internal model are compared [s]
_STRIDE = 0.005  # between the moments at which they are, at least a sample [s]
_TURN = 0.5 * np.pi  # of the fastest oscillator meanwhile: at π one state would not show


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
    for the other. What the gains make of error and rate at the last sample differently goes into
    the bump, which fades.
    """
    for part in ('axes', 'sample'):
        new.records[part] = old.records[part]
    new.xi[:] = 0.0
    for axis in range(5):
        if old.axes['fresh'][axis]:
            continue
        if old.settings['observed'][axis] != new.settings['observed'][axis]:
            _translate_rate(new, axis)
        new.xi[axis] = maps[axis] @ old.xi[axis]
        new.axes['bump'][axis] += _wanted(old, axis) - _wanted(new, axis)
        _settle_notches(new, axis)


def _feedback(arrays: ControlArrays, axis: int) -> float:
    """What notches filter of w, by the last sample's error and rate and ξ as it is now."""
    settings, error = arrays.settings, arrays.axes[axis]['error']
    rate = arrays.sample['error_rate'][axis]
    value = settings['error_gain'][axis] * error + settings['rate_gain'][axis] * rate
    return float(value) + float(arrays.models['output'][axis] @ arrays.xi[axis])


def _wanted(arrays: ControlArrays, axis: int) -> float:
    """w but for the bump, likewise."""
    settings, state = arrays.settings, arrays.axes[axis]
    ahead = float(settings['feed_forward'] * state['reference_acceleration'])
    friction = state['friction'] * state['bristle'] if settings['friction_gain'] > 0.0 else 0.0
    return _feedback(arrays, axis) + ahead + float(friction)


def _settle_notches(arrays: ControlArrays, axis: int) -> None:
    """Notches as they are after the last sample's feedback has been held for long."""
    settings, state = arrays.settings, arrays.axes[axis]
    value = _feedback(arrays, axis)
    for k in range(int(settings['notches'][axis])):
        b_0, _, b_2, _, a_2 = settings['notch'][axis, k]
        state['notch'][k] = (1.0 - b_0) * value, (b_2 - a_2) * value


def _translate_rate(new: ControlArrays, axis: int) -> None:
    """The rate that the other estimator had, in this one's state for the next sample."""
    settings, state, sample = new.settings, new.axes[axis], new.sample
    period = float(settings['period'])
    measured, acceleration = float(sample['position'][axis]), float(sample['virtual_input'][axis])
    velocity = float(sample['error_rate'][axis]) + float(state['smooth_velocity'])
    if settings['observed'][axis]:
        state['estimated_position'] = measured + period * (velocity + 0.5 * period * acceleration)
        state['estimated_velocity'] = velocity + period * acceleration
        state['pending_acceleration'] = acceleration
    else:
        lag = velocity / float(settings['filter_gain'][axis])
        state['filtered_position'] = measured + period * velocity - lag
        state['filtered_velocity'] = state['smooth_velocity']


def _model_map(old: ControlArrays, new: ControlArrays, axis: int) -> FloatArray:
    samples = min(_stride(old, axis), _stride(new, axis))
    outputs = _outputs(new, axis, samples)
    scale = np.max(np.abs(outputs), axis=0)
    scale[scale == 0.0] = 1.0
    scaled: FloatArray = np.linalg.pinv(outputs / scale, rcond=1e-10) @ _outputs(old, axis, samples)
    return np.asarray(scaled / scale[:, None])


def _stride(arrays: ControlArrays, axis: int) -> int:
    """Samples between the moments at which an internal model is compared."""
    turn = np.abs(np.angle(np.linalg.eigvals(arrays.transition[axis]))).max()  # in a sample
    longest = round(_STRIDE / float(arrays.settings['period']))
    return max(1, min(longest, int(_TURN / turn)) if turn > 0.0 else longest)


def _outputs(arrays: ControlArrays, axis: int, samples: int) -> FloatArray:
    """What each state of an internal model, left to itself, adds to w, every so many samples."""
    transition, output = arrays.transition[axis], arrays.models['output'][axis]
    stride = np.linalg.matrix_power(transition, samples)
    rows = np.empty((round(_HORIZON / (samples * float(arrays.settings['period']))), output.size))
    for row in rows:
        row[:] = output
        output = output @ stride
    return rows
