"""What a volt makes of each amplifier, shown by an ammeter at its load.

What the encoders see of a phase's current shows wiring, not gain, for friction decides how far it
moves, and a lift-off makes up for what is commanded too much or too little.
"""

from __future__ import annotations

import numpy as np

from maglev_hw_bridge.amplifiers import Amplifiers
from maglev_hw_bridge.commissioning.operators import Operator
from maglev_hw_bridge.commissioning.proof import WrongError, refuse_pressed
from maglev_hw_bridge.doubts import LEFT_CURRENT
from maglev_hw_bridge.drivers import SampledDriver
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.signal_parameters import PHASE_NAMES, PHASES

_MOST = 1.0  # that is measured, where that is not more than half the continuous current [A]
_TOLERANCE = 0.05  # of it, for amplifier and ammeter
_NOTHING = 0.05  # of it: what carries less is not connected, which its motion shows


def measured_current(parameters: BridgeParameters) -> float:
    """What each load is to carry while it is measured [A]."""
    return min(_MOST, 0.5 * parameters.amplifier.continuous_current)


def prove_gains(
    parameters: BridgeParameters,
    driver: SampledDriver,
    amplifiers: Amplifiers,
    operator: Operator,
) -> None:
    """Have the operator measure every load, on boards that are open; they are left so.

    Raises WrongError, also once the emergency stop is pressed, and DriverError.
    """
    wanted = measured_current(parameters)
    least = LEFT_CURRENT * parameters.amplifier.continuous_current
    counts, current = np.zeros(6, dtype=np.int32), np.zeros(PHASES)

    def drive() -> None:
        driver.read(counts)
        driver.write(amplifiers.drive_phases(current))
        refuse_pressed(driver)

    for phase, name in enumerate(PHASE_NAMES):
        operator.connect_meter(phase)
        driver.start()
        try:
            left = operator.reads_current(phase, drive)
            current[phase] = wanted
            seen = operator.reads_current(phase, drive)
        finally:
            current[phase] = 0.0
            amplifiers.cut()
            driver.stop()
        if abs(left) > least:
            raise WrongError(
                f'{name} carries {left:g} A where none is commanded, more than {least:g} A: check '
                f'element {phase} of amplifier.offset'
            )
        made = abs(seen - left)
        if made > _NOTHING * wanted and abs(made - wanted) > _TOLERANCE * wanted:
            raise WrongError(
                f'{name} carries {made:.2f} A where {wanted:g} A are commanded: check element '
                f'{phase} of amplifier.gain'
            )
