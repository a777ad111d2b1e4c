"""Fixtures of the tests that start real nodes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from graph import Nodes, Observer

from maglev_node.topics import CONTROLLER_STATE, CURRENTS, MEASUREMENT, REFERENCE, TRUE_STATE


@pytest.fixture
def nodes(tmp_path: Path) -> Iterator[Nodes]:
    """Start nodes that end with the test."""
    started = Nodes(tmp_path)
    yield started
    for process in started.started:
        process.kill()


@pytest.fixture
def observer() -> Iterator[Observer]:
    """A node that watches the graph."""
    watching = Observer()
    yield watching
    watching.close()


@pytest.fixture
def watching(observer: Observer) -> Observer:
    """An observer of all sample topics, part of what the reference waits for."""
    observer.watch(REFERENCE, MEASUREMENT, TRUE_STATE, CURRENTS, CONTROLLER_STATE)
    return observer
