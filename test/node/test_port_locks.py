"""Locks of ports: what a dead process held is given back, and nothing else is touched."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from maglev_node import port_locks
from maglev_node.port_locks import free_ports, held_locks

DOMAIN = 230  # of nobody else's tests
SHM = Path('/dev/shm')

# Makes a semaphore, takes it, says so and stays; told to, gives it back.
HOLDER = """
import ctypes, os, sys
libc = ctypes.CDLL(None, use_errno=True)
libc.sem_open.restype = ctypes.c_void_p
libc.sem_open.argtypes = [ctypes.c_char_p, ctypes.c_int, ctypes.c_uint, ctypes.c_uint]
libc.sem_wait.argtypes = libc.sem_post.argtypes = [ctypes.c_void_p]
semaphore = libc.sem_open(sys.argv[1].encode(), os.O_CREAT, 0o666, 1)
libc.sem_wait(semaphore)
print('held', flush=True)
sys.stdin.readline()
libc.sem_post(semaphore)
print('given back', flush=True)
sys.stdin.readline()
"""

Hold = Callable[[int], 'subprocess.Popen[str]']


def file(offset: int) -> Path:
    return SHM / f'sem.fastrtps_port{7400 + 250 * DOMAIN + offset}_mutex'


def value(path: Path) -> int:
    return int.from_bytes(path.read_bytes()[:4], sys.byteorder)


@pytest.fixture
def hold() -> Iterator[Hold]:
    """Start a process that holds the lock of a port."""
    started = []

    def start(offset: int) -> subprocess.Popen[str]:
        name = f'/{file(offset).name.removeprefix("sem.")}'
        process = subprocess.Popen(
            [sys.executable, '-c', HOLDER, name],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        assert process.stdout is not None
        assert process.stdout.readline() == 'held\n'
        return process

    yield start
    for process in started:
        process.kill()
        process.communicate()
    for path in SHM.glob(f'*fastrtps_port{str(7400 + 250 * DOMAIN)[:3]}*'):
        path.unlink()


def kill(process: subprocess.Popen[str]) -> None:
    process.send_signal(signal.SIGKILL)
    process.wait()


def test_what_a_dead_process_held_is_given_back(hold: Hold) -> None:
    kill(hold(11))
    port = file(11).with_name(f'fastrtps_port{7411 + 250 * DOMAIN}')
    port.write_bytes(b'')  # was being made
    inode = file(11).stat().st_ino
    assert value(file(11)) == 0
    free_ports(DOMAIN)
    assert value(file(11)) == 1
    assert file(11).stat().st_ino == inode
    assert not port.exists()
    free_ports(DOMAIN)
    assert value(file(11)) == 1  # once


def test_a_port_that_was_made_stays(hold: Hold) -> None:
    kill(hold(11))
    port = file(11).with_name(f'fastrtps_port{7411 + 250 * DOMAIN}')
    port.write_bytes(b'a port')
    free_ports(DOMAIN)
    assert (value(file(11)), port.read_bytes()) == (1, b'a port')


def test_a_live_holder_keeps_its_lock(hold: Hold) -> None:
    process = hold(13)
    assert {lock.path for lock in held_locks(DOMAIN)} == {file(13)}
    free_ports(DOMAIN)
    assert value(file(13)) == 0
    process.send_signal(signal.SIGSTOP)  # for however long
    free_ports(DOMAIN)
    assert value(file(13)) == 0
    process.send_signal(signal.SIGCONT)
    assert process.stdin is not None
    process.stdin.write('\n')
    process.stdin.flush()
    assert process.stdout is not None
    assert process.stdout.readline() == 'given back\n'
    assert value(file(13)) == 1


def test_another_domains_lock_is_nobody_elses_business(hold: Hold) -> None:
    kill(hold(11))
    free_ports(DOMAIN + 1)
    free_ports(DOMAIN - 1)
    assert value(file(11)) == 0


def test_a_file_that_was_replaced_meanwhile_is_left_alone(
    hold: Hold, monkeypatch: pytest.MonkeyPatch
) -> None:
    kill(hold(11))
    looked = port_locks.users

    def replace(locks: set[port_locks.Lock]) -> tuple[set[port_locks.Lock], bool]:
        answer = looked(locks)
        if file(11).stat().st_ino in {lock.inode for lock in locks}:
            os.rename(file(11), file(11).with_suffix('.old'))
            hold(11)  # a neighbour, who comes up
        return answer

    monkeypatch.setattr(port_locks, 'users', replace)
    free_ports(DOMAIN)
    assert value(file(11)) == 0
    assert value(file(11).with_suffix('.old')) == 0


def test_who_has_waited_for_it_has_it_afterwards(hold: Hold) -> None:
    """And nobody after that: a waiter may be the holder, so it is left alone."""
    kill(hold(15))
    waiter = threading.Thread(target=lambda: waiting.append(hold(15)), daemon=True)
    waiting: list[subprocess.Popen[str]] = []
    waiter.start()
    time.sleep(0.5)
    free_ports(DOMAIN)
    assert not waiting
    lock = next(iter(held_locks(DOMAIN)))
    with lock.path.open('r+b') as opened, port_locks.mmap.mmap(opened.fileno(), 32) as memory:
        port_locks._post(memory)
    waiter.join(10.0)
    assert len(waiting) == 1


def test_where_processes_are_hidden_a_lock_must_be_old(
    hold: Hold, monkeypatch: pytest.MonkeyPatch
) -> None:
    kill(hold(11))
    looked = port_locks.users
    monkeypatch.setattr(port_locks, 'users', lambda locks: (looked(locks)[0], False))
    begun = time.monotonic()
    free_ports(DOMAIN, patience=1.0)
    assert time.monotonic() - begun > 1.0
    assert value(file(11)) == 1


@pytest.mark.parametrize(
    ('user', 'mode', 'expected'),
    [
        (0, 0o600, True),
        (1000, 0o600, True),
        (1001, 0o644, False),
        (1001, 0o664, True),
        (1001, 0o646, True),
    ],
)
def test_who_may_write_to_a_lock_may_hold_it(user: int, mode: int, expected: bool) -> None:
    found = os.stat_result((mode, 1, 1, 1, 1000, 1000, 32, 0, 0, 0))
    assert port_locks._may_write(user, found) == expected


def test_the_kernel_holds_none(hold: Hold, tmp_path: Path) -> None:
    kill(hold(11))
    (tmp_path / 'stat').write_text('1 (a (b) c) S 1 1 1 0 -1 4194560 0 0')
    assert port_locks._may_use(tmp_path, held_locks(DOMAIN))
    (tmp_path / 'stat').write_text('1 (kworker) S 2 0 0 0 -1 2129984 0 0')
    assert not port_locks._may_use(tmp_path, held_locks(DOMAIN))
