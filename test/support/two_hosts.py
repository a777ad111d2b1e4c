"""Two hosts on one machine: network namespaces with nothing in common but one bad cable.

Run as a program it is the cable: it makes both hosts, prints the process that holds each, and
forwards Ethernet frames between them. Its standard input tells it what becomes of them: ``LOSS
DELAY`` as a share and in seconds, ``cut`` for a loss of all. Everything is gone when that closes.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import random
import select
import shutil
import struct
import subprocess
import sys
import time
from collections import deque

_TUNSETIFF, _TAP, _NO_INFORMATION = 0x400454CA, 0x0002, 0x1000
_FRAME = 2048

# A host: a loopback, shared memory of its own, and life until its input closes.
_HOST = 'mount -t tmpfs none /dev/shm && ip link set lo up && echo up && exec cat'


def why_not() -> str:
    """Why there can be no two hosts here; empty when there can."""
    for program in ('ip', 'unshare', 'nsenter'):
        if shutil.which(program) is None:
            return f"there is no program '{program}'"
    if not os.access('/dev/net/tun', os.R_OK | os.W_OK):
        return 'there is no /dev/net/tun to read and write'
    done = subprocess.run(
        [*_unshare(), 'sh', '-c', _HOST], stdin=subprocess.DEVNULL, capture_output=True, text=True
    )
    return f'namespaces are not permitted: {done.stderr.strip()}' if done.returncode else ''


def _unshare() -> list[str]:
    own_root = [] if os.getuid() == 0 else ['--map-root-user']
    return ['unshare', *own_root, '--net', '--mount']


class TwoHosts:
    """The hosts and their cable, until :meth:`close`."""

    def __init__(self) -> None:
        self._cable = subprocess.Popen(
            [*_unshare(), sys.executable, __file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._cable.stdout is not None
        self._holders = self._cable.stdout.readline().split()
        assert len(self._holders) == 2, 'the cable has not come up'

    def on(self, host: int) -> list[str]:
        """What a command begins with that runs on host 0 or 1."""
        user = [] if os.getuid() == 0 else ['--user', '--preserve-credentials']
        return [
            *('nsenter', '--target', self._holders[host], '--net', '--mount', *user, '--'),
            *('env', 'ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET'),
        ]

    def lose(self, share: float, delay: float) -> None:
        """Lose a share of all frames from now on and deliver the others late by a delay [s]."""
        self._tell(f'{share} {delay}')

    def cut(self) -> None:
        """Let nothing through from now on."""
        self._tell('cut')

    def close(self) -> int:
        """End the cable and the hosts, with no process left on them; how many frames were lost."""
        output, _ = self._cable.communicate(timeout=10)
        return int(output or 0)

    def _tell(self, text: str) -> None:
        assert self._cable.stdin is not None
        print(text, file=self._cable.stdin, flush=True)


class Cable:
    """Both ends of the cable, and the frames that are on the way."""

    def __init__(self) -> None:
        self._hosts = [self._host() for _ in range(2)]
        self._ends = [self._plug(number, host) for number, host in enumerate(self._hosts)]
        self._on_the_way: deque[tuple[float, int, bytes]] = deque()  # when, where to, what
        self._loss, self._delay, self._lost = 0.0, 0.0, 0
        self._draw = random.Random(0)
        print(*(host.pid for host in self._hosts), flush=True)

    def run(self) -> None:
        """Forward frames until the input closes; before all other processes, where permitted."""
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
        while True:
            wait = self._on_the_way[0][0] - time.monotonic() if self._on_the_way else None
            ready, _, _ = select.select([0, *self._ends], [], [], wait and max(wait, 0.0))
            if 0 in ready and not self._obey():
                break
            for number, end in enumerate(self._ends):
                if end in ready:
                    self._take(os.read(end, _FRAME), 1 - number)
            self._deliver()
        for host in self._hosts:
            host.communicate(timeout=5)
        print(self._lost)

    @staticmethod
    def _host() -> subprocess.Popen[str]:
        host = subprocess.Popen(
            ['unshare', '--net', '--mount', 'sh', '-c', _HOST],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert host.stdout is not None
        assert host.stdout.readline() == 'up\n'
        return host

    @staticmethod
    def _plug(number: int, host: subprocess.Popen[str]) -> int:
        """Our end of a network device of the host, which has the address 10.0.0.1 or 10.0.0.2."""
        end = os.open('/dev/net/tun', os.O_RDWR)
        name = f'stage{number}'
        fcntl.ioctl(end, _TUNSETIFF, struct.pack('16sH22x', name.encode(), _TAP | _NO_INFORMATION))
        inside = ['nsenter', '--target', str(host.pid), '--net', '--', 'ip']
        for command in (
            ['ip', 'link', 'set', name, 'netns', str(host.pid)],
            [*inside, 'address', 'add', f'10.0.0.{number + 1}/24', 'dev', name],
            [*inside, 'link', 'set', name, 'up'],
        ):
            subprocess.run(command, check=True)
        return end

    def _obey(self) -> bool:
        """Do what the input says; false at its end."""
        order = os.read(0, 256).decode().split()
        if order:
            self._loss, self._delay = (
                (1.0, 0.0) if order[-1] == 'cut' else (float(order[-2]), float(order[-1]))
            )
        return bool(order)

    def _take(self, frame: bytes, to: int) -> None:
        if self._draw.random() < self._loss:
            self._lost += 1
        else:
            self._on_the_way.append((time.monotonic() + self._delay, to, frame))

    def _deliver(self) -> None:
        now = time.monotonic()
        while self._on_the_way and self._on_the_way[0][0] <= now:
            _, to, frame = self._on_the_way.popleft()
            os.write(self._ends[to], frame)


if __name__ == '__main__':
    Cable().run()
