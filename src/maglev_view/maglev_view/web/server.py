"""A viser server without a word on the terminal, and where its camera is at first. No ROS here."""

from __future__ import annotations

import contextlib
import io
import socket
from typing import Any

import viser

FITTING = """
const asked = new URLSearchParams(location.search), query = new URLSearchParams(asked);
const where = (media, name, value) => {
  if (matchMedia(media).matches && !query.has(name)) query.set(name, value);
};
where('(prefers-color-scheme: dark)', 'darkMode', '');
where('(orientation: portrait)', 'initialCameraPosition', '1.6,-2.3,0.8');
where('(orientation: portrait)', 'initialCameraLookAt', '0,0,0.12');
if (`${query}` !== `${asked}`) location.replace(`?${query}`);
"""
"""JavaScript: a page takes on the colours that its browser prefers, and on an upright screen shows
the whole stage. It is loaded again with what viser's client takes from the query."""


class _Server(viser.ViserServer):
    """Is never shared: any page of any site could ask for a tunnel from outside to this machine."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Open none."""

    def disconnect_share_url(self) -> None:
        """There is none."""


def serve(host: str, port: int, title: str = '') -> Any:
    """A server at an address and a port, or the next one that is free; 0: any.

    Raises OSError for an address that is none of this machine's.
    """
    family, *_ = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0]
    socket.create_server((host, 0), family=family).close()  # viser would try for ever
    with contextlib.redirect_stdout(io.StringIO()):  # its banner
        server: Any = _Server(host=host, port=port, label=title, verbose=False)
    camera = server.initial_camera
    camera.position, camera.look_at = (1.0, -1.2, 0.45), (0.2, 0.0, 0.12)
    return server


def address(server: Any) -> str:
    """Where a browser finds it."""
    host = str(server.get_host())
    return f'http://{f"[{host}]" if ":" in host else host}:{server.get_port()}'


def stop(server: Any) -> None:
    """End it, likewise without a word."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()
