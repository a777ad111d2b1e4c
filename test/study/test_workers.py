"""A function over many tasks, in processes of their own."""

from __future__ import annotations

import signal

from maglev_study.workers import results


def test_processes_leave_ctrl_c_to_whoever_started_them() -> None:
    asked = (signal.SIG_BLOCK, ())
    held = list(results(signal.pthread_sigmask, [asked, asked, asked], jobs=2))
    assert held == [{signal.SIGINT}] * 3
    assert signal.SIGINT not in signal.pthread_sigmask(*asked)
