"""A headless browser, driven over its debugging protocol."""

from __future__ import annotations

import base64
import contextlib
import json
import os
import shutil
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

from websockets.sync.client import connect

NAMES = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable')


def found() -> str:
    """Path of a browser of this machine, empty where there is none."""
    return next((path for path in map(shutil.which, NAMES) if path), '')


class Browser:
    """One page in a browser of its own; all it asks the network for is in :attr:`requested`."""

    def __init__(self, folder: Path) -> None:
        options = ['--headless=new', '--no-sandbox', '--disable-gpu', '--use-angle=swiftshader']
        options += ['--enable-unsafe-swiftshader', '--disable-dev-shm-usage', '--no-first-run']
        options += ['--disable-background-networking', '--disable-component-update']
        options += ['--remote-debugging-port=0', f'--user-data-dir={folder}', '--mute-audio']
        options += ['--window-size=900,500', 'about:blank']
        self._process = subprocess.Popen(
            ['nice', '-n', '19', found(), *options],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        port = self._port(folder / 'DevToolsActivePort')
        self._socket = connect(port, max_size=None)
        self._number = 0
        self._session = ''
        self.requested: list[str] = []
        targets = self._ask('Target.getTargets')['targetInfos']
        target = next(each['targetId'] for each in targets if each['type'] == 'page')
        attached = self._ask('Target.attachToTarget', targetId=target, flatten=True)
        self._session = attached['sessionId']
        self._ask('Network.enable')
        self._ask('Page.enable')

    def open(self, address: str) -> None:
        """Go to a page."""
        self._ask('Page.navigate', url=address)

    def evaluate(self, expression: str) -> Any:
        """The value of an expression in JavaScript."""
        result = self._ask('Runtime.evaluate', expression=expression, returnByValue=True)
        return result['result'].get('value')

    def wait(self, expression: str, timeout: float = 60.0) -> None:
        """Wait until an expression is true."""
        deadline = time.monotonic() + timeout
        while not self.evaluate(f'Boolean({expression})'):
            assert time.monotonic() < deadline, f'never true: {expression}'
            time.sleep(0.1)

    def picture(self, width: int, height: int) -> bytes:
        """What is seen in the upper left corner, as PNG."""
        clip = {'x': 0, 'y': 0, 'width': width, 'height': height, 'scale': 1}
        return base64.b64decode(self._ask('Page.captureScreenshot', clip=clip)['data'])

    def resize(self, width: int, height: int) -> None:
        """Become a window of so many CSS pixels, as on a phone."""
        size = {'width': width, 'height': height, 'deviceScaleFactor': 1, 'mobile': True}
        self._ask('Emulation.setDeviceMetricsOverride', **size)

    def darken(self) -> None:
        """Prefer dark pages from now on."""
        wish = {'name': 'prefers-color-scheme', 'value': 'dark'}
        self._ask('Emulation.setEmulatedMedia', features=[wish])

    def close(self) -> None:
        """End the browser with all its processes."""
        self._socket.close()
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait(10)

    def _port(self, file: Path) -> str:
        deadline = time.monotonic() + 60.0
        while not file.exists() or len(file.read_text().splitlines()) < 2:
            assert self._process.poll() is None, 'the browser has ended'
            assert time.monotonic() < deadline, 'the browser never came up'
            time.sleep(0.05)
        port, path = file.read_text().splitlines()[:2]
        return f'ws://127.0.0.1:{port}{path}'

    def _ask(self, method: str, **parameters: Any) -> Any:
        self._number += 1
        asked = {'id': self._number, 'method': method, 'params': parameters}
        if self._session:
            asked['sessionId'] = self._session
        self._socket.send(json.dumps(asked))
        while True:
            answer = json.loads(self._socket.recv(timeout=60.0))
            if answer.get('method') == 'Network.requestWillBeSent':
                self.requested.append(answer['params']['request']['url'])
            if answer.get('method') == 'Network.webSocketCreated':
                self.requested.append(answer['params']['url'])
            if answer.get('id') == self._number:
                assert 'error' not in answer, answer['error']
                return answer['result']
