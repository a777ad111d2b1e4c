"""Every kind of fault, by name."""

from __future__ import annotations

from maglev_study.faults.hardware_faults import SIZES, WHICH, WRONG, amplifier, calls, encoders
from maglev_study.faults.kinds import CUT, Kind
from maglev_study.faults.process_faults import (
    SAMPLING,
    controller,
    heat,
    leave,
    operator,
    press,
    second,
    skip_homing,
    stopped,
    void,
)
from maglev_study.faults.world import CALLS

KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        operator('none', lambda run, fault: None),
        *(encoders(name, which) for name in SIZES for which in WHICH.values()),
        calls('once', CALLS, lasts=False),
        calls('persistent', CALLS, lasts=True),
        calls('interrupted', CALLS, lasts=False),
        calls('foreign exception', CALLS, lasts=False),
        calls('hang', CALLS, lasts=False),
        calls('wrong result', tuple(WRONG), lasts=True),
        *(amplifier(name) for name in ('dead', 'stuck on', 'gain')),
        controller('killed', 0, 0, 8),
        controller('exception', 0, 0, None),
        controller('gives up', 0, 0, 3),
        controller('zeros', 0, 0, 8),
        controller('NaN', 0, 3, 3),
        controller('slow', 1, 50, None),
        controller('stalled', 1, 50, None),
        controller('replayed', 20, 500, None),
        controller('foreign', 0, 0, None),
        stopped(),
        operator('signal once', lambda run, fault: run.flight.bridge.signal(1)),
        operator('signal twice', lambda run, fault: run.flight.bridge.signal(2)),
        operator('hang-up', lambda run, fault: run.flight.bridge.signal(1)),
        operator('kill', lambda run, fault: run.flight.bridge.vanish(), CUT),
        operator(
            'stop service',
            lambda run, fault: run.flight.bridge.emergency_stop(),
            phases=tuple(phase for phase in SAMPLING if phase != 'after a fault'),
            blame='emergency stop',
            seen=2,
        ),
        operator('stop input', press, blame='emergency stop', seen=3),
        operator('not homed', skip_homing, blame='not homed', phases=('homing',)),
        operator('hot', heat, blame='hot', phases=('arming',)),
        operator('deactivate', leave),
        operator('reset', lambda run, fault: void(run.flight.bridge.reset())),
        operator('second bridge', second),
    )
}
"""By name, in the order of the table."""
