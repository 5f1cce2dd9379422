"""The barrier of a fleet in lockstep: one plant owns /clock, and no vessel takes a step before all have finished the last one.

The owner reads `applied_wrench` of every follower, which each publishes when it has finished a step, and publishes the next tick
of /clock when all of them, and it itself, are done. A follower takes its next step when it has received that tick. /clock is
latched, so a follower that connects late still receives the tick that it waits for.
"""

from collections.abc import Callable
from functools import partial

from geometry_msgs.msg import WrenchStamped
from rosgraph_msgs.msg import Clock

from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import VesselNode

BEFORE_START = -1
"""The step that every plant has finished before the first one, as a stamp, ns."""


class FleetClock:
    """The wait of one plant for the others.

    Args:
        node: The plant, in lockstep.
        followers: Namespaces of the plants that wait for this one's ticks, without slashes; empty for a follower.
    """

    def __init__(self, node: VesselNode, followers: tuple[str, ...]) -> None:
        self._node = node
        self._topics = {f"/{follower}/applied_wrench": BEFORE_START for follower in followers} or {"/clock": BEFORE_START}
        self._follows = not followers
        self._wanted = BEFORE_START
        self._then: Callable[[], None] | None = None
        kind, profile = (Clock, qos.CLOCK) if self._follows else (WrenchStamped, qos.data(lockstep=True))
        for topic in self._topics:
            node.listen(kind, topic, partial(self._on_message, topic), profile)

    def wait(self, finished: int, following: int, then: Callable[[], None]) -> None:
        """Call a function when the next step may begin.

        Args:
            finished: Stamp of the step that this plant has finished, ns; BEFORE_START before the first.
            following: Stamp of the next step, ns.
            then: Called at once, or when the last message arrives that it waits for.
        """
        self._wanted, self._then = following if self._follows else finished, then
        self._go_on()

    def wait_for_end(self, finished: int, then: Callable[[], None]) -> None:
        """Call a function when the owner may end: the followers have finished the last step too; a follower ends at once.

        Args:
            finished: Stamp of the last step, ns.
            then: Called at once, or when the last follower has finished.
        """
        if self._follows:
            then()
        else:
            self.wait(finished, finished, then)

    @property
    def waiting(self) -> bool:
        """Whether this plant has finished its step and others have not."""
        return self._then is not None

    def lost(self) -> str:
        """The topic that this plant waits for and that no node publishes any more; empty if there is none."""
        behind = (topic for topic, stamp in self._topics.items() if stamp < self._wanted)
        return next((topic for topic in behind if not self._node.count_publishers(topic)), "")

    def _on_message(self, topic: str, message: Clock | WrenchStamped) -> None:
        self._topics[topic] = conversions.nanoseconds(message.clock if self._follows else message.header.stamp)
        self._go_on()

    def _go_on(self) -> None:
        if self._then is not None and min(self._topics.values()) >= self._wanted:
            then, self._then = self._then, None
            then()
