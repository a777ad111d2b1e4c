"""What about parameters of real boards can be, but should be said: the rest is refused."""

from __future__ import annotations

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.signal_parameters import PHASE_NAMES
from maglev_model.axes import AXES

LEFT_CURRENT = 0.02
"""Share of the continuous current that is worth a word when the watchdog leaves it flowing."""


def doubts(parameters: BridgeParameters) -> list[str]:
    """One sentence for each, naming the parameter; none with emulated boards."""
    boards = parameters.boards
    if parameters.driver == 'emulated':
        return []
    said = []
    if boards.stop_input < 0:
        said.append("parameter 'boards.stop_input' is -1: no emergency stop is read")
    elif boards.stop_level != boards.open_level:
        said.append(
            f"parameter 'boards.stop_level' is {boards.stop_level}, a broken wire reads "
            f'{boards.open_level} (open_level): it would not read as pressed'
        )
    if boards.enable_output < 0:
        said.append(
            "parameter 'boards.enable_output' is -1: nothing but 0 V at their inputs keeps the "
            'amplifiers from carrying current'
        )
    return said + _left_flowing(parameters) + _beyond_the_stops(parameters)


def _left_flowing(parameters: BridgeParameters) -> list[str]:
    amplifier = parameters.amplifier
    if parameters.boards.analog_expiry != 'zero':
        return []
    left = [abs(g * v) for g, v in zip(amplifier.gain, amplifier.offset, strict=True)]
    worst = max(range(len(left)), key=left.__getitem__)
    if left[worst] <= LEFT_CURRENT * amplifier.continuous_current:
        return []
    return [
        f"parameter 'amplifier.offset[{worst}]' is {amplifier.offset[worst]:g} V: when the watchdog"
        f' puts out 0 V, {PHASE_NAMES[worst]} carries {left[worst]:.2f} A unless the enable line '
        "stops it; null the amplifier's offset"
    ]


def _beyond_the_stops(parameters: BridgeParameters) -> list[str]:
    """Of y only the upper stop: on the lower one it rests."""
    fault, machine = parameters.fault, parameters.machine
    said = []
    for axis, name in enumerate(AXES):
        for side, limit, stop in (
            ('lower', fault.lower[axis], machine.lower_limit[axis]),
            ('upper', fault.upper[axis], machine.upper_limit[axis]),
        ):
            within = limit > stop if side == 'lower' else limit < stop
            if within or (name, side) == ('y', 'upper'):
                continue
            said.append(
                f"parameter 'fault.{side}[{axis}]' is {limit:g}, not within the stop of {name} at "
                f'{stop:g}: it is met before the platen is landed'
            )
    return said
