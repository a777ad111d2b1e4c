"""Whose clicks may do harm: those of a page that came from here. No ROS here.

A browser lets any page of any site speak to a server on this machine. Such a page names its own
origin, and one that has bent a name of its own to this machine names that as the host: neither
shall lift the platen.
"""

from __future__ import annotations

import ipaddress
import socket
from collections.abc import Mapping
from urllib.parse import urlsplit


def trusted(headers: Mapping[str, str]) -> bool:
    """Whether a connection is of our own page, or of no browser.

    :param headers: those of the request that opened it.
    """
    origin = headers.get('Origin')
    if origin is None:
        return True
    host = headers.get('Host', '')
    return urlsplit(origin).netloc == host and _is_here(urlsplit(f'//{host}').hostname or '')


def _is_here(name: str) -> bool:
    """Whether a name is one that no other can give this machine."""
    if name in ('localhost', socket.gethostname().lower()):
        return True
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
