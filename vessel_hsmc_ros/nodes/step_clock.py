"""The steps of the plant, in lockstep: which odometry and which reference belong to each of them."""

from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

from rosgraph_msgs.msg import Clock

from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import VesselNode


class StepClock:
    """Finds the stamps of the plant's steps: those of its odometry, or the time of /clock where odometry is late by its stamp.

    The plant waits for the command of a step, so the last tick of /clock is of that step or of the one before.

    Args:
        node: The node that receives the odometry.
        on_tick: Called at each tick of /clock, which is only read once odometry has been late.
    """

    def __init__(self, node: VesselNode, on_tick: Callable[[], None]) -> None:
        self._node, self._on_tick = node, on_tick
        self._now: int | None = None

    def step_of(self, measured_at: int, last: int) -> int | None:
        """The stamp of the step that odometry belongs to, ns; None until the tick of that step has been received.

        Args:
            measured_at: Stamp of the odometry, ns.
            last: Stamp of the last step, ns; late odometry is not after it.
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
    """A message of a topic that waits for its step.

    Attributes:
        stamp: Its stamp, ns.
        message: Its content; None where it only says that there is nothing of the step of its stamp.
    """

    stamp: int
    message: Any


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
