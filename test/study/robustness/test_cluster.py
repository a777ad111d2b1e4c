"""A campaign on a real Dask scheduler with two real workers: killed, interrupted, of other code."""

from __future__ import annotations

import contextlib
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from maglev_model.parameters import ParameterError
from maglev_study.robustness import fleet
from maglev_study.robustness.fleet import Campaign, Plan, fly_plan, make_plan
from maglev_study.robustness.fly import Flown

distributed = pytest.importorskip('distributed', reason='distributed comes with the test tools')

PARAMS = Path(__file__).resolve().parents[3] / 'params'
EXPERIMENTS = ('step_y', 'step_x', 'scan')


@pytest.fixture(scope='module')
def plan() -> Plan:
    """The nominal machine and five drawn ones, through what is soon flown."""
    return make_plan(PARAMS, 5, names=EXPERIMENTS)


@pytest.fixture(scope='module')
def alone(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """What one process gives."""
    return plain(fly_plan(plan, tmp_path_factory.mktemp('alone')))


def plain(campaign: Campaign) -> list[str]:
    """All results, to the last bit."""
    return [repr(one.to_json()) for one in campaign.flown]


class Cluster:
    """A scheduler and two workers of one thread, processes of their own."""

    def __init__(self, opened: contextlib.ExitStack, folder: Path) -> None:
        with socket.create_server(('127.0.0.1', 0)) as free:
            port = free.getsockname()[1]
        self.address = f'tcp://127.0.0.1:{port}'
        self._opened, self._folder = opened, folder
        quiet = '--no-dashboard', '--host', '127.0.0.1'
        self._start('scheduler', '--port', str(port), *quiet)
        alone = '--no-nanny', '--nthreads', '1', *quiet
        self.workers = {
            name: self._start('worker', self.address, '--name', name, *alone)
            for name in ('one', 'two')
        }
        with distributed.Client(self.address, timeout=60.0) as client:
            client.wait_for_workers(2, timeout=60.0)

    def _start(self, what: str, *arguments: str) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(
            [sys.executable, '-m', 'dask', what, *arguments],
            cwd=self._folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        self._opened.callback(process.wait)
        self._opened.callback(process.kill)
        return process


@pytest.fixture(scope='module')
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """A real one."""
    with contextlib.ExitStack() as opened:
        yield Cluster(opened, tmp_path_factory.mktemp('dask'))


def workers_of(client: Any) -> dict[str, str]:
    """The names of the workers that the scheduler knows, by address."""
    known = client.scheduler_info(n_workers=-1)['workers']
    return {address: one['name'] for address, one in known.items()}


def test_ctrl_c_leaves_the_cluster_to_others_and_the_campaign_goes_on(
    plan: Plan, alone: list[str], cluster: Cluster, tmp_path: Path
) -> None:
    def interrupt(done: int, wanted: int, new: Sequence[Flown]) -> None:
        if done:
            signal.raise_signal(signal.SIGINT)

    part = fly_plan(plan, tmp_path, scheduler=cluster.address, heard=interrupt)
    assert part.interrupted
    assert 0 < len(part.flown) < len(alone)
    with distributed.Client(cluster.address, timeout=60.0) as client:
        assert set(workers_of(client).values()) == set(cluster.workers)
        deadline = time.monotonic() + 60.0
        while any(client.processing().values()):  # what was begun comes to its end
            assert time.monotonic() < deadline
            time.sleep(0.05)
    heard: list[int] = []
    found = fly_plan(plan, tmp_path, heard=lambda done, *_: heard.append(done))
    assert heard[0] == len(part.flown) // len(EXPERIMENTS)
    assert plain(found) == alone


def test_a_worker_of_other_code_is_refused(
    plan: Plan, cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fleet, 'sources_digest', lambda: 'other')
    with pytest.raises(ParameterError, match=r"code of the worker on .*of the campaign 'other'"):
        fly_plan(plan, tmp_path, scheduler=cluster.address)


def test_a_worker_that_is_killed_loses_nothing(
    plan: Plan, alone: list[str], cluster: Cluster, tmp_path: Path
) -> None:
    killed: list[str] = []

    def kill_a_busy_one(done: int, wanted: int, new: Sequence[Flown]) -> None:
        if done and not killed:
            client = distributed.get_client()
            names = workers_of(client)
            busy = [names[address] for address, tasks in client.processing().items() if tasks]
            killed.append(busy[0])
            cluster.workers[killed[0]].kill()

    found = fly_plan(plan, tmp_path, scheduler=cluster.address, heard=kill_a_busy_one)
    assert killed
    assert not found.interrupted
    assert plain(found) == alone
    with distributed.Client(cluster.address, timeout=60.0) as client:
        assert {*workers_of(client).values(), *killed} == set(cluster.workers)
        assert len(workers_of(client)) == 1
