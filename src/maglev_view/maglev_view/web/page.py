"""The page: the stage in 3D, plots, status and buttons, on viser."""

from __future__ import annotations

import queue
from collections.abc import Callable, Mapping
from html import escape
from typing import Any

import numpy as np

from maglev_model.axes import AXES, FloatArray
from maglev_view.colours import AXIS_COLOURS
from maglev_view.parameters import WebParameters
from maglev_view.web.guard import trusted
from maglev_view.web.live import Live
from maglev_view.web.panel import motors_html, status_html
from maglev_view.web.scene import StageScene
from maglev_view.web.server import FITTING, address, serve, stop

BUTTONS = {
    'Lift off': None,
    'Land': None,
    'Emergency stop': 'red',
    'Reset': None,
    'Enable': None,
    'Step': None,
}
"""What an operator may ask for, with the colours of the buttons."""

HARMLESS = ('Land', 'Emergency stop')
"""What is obeyed whoever asks: a stop must not depend on the name that a page was loaded by."""

_STRANGE = 'refused: this page was loaded by a name that is not one of this machine or its address'

_FITTING = f'<img hidden src="data:," onerror="{escape(FITTING)}">'
"""A script that comes into a page later does not run; what a broken image leads to does."""

_PLOTS = {'errors in y, x, z [µm]': (0, 1, 2), 'errors in phi, theta [µrad]': (3, 4)}
_STEP = 1.0  # largest, in the unit of the field [mm, mrad]
_SLOW = 5  # the plots are drawn at every so many updates


def plotted(time: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, ...]:
    """What a plot is given: the time, then least and greatest values of each column in turn.

    ``low`` and ``high`` have shape (n, columns). What is not known yet is left out, since uPlot
    finds no scale for a curve that begins with NaN.
    """
    known = np.flatnonzero(~np.isnan(low).any(axis=1))
    begun = slice(int(known[0]) if len(known) else 0, None)
    return time[begun], *(each[begun, c] for c in range(low.shape[1]) for each in (low, high))


class Page:
    """Serves the page and shows a run on it.

    What is clicked is put into :attr:`wishes` with the values to it, by another thread.
    """

    def __init__(self, parameters: WebParameters, title: str) -> None:
        self._parameters = parameters
        self.wishes: queue.SimpleQueue[tuple[str, Mapping[str, object]]] = queue.SimpleQueue()
        self._server = serve(parameters.host, parameters.port, title)
        self._updates = 0
        gui = self._server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width='large')
        self._scene = StageScene(self._server.scene, parameters.machine)
        self._status = gui.add_html(status_html(Live(parameters)))
        with gui.add_folder('Operate'):
            for label, colour in BUTTONS.items():
                if label == 'Step':
                    self._axis = gui.add_dropdown('axis', AXES, initial_value='x')
                    self._distance = gui.add_number(
                        'by [mm, mrad]', 0.1, min=-_STEP, max=_STEP, step=0.01
                    )
                gui.add_button(label, color=colour).on_click(self._asks_for(label))
            self._answer = gui.add_html('')
        self._tilt = gui.add_slider('tilt ×', min=1, max=50, step=1, initial_value=10)
        with gui.add_folder('Motors'):
            self._motors = gui.add_html('')
        self._plots = {columns: self._add_plot(name, columns) for name, columns in _PLOTS.items()}
        gui.add_html(_FITTING)

    @property
    def address(self) -> str:
        """Where the page is."""
        return address(self._server)

    def close(self) -> None:
        """Serve it no more."""
        stop(self._server)

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
        self._answer.content = f'<div style="font-size:90%">{escape(text)}</div>'

    def _show_slowly(self, live: Live) -> None:
        peak = self._parameters.peak_current
        self._scene.colour(np.zeros(4) if live.currents is None else live.currents / peak)
        self._scene.draw(live.flown.points, live.planned.points)
        self._status.content = status_html(live)
        self._motors.content = motors_html(live, peak)
        sequence, low, high = live.errors.curves()
        time = np.asarray(sequence * self._parameters.sample_time, np.float64)
        for columns, plot in self._plots.items():
            plot.data = plotted(time, 1e6 * low[:, columns], 1e6 * high[:, columns])

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
            if wish not in HARMLESS and not self._knows(event.client_id):
                self.answer(_STRANGE)
                return
            values = self._values(wish)
            if abs(values.get('distance', 0.0)) <= 1e-3 * _STEP:
                self.wishes.put((wish, values))
            else:  # a browser keeps to the bounds of a field, another client need not
                by = f'{1e3 * values["distance"]:g} mm or mrad'
                self.answer(f'refused: a step by {by}, at most {_STEP:g} is allowed')

        return clicked

    def _values(self, wish: str) -> Mapping[str, Any]:
        """What the fields beside a button say."""
        if wish != 'Step':
            return {}
        return {'axis': self._axis.value, 'distance': 1e-3 * float(self._distance.value)}

    def _knows(self, client: int | None) -> bool:
        """Whether a click came from our own page."""
        connection = self._server._websock_server._live_connections.get(client)
        return connection is not None and trusted(connection.request.headers)
