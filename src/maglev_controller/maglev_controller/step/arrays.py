"""What a sample of the control law works on.

What has one size is held in records whose fields have names; what grows with the order n of the
internal models is held in arrays, so that no n needs machine code of its own.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from maglev_controller.design.notch import MOST
from maglev_model.axes import FloatArray
from maglev_model.machine import Machine

Record = Any
"""An element of an array of records, whose fields compiled code reads and writes as attributes."""

INTERVALS: Final = 64
"""Of the gaps between which the inductance is interpolated."""

INVERSES: Final = ('simplified', 'exact', 'equilibrium')
SIMPLIFIED: Final = 0
EXACT: Final = 1

WINDING: Final = np.dtype(
    [
        ('limits', '?'),  # whether the rail's voltage limits currents
        ('voltage', 'f8'),  # [V]
        ('resistance', 'f8'),  # [ohm]
        ('least_gap', 'f8'),  # of the table [m]
        ('spacing', 'f8'),  # [m]
        ('inductance', 'f8', INTERVALS + 1),  # of a phase, by gap [H]
    ],
    align=True,
)

SETTINGS: Final = np.dtype(
    [
        ('machine', 'f8', len(Machine._fields)),  # as machine_from_array takes it
        ('period', 'f8'),  # [s]
        ('controlled', 'f8', 5),  # 1, or 0 for an axis that gets no control
        ('lower', 'f8', 5),  # outputs that are believed [m, rad]
        ('upper', 'f8', 5),
        ('warp', 'f8'),  # that is believed, at most [m]
        ('inverse', 'i8'),  # one of INVERSES, by its number
        ('equilibrium', 'f8'),  # air gap that is linearised about [m]
        ('current', 'f8'),  # CurrentLimits
        ('levitation_first', 'f8'),
        ('least_attraction', 'f8'),
        ('tilt', 'f8'),
        ('jump_time', 'f8'),  # [s]
        ('jump_acceleration', 'f8', 5),
        ('feed_forward', 'f8'),  # 1, or 0
        ('error_gain', 'f8', 5),  # of w on e
        ('rate_gain', 'f8', 5),  # of w on ė
        ('error_limit', 'f8', 5),  # of the error that is fed back
        ('learned_error', 'f8', 5),  # that an internal model learns from, at most
        ('filter_gain', 'f8', 5),  # of the derivative filter [1/s]
        ('filter_forget', 'f8', 5),
        ('observed', 'i1', 5),  # whether the rate comes from the observer, not from the filter
        ('observer_position', 'f8', 5),
        ('observer_velocity', 'f8', 5),  # [1/s]
        ('late', '?'),  # whether the currents come a sample late, and the observer predicts it
        ('paper_antiwindup', '?'),
        ('fade', 'f8'),  # what is left of a bump a sample later
        ('rest_fades', '?'),  # whether oscillators fade where the reference rests
        ('waking', 'f8'),  # share of the way that this goes in a sample
        ('doubt', 'f8'),  # share of a difference within the count that is not believed at rest
        ('half_gap', 'f8'),  # half a count of the gaps' encoders [m]
        ('half_horizontal', 'f8'),  # of those of x and z
        ('within_count', 'f8', 5),  # share of an error within that that is learned from at rest
        ('slide_speed', 'f8', 5),  # of what has broken loose, 0: it does not slide on [m/s]
        ('floored', '?'),  # whether counts are rounded down
        ('notches', 'i8', 5),  # how many
        ('notch', 'f8', (5, MOST, 5)),  # their coefficients, as of Notch
        ('winding', WINDING),
        ('learns', '?'),  # whether what repeats is learned, iteratively
        ('friction_gain', 'f8'),  # share of what is missing that is learned in a sample, 0: none
        ('friction_way', 'f8', 5),  # [m, rad]
        ('friction_limit', 'f8', 5),  # [m/s², rad/s²]
    ],
    align=True,
)

AXIS: Final = np.dtype(
    [
        ('fresh', '?'),  # before the first sample
        ('filtered_position', 'f8'),  # f of the derivative filter
        ('filtered_velocity', 'f8'),  # of the reference, through the same filter
        ('reference_position', 'f8'),  # of the last sample
        ('reference_velocity', 'f8'),
        ('reference_acceleration', 'f8'),
        ('smooth_position', 'f8'),  # of the reference with jumps made good
        ('smooth_velocity', 'f8'),
        ('transition_duration', 'f8'),  # of what makes a jump good [s]
        ('transition_elapsed', 'f8'),
        ('transition_position', 'f8'),  # at its start
        ('transition_velocity', 'f8'),
        ('transition_acceleration', 'f8'),
        ('estimated_position', 'f8'),  # predicted for this sample
        ('estimated_velocity', 'f8'),
        ('pending_acceleration', 'f8'),  # commanded, and yet to act where the currents come late
        ('error', 'f8'),  # of the last sample, as w used it
        ('rested', 'f8'),  # how long the reference has been at rest [s]
        ('awake', 'f8'),  # 1 where the reference moves, 0 where it rests, and between them
        ('last_read', 'f8'),  # error of the last reading
        ('stood', 'f8'),  # how long the reading has not changed [s]
        ('edge', 'f8'),  # over which the platen came back last, by sign; 0: none
        ('returned', 'f8'),  # how long ago [s]
        ('way', 'f8'),  # from there to where it should be
        ('push_left', 'f8'),  # how much longer that is learned from [s]
        ('too_far', 'i8'),  # how often that led over the other edge
        ('goes_on', 'f8'),  # how much longer w stays as it is [s]
        ('surprise', 'f8'),  # what the encoders read beyond the prediction
        ('wanted_acceleration', 'f8'),  # of the reference with jumps made good
        ('bristle', 'f8'),  # friction's shape, -1 to 1, in the direction of motion
        ('friction', 'f8'),  # its level as learned [m/s², rad/s²]
        ('load', 'f8'),  # what else acts against the motion, likewise
        ('learned', 'f8'),  # fed forward against what repeats [m/s², rad/s²]
        ('notch', 'f8', (MOST, 2)),  # states of the notches
        ('bump', 'f8'),  # part of w that fades, so that w does not jump when gains change
    ],
    align=True,
)

SAMPLE: Final = np.dtype(
    [
        ('output', 'f8', 5),  # what was measured, believed or not
        ('position', 'f8', 5),
        ('error', 'f8', 5),
        ('error_rate', 'f8', 5),
        ('virtual_input', 'f8', 5),  # w
        ('internal_model', 'f8', 5),  # its part of w
        ('learned_error', 'f8', 5),
        ('realised', 'f8', 5),  # accelerations that the currents give
        ('asked', 'f8', 8),  # currents, i_d of motors 1..4, then i_q [A]
        ('excess', 'f8', 2),  # sat(u) - u of u_x and u_z [A]
        ('work', 'f8', (5, 4)),  # the inverse's own
    ],
    align=True,
)

RECORDS: Final = np.dtype(
    [('settings', SETTINGS), ('axes', AXIS, 5), ('sample', SAMPLE)], align=True
)
"""All of these in one: what is constant, what is remembered of an axis (but for ξ), what the last
sample came to. Python hands over one array faster than three."""

MODEL: Final = np.dtype(
    [
        ('output', 'f8'),
        ('drive', 'f8'),
        ('antiwindup', 'f8'),
        ('oscillates', '?'),
        ('first', 'i8'),
        ('end', 'i8'),
        ('following', 'f8'),
    ],
    align=True,
)
"""What belongs to one state of an internal model: elements of κ (Γ included), N_d and E_d; whether
it is an oscillator's that fades at rest; between which columns its row of Φ_d is not zero; and room
for ξ as it follows from this one."""


class ControlArrays(NamedTuple):
    """What :func:`control_step` works on; n is the order of the largest internal model."""

    records: NDArray[np.void]  # (1,) of RECORDS
    models: NDArray[np.void]  # (5, n) of MODEL
    transition: FloatArray  # Φ_d, (5, n, n)
    xi: FloatArray  # ξ, (5, n)

    @property
    def settings(self) -> Record:
        """The one of SETTINGS."""
        return self.records[0]['settings']

    @property
    def axes(self) -> NDArray[np.void]:
        """The five of AXIS."""
        return self.records[0]['axes']  # type: ignore[no-any-return]

    @property
    def sample(self) -> Record:
        """The one of SAMPLE."""
        return self.records[0]['sample']


class Reading(NamedTuple):
    """What the encoders read."""

    gap: FloatArray  # (4,) [m]
    x: float  # [m]
    z: float


class Reference(NamedTuple):
    """What the outputs shall be, (5,) each."""

    position: FloatArray  # [m, rad]
    velocity: FloatArray
    acceleration: FloatArray


class Currents(NamedTuple):
    """The answer, of motors 1..4, (4,) each."""

    direct: FloatArray  # [A]
    quadrature: FloatArray
