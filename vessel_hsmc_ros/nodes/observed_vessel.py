"""The vessel as the reference that follows it sees it: the newest odometry, and in lockstep that of the step before."""

from collections import deque
from typing import Any

from nav_msgs.msg import Odometry

from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos

OLD = NANOSECONDS  # age from which on odometry counts as lost in real time, ns


class ObservedVessel:
    """Shows odometry to a reference that follows the vessel.

    In lockstep the reference takes, at each tick of the clock, the odometry of the tick before, and none at the first two: a
    run does not depend on the order in which messages come. It publishes its first state only after the first tick. The clock
    is subscribed to after the odometry, so that the plant, whose ticks come, then knows the reader of its odometry too.
    `reference`: the reference, a `FollowingReference`.

    Attributes:
        ticks: Stamps of the clock that the reference has not taken, ns.
    """

    def __init__(self, node: Any, reference: Any) -> None:
        self._node, self._reference, self._lockstep = node, reference, node.parameters.lockstep
        self.ticks: deque[int] = deque()
        self._last_tick, self._any_tick = 0, False
        self._positions: dict[int, tuple[float, float]] = {}
        self._newest: int | None = None
        self._received = 0
        # Not by `listen`, which would subscribe to the clock first where it finds that earlier.
        reader = node.create_subscription(Odometry, "odom", self._on_odometry, qos.newest(self._lockstep))
        if self._lockstep:
            node.direct_subscriptions.append(reader)
            node.connections.add_condition(lambda: "" if self.ticks else "the first tick of /clock")

    def _on_odometry(self, message: Any) -> None:
        stamp, motion = conversions.nanoseconds(message.header.stamp), conversions.read_odometry(message)
        if not self._lockstep:
            self._positions.clear()
        self._positions[stamp] = (motion.x, motion.y)
        self._newest, self._received = stamp, self._node.now()
        if self._lockstep:
            self._node.take_ticks()

    @property
    def ready(self) -> bool:
        """Whether the reference can take the next tick."""
        return bool(self.ticks) and (self._last_tick == 0 or self._last_tick in self._positions)

    def take(self) -> int:
        """Show the odometry of the tick before; returns the stamp of the tick, ns."""
        before, self._last_tick = self._last_tick, self.ticks.popleft()
        self._reference.observe(self._positions.get(before) if before else None)
        for stamp in [stamp for stamp in self._positions if stamp <= before]:
            del self._positions[stamp]
        return self._last_tick

    def show(self) -> None:
        """Real time: show the newest odometry; none where it is old."""
        self._reference.observe(None if self.problem else next(iter(self._positions.values())))

    @property
    def problem(self) -> str:
        """That there is no odometry, or that it is old; empty if neither is so, and in lockstep."""
        if self._lockstep:
            return ""
        if self._newest is None:
            return "the reference stands: no odometry on odom"
        now = self._node.now()
        # A stamp ahead of the clock is by another clock and shows no age.
        age = max(now - self._received, abs(now - self._newest))
        return f"the reference stands: odometry is {1e-9 * age:.1f} s old" if age > OLD else ""
