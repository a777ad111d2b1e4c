"""Tests that run side by side do not meet on the graph; the longest files begin first."""

from __future__ import annotations

import os
import signal
from collections.abc import Generator

import pytest
from _pytest.runner import runtestprotocol
from hypothesis import HealthCheck, settings
from witness import SHORT, Witness

settings.register_profile('loaded', deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile('loaded')

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as a script's background jobs have it
    signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:  # as by nohup
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

_late = ''  # that the machine does not keep time, and where that was found out

_worker = os.environ.get('PYTEST_XDIST_WORKER', 'gw0').removeprefix('gw')
_domains = os.environ.get('MAGLEV_TEST_DOMAINS', '').split()
if _domains:
    if int(_worker) >= len(_domains):
        raise pytest.UsageError(f'more workers than the {len(_domains)} ROS domains that are ours')
    os.environ['ROS_DOMAIN_ID'] = _domains[int(_worker)]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Scenarios and the fault campaign first, then those with real nodes, which often wait."""

    def place(item: pytest.Item) -> tuple[bool, bool]:
        longest = ('scenario/test_scenarios.py', 'faults/test_campaign.py')
        return not any(map(item.path.match, longest)), item.path.parent.name != 'graph'

    items.sort(key=place)


def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> bool | None:
    """What flies in real time flies again where the machine itself did not keep time.

    Where that happens twice in a row nothing more is flown in real time on this machine.
    """
    global _late
    if item.get_closest_marker('real_time') is None:
        return None
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    if _late:
        item.add_marker(pytest.mark.skip(reason=f'before it {_late}'))
        reports = runtestprotocol(item, log=False, nextitem=nextitem)
    else:
        reports = _flown(item, nextitem)
    for report in reports:
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


def _flown(item: pytest.Item, nextitem: pytest.Item | None) -> list[pytest.TestReport]:
    """What became of a flight in real time; skipped, where both are lost to the machine."""
    global _late
    for attempt in range(2):
        if attempt:
            item._initrequest()  # its fixtures anew
        with Witness() as witness:
            reports = runtestprotocol(item, log=False, nextitem=nextitem)
        failed = [report for report in reports if report.failed]
        if not failed or not witness.disturbed:
            return reports
        lost = (
            f'lost while a SCHED_FIFO thread was late by up to {witness.worst:.4f} s, and in'
            f' {witness.share:.2%} of its looks by more than {SHORT} s'
        )
        print(f'\n{item.name}: {lost}')
    _late = f'{item.name} was {lost}'
    for report in failed:
        report.outcome = 'skipped'
        report.longrepr = str(item.path), item.location[1], f'twice {lost}'
    return reports


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """With a test that failed goes what the nodes said that it started."""
    report = yield
    nodes = getattr(item, 'funcargs', {}).get('nodes')
    if report.failed:
        for process in getattr(nodes, 'started', ()):  # a parameter may have that name, too
            report.sections.append((f'log of {process.log.stem}', process.output[-6000:]))
    return report
