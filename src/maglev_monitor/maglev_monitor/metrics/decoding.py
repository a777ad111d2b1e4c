"""The five topics of a run as columns: serialized messages in, NumPy records out.

A block of serialized messages of one topic is decoded at once, without building a message object
for each: the fields lie where :mod:`maglev_model.contract.wire` says, so a block is one structured
array. A live monitor and the analysis of a bag both read through here. No ROS here.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from maglev_model.contract.wire import TOPIC_TYPES, DecodeError, no_record_type, record_type

Records = NDArray[np.void]

_HEAD = 16  # encapsulation, stamp and the frame_id's length [octets]


def decode(key: str, messages: Sequence[bytes]) -> Records:
    """Decode serialized messages of one topic.

    :param key: key of the topic in :data:`TOPIC_TYPES`.
    :param messages: the serialized messages, in order of arrival.
    :returns: records, shape (n,): the message's fields, and its stamp as ``seconds`` and
        ``nanoseconds``.
    :raises DecodeError: when a message is too short, too long or not plain little-endian CDR.
    """
    if not messages:
        return np.zeros(0, no_record_type(key))
    first = messages[0]
    uniform = all(len(message) == len(first) for message in messages)
    if uniform:
        octets = np.frombuffer(b''.join(messages), np.uint8).reshape(len(messages), -1)
        if octets.shape[1] >= _HEAD:
            lengths = octets[:, _HEAD - 4 : _HEAD]
            if (lengths == lengths[0]).all() and (octets[:, 1] == first[1]).all():
                return octets.view(record_type(key, first))[:, 0]
    if len(messages) == 1:
        raise DecodeError(f'a message of {len(first)} bytes is no {TOPIC_TYPES[key].message_type}')
    parts = [decode(key, [message]) for message in messages]
    if any(part.dtype.names != parts[0].dtype.names for part in parts):
        raise DecodeError(f'not every {TOPIC_TYPES[key].message_type} has the same fields')
    return joined(parts)


def joined(parts: Sequence[Records]) -> Records:
    """Records with the same fields in one array, whose fields need not lie as in the messages."""
    names = parts[0].dtype.names or ()
    whole = np.empty(sum(map(len, parts)), [(name, parts[0].dtype[name]) for name in names])
    for name in names:
        whole[name] = np.concatenate([part[name] for part in parts])
    return whole


def stamps(records: Records) -> NDArray[np.int64]:
    """Header stamps of decoded records [ns], shape (n,)."""
    seconds = records['seconds'].astype(np.int64)
    nanoseconds: NDArray[np.int64] = seconds * 1_000_000_000 + records['nanoseconds']
    return nanoseconds


def stage_period(measured: Records) -> float | None:
    """Stage time from sample to sample [s], by measurements in order; None where it is not known.

    Former measurements were stamped by the wall clock.
    """
    if 'wall_time' not in (measured.dtype.names or ()):
        return None
    follows = np.diff(measured['sequence'].astype(np.int64)) == 1
    periods = np.diff(stamps(measured))[follows]
    return 1e-9 * round(float(np.median(periods))) if len(periods) else None
