"""A client of the live view's page without a browser: reads what it is sent, presses buttons."""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Callable, Iterable
from typing import Any

import msgspec
import viser
import zstandard
from websockets.sync.client import connect

from maglev_view.frames import PLATEN, STAGE


def heights(messages: Iterable[dict[str, Any]]) -> list[float]:
    """Where messages put the platen, one after the other, the stators' face at zero [m]."""
    moved = [m for m in messages if m['type'] == 'SetPositionMessage']
    return [m['position'][2] for m in moved if m['name'] == f'/{STAGE}/{PLATEN}']


class PageClient:
    """What a page would know; leaves at the end of a ``with``.

    :param address: of the page, ``http://127.0.0.1:8080``.
    :param origin: the site that a browser would name as the page's, None for no browser.
    """

    def __init__(self, address: str, origin: str | None = None) -> None:
        self._socket = connect(
            address.replace('http', 'ws'),
            origin=origin,
            subprotocols=[f'viser-v{viser.__version__}'],
            max_size=None,
        )
        self.messages: list[dict[str, Any]] = []
        self.send(self._camera())

    def __enter__(self) -> PageClient:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def read(self, duration: float) -> None:
        """Take what comes for some time [s]."""
        deadline = time.monotonic() + duration
        while (left := deadline - time.monotonic()) > 0.0:
            try:
                frame = self._socket.recv(timeout=left)
            except TimeoutError:
                return
            assert isinstance(frame, bytes)
            size = int.from_bytes(frame[8:16], 'little')
            text = zstandard.ZstdDecompressor().decompress(frame[16 : 16 + size])
            self.messages += msgspec.msgpack.decode(text)['messages']

    def wait(self, condition: Callable[[], Any], timeout: float = 60.0) -> Any:
        """Read until something holds; what it is."""
        deadline = time.monotonic() + timeout
        while not (found := condition()):
            assert time.monotonic() < deadline, f'it never held; the page says:\n{self.text()}'
            self.read(0.05)
        return found

    def of(self, kind: str) -> list[dict[str, Any]]:
        """The messages of one type."""
        return [message for message in self.messages if message['type'] == kind]

    def buttons(self) -> dict[str, str]:
        """The buttons' numbers by their labels."""
        found = self.of('GuiButtonMessage')
        return {message['props']['label']: message['uuid'] for message in found}

    def press(self, label: str) -> None:
        """Click a button."""
        click = {'type': 'GuiUpdateMessage', 'uuid': self.buttons()[label]}
        self.send({**click, 'updates': {'value': True}})

    def enter(self, label: str, value: float) -> None:
        """Put a number into a field, whatever the bounds that a browser would keep to."""
        fields = {m['props']['label']: m['uuid'] for m in self.of('GuiNumberMessage')}
        self.send({'type': 'GuiUpdateMessage', 'uuid': fields[label], 'updates': {'value': value}})

    def send(self, message: dict[str, Any]) -> None:
        """Send any message of viser's."""
        self._socket.send(msgspec.msgpack.encode(message))

    def text(self) -> str:
        """All HTML that is shown now, part by part."""
        shown = {m['uuid']: m['props']['content'] for m in self.of('GuiHtmlMessage')}
        for message in self.of('GuiUpdateMessage'):
            if 'content' in message['updates']:
                shown[message['uuid']] = message['updates']['content']
        return '\n'.join(shown.values())

    def close(self) -> None:
        """Leave without a word, as a browser that is killed."""
        with contextlib.suppress(OSError):  # it has ended by itself
            self._socket.socket.shutdown(socket.SHUT_RDWR)
        self._socket.recv_events_thread.join(10)
        self._socket.socket.close()

    @staticmethod
    def _camera() -> dict[str, Any]:
        """With which viser counts a client as connected."""
        return {
            'type': 'ViewerCameraMessage',
            'wxyz': (1.0, 0.0, 0.0, 0.0),
            'position': (1.0, 1.0, 1.0),
            'fov': 1.0,
            'near': 0.1,
            'far': 10.0,
            'image_height': 100,
            'image_width': 100,
            'look_at': (0.0, 0.0, 0.0),
            'up_direction': (0.0, 0.0, 1.0),
        }
