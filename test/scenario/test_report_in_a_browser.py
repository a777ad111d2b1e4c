"""The report of a run and its replay, looked at with a browser."""

from __future__ import annotations

from pathlib import Path

import browser
import pytest
from bag_fixtures import bag, encoder, messages, run

from maglev_monitor.report.analyze_cli import analyze
from maglev_view.replay import run as make_replay

__all__ = ['bag', 'encoder', 'messages', 'run']


pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not browser.found(), reason='there is no Chromium or Chrome here'),
]


def test_its_panels_fit_a_phone_and_a_sheet_of_paper(bag: Path, tmp_path: Path) -> None:
    analyze([str(bag), '--out', str(tmp_path)])
    widest = 'Math.max(...[...document.querySelectorAll(".panels > div")].map(p => %s))'
    right = widest % 'p.getBoundingClientRect().right'
    page = browser.Browser(tmp_path / 'profile')
    try:
        page.open((tmp_path / 'report.html').as_uri())
        page.wait('document.querySelector(".panels > div")?.innerHTML')
        page.evaluate('dispatchEvent(new Event("beforeprint"))')
        assert 600.0 < page.evaluate(right) < 720.0  # A4 less the margins of a browser
        page.evaluate('dispatchEvent(new Event("afterprint"))')
        assert page.evaluate(right) > 720.0
        page.resize(390, 800)
        page.wait('document.documentElement.scrollWidth <= 390')
        assert page.evaluate(right) <= 390.0
    finally:
        page.close()


def test_the_replay_is_dark_in_a_dark_browser_and_fits_a_phone(bag: Path, tmp_path: Path) -> None:
    pytest.importorskip('viser', reason='viser comes with the test tools')
    assert make_replay([str(bag), '--out', str(tmp_path)]) == 0
    page = browser.Browser(tmp_path / 'profile')
    shown = 'document.querySelector("canvas") && document.documentElement.dataset'
    try:
        page.open((tmp_path / 'replay.html').as_uri())
        page.wait(f'{shown}.mantineColorScheme == "light"')
        assert page.evaluate('location.search') == ''
        page.darken()
        page.resize(390, 844)
        page.open((tmp_path / 'replay.html').as_uri())
        page.wait(f'{shown}.mantineColorScheme == "dark"')
        assert 'initialCameraPosition=' in page.evaluate('location.search')
    finally:
        page.close()
