"""A bridge, a controller and what is between them, sample by sample, in one thread without ROS.

The stage, its driver, the control step and its supervision are the real ones. What the nodes do
with them (which call follows which) is retold here: :class:`Bridge` as ``maglev_node.sampling`` and
``maglev_node.process``, :class:`Controller` as ``maglev_controller.node``, in real time, where
currents answer the sample before.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from maglev_controller.parameters import ControllerParameters
from maglev_controller.supervision import Supervisor
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.encoders import HomingError
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage
from maglev_model.axes import FloatArray
from maglev_model.contract.controller_watch import ControllerWatch, Verdict
from maglev_model.contract.stage import EncoderSample, Fault, StageError
from maglev_study.faults.machines import PLAIN, Believed, machine
from maglev_study.faults.programme import RESET, STOP, programme
from maglev_study.faults.world import World

_LONGEST_GAP = 0.02  # a controller misses samples before it gives up [s]
SESSION = 4711
"""Of the one controller there should be."""

_POLL = 0.1  # from a look at the signals to the next [s]


class Answer(NamedTuple):
    """Currents, as they go from the controller to the bridge."""

    sequence: int
    direct: FloatArray
    quadrature: FloatArray
    status: int
    session: int = SESSION
    stamped: bool = True  # with the stamp of the measurement they answer


class Bridge:
    """The bridge's process."""

    def __init__(self, parameters: BridgeParameters, world: World) -> None:
        driver = QuanserDriver(parameters, world, world.now, world.sleep)
        self.stage = BridgeStage(parameters, driver=driver)
        self.alive = True
        self.active = self.homed = self.vanished = False
        self.stray = ''  # what left the stage and is none of its errors
        self.refused = ''  # what was refused last
        self.sequence = -1
        self.lost = False
        self._watch = ControllerWatch()
        self._signals = 0
        self._looks, self._look_period = 0, round(_POLL / parameters.sample_time)
        self._rescued = False
        self._finally: Callable[[], None] | None = None  # when it has landed by itself

    # -- life cycle --------------------------------------------------------------------------------

    def configure(self) -> bool:
        """Open the boards; whether that went well."""
        return self._try(self.stage.configure)

    def home(self, *, vouched: bool = False) -> bool:
        """The service ~/home; ``vouched``: without the lift that proves where the platen rests."""
        self.homed = self._try(partial(self.stage.home, vouched))
        return self.homed

    def activate(self) -> bool:
        """Begin to sample."""
        self.active = self._try(self.stage.activate)
        self.lost = False
        self._watch.forget()
        return self.active

    def deactivate(self) -> None:
        """Land, then end sampling."""
        self._land_then('deactivated', self._end_sampling)

    def cleanup(self) -> None:
        """Give up the stage."""
        self.active = False
        self._try(self.stage.close)

    def end(self) -> None:
        """End the process in order: land, then release."""
        if self.active:
            self._land_then('shut down', self.die)
        else:
            self.die()

    def die(self) -> None:
        """End the process, releasing the stage; as after an error that nobody caught."""
        if self.alive:
            self._try(self.stage.close)
            self.alive = self.active = False

    def vanish(self) -> None:
        """The process is gone without another word."""
        self.vanished = self.alive
        self.alive = self.active = False

    def signal(self, times: int) -> None:
        """SIGINT, SIGTERM or SIGHUP, so often before the process looks."""
        self._signals += times

    @property
    def ending(self) -> bool:
        """Whether it lands because it was asked to end."""
        return self._finally is not None

    def _end_sampling(self) -> None:
        self.active = False
        self._try(self.stage.deactivate)

    def _land_then(self, why: str, last: Callable[[], None]) -> None:
        if self.alive:
            self._try(lambda: self.stage.land(why))
            self._finally = last

    # -- services ----------------------------------------------------------------------------------

    def emergency_stop(self) -> None:
        """The service of that name; refused by a node that is not active."""
        if self.active:
            self._try(self.stage.stop)

    def reset(self) -> bool:
        """The service ~/reset; whether a fault was cleared."""
        if not self.alive:
            return False
        cleared: list[bool] = []
        self._try(lambda: cleared.append(self.stage.reset()[0]))
        if any(cleared):
            self._watch.forget()
            self.lost = False
        return any(cleared)

    # -- samples -----------------------------------------------------------------------------------

    def sample(self, inbox: list[Answer]) -> EncoderSample | None:
        """One sample: read, then follow the newest currents; what is measured, where it was."""
        self._looks += 1
        if self._signals and (not self.active or self._looks % self._look_period == 0):
            self._signals = 0
            self.end()
        if self._finally is not None and (self.lost or not self.stage.flying):
            last, self._finally = self._finally, None
            last()
        if not self.active or self.lost:
            return None
        read: list[EncoderSample] = []
        self._try(lambda: read.append(self.stage.read()), lose=True)
        if not read:
            return None
        self.sequence += 1
        self._answer(inbox)
        return read[0]

    def _answer(self, inbox: list[Answer]) -> None:
        """Follow the newest currents that are to be followed; none while it ends."""
        fresh = None
        for answer in inbox if self._finally is None else ():
            if self._heed(answer) is Verdict.FOLLOWED:
                fresh = answer
        if fresh is None:
            self._try(self.stage.hold, lose=True)
        else:
            self._try(partial(self._write, fresh), lose=True)

    def _heed(self, answer: Answer) -> Verdict:
        verdict = self._watch.judge(
            answer.session,
            answer.sequence,
            answer.status,
            answer.direct,
            answer.quadrature,
            stamped=answer.stamped,
            sample=self.sequence,
            flying=self.stage.flying,
        )
        if verdict is Verdict.REFUSED and self.stage.fault is None:
            self._try(lambda: self.stage.stop(self._watch.why, kind='controller'))
        return verdict

    def _write(self, answer: Answer) -> None:
        try:
            self.stage.write(answer.direct, answer.quadrature, self.sequence - answer.sequence)
        except ValueError as error:
            if self.stage.fault is None:
                self.stage.stop(str(error), kind='controller')

    def _try(self, action: Callable[[], object], *, lose: bool = False) -> bool:
        """Do it; a refusal is kept, any other error ends the process as in a callback."""
        try:
            action()
        except (StageError, HomingError) as error:
            self.refused = str(error)
            self.lost = self.lost or lose
            return False
        except Exception as error:
            self.stray = self.stray or repr(error)
            if self._rescued:
                self.vanish()
            elif self.alive:
                self._rescued = True
                self._land_then('a defect of the node', self.die)
            return False
        return True


