"""The made-up run, decoded."""

from __future__ import annotations

import pytest

from maglev_monitor.metrics.decoding import Records, decode


@pytest.fixture(scope='module')
def decoded(messages: dict[str, list[bytes]]) -> dict[str, Records]:
    return {key: decode(key, part) for key, part in messages.items()}


@pytest.fixture
def records(decoded: dict[str, Records]) -> dict[str, Records]:
    return dict(decoded)
