"""What follows from the joined samples of a run: outputs and phase currents. No ROS here."""

from __future__ import annotations

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.geometry import motor_phase_currents, outputs_of_gaps
from maglev_monitor.metrics.decoding import Records

SOURCES = ('true', 'measured', 'own')
"""Whose position it is, in the order of :func:`positions`.

*true* is the rigid platen's, *measured* what the encoders count, *own* what the scales of the
encoders have it to be, zeros and all, between the counts: what a law can be judged by.
"""

_OUTPUT_STATES = [0, 2, 4, 6, 8]  # x1, x3, x5, x7, x9 of Table II


def positions(rows: Records, radius: float) -> FloatArray:
    """Outputs by source (true, measured, own) [m, rad], NaN where unknown, shape (n, 3, 5).

    ``radius`` is r of (5) [m]. Gaps that no tilt can make give NaN tilts.
    """
    outputs = np.full((len(rows), len(SOURCES), 5), np.nan)
    plant = rows['has_plant']
    outputs[plant, 0] = rows['state'][plant][:, _OUTPUT_STATES]
    measured = rows['has_measurement']
    some = rows[measured]
    outputs[measured, 1] = outputs_of_gaps(some['gap'], some['x'], some['z'], radius)
    own = rows['own_length']
    outputs[:, 2] = outputs_of_gaps(own[:, :4], own[:, 4], own[:, 5], radius)
    return outputs


def phase_currents(rows: Records, pole_pitch: float) -> FloatArray:
    """Currents in the three phases of the four motors [A], shape (n, 4, 3).

    :param rows: joined rows that have currents and measurement, shape (n,).
    :param pole_pitch: tau [m].
    """
    return motor_phase_currents(
        rows['direct_current'], rows['quadrature_current'], rows['x'], rows['z'], pole_pitch
    )
