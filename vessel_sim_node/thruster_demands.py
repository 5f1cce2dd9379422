"""The demands of the thrusters as they are received, topic by topic."""

import math
from collections import deque

from vessel_hsmc_ros.core.thruster_layout import FIXED, ThrusterLayout

Demand = tuple[list[float], list[float]]
"""Thrusts [N] and angles of all thrusters."""

NEVER = -(2**63)
"""A time before every other, ns."""


class ThrusterDemands:
    """Queues of the demands in lockstep, and the latest ones in real time.

    Args:
        layout: The thrusters.

    Attributes:
        topics: Index of the thruster, and 0 for a thrust or 1 for an angle, by topic.
    """

    def __init__(self, layout: ThrusterLayout) -> None:
        self.topics = {topic: (i, part) for topic, i, part in layout.topics()}
        self._queues: dict[str, deque[float]] = {topic: deque() for topic in self.topics}
        each = layout.thrusters()
        self._latest: Demand = [0.0] * len(each), [t.angle if t.kind == FIXED else 0.0 for t in each]
        self._received: dict[str, int] = {}

    def append(self, topic: str, value: float) -> None:
        """Lockstep: queue a demand; the n-th of each topic belongs to the n-th step."""
        self._queues[topic].append(value)

    def complete(self) -> bool:
        """Lockstep: whether the demands of the next step have come on every topic."""
        return all(self._queues.values())

    def take(self, now: int, oldest: int | None = None) -> Demand:
        """Lockstep: the demands of the next step.

        Args:
            now: Time of the step, ns.
            oldest: With it, a demand of NaN states that none came, and the last one holds if it is not before this time, ns.
        """
        for topic, queue in self._queues.items():
            value = queue.popleft()
            if oldest is None or math.isfinite(value):
                self._set(topic, value)
                self._received[topic] = now
        return self.present(NEVER if oldest is None else oldest)

    def hold(self, topic: str, value: float, now: int) -> str:
        """Real time: hold a demand until the next.

        Args:
            topic: Its topic.
            value: N, or rad.
            now: Time of receipt, ns.

        Returns:
            What is wrong with a demand that is ignored; otherwise nothing.
        """
        if not math.isfinite(value):
            return f"{topic} = {value} is not allowed: it takes a finite number"
        self._set(topic, value)
        self._received[topic] = now
        return ""

    def stale(self, oldest: int) -> list[str]:
        """The topics of thrusts without a demand since a time, ns."""
        return [topic for topic, (_, part) in self.topics.items() if part == 0 and self._received.get(topic, NEVER) < oldest]

    def present(self, oldest: int) -> Demand:
        """The demands; thrusts that were received before a time, ns, are zero, while angles hold."""
        thrust, angle = [*self._latest[0]], [*self._latest[1]]
        for topic in self.stale(oldest):
            thrust[self.topics[topic][0]] = 0.0
        return thrust, angle

    def stopped(self) -> Demand:
        """No thrust, at the present angles."""
        return [0.0] * len(self._latest[0]), [*self._latest[1]]

    def forget(self) -> None:
        """Let no demand hold until the next one of its topic."""
        self._received.clear()

    def _set(self, topic: str, value: float) -> None:
        i, part = self.topics[topic]
        self._latest[part][i] = value
