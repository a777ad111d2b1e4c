"""Definitions and hashes of message types, for bags. No ROS here."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from maglev_monitor.bag.errors import BagError

FindMessages = Callable[[str], Path]
"""From a package's name to the folder of its .msg files; raises LookupError."""


class Definition(NamedTuple):
    """A message type's definition with all it is made of, as .msg text, and its hash (REP-2011)."""

    text: str
    type_hash: str


class Definitions:
    """Message types, from ROS's own store or from .msg files.

    :param find_messages: where the .msg files of packages lie that are not ROS's own.
    """

    def __init__(self, find_messages: FindMessages) -> None:
        self._find_messages = find_messages
        self._typestore = get_typestore(Stores.ROS2_JAZZY)

    def of(self, message_type: str) -> Definition:
        """The definition of a type such as ``std_msgs/msg/Header``. Raises :class:`BagError`."""
        self._know(message_type)
        text, _ = self._typestore.generate_msgdef(message_type, ros_version=2)
        return Definition(text, self._typestore.hash_rihs01(message_type))

    def _know(self, message_type: str) -> None:
        known = self._typestore.types
        if message_type in known:
            return
        package = message_type.split('/')[0]
        types: dict[str, Any] = {}
        try:
            for file in sorted(self._find_messages(package).glob('*.msg')):
                name = f'{package}/msg/{file.stem}'
                if name not in known:
                    types.update(get_types_from_msg(file.read_text(encoding='utf-8'), name))
            self._typestore.register(types)
        except (OSError, LookupError) as error:
            reason = error.strerror if isinstance(error, OSError) else error
            raise BagError(f"no definition of '{message_type}' found: {reason}") from error
        if message_type not in known:
            raise BagError(f"no definition of '{message_type}' found in package '{package}'")
