"""A run of any length in a bag, written as the recorder does but without flying for so long.

It is the made-up run whose tracking goes on and on, under sample numbers and stamps of its own.
``python long_run.py BAG SAMPLES`` writes it, and prints after each second of it the number of
samples and the resident memory of the process [MB].
"""

from __future__ import annotations

import json
import resource
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from made_up_run import TOPICS, Encoder, make_run, open_bag
from numpy.typing import NDArray

from maglev_model.contract.phases import Phase
from maglev_monitor.bag.log_time import LogTimes
from maglev_monitor.metrics.decoding import decode

RATE = 1000
"""Samples in a second of stage time."""

_PERIOD = 1_000_000  # of the samples [ns]
_BURST = 50  # samples that the recorder takes at once
_RUN = {'scenario': 'long_run', 'mode': 'lockstep', 'stage': 'plant'}


class LongRun:
    """The messages of a run of ``samples``, at least those of the short one."""

    def __init__(self, samples: int, short: int = 3000) -> None:
        run, encoder = make_run(short), Encoder()
        self.samples = samples
        self.start = int(run.stamp[0])
        """Stamp of the first sample [ns]."""
        tracked = np.flatnonzero(run.phase == Phase.TRACK)
        self._before, self._tracked = int(tracked[0]), len(tracked)
        self._after = short - int(tracked[-1]) - 1
        self._octets: dict[str, NDArray[np.uint8]] = {}
        self._types: dict[str, np.dtype[np.void]] = {}
        for key in TOPICS:
            messages = [encoder.message(run, key, n) for n in range(short)]
            self._types[key] = decode(key, messages).dtype
            octets = np.frombuffer(b''.join(messages), np.uint8)
            self._octets[key] = octets.reshape(short, -1)
        values = {'run': json.dumps(_RUN)}
        self.diagnostic = encoder.diagnostic(self.start, 0, 'monitor', 'ok', values)
        """What the monitor says of the run, serialized."""

    def messages(self, key: str, first: int, last: int) -> list[tuple[bytes, int]]:
        """Serialized messages of a topic from one sample to before another, each with its stamp."""
        numbers = np.arange(first, last)
        stamps = self.start + _PERIOD * numbers
        octets = self._octets[key][self._rows(numbers)]
        records = octets.view(self._types[key])[:, 0]
        records['sequence'] = numbers
        records['seconds'], records['nanoseconds'] = np.divmod(stamps, 1_000_000_000)
        if key == 'measurement':
            records['wall_time'] = stamps
        size, data = octets.shape[1], octets.tobytes()
        parts = (data[place : place + size] for place in range(0, len(data), size))
        return list(zip(parts, stamps.tolist(), strict=True))

    def _rows(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """Which samples of the short run these are."""
        end = self._before + self._tracked
        landing = self.samples - self._after
        again = self._before + (numbers - self._before) % self._tracked
        rows: NDArray[np.int64] = np.where(numbers < self._before, numbers, again)
        return np.where(numbers < landing, rows, numbers - landing + end)


def write_long_run(path: Path, samples: int, *, compress: bool = True) -> Iterator[int]:
    """Write the bag of a run, in the bursts of a recorder; how much is written at each second."""
    run, writer, log_times = LongRun(samples), open_bag(path, compress=compress), LogTimes()
    writer.write('/diagnostics', [(run.diagnostic, run.start)])
    order = ('measurement', *(key for key in TOPICS if key != 'measurement'))
    for first in range(0, samples, RATE):
        last = min(first + RATE, samples)
        messages = {key: run.messages(key, first, last) for key in TOPICS}
        for burst in range(0, last - first, _BURST):
            for key in order:
                topic, message_type = TOPICS[key]
                timed = log_times.of(message_type, messages[key][burst : burst + _BURST])
                writer.write(topic, timed)
        writer.flush()
        yield last
    writer.close()


def main(path: str, samples: str) -> None:
    """Write a bag and print what it takes."""
    page = 1e-6 * resource.getpagesize()
    for written in write_long_run(Path(path), int(samples)):
        print(written, page * int(Path('/proc/self/statm').read_text().split()[1]), flush=True)


if __name__ == '__main__':
    main(*sys.argv[1:])
