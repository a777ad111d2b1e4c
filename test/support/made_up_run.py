"""A made-up run: columns, serialized messages and a bag; encoded by rosbags, not by us.

Messages are those of today, or as they were before the stage had a clock of its own.
"""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from maglev_model.contract.controller_watch import Status
from maglev_model.contract.phases import Phase
from maglev_model.contract.wire import HARDWARE_ID
from maglev_monitor.bag.reader import Bag
from maglev_monitor.bag.writer import BagWriter

FORMER = {
    'Reference': 'std_msgs/Header header\nuint64 sequence\nuint8 phase\nuint32 segment\n'
    'float64[5] position\nfloat64[5] velocity\nfloat64[5] acceleration\nfloat64[5] target\n',
    'Currents': 'std_msgs/Header header\nuint64 sequence\nfloat64[4] direct_current\n'
    'float64[4] quadrature_current\n',
    'Measurement': 'std_msgs/Header header\nuint64 sequence\nfloat64[4] gap\nfloat64 x\nfloat64 z\n'
    'uint64 late_samples\n',
    'ControllerState': 'std_msgs/Header header\nuint64 sequence\nuint8 mode\nbool saturated\n'
    'float64[5] position\nfloat64[5] error\nfloat64[5] error_rate\nfloat64[5] virtual_input\n'
    'float64[5] internal_model\n',
    'PlantState': 'std_msgs/Header header\nuint64 sequence\nfloat64[10] state\n'
    'float64[4] direct_current\nfloat64[4] quadrature_current\nfloat64[4] thermal_load\n',
}
"""Messages that have grown since, as they were."""

MESSAGES = Path(__file__).resolve().parents[2] / 'src' / 'maglev_msgs' / 'msg'
RADIUS = 0.397
OWN = 2e-6
"""What the encoders' own scales have more than there is [m]."""
SESSION = 2**63 + 1
TOPICS = {
    'reference': ('/reference', 'maglev_msgs/msg/Reference'),
    'measurement': ('/stage/measurement', 'maglev_msgs/msg/Measurement'),
    'currents': ('/stage/currents', 'maglev_msgs/msg/Currents'),
    'controller': ('/controller/state', 'maglev_msgs/msg/ControllerState'),
    'plant': ('/stage/true_state', 'maglev_msgs/msg/PlantState'),
}


@dataclasses.dataclass
class Run:
    """Columns of a run by sample number, all of length n."""

    phase: NDArray[np.uint8]
    segment: NDArray[np.uint32]
    reference: NDArray[np.float64]
    target: NDArray[np.float64]
    position: NDArray[np.float64]  # true outputs
    gap: NDArray[np.float64]
    direct: NDArray[np.float64]
    quadrature: NDArray[np.float64]
    limited_by: NDArray[np.uint8]
    late: NDArray[np.uint64]
    stamp: NDArray[np.int64]  # wall clock

    @property
    def saturated(self) -> NDArray[np.bool_]:
        return self.limited_by > 0

    @property
    def stage_time(self) -> NDArray[np.int64]:
        return self.stamp[0] + np.arange(len(self)) * 1_000_000

    def __len__(self) -> int:
        return len(self.phase)


def make_run(n: int = 1200, seed: int = 1) -> Run:
    """REST, LIFT_OFF, HOLD, a STEP of y, a STEP of theta, TRACK and END, with noise for errors."""
    random = np.random.default_rng(seed)
    parts = [
        (Phase.REST, 0.05, [0.031, 0.0, 0.0, 0.0, 0.0]),
        (Phase.LIFT_OFF, 0.1, [0.020, 0.0, 0.0, 0.0, 0.0]),
        (Phase.HOLD, 0.1, [0.020, 0.0, 0.0, 0.0, 0.0]),
        (Phase.STEP, 0.25, [0.027, 0.0, 0.0, 0.0, 0.0]),
        (Phase.STEP, 0.2, [0.027, 0.0, 0.0, 0.0, 0.01]),
        (Phase.TRACK, 0.2, [0.025, 0.0, 0.0, 0.0, 0.0]),
        (Phase.LAND, 0.05, [0.031, 0.0, 0.0, 0.0, 0.0]),
        (Phase.END, 0.05, [0.031, 0.0, 0.0, 0.0, 0.0]),
    ]
    bounds = np.round(np.cumsum([0.0, *(part[1] for part in parts)]) * n).astype(int)
    phase, segment = np.zeros(n, np.uint8), np.zeros(n, np.uint32)
    target = np.zeros((n, 5))
    for number, (part, first, last) in enumerate(zip(parts, bounds[:-1], bounds[1:], strict=True)):
        phase[first:last], segment[first:last], target[first:last] = part[0], number, part[2]
    reference = target.copy()
    tracking = phase == Phase.TRACK
    angle = np.linspace(0.0, 4.0 * np.pi, np.count_nonzero(tracking))
    reference[tracking, 0] += 0.005 * np.sin(angle)
    reference[tracking, 1] = 0.03 * np.cos(angle)
    reference[tracking, 2] = 0.03 * np.sin(angle)
    age = np.concatenate([np.arange(b - a) for a, b in itertools.pairwise(bounds)])
    before = np.vstack([target[:1], target[np.maximum(bounds[segment] - 1, 0)][1:]])
    response = (np.exp(-age / 40.0) * np.cos(age / 15.0))[:, None] * (before - target)
    position = reference + response + 2e-5 * random.standard_normal((n, 5))
    sines = RADIUS * np.sin(position[:, 3:])
    gap = position[:, :1] + np.stack([-sines[:, 0], sines[:, 1], sines[:, 0], -sines[:, 1]], axis=1)
    tick = np.maximum(1_000_000 + 50_000 * random.standard_normal(n), 1e5).astype(np.int64)
    return Run(
        phase=phase,
        segment=segment,
        reference=reference,
        target=target,
        position=position,
        gap=gap,
        direct=random.uniform(-3.0, 3.0, (n, 4)),
        quadrature=random.uniform(-3.0, 3.0, (n, 4)),
        limited_by=np.where(random.random(n) < 0.05, random.integers(1, 4, n), 0).astype(np.uint8),
        late=np.cumsum(random.random(n) < 0.02).astype(np.uint64),
        stamp=1_700_000_000_000_000_000 + np.cumsum(tick),
    )


