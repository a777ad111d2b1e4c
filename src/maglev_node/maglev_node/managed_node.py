"""A node with a life cycle (REP-2002's managed node) that can also bring itself up."""

from __future__ import annotations

import dataclasses
import gc
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, ClassVar, TypeVar

from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn

from maglev_model.contract.stage import StageError
from maglev_model.parameters import ParameterError, parameter
from maglev_node.node import MaglevNode, NodeError, SourceParameters


@dataclasses.dataclass(frozen=True, kw_only=True)
class ManagedParameters(SourceParameters):
    """What every managed node takes."""

    autostart: bool = parameter(
        True, 'configure and activate by itself; false: by the life-cycle services', read_only=True
    )


P = TypeVar('P', bound=ManagedParameters)

_ANSWER_TIME = 0.1  # in which whoever asked for the end gets the answer [s]

_REFUSALS = (NodeError, StageError, ParameterError)


class ManagedNode(LifecycleNodeMixin, MaglevNode[P]):
    """A node that is configured, activated, deactivated and cleaned up, by services or by itself.

    A subclass does the work in :meth:`configure`, :meth:`activate`, :meth:`deactivate` and
    :meth:`cleanup`; NodeError, StageError or ParameterError raised there refuses the transition.
    """

    by_hand: ClassVar[Sequence[str]] = ('lifecycle set {} configure', 'lifecycle set {} activate')
    """The commands of ``ros2``, with its name left out, that bring it up where it does not."""

    def __init__(self, name: str, parameter_table: type[P]) -> None:
        MaglevNode.__init__(self, name, parameter_table)
        LifecycleNodeMixin.__init__(self)
        self._change_state = self._service_change_state.callback
        self._service_change_state.callback = self._on_change_state
        self._bringing_up = False
        self._refusal: Exception | None = None

    def configure(self) -> None:
        """Get hold of everything that is needed."""

    def activate(self) -> None:
        """Begin to work."""

    def deactivate(self) -> None:
        """End working, in a state that is safe."""

    def cleanup(self) -> None:
        """Release everything."""

    def destroy_node(self) -> None:
        """Leave the graph; rclpy's mixin leaves the state machine, which keeps the node alive."""
        self._state_machine.destroy_when_not_in_use()
        super().destroy_node()

    @property
    def state(self) -> str:
        """The life-cycle state: unconfigured, inactive, active or finalized."""
        return str(self._state_machine.current_state[1])

    def spin(self, stop: Callable[[], bool]) -> None:
        """Bring itself up, or say who must, then serve the graph."""
        if self.parameters.autostart:
            self._bringing_up = True
            if self.trigger_configure() != TransitionCallbackReturn.SUCCESS:
                assert self._refusal is not None
                raise self._refusal
            gc.collect()
            gc.freeze()
            self._start = self.create_timer(1e-3, self._autostart, clock=self.steady_clock)
        else:
            name = self.get_fully_qualified_name()
            commands = ', '.join(f'ros2 {command.format(name)}' for command in self.by_hand)
            self.get_logger().warning(f'unconfigured, autostart is false: waiting for {commands}')
        super().spin(stop)

    def _autostart(self) -> None:
        """Activate when the graph is served, so that nothing comes between that and work."""
        self._start.cancel()
        # A service may have been faster, or the executor had the timer's next event already.
        due = self._bringing_up and self.state == 'inactive'
        if due and self.trigger_activate() != TransitionCallbackReturn.SUCCESS:
            self.fail(str(self._refusal))
        self._bringing_up = False

    def _on_change_state(self, request: Any, response: Any) -> Any:
        """As rclpy, which ends a node that is asked for what does not begin in its state."""
        wanted = request.transition.label or request.transition.id
        known = {number: label for number, label, *_ in self._state_machine.available_transitions}
        if wanted in known or wanted in known.values():
            return self._change_state(request, response)
        self.get_logger().error(
            f"transition '{wanted}' refused: {self.state}, from where there are "
            + ', '.join(f'{label} ({number})' for number, label in known.items())
        )
        response.success = False
        return response

    def _transit(
        self, name: str, state: str, *actions: Callable[[], None]
    ) -> TransitionCallbackReturn:
        try:
            for action in actions:
                action()
        except _REFUSALS as error:
            user_error = not isinstance(error, StageError)
            self._refusal = error if user_error else NodeError(str(error))
            if not self._bringing_up:
                self.get_logger().error(f'{name} refused: {error}')
            return TransitionCallbackReturn.FAILURE
        except Exception as error:
            self._refusal = error
            self.get_logger().fatal(f'{name} failed: {error!r}')
            return TransitionCallbackReturn.ERROR
        self.get_logger().info(f'{name}: {state}')
        return TransitionCallbackReturn.SUCCESS

    def on_configure(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """From unconfigured to inactive."""
        return self._transit('configure', 'inactive', self.configure)

    def on_activate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """From inactive to active."""
        return self._transit('activate', 'active', self.activate)

    def on_deactivate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """From active to inactive."""
        return self._transit('deactivate', 'inactive', self.deactivate)

    def on_cleanup(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """From inactive to unconfigured."""
        return self._transit('cleanup', 'unconfigured', self.cleanup)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """From any state to the end of the process, once that is answered."""
        actions = {'active': (self.deactivate, self.cleanup), 'inactive': (self.cleanup,)}
        result = self._transit('shutdown', 'finalized', *actions.get(state.label, ()))
        end = partial(self.finish, 0 if result == TransitionCallbackReturn.SUCCESS else 1)
        self.create_timer(_ANSWER_TIME, end, clock=self.steady_clock)
        return result

    def on_error(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """After a defect: release everything and be unconfigured."""
        return self._transit('clean-up after an error', 'unconfigured', self.cleanup)
