"""Libraries that only some tools need, and no set-up brings. No ROS here."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator


class MissingLibraryError(ImportError):
    """A library that is no part of the set-up is needed; the message says how to install it."""


@contextlib.contextmanager
def needed(name: str, what: str, versions: str = '') -> Iterator[None]:
    """Import a library that only ``what`` needs, in some ``versions``, ``>=2,<3``.

    Raises :class:`MissingLibraryError` naming it.
    """
    try:
        yield
    except ImportError as error:
        wanted = f"'{name}{versions}'" if versions else name
        raise MissingLibraryError(f'{what} needs {name}: pip install {wanted}') from error
