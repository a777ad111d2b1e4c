"""The page: the stage in 3D, plots, status and buttons, on viser."""

from __future__ import annotations

import contextlib
import io
import queue
from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from maglev_model.axes import AXES
from maglev_view.colours import AXIS_COLOURS
from maglev_view.parameters import WebParameters
from maglev_view.web.guard import trusted
from maglev_view.web.live import Live
from maglev_view.web.panel import motors_html, status_html
from maglev_view.web.scene import StageScene

BUTTONS = {
    'Lift off': None,
    'Land': None,
    'Emergency stop': 'red',
    'Reset': None,
    'Enable': None,
}
"""What an operator may ask for, with the colours of the buttons."""

HARMLESS = ('Land', 'Emergency stop')
"""What is obeyed whoever asks: a stop must not depend on the name that a page was loaded by."""

_STRANGE = 'refused: this page was loaded by a name that is not one of this machine or its address'

_PLOTS = {'errors in y, x, z [µm]': (0, 1, 2), 'errors in phi, theta [µrad]': (3, 4)}
_SLOW = 5  # the plots are drawn at every so many updates


class Page:
    """Serves the page and shows a run on it.

    What is clicked is put into :attr:`wishes`, by another thread.
    """

    def __init__(self, parameters: WebParameters, title: str) -> None:
        self._parameters = parameters
        self.wishes: queue.SimpleQueue[str] = queue.SimpleQueue()
        with contextlib.redirect_stdout(io.StringIO()):  # its banner
            self._server: Any = viser.ViserServer(
                host=parameters.host, port=parameters.port, label=title, verbose=False
            )
        self._updates = 0
        gui = self._server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width='large')
        self._scene = StageScene(self._server.scene, parameters.machine)
        camera = self._server.initial_camera
        camera.position, camera.look_at = (1.0, -1.2, 0.45), (0.2, 0.0, 0.12)
        self._status = gui.add_html(status_html(Live(parameters)))
        with gui.add_folder('Operate'):
            for label, colour in BUTTONS.items():
                gui.add_button(label, color=colour).on_click(self._asks_for(label))
            self._answer = gui.add_html('')
        self._tilt = gui.add_slider('tilt ×', min=1, max=50, step=1, initial_value=10)
        with gui.add_folder('Motors'):
            self._motors = gui.add_html('')
        self._plots = {columns: self._add_plot(name, columns) for name, columns in _PLOTS.items()}

    @property
    def address(self) -> str:
        """Where the page is."""
        return f'http://{self._server.get_host()}:{self._server.get_port()}'

    def show(self, live: Live) -> None:
        """Show a run as it is: the stage each time, all else now and then."""
        slowly = self._updates % _SLOW == 0
        self._updates += 1
        with self._server.atomic():
            self._scene.place(live.outputs, live.reference, float(self._tilt.value))
            if slowly:
                self._show_slowly(live)

    def answer(self, text: str) -> None:
        """Say what came of a wish."""
        from html import escape

        self._answer.content = f'<div style="font-size:90%">{escape(text)}</div>'

    def _show_slowly(self, live: Live) -> None:
        peak = self._parameters.peak_current
        self._scene.colour(live.currents / peak)
        self._scene.draw(live.flown.points, live.planned.points)
        self._status.content = status_html(live)
        self._motors.content = motors_html(live, peak)
        sequence, low, high = live.errors.curves()
        time = sequence * self._parameters.sample_time
        for columns, plot in self._plots.items():
            curves = (1e6 * each[:, c] for c in columns for each in (low, high))
            plot.data = (time, *curves)

    def _add_plot(self, name: str, columns: tuple[int, ...]) -> Any:
        nothing = np.array([0.0, 1.0])
        series: list[dict[str, Any]] = [{'label': 't [s]'}]
        bands = []
        for column in columns:
            colour = AXIS_COLOURS[column]
            first = len(series)
            series += [{'label': AXES[column], 'stroke': colour, 'width': 1}]
            series += [{'label': f'{AXES[column]} high', 'stroke': colour, 'width': 1}]
            bands.append({'series': (first + 1, first), 'fill': f'{colour}40'})
        data = (nothing, *(np.full(2, np.nan) for _ in series[1:]))
        return self._server.gui.add_uplot(
            data,
            tuple(series),
            title=name,
            bands=tuple(bands),
            scales={'x': {'time': False, 'auto': True}, 'y': {'auto': True}},
            legend={'show': False},
            aspect=2.0,
        )

    def _asks_for(self, wish: str) -> Callable[[Any], None]:
        def clicked(event: Any) -> None:
            if wish in HARMLESS or self._knows(event.client_id):
                self.wishes.put(wish)
            else:
                self.answer(_STRANGE)

        return clicked

    def _knows(self, client: int | None) -> bool:
        """Whether a click came from our own page."""
        connection = self._server._websock_server._live_connections.get(client)
        return connection is not None and trusted(connection.request.headers)
