"""One stage on the graph: its samples go out, the currents that answer them come in."""

from __future__ import annotations

import time
from itertools import count
from typing import Any, Generic, TypeVar

from maglev_model.contract.controller_watch import NOBODY, ControllerWatch, Verdict
from maglev_model.contract.stage import EncoderSample, Fault, Stage, StageError
from maglev_node.flow_control import FlowControl
from maglev_node.managed_node import ManagedNode
from maglev_node.pacing import Deadlines, Pace, StageClock
from maglev_node.sample_publisher import SamplePublisher
from maglev_node.samples import SampleQueue, hear
from maglev_node.stage_parameters import ClockedStageParameters, StageNodeParameters
from maglev_node.topics import CURRENTS

_REPEAT_PERIOD = 0.02
"""How often lockstep looks whether an answer is overdue or a watcher has caught up [s].

And repeats the first sample."""

_REMEDY = 'see to the controller, and that it is the only one'

P = TypeVar('P', bound=StageNodeParameters)
S = TypeVar('S', bound=Stage)


class Sampling(Generic[P, S]):
    """Takes a stage's samples from :meth:`start` to :meth:`stop`; again after another start.

    Lockstep: the first sample is repeated until a controller answers it, and at rest the one that
    waits when controllers came or went; else each waits for the currents with its sequence number,
    and for those who watch, not to lose any (:class:`~maglev_node.flow_control.FlowControl`).
    Real time: a sample every sample time, with the newest currents, hence one sample of delay.
    Whose currents are followed, and from when on, is for the
    :class:`~maglev_model.contract.controller_watch.ControllerWatch` to say; what it refuses in
    flight is a fault of the stage.
    """

    def __init__(self, node: ManagedNode[P], stage: S) -> None:
        self.stage = stage
        self.sequence = node.parameters.first_sequence - 1
        self.late_samples = 0
        self.answered = False  # by a controller, since the start
        self.controller = ControllerWatch()
        self._node = node
        self._lost = False  # the stage cannot go on
        self._reported: Fault | None = None
        self._sample: EncoderSample | None = None
        self._sample_time = 0.0  # when it was taken
        self._timer: Any = None
        self._newest = -1  # sequence of the newest currents that came
        self._publisher = SamplePublisher(node, stage.sample_time, truth=stage.truth() is not None)
        self._answers: Any = None
        self._controllers = 0  # how many there were when one answered first
        self._held_at = -1  # sample that is answered and waits for those who watch
        self._pace: Pace = StageClock(stage.sample_time)
        if not stage.paced:
            self._pace = Deadlines(stage.sample_time)
        if node.parameters.mode == 'lockstep':
            self._answers = hear(node, CURRENTS, self._on_answer)
            self._flow_control = FlowControl(node, node.parameters.watchers)
        else:
            self._currents = SampleQueue(node, CURRENTS)

    def start(self) -> None:
        """Activate the stage and take the first sample. Raises StageError."""
        self.stage.activate()
        self.answered = self._lost = False
        self.controller.forget()
        self._newest = -1
        try:
            self._sample = self.stage.read()
        except StageError:
            self.stage.deactivate()
            raise
        self.sequence += 1
        self._sample_time = time.monotonic()
        self._publisher.start()
        self._pace.start(self.sequence)
        period, action = self._pace.period, self._on_tick
        if self._answers is not None:
            period, action = _REPEAT_PERIOD, self._watch_answers
        self._timer = self._node.create_timer(period, action, clock=self._node.steady_clock)

    def stop(self) -> None:
        """Land, then take no more samples. Raises StageError."""
        self._stop_timer()
        self.land('deactivated')
        self.stage.deactivate()

    def release(self) -> None:
        """Give up the stage, with no current flowing."""
        self._stop_timer()
        self.stage.close()

    def close(self) -> None:
        """Release the stage and leave the graph."""
        self.release()
        self._publisher.destroy()
        if self._answers is not None:
            self._node.destroy_subscription(self._answers)
            self._flow_control.destroy()
        else:
            self._currents.raw.destroy()

    def land(self, why: str) -> None:
        """Land, publishing every sample, and be done with it."""
        self.stage.land(why)
        self._go_on_alone()

    def awaited(self) -> str:
        """Who is waited for before the first sample is answered."""
        if missing := self._publisher.watchers.missing():
            return ', '.join(missing)
        there = self._answers is not None and self._answers.get_publisher_count()
        return 'the controller, or the reference it waits for' if there else 'a controller'

    def emergency_stop(self) -> str:
        """Latch a fault; returns what comes of it."""
        self.stage.stop()
        self._report()
        return str(self.stage.fault)

    def reset(self) -> tuple[bool, str]:
        """Clear the stage's fault; a stage that was lost samples again."""
        success, message = self.stage.reset()
        self._report()
        if success:
            self.controller.forget()
            lost, self._lost = self._lost, False
            if lost and self._timer is not None:
                self.answered = False
                self._timer.reset()
                self._advance()
        return success, message

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
            self._timer = None

    @property
    def _ticks(self) -> bool:
        """Whether a tick is due: the executor may have had one of a timer that is gone since."""
        return self._timer is not None and not self._lost

    # -- lockstep ----------------------------------------------------------------------------------

    def _on_answer(self, message: Any) -> None:
        if self._timer is None or not (self.answered or self._publisher.watchers.there()):
            return
        verdict = self._judge(message)
        expected = message.sequence == self.sequence != self._held_at
        if expected and verdict is not Verdict.ELSEWHERE:
            if not self.answered:
                self.answered, self._controllers = True, self._answers.get_publisher_count()
            if verdict is Verdict.FOLLOWED:
                self._write(message)
            else:
                self._hold()
            self._held_at = self.sequence
            self._advance_within_window()
        if verdict is Verdict.REFUSED and self.controller.gave_up:  # it may not answer any more
            self._go_on_alone()
            self.answered = not self.stage.restartable

    def _advance_within_window(self) -> None:
        if not self._flow_control.holds(self.sequence):
            self._advance()

    def _watch_answers(self) -> None:
        if not self._ticks:
            return
        if self._held_at == self.sequence:
            self._advance_within_window()
            return
        waited = time.monotonic() - self._sample_time
        if not self.stage.flying and self._controllers != self._answers.get_publisher_count():
            self.answered = False
        if not self.answered:
            self._publisher.watchers.there()  # they match while nobody answers yet
            self._publish()
        elif waited > self._node.parameters.answer_timeout:
            who = (
                'the controller, or the reference it waits for, has stopped'
                if self._answers.get_publisher_count()
                else f'no controller publishes {self._answers.topic_name} any more'
            )
            self._unanswered(f'no currents for sample {self.sequence} within {waited:.1f} s: {who}')

    def _unanswered(self, message: str) -> None:
        """Land without the controller; wait for one again, or end the node."""
        if self.stage.restartable:
            self._node.get_logger().error(message)
            self._go_on_alone()
            self.answered = False
        else:
            self._go_on_alone()
            self._node.fail(message)

    # -- real time ---------------------------------------------------------------------------------

    def _on_tick(self) -> None:
        if not self._ticks or self._overrun():
            return
        pace, stage = self._pace, self.stage
        for taken in count(1):
            self._take_sample()
            if self._lost or not pace.again(self.sequence, taken, stage.late):
                break
        wait = pace.wait(stage.late + time.monotonic() - self._sample_time)
        if wait is not None and self._ticks:
            self._timer.timer_period_ns = int(1e9 * wait)
            self._timer.reset()

    def _overrun(self) -> bool:
        behind, parameters = self._pace.behind(self.sequence), self._node.parameters
        if not isinstance(parameters, ClockedStageParameters) or behind <= parameters.overrun_limit:
            return False
        self._node.fail(
            f'{behind:.2f} s behind the clock at sample {self.sequence}: this machine is too'
            ' slow or too busy for real time; free a core, or use mode lockstep'
        )
        return True

    def _take_sample(self) -> None:
        """One sample, and the newest currents that have arrived by then."""
        self._advance()
        fresh = self._take_currents()
        if self.answered and self._newest < self.sequence - 1:
            self.late_samples += 1
        if fresh is None:
            self._hold()
        else:
            self._write(fresh)

    def _take_currents(self) -> Any:
        """The newest that are followed, if any; called at the tick, so that none come too late."""
        fresh = None
        for message in self._currents.take():
            verdict = self._judge(message)
            if verdict is Verdict.ELSEWHERE:
                continue
            self._newest = message.sequence
            # A controller that catches up with what it missed at its start is not late.
            self.answered |= message.sequence >= self.sequence - 2
            if verdict is Verdict.FOLLOWED:
                fresh = message
        return fresh

    # -- both --------------------------------------------------------------------------------------

    def _advance(self) -> None:
        """Take the next sample and publish it."""
        if self._lost:
            return
        try:
            self._sample = self.stage.read()
        except StageError as error:
            self._lose(error)
        else:
            self.sequence += 1
            self._sample_time = time.monotonic()
            self._publish()

    def _publish(self) -> None:
        if self._sample is not None:
            controller = self.controller.session if self.stage.flying else NOBODY
            truth = self.stage.truth()
            self._publisher.publish(
                self.sequence, self._sample, self.late_samples, controller, truth
            )

    def _judge(self, message: Any) -> Verdict:
        """What becomes of a command; one that is refused is a fault."""
        sequence, controller = message.sequence, self.controller
        verdict = controller.judge(
            message.session,
            sequence,
            message.status,
            message.direct_current,
            message.quadrature_current,
            stamped=message.stamp == self._publisher.stage_time(sequence),
            sample=self.sequence,
            flying=self.stage.flying,
        )
        if verdict is Verdict.REFUSED and self.stage.fault is None:
            self.stage.stop(controller.why, kind='controller', remedy=_REMEDY)
        if verdict is Verdict.ELSEWHERE:
            self._node.get_logger().warning(controller.why, once=True)
        return verdict

    def _write(self, message: Any) -> None:
        """Let the stage follow fresh currents."""
        if self._lost:
            return
        age = self.sequence - message.sequence
        try:
            self.stage.write(message.direct_current, message.quadrature_current, age)
        except StageError as error:
            self._lose(error)
        except ValueError as error:
            if self.stage.fault is None:
                self.stage.stop(str(error), kind='controller', remedy=_REMEDY)
        self._report()

    def _hold(self) -> None:
        """No currents to follow for this sample."""
        if not self._lost:
            try:
                self.stage.hold()
            except StageError as error:
                self._lose(error)
            self._report()

    def _go_on_alone(self) -> None:
        """Sample without a controller until the stage has landed, if it flies."""
        while self.stage.flying and not self._lost:
            self._hold()
            self._advance()
        self._hold()

    def _lose(self, error: StageError) -> None:
        """The stage cannot go on: that ends the node, unless a reset can bring it back."""
        self._lost = True
        self._report()
        if self._timer is not None:
            self._timer.cancel()
        if not self.stage.restartable:
            self._node.fail(str(error))

    def _report(self) -> None:
        """Say a new fault, once; where outputs can still answer it, after they have."""
        fault = self.stage.fault
        if fault is not self._reported:
            self._reported = fault
            if fault is not None:
                self._node.get_logger().error(f'fault at sample {self.sequence}: {fault}')
