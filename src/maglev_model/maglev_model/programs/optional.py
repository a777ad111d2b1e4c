"""Libraries that only some tools need, and no set-up brings. No ROS here."""

from __future__ import annotations

import contextlib
import shlex
import sys
from collections.abc import Iterator


class MissingLibraryError(ImportError):
    """A library that is no part of the set-up is needed; the message says how to install it."""


@contextlib.contextmanager
def needed(name: str, what: str, versions: str = '') -> Iterator[None]:
    """Import a library that only ``what`` needs, in some ``versions``, ``>=2,<3``.

    Raises :class:`MissingLibraryError` naming it, and the Python that lacks it: `pip` alone may be
    another's.
    """
    try:
        yield
    except ImportError as error:
        wanted = f"'{name}{versions}'" if versions else name
        how = f'{shlex.quote(sys.executable)} -m pip install {wanted}'
        raise MissingLibraryError(f'{what} needs {name}: {how}') from error
