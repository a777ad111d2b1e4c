"""The made-up run of the monitor's tests."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from made_up_run import TOPICS, Encoder, Run, make_run, open_bag, write_samples


@pytest.fixture(scope='session')
def run() -> Run:
    return make_run()


@pytest.fixture(scope='session')
def encoder() -> Encoder:
    return Encoder()


@pytest.fixture(scope='session')
def messages(run: Run, encoder: Encoder) -> dict[str, list[bytes]]:
    """All messages of the made-up run by topic key."""
    return {key: [encoder.message(run, key, n) for n in range(len(run))] for key in TOPICS}


@pytest.fixture(scope='session')
def bag(
    tmp_path_factory: pytest.TempPathFactory,
    run: Run,
    messages: dict[str, list[bytes]],
    encoder: Encoder,
) -> Path:
    """A whole bag of the made-up run, with what the monitor says in it."""
    path = tmp_path_factory.mktemp('run') / 'bag'
    writer = open_bag(path)
    values = {'run': json.dumps({'scenario': 'made_up', 'mode': 'lockstep', 'stage': 'plant'})}
    stamp = int(run.stamp[0])
    message = encoder.diagnostic(stamp, 0, 'monitor', 'ok', values)
    writer.write('/diagnostics', [(message, stamp)])
    write_samples(writer, run, messages)
    writer.close()
    return path