class Controller:
    """The controller's process."""

    def __init__(self, parameters: ControllerParameters) -> None:
        self.supervisor = Supervisor(parameters)
        self._longest_gap = _LONGEST_GAP / parameters.sample_time
        self.alive = True
        self.stalled = False
        self.pace = 1.0  # samples answered per sample
        self.twist: Callable[[Answer], list[Answer]] | None = None  # what becomes of an answer
        self.heeded = True  # else it only goes on saying what it said last, which is cheaper
        self._credit = 0.0
        self._waiting: deque[tuple[int, EncoderSample]] = deque()
        self._sequence = -1

    def take(self, sequence: int, sample: EncoderSample) -> None:
        """A measurement arrives."""
        if self.alive:
            self._waiting.append((sequence, sample))

    def work(self) -> list[Answer]:
        """What is answered within one sample's time."""
        if not self.alive or self.stalled:
            return []
        answers: list[Answer] = []
        self._credit += self.pace
        if self.pace >= 1.0:
            self._credit = len(self._waiting) + 1.0
        while self._waiting and self._credit >= 1.0:
            self._credit -= 1.0
            answer = self._answer(*self._waiting.popleft())
            answers += [answer] if self.twist is None else self.twist(answer)
        return answers

    def last_words(self) -> list[Answer]:
        """Give up at once, and say so."""
        self.alive = False
        if not self.supervisor.flying:
            return []
        self.supervisor.give_up('shut down')
        return [self._currents(self._sequence)]

    def defect(self) -> None:
        """Die of an exception: after a landing where it flies."""
        self.supervisor.stop('defect: injected')
        self.alive = self.supervisor.flying

    def _answer(self, sequence: int, sample: EncoderSample) -> Answer:
        supervisor = self.supervisor
        if not self.heeded:
            return self._currents(sequence)
        missing = self._sequence >= 0 and sequence - self._sequence > self._longest_gap
        if missing and supervisor.flying:
            supervisor.stop('measurements are missing')
        self._sequence = sequence
        supervisor.step(supervisor.references.find(sequence), *sample)
        return self._currents(sequence)

    def _currents(self, sequence: int) -> Answer:
        supervisor = self.supervisor
        return Answer(
            sequence,
            supervisor.direct_current.copy(),
            supervisor.quadrature_current.copy(),
            int(supervisor.status),
        )


class Flight:
    """The world, a bridge, a controller and a programme; one :meth:`step` a sample.

    Those of the machine ``number`` among the ones that differ from what is believed.
    """

    def __init__(self, number: int, believed: Believed = PLAIN) -> None:
        self.parameters = machine(number, believed)
        self.period = self.parameters.sample_time
        self.course = programme(number, self.parameters.machine.gap_max, self.period)
        self.world = World(self.parameters)
        self.bridge = Bridge(self.parameters, self.world)
        self.controller = Controller(believed.controller)
        self.inbox: list[Answer] = []
        self.samples = 0  # stepped
        self.acting = True  # the operator goes on with the programme
        self.skip_homing = False
        self.forbidden = ''  # why the amplifiers must not be enabled
        self.asked: Fault | None = None  # the bridge's, by the programme's own emergency stop
        self.each: Callable[[], None] | None = None  # before each sample

    def samples_in(self, time: float) -> int:
        """How many samples take that time [s]."""
        return round(time / self.period)

    def step(self) -> None:
        """One sample passes."""
        if self.acting:
            self.act()
        if self.each is not None:
            self.each()
        ticks = self.world.ticks
        sample = self.bridge.sample(self.inbox)
        if sample is None and self.world.ticks == ticks:  # nobody waited; one that is late need not
            self.world.tick()
        self.samples += 1
        self.inbox = []
        if sample is not None:
            if self.controller.heeded:
                self._refer(self.bridge.sequence)
            self.controller.take(self.bridge.sequence, sample)
        self.inbox += self.controller.work()

    def _refer(self, sequence: int) -> None:
        """The reference of a sample, just in time."""
        course, row = self.course, min(sequence, len(self.course.kind) - 1)
        position, velocity, acceleration = course.references
        self.controller.supervisor.references.store(
            sequence, course.kind[row], 0, position[row], velocity[row], acceleration[row]
        )

    def act(self) -> None:
        """What the operator does at this sample of the programme."""
        action = self.course.actions.get(self.samples)
        supervisor = self.controller.supervisor
        if action == STOP:
            self.bridge.emergency_stop()
            self.asked = self.bridge.stage.fault
            supervisor.disable()
        elif action == RESET:
            self.bridge.reset()
            supervisor.enable()
