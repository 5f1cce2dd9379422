"""The controller in lockstep: each step of the plant is answered by a command with its stamp."""

from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

from rosgraph_msgs.msg import Clock

from vessel_hsmc_ros.core.exceptions import ControlError
from vessel_hsmc_ros.core.kinematics import extrapolate
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import VesselNode
from vessel_hsmc_ros.nodes.controller_inputs import Desired, Measured
from vessel_hsmc_ros.nodes.controller_timing import TimedNode, Timing

REFERENCES_KEPT = 2000
"""Limit of the references that wait, in lockstep, for the odometry of their stamp; a reference ship is far less ahead."""


class StepClock:
    """Finds the stamps of the plant's steps: those of its odometry, or the time of /clock where odometry is late by its stamp.

    The plant waits for the command of a step, so the last tick of /clock is of that step or of the one before. `on_tick`:
    called at each tick of /clock, which is only read once odometry has been late.
    """

    def __init__(self, node: VesselNode, on_tick: Callable[[], None]) -> None:
        self._node, self._on_tick = node, on_tick
        self._now: int | None = None

    def step_of(self, measured_at: int, last: int) -> int | None:
        """The stamp of the step that odometry belongs to, ns; None until the tick of that step has been received.

        `measured_at`: stamp of the odometry, ns. `last`: stamp of the last step, ns; late odometry is not after it.
        """
        return measured_at if measured_at > last else self.next_after(last)

    def next_after(self, last: int) -> int | None:
        """The stamp of the step after the last one, ns; None until its tick has been received."""
        if self._now is None:
            self._now = last
            # Latched: the tick of this step is received too, although it may have been published before.
            subscription = self._node.create_subscription(Clock, "/clock", self._tick, qos.CLOCK)
            self._node.direct_subscriptions.append(subscription)
        return self._now if self._now > last else None

    def _tick(self, message: Clock) -> None:
        self._now = conversions.nanoseconds(message.clock)
        self._on_tick()


class Queued(NamedTuple):
    """A message of a topic that waits for its step."""

    stamp: int  # its stamp, ns
    message: Any  # its content; None for the announcement that there is nothing of a step


class StepQueue:
    """The messages of one topic, taken step by step in their order, so that two runs with the same faults are alike.

    A step is complete with the message of its stamp. Those before it, with other stamps, were received during the step.
    """

    def __init__(self) -> None:
        self._waiting: deque[Queued] = deque()

    def append(self, stamp: int, message: Any) -> None:
        """Queue a message, or None for the announcement that there is nothing of a step."""
        self._waiting.append(Queued(stamp, message))

    def complete(self, step: int) -> bool:
        """Whether the message, or the announcement, of a step has been received."""
        return any(queued.stamp == step for queued in self._waiting)

    def take(self, step: int) -> list[Queued]:
        """Take the messages up to and including that of a complete step, without announcements."""
        taken: list[Queued] = []
        while not (taken and taken[-1].stamp == step):
            taken.append(self._waiting.popleft())
        return [queued for queued in taken if queued.message is not None]


class Lockstep(Timing):
    """Runs the law on odometry and reference of one stamp; an input that is refused ends the run.

    The law runs at the start of each control period, and its wrench is held (zero-order hold) for the odometry in between.
    """

    def __init__(self, node: TimedNode) -> None:
        super().__init__(node)
        self._odometry: Measured | None = None
        self._unanswered = 0
        self._references: dict[int, Desired] = {}
        self._steps = StepClock(node, self.start)

    @property
    def waiting(self) -> int:
        """Number of references that wait for odometry of their stamp."""
        return len(self._references)

    @property
    def pending(self) -> int | None:
        """Stamp of the first odometry since the last command that waits for the reference of its stamp, ns."""
        return self._unanswered if self._odometry else None

    def take_odometry(self, measured: Measured) -> None:
        """Answer odometry as soon as the inputs of the law are complete."""
        self._check(measured)
        if self._odometry is None:
            self._unanswered = measured.sample.stamp
        self._odometry = measured
        self._node.inputs.monitor.receive("odometry", measured.sample.stamp)
        self.start()

    def take_reference(self, desired: Desired) -> None:
        """Keep a reference for the odometry of its stamp."""
        self._check(desired)
        if len(self._references) >= REFERENCES_KEPT:  # of stamps that no odometry has: the oldest will not be needed
            del self._references[next(iter(self._references))]
        self._references[desired.sample.stamp] = desired
        self._node.inputs.monitor.receive("reference", desired.sample.stamp)
        self.start()

    def _check(self, message: Measured | Desired) -> None:
        if wrong := message.wrong:
            raise ControlError(wrong)

    def start(self) -> None:
        """Publish the command for the pending odometry, unless an input is still missing."""
        node, loop = self._node, self._node.loop
        if self._odometry is None or not node.connected:
            return
        measured_at = self._odometry.sample.stamp
        if (stamp := self._steps.step_of(measured_at, node.stamp)) is None:
            return
        if not loop.due(stamp):
            self._odometry = None
            node.publish_command(stamp)
            return
        if stamp not in self._references:  # odometry and reference may arrive in either order
            return
        measured, (_, reference, acceleration) = self._odometry, self._references[stamp]
        age = seconds(stamp - measured_at)
        with node.timed():
            desired = extrapolate(reference, acceleration, -age)
            terms = loop.step(stamp, measured.motion, desired, acceleration, measured_at, age)
        self._references = {t: r for t, r in self._references.items() if t > stamp}
        self._odometry = None  # each odometry message is answered once, whatever references follow
        node.publish_period(stamp, terms)


class RideThrough(Timing):
    """Lockstep in which an input that is refused or missing is bridged as in real time, by the age of its stamp.

    The step is that of /clock. A message without a frame announces that there is nothing of the step of its stamp.
    """

    def __init__(self, node: TimedNode) -> None:
        super().__init__(node)
        self._odometry, self._references = StepQueue(), StepQueue()
        self._steps = StepClock(node, self.start)

    def take_odometry(self, measured: Measured) -> None:
        """Queue odometry for its step."""
        self._queue(self._odometry, measured)

    def take_reference(self, desired: Desired) -> None:
        """Queue a reference for its step."""
        self._queue(self._references, desired)

    def _queue(self, queue: StepQueue, message: Any) -> None:
        queue.append(message.sample.stamp, message if message.sample.frame else None)
        self.start()

    def start(self) -> None:
        """Publish the command of the present step, once it is complete."""
        node, loop, inputs = self._node, self._node.loop, self._node.inputs
        step = self._steps.next_after(node.stamp) if node.connected else None
        if step is None or not self._odometry.complete(step):
            return
        due = loop.due(step)
        if due and not self._references.complete(step):
            return
        for queued in self._odometry.take(step):
            inputs.take_odometry(queued.message, step, step)
        if not due:
            node.publish_command(step)
            return
        for queued in self._references.take(step):
            inputs.take_reference(queued.message, step, step)
        with node.timed():
            terms = inputs.serve(step, step, step)
        node.publish_period(step, terms)
