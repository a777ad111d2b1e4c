"""Every kind of fault, by name."""

from __future__ import annotations

from maglev_study.faults.hardware_faults import SIZES, WHICH, WRONG, amplifier, calls, encoders
from maglev_study.faults.kinds import CUT, Kind
from maglev_study.faults.process_faults import (
    SAMPLING,
    controller,
    die,
    foreign,
    give_up,
    heat,
    nan,
    operator,
    press,
    replay,
    second,
    skip_homing,
    slow,
    stall,
    stopped,
    zeros,
)
from maglev_study.faults.world import CALLS

KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        operator('none', lambda run, fault: None),
        *(encoders(name, which) for name in SIZES for which in WHICH),
        calls('once', CALLS, lasts=False),
        calls('persistent', CALLS, lasts=True),
        calls('interrupted', CALLS, lasts=False),
        calls('foreign exception', CALLS, lasts=False),
        calls('hang', CALLS, lasts=False),
        calls('wrong result', tuple(WRONG), lasts=True),
        *(amplifier(name) for name in ('dead', 'stuck on', 'gain')),
        controller('killed', die, seen=0.008),
        controller('exception', lambda run, fault: run.flight.controller.defect()),
        controller('gives up', give_up, seen=0.003),
        controller('zeros', zeros, seen=0.008),
        controller('NaN', nan, (0, 3), seen=0.003),
        controller('slow', slow, (1, 50), shows=False),
        controller('stalled', stall, (1, 50), shows=False),
        controller('replayed', replay, (20, 500)),
        controller('foreign', foreign),
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
            seen=0.002,
        ),
        operator('stop input', press, blame='emergency stop', seen=0.003),
        operator('not homed', skip_homing, blame='not homed', phases=('homing',)),
        operator('hot', heat, blame='hot', phases=('arming',)),
        operator('deactivate', lambda run, fault: run.flight.bridge.deactivate()),
        operator('reset', lambda run, fault: run.flight.bridge.reset()),
        operator('second bridge', second),
    )
}
"""By name, in the order of the table."""
