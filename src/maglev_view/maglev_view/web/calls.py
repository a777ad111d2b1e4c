"""The services behind the page's buttons, of the nodes that are stage, controller, reference."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from std_srvs.srv import SetBool, Trigger

from maglev_msgs.srv import Step
from maglev_node.node import MaglevNode
from maglev_node.topics import CURRENTS, MEASUREMENT, REFERENCE


class Call(NamedTuple):
    """A service of the node that publishes a topic.

    It is sought for some time [s], since a view that has just come up does not know everybody yet;
    short, or a lift-off would come when nobody thinks of it any more. Then its answer is waited for
    with some patience [s].
    """

    topic: str
    service: str
    sought: float = 1.0
    patience: float = 10.0

    @property
    def kind(self) -> Any:
        """The type of the service."""
        return {'enable': SetBool, 'step': Step}.get(self.service, Trigger)


class Wish(NamedTuple):
    """What to call in turn: all of it, or only until one call succeeds; and with which values."""

    calls: tuple[Call, ...]
    one_is_enough: bool = False
    values: Mapping[str, object] = {}


WISHES = {
    'Lift off': Wish((Call(REFERENCE, 'lift_off'),)),
    'Land': Wish((Call(REFERENCE, 'land'),)),
    # The controller lands the platen; the stage, which may only cut the currents, comes second.
    'Emergency stop': Wish(
        (
            Call(CURRENTS, 'emergency_stop', sought=0.5, patience=0.5),
            Call(MEASUREMENT, 'emergency_stop', sought=10.0),
        ),
        one_is_enough=True,
    ),
    'Reset': Wish((Call(MEASUREMENT, 'reset'), Call(CURRENTS, 'reset'))),
    'Enable': Wish((Call(CURRENTS, 'enable'),), values={'data': True}),
    'Step': Wish((Call(REFERENCE, 'step'),)),
}
"""By the buttons' labels."""


_DISCOVERY = 5.0
"""In which who has just joined a graph has found everybody, also on a busy machine [s]."""


class Operator:
    """Calls services for whoever clicks; :meth:`look` and :meth:`go_on` are to be called often.

    Who is not found is sought for longer while it has just come up itself: the stage's stop is
    second best, and its turn would come too soon.

    :param tell: takes what came of it, as a text.
    """

    def __init__(self, node: MaglevNode[Any], tell: Callable[[str], None]) -> None:
        self._node, self._tell = node, tell
        self._clients: dict[Call, Any] = {}
        self._errands: list[_Errand] = []
        self._acquainted = time.monotonic() + _DISCOVERY

    def look(self) -> None:
        """Find the nodes, so that their services know us before they are called."""
        for call in {call for wish in WISHES.values() for call in wish.calls}:
            publishers = self._node.get_publishers_info_by_topic(call.topic)
            if not publishers:
                continue
            who = f'{publishers[0].node_namespace.rstrip("/")}/{publishers[0].node_name}'
            name, client = f'{who}/{call.service}', self._clients.get(call)
            if client is None or client.srv_name != name:
                self._clients[call] = self._node.create_client(call.kind, name)

    def ask(self, wish: str, values: Mapping[str, object]) -> None:
        """Begin with what is wished, with these values of its calls and the wish's own."""
        self._tell(f'{wish} …')
        known = WISHES[wish]
        wanted = known._replace(values={**known.values, **values})
        self._errands.append(_Errand(wanted, self._clients, self._acquainted))

    def go_on(self) -> None:
        """Take the answers that have come and make the next calls."""
        if any(errand.seeks for errand in self._errands):
            self.look()
        for errand in self._errands:
            errand.go_on()
            if errand.over:
                self._tell('; '.join(errand.said))
        self._errands = [errand for errand in self._errands if not errand.over]


class _Errand:
    """A wish on its way."""

    def __init__(self, wish: Wish, clients: Mapping[Call, Any], acquainted: float) -> None:
        self._wish, self._left, self._clients = wish, list(wish.calls), clients
        self._acquainted = acquainted
        self._client: Any = None
        self._future: Any = None
        self._deadline = 0.0
        self.said: list[str] = []
        self.over = False
        self._next()

    @property
    def seeks(self) -> bool:
        """Whether the service to be called is not there yet."""
        return not self.over and self._future is None

    def go_on(self) -> None:
        if self.seeks:
            self._seek()
        elif not self.over:
            self._await()

    def _next(self) -> None:
        """Turn to the next call, if there is one left."""
        self._future = None
        if not self._left:
            self.over = True
            return
        self._call = self._left.pop(0)
        self._deadline = max(time.monotonic() + self._call.sought, self._acquainted)
        self._seek()

    def _seek(self) -> None:
        call, client = self._call, self._clients.get(self._call)
        if client is not None and client.service_is_ready():
            request = call.kind.Request()
            for name, value in self._wish.values.items():
                setattr(request, name, value)
            self._deadline = time.monotonic() + call.patience
            self._client, self._future = client, client.call_async(request)
        elif time.monotonic() > self._deadline:
            self._end(f'nobody offers {call.service} beside {call.topic}', success=False)

    def _await(self) -> None:
        name = self._client.srv_name
        if self._future.done():
            answer = self._future.result()
            words = answer.message or ('done' if answer.success else 'refused')
            self._end(f'{name}: {words}', success=bool(answer.success))
        elif time.monotonic() > self._deadline:
            self._end(f'{name} does not answer', success=False)

    def _end(self, text: str, *, success: bool) -> None:
        self.said.append(text)
        if success and self._wish.one_is_enough:
            self._left.clear()
        self._next()
