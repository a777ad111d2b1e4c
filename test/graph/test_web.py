"""The live view beside a flight: the page moves, its buttons act, and nobody needs it."""

from __future__ import annotations

import contextlib
import math
import signal
from pathlib import Path

import browser
import pytest
from flight import LONG, airborne, fly, landed_without_current, samples
from graph import Nodes, Observer, Process
from page_client import PageClient, heights

from maglev_msgs.msg import ControllerState
from maglev_node.topics import CONTROLLER_STATE
from maglev_view.parameters import WebParameters
from maglev_view.web.page import Page

AT_REST = -0.031

needs_browser = pytest.mark.skipif(
    not browser.found(), reason='there is no Chromium or Chrome here'
)


@pytest.fixture
def flying(nodes: Nodes, watching: Observer) -> Process:
    """The live view of a flight in the air."""
    web = nodes.start('web', 'port:=0', 'window:=2.0')
    fly(nodes, LONG)
    web.wait_for('live view: ')
    watching.wait(lambda: airborne(watching))
    return web


def address(web: Process) -> str:
    return web.output.rpartition('live view: ')[2].split()[0]


def mode(observer: Observer) -> int:
    return int(observer.newest(CONTROLLER_STATE).mode)


def test_an_address_of_another_machine_is_refused(nodes: Nodes) -> None:
    web = nodes.start('web', 'host:=192.0.2.1')  # of documents only (RFC 5737)
    assert web.wait() == 1
    assert "web: error: cannot serve the page at '192.0.2.1'" in web.output


def test_the_page_shows_the_flight_and_its_buttons_act(flying: Process, watching: Observer) -> None:
    with PageClient(address(flying), origin=address(flying)) as page:
        page.wait(lambda: len(set(heights(page.messages))) > 5)
        assert all(AT_REST - 1e-4 < z < -0.018 for z in heights(page.messages))
        page.wait(lambda: 'controller regulating' in page.text() and 'motor 4' in page.text())

        page.press('Emergency stop')
        page.wait(lambda: mode(watching) == ControllerState.FAULT)
        page.wait(lambda: landed_without_current(watching))
        page.wait(lambda: '<b>controller</b>: FAULT' in page.text())
        with PageClient(address(flying), origin='https://elsewhere.example') as stranger:
            stranger.wait(lambda: stranger.buttons())
            stranger.press('Reset')
            stranger.wait(lambda: 'refused: this page' in stranger.text())
            assert mode(watching) == ControllerState.FAULT
        page.press('Reset')
        page.wait(lambda: mode(watching) == ControllerState.DISABLED)
        page.press('Enable')
        page.wait(lambda: mode(watching) == ControllerState.WAITING)
        page.press('Step')
        refusal = '/reference/step: step refused: the reference does not hover'
        page.wait(lambda: refusal in page.text())
        page.press('Lift off')
        page.wait(lambda: airborne(watching))
    flying.signal(signal.SIGKILL)
    assert flying.wait() == 137
    samples(watching, 500)
    assert mode(watching) == ControllerState.REGULATING


def test_an_emergency_stop_before_the_view_knows_any_node_lands_the_platen(
    nodes: Nodes, watching: Observer
) -> None:
    fly(nodes, LONG)
    watching.wait(lambda: airborne(watching))
    web = nodes.start('web', 'port:=0')
    web.wait_for('live view: ')
    with PageClient(address(web), origin=address(web)) as page:
        page.wait(lambda: 'Emergency stop' in page.buttons())
        page.press('Emergency stop')
        page.wait(lambda: '/controller/emergency_stop: ' in page.text())
        page.wait(lambda: landed_without_current(watching))
        page.wait(lambda: mode(watching) == ControllerState.FAULT)


def test_the_fields_of_the_page_go_with_its_step() -> None:
    page = Page(WebParameters(port=0), 'test')
    with contextlib.closing(page), PageClient(page.address, origin=page.address) as client:
        client.wait(lambda: 'Step' in client.buttons())
        client.press('Step')
        assert page.wishes.get(timeout=10.0) == ('Step', {'axis': 'x', 'distance': 1e-4})
        client.press('Land')
        assert page.wishes.get(timeout=10.0) == ('Land', {})


@pytest.mark.parametrize('distance', [1.001, -1000.0, math.inf, math.nan])
def test_a_step_beyond_the_field_s_bounds_is_refused_whoever_sends_it(distance: float) -> None:
    page = Page(WebParameters(port=0), 'test')
    with contextlib.closing(page), PageClient(page.address) as client:
        client.wait(lambda: 'Step' in client.buttons())
        client.enter('by [mm, mrad]', distance)
        client.press('Step')
        client.wait(lambda: f'a step by {distance:g} mm or mrad' in client.text())
        assert page.wishes.empty()
        client.enter('by [mm, mrad]', -1.0)
        client.press('Step')
        assert page.wishes.get(timeout=10.0) == ('Step', {'axis': 'x', 'distance': -1e-3})


def test_no_client_opens_a_tunnel_to_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    tunnels: list[tuple[object, ...]] = []

    def tunnel(*address: object) -> None:
        tunnels.append(address)
        raise ConnectionError

    monkeypatch.setattr('viser._viser.ViserTunnel', tunnel)
    page = Page(WebParameters(port=0), 'test')
    with contextlib.closing(page), PageClient(page.address, origin=page.address) as client:
        client.wait(lambda: 'Land' in client.buttons())
        client.send({'type': 'ShareUrlRequest'})
        client.press('Land')  # is taken after it
        assert page.wishes.get(timeout=10.0) == ('Land', {})
    assert tunnels == []


@pytest.mark.long
@needs_browser
def test_the_page_is_dark_in_a_dark_browser_and_fits_a_phone(tmp_path: Path) -> None:
    served = Page(WebParameters(port=0), 'test')
    page = browser.Browser(tmp_path / 'profile')
    try:
        page.darken()
        page.resize(390, 844)
        page.open(served.address)
        page.wait('document.documentElement.dataset.mantineColorScheme == "dark"')
        page.wait('[...document.querySelectorAll("button")].some(b => b.innerText == "Land")')
        assert 'initialCameraPosition=' in page.evaluate('location.search')
    finally:
        page.close()
        served.close()


@pytest.mark.long
@needs_browser
def test_in_a_browser_the_scene_moves_and_the_emergency_stop_stops(
    flying: Process, watching: Observer, tmp_path: Path
) -> None:
    page = browser.Browser(tmp_path / 'profile')
    try:
        page.open(address(flying))
        button = '[...document.querySelectorAll("button")].find(b => b.innerText == "%s")'
        page.wait(button % 'Emergency stop')
        page.wait('document.body.innerText.includes("controller regulating")')
        page.wait('document.querySelector("canvas")')
        first = page.picture(450, 400)  # beside the panel
        watching.wait(lambda: page.picture(450, 400) != first)
        page.evaluate(f'({button % "Emergency stop"}).click()')
        watching.wait(lambda: mode(watching) == ControllerState.FAULT)
        page.wait('document.body.innerText.includes("controller: FAULT")')
        outside = [
            url
            for url in page.requested
            if not url.startswith((address(flying), address(flying).replace('http', 'ws')))
            and not url.startswith(('data:', 'blob:', 'about:'))
        ]
        assert outside == []
    finally:
        page.close()
