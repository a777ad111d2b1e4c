"""What the page knows of a run, and what it says: from a made-up run's own messages."""

from __future__ import annotations

import math
import time
from types import SimpleNamespace

import numpy as np
import pytest
from made_up_run import Encoder, Run, make_run

from maglev_model.contract.phases import Phase
from maglev_monitor.metrics.decoding import decode
from maglev_view.colours import colour_of
from maglev_view.parameters import WebParameters
from maglev_view.web.guard import trusted
from maglev_view.web.live import Live
from maglev_view.web.panel import motors_html, status_html
from maglev_view.web.server import address

SAMPLES = 400


@pytest.fixture(scope='module')
def run() -> Run:
    return make_run(SAMPLES)


@pytest.fixture
def live(run: Run) -> Live:
    found, encoder = Live(WebParameters(window=0.5, bins=50)), Encoder()
    for first in range(0, SAMPLES, 50):
        for key in ('measurement', 'currents', 'reference', 'controller', 'plant'):
            block = [encoder.message(run, key, n) for n in range(first, first + 50)]
            found.take(key, decode(key, block))
    return found


def test_the_newest_sample_is_shown(run: Run, live: Live) -> None:
    assert live.sequence == SAMPLES - 1
    assert live.stage_time == pytest.approx(0.399)
    assert live.outputs == pytest.approx(run.position[-1], abs=3e-5)  # counted
    assert live.phase == Phase(run.phase[-1]).name
    assert live.currents == pytest.approx(np.hypot(run.direct[-1], run.quadrature[-1]))
    assert live.phase in status_html(live)


def test_the_reference_is_the_position_without_its_error(run: Run, live: Live) -> None:
    rows = decode('controller', [Encoder().message(run, 'controller', 0)]).copy()
    rows['position'], rows['error'] = [0.025, 0.01, 0.0, 0.0, 0.001], [1e-5, 0.0, 0.0, 0.0, -1e-4]
    live.take('controller', rows)
    assert live.reference == pytest.approx([0.02499, 0.01, 0.0, 0.0, 0.0011])
    assert live.planned.points[-1] == pytest.approx((0.01, 0.0, -0.02499))


def test_nothing_is_claimed_before_a_stage_is_heard() -> None:
    assert 'no stage is heard' in status_html(Live(WebParameters()))


def test_faults_are_shown_with_their_remedy_until_they_are_gone(live: Live) -> None:
    live.told('plant', 2, 'stop at sample 7 <b>', {'remedy': 'press reset & look'})
    live.told('controller', 1, 'waiting', {})
    text = status_html(live)
    assert 'stop at sample 7 &lt;b&gt;' in text
    assert 'what to do: press reset &amp; look' in text
    assert 'waiting' not in text
    live.told('plant', 0, 'running', {})
    assert 'what to do' not in status_html(live)


@pytest.mark.parametrize(
    ('mode', 'said'),
    [('FAULT', 'press Reset, then Enable, then Lift off'), ('DISABLED', 'press Enable, then Lift')],
)
def test_what_to_do_about_a_controller_is_said(live: Live, mode: str, said: str) -> None:
    live.told('controller', 2, f'{mode}: emergency stop', {'mode': mode})
    assert said in status_html(live)
    live.told('controller', 0, 'regulating', {'mode': 'REGULATING'})
    assert said not in status_html(live)


def test_a_stage_that_falls_silent_is_noticed(live: Live, monkeypatch: pytest.MonkeyPatch) -> None:
    assert 'no sample for' not in status_html(live)
    now = time.monotonic()
    monkeypatch.setattr(time, 'monotonic', lambda: now + 7.0)
    assert 'no sample for 7 s' in status_html(live)


def test_what_a_controller_said_that_is_gone_is_not_shown_as_now(run: Run, live: Live) -> None:
    assert '– of 7 A' not in motors_html(live, 7.0)
    later = decode('measurement', [Encoder().message(run, 'measurement', 0)]).copy()
    for sequence, known in ((SAMPLES + 900, True), (SAMPLES + 1100, False)):
        later['sequence'] = sequence
        live.take('measurement', later)
        assert ('controller regulating' in status_html(live)) == known
        assert (live.phase != '') == (live.reference is not None) == known
        assert ('– of 7 A' not in motors_html(live, 7.0)) == known
    for key in ('currents', 'reference', 'controller'):
        block = decode(key, [Encoder().message(run, key, SAMPLES - 1)]).copy()
        block['sequence'] = SAMPLES + 1100
        live.take(key, block)
    assert 'controller regulating' in status_html(live)
    assert '– of 7 A' not in motors_html(live, 7.0)


def test_bars_are_full_at_the_limit(live: Live) -> None:
    live.currents = np.array([0.0, 3.5, 7.0, 70.0])
    live.load = np.array([0.25, 0.5, 1.0, 1.2])
    text = motors_html(live, 7.0)
    widths = [part.split('%')[0] for part in text.split('<div style="width:')[1:]]
    assert widths == ['0.0', '25.0', '50.0', '50.0', '100.0', '100.0', '100.0', '100.0']
    live.load = None
    assert 'heat' not in motors_html(live, 7.0)


def test_currents_that_are_no_numbers_are_shown_as_such(run: Run, live: Live) -> None:
    """As of a controller of one's own: the page with its emergency stop does not end by them."""
    rows = decode('currents', [Encoder().message(run, 'currents', 0)]).copy()
    rows['direct_current'] = [np.nan, np.inf, -np.inf, 0.0]
    live.take('currents', rows)
    text = motors_html(live, 7.0)
    assert 'nan of 7 A' in text
    assert text.count('width:100.0%') == 3
    assert colour_of(math.nan) == colour_of(math.inf) == colour_of(1.0)


def test_the_load_of_a_real_amplifier_comes_from_its_diagnostics(live: Live) -> None:
    live.told('hw_bridge', 0, 'running', {'i2t_load': '0.4'})
    assert live.load is not None
    assert live.load.tolist() == [0.4] * 4


@pytest.mark.parametrize(
    ('headers', 'expected'),
    [
        ({'Host': '127.0.0.1:8080'}, True),  # no browser
        ({'Host': '127.0.0.1:8080', 'Origin': 'http://127.0.0.1:8080'}, True),
        ({'Host': 'localhost:8080', 'Origin': 'http://localhost:8080'}, True),
        ({'Host': '[::1]:8080', 'Origin': 'http://[::1]:8080'}, True),
        ({'Host': '127.0.0.1:8080', 'Origin': 'https://elsewhere.example'}, False),
        ({'Host': '127.0.0.1:8080', 'Origin': 'http://127.0.0.1:9999'}, False),
        ({'Host': '127.0.0.1:8080', 'Origin': 'null'}, False),
        ({'Host': 'bent.example:8080', 'Origin': 'http://bent.example:8080'}, False),
    ],
)
def test_only_our_own_page_may_ask(headers: dict[str, str], expected: bool) -> None:
    assert trusted(headers) is expected


@pytest.mark.parametrize(
    ('host', 'expected'),
    [
        ('127.0.0.1', 'http://127.0.0.1:80'),
        ('::1', 'http://[::1]:80'),
        ('stage', 'http://stage:80'),
    ],
)
def test_the_address_is_one_that_a_browser_takes(host: str, expected: str) -> None:
    assert address(SimpleNamespace(get_host=lambda: host, get_port=lambda: 80)) == expected
