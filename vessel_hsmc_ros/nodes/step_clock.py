"""The step of the plant that odometry belongs to, in lockstep."""

from collections.abc import Callable

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
        if measured_at > last:
            return measured_at
        if self._now is None:
            self._now = last
            # Latched: the tick of this step is received too, although it may have been published before.
            subscription = self._node.create_subscription(Clock, "/clock", self._tick, qos.CLOCK)
            self._node.direct_subscriptions.append(subscription)
        return self._now if self._now != last else None

    def _tick(self, message: Clock) -> None:
        self._now = conversions.nanoseconds(message.clock)
        self._on_tick()