class Encoder:
    """Serializes a run's messages with rosbags; ``former`` ones are stamped by the wall clock."""

    def __init__(self, *, former: bool = False, lockstep: bool = True) -> None:
        self._former, self._lockstep = former, lockstep
        self.store = get_typestore(Stores.ROS2_JAZZY)
        types: dict[str, Any] = {}
        for file in MESSAGES.glob('*.msg'):
            text = FORMER.get(file.stem) if former else None
            name = f'maglev_msgs/msg/{file.stem}'
            types.update(get_types_from_msg(text or file.read_text(), name))
        self.store.register(types)

    def header(self, stamp: int, frame_id: str) -> Any:
        seconds, nanoseconds = divmod(int(stamp), 1_000_000_000)
        time = self.store.types['builtin_interfaces/msg/Time'](seconds, nanoseconds)
        return self.store.types['std_msgs/msg/Header'](time, frame_id)

    def message(self, run: Run, key: str, n: int, frame_id: str = '') -> bytes:
        """The message of one topic for sample ``n``."""
        name = TOPICS[key][1]
        fields: dict[str, tuple[Any, ...]] = {
            'reference': (
                run.phase[n],
                run.segment[n],
                run.reference[n],
                np.full(5, 1.0),
                np.full(5, 2.0),
                run.target[n],
                *(() if self._former else (SESSION,)),
            ),
            'measurement': (
                run.gap[n],
                run.position[n, 1],
                run.position[n, 2],
                run.late[n],
                *(() if self._former else (run.stamp[n], self._lockstep, SESSION)),
            ),
            'currents': (
                run.direct[n],
                run.quadrature[n],
                *(() if self._former else (SESSION, int(Status.FLYING))),
            ),
            'controller': (
                2,
                bool(run.saturated[n]),
                *np.zeros((5, 5)),
                *(() if self._former else (run.limited_by[n],)),
            ),
            'plant': (
                np.stack([run.position[n], np.full(5, 0.1)], axis=1).ravel(),
                run.direct[n],
                run.quadrature[n],
                np.full(4, 0.25),
                *(() if self._former else (np.append(run.gap[n], run.position[n, 1:3]) + OWN,)),
            ),
        }
        header = self.header((run.stamp if self._former else run.stage_time)[n], frame_id)
        message = self.store.types[name](header, n, *fields[key])
        return bytes(self.store.serialize_cdr(message, name))

    def diagnostic(
        self,
        stamp: int,
        level: int,
        name: str,
        text: str,
        values: dict[str, str],
        hardware: str = HARDWARE_ID,
    ) -> bytes:
        """A DiagnosticArray with one status."""
        types = self.store.types
        pairs = [types['diagnostic_msgs/msg/KeyValue'](key, value) for key, value in values.items()]
        status = types['diagnostic_msgs/msg/DiagnosticStatus'](level, name, text, hardware, pairs)
        array = types['diagnostic_msgs/msg/DiagnosticArray'](self.header(stamp, ''), [status])
        return bytes(self.store.serialize_cdr(array, 'diagnostic_msgs/msg/DiagnosticArray'))


def open_bag(path: Path, **options: Any) -> BagWriter:
    """A bag with the run's topics and diagnostics."""
    writer = BagWriter(path, lambda _package: MESSAGES, **options)
    writer.open()
    for topic, message_type in TOPICS.values():
        writer.add_topic(topic, message_type)
    writer.add_topic('/diagnostics', 'diagnostic_msgs/msg/DiagnosticArray')
    return writer


def write_samples(writer: BagWriter, run: Run, messages: dict[str, list[bytes]]) -> None:
    """All samples of a run in bursts, topic by topic, as a recorder that polls writes them."""
    for first in range(0, len(run), 40):
        for key, (topic, _) in TOPICS.items():
            part = slice(first, first + 40)
            stamps = run.stamp[part].tolist()
            writer.write(topic, zip(messages[key][part], stamps, strict=True))


def read(path: Path) -> tuple[dict[str, int], list[str]]:
    """Samples by topic key, and notes."""
    bag = Bag(path)
    counts: dict[str, int] = {}
    for batch in bag.batches():
        for key, records in batch.samples.items():
            counts[key] = counts.get(key, 0) + len(records)
    return counts, bag.notes
