"""One run again, alone, with all that was logged of it drawn."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from maglev_model.axes import FloatArray
from maglev_study.faults.campaign import Outcome
from maglev_study.faults.flight import Flight
from maglev_study.faults.fly import Course, Scenario
from maglev_study.faults.judge import Verdict
from maglev_study.faults.machines import PLAIN, Believed
from maglev_study.faults.page import describe, describe_violations
from maglev_study.faults.train import fly_all

_MOST = 5.0  # that is drawn of an encoder beside the truth [mm]


class Record(NamedTuple):
    """A run with its log; row k is k samples after the instant at which the run begins."""

    run: Scenario
    verdict: Verdict
    state: FloatArray  # true x1..x10 (n, 10)
    volts: FloatArray  # outputs of both boards (n, 16)
    shift: FloatArray  # what the encoders read beside the truth (n, 6) [m]
    enabled: FloatArray  # whether the amplifiers are (n,)
    marks: dict[str, float]  # what happened when [ms]
    period: float  # of the samples [s]


def replay(run: Scenario, believed: Believed = PLAIN) -> Record:
    """Fly one run and keep its log."""
    ((_, outcome),) = fly_all([run], believed, work=_record)
    if isinstance(outcome, Verdict):  # it hung, or died
        log = np.zeros((0, 10)), np.zeros((0, 16)), np.zeros((0, 6)), np.zeros(0)
        return Record(run, outcome, *log, {}, believed.bridge.sample_time)
    return outcome


def _record(flight: Flight, run: Scenario) -> Record:
    course = Course(flight, run)
    verdict = course.fly()
    judge = course.judge
    return Record(run, verdict, *judge.log(), judge.marks(course.shows), flight.period)


def draw(record: Record) -> str:
    """The run as an HTML page."""
    from maglev_monitor.report.page import bullets, header, page, picture

    verdict = record.verdict
    facts = [
        f'{verdict.ended}, {verdict.impact:.4f} m/s at a stop',
        f'as the bridge says: {verdict.reason or "nothing"}',
    ]
    facts += [f'{name} {at:g} ms after the beginning' for name, at in record.marks.items()]
    title = f'Run {record.run.seed}'
    broken = describe_violations(Outcome(record.run, verdict))
    parts = [
        header(title, 'fail' if broken else 'pass', [describe(record.run)]),
        bullets('What happened', facts),
        bullets('Broken', [broken] if broken else []),
        picture(_plot(record)),
    ]
    return page(title, parts)


def _plot(record: Record):  # type: ignore[no-untyped-def]
    from matplotlib import pyplot as plt

    from maglev_monitor.report.drawing import STYLE, to_plot

    time = 1e3 * record.period * np.arange(len(record.state))
    with plt.rc_context(STYLE):
        figure, rows = plt.subplots(5, 1, figsize=(9.0, 11.0), sharex=True)
        state = 1e3 * record.state
        rows[0].plot(time, state[:, 0])
        rows[0].set(title='true air gap y', ylabel='mm')
        rows[1].plot(time, state[:, 2:5:2], label=('x', 'z'))
        rows[1].set(title='true displacements', ylabel='mm')
        rows[2].plot(time, np.clip(1e3 * record.shift, -_MOST, _MOST), label=_ENCODERS)
        rows[2].set(title='what the encoders count off the truth, to 5 mm', ylabel='mm')
        rows[3].plot(time, record.volts)
        rows[3].set(title='outputs of both boards', ylabel='V')
        rows[4].plot(time, record.enabled)
        rows[4].set(title='amplifiers enabled', xlabel='ms after the beginning')
        for panel in rows:
            for name, at in record.marks.items():
                panel.axvline(at, color=_MARKS.get(name, '#888888'), linewidth=0.8)
        rows[1].legend()
        rows[2].legend(ncols=3)
        caption = 'Lines: ' + ', '.join(f'{name} at {at:g} ms' for name, at in record.marks.items())
        return to_plot('The run', caption, figure)


_ENCODERS = ('gap 1', 'gap 2', 'gap 3', 'gap 4', 'x', 'z')
_MARKS = {'shows': '#c2452d', 'found': '#1f5fa8', 'over': '#2a8a62', 'process ended': '#9a9a9a'}
