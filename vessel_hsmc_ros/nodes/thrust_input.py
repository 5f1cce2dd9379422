"""The commanded thrusts of several thrusters as a consumer takes them: fresh, finite, of one publisher each."""

import math
import time
from functools import partial
from typing import Any

from std_msgs.msg import Float64

from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import ERROR, WARN, VesselNode
from vessel_hsmc_ros.nodes.reporting import RecentProblem


class ThrustInput:
    """The latest thrust of each thruster.

    They are Float64 without stamps, so that their age counts from the receipt, by the steady clock.

    Args:
        node: The node that carries them out.
        names: Of the thrusters.
        timeout: Age from which on a thrust does not count, s.
    """

    def __init__(self, node: VesselNode, names: tuple[str, ...], timeout: float) -> None:
        self._node, self._timeout = node, timeout
        self._topics = [f"thrusters/{name}/thrust" for name in names]
        self._latest: dict[str, tuple[float, float]] = {}
        self._problem = RecentProblem()
        self._taken = self._refused = 0
        for topic in self._topics:
            node.listen(Float64, topic, partial(self._take, topic), qos.NEWEST)

    def present(self) -> tuple[float, ...] | None:
        """The thrusts that hold now, N; None if one of them is missing or old, or has two publishers."""
        if self._conflict() or self._overdue():
            return None
        return tuple(self._latest[topic][0] for topic in self._topics)

    def retune(self, timeout: float) -> None:
        """Take a changed time-out, s."""
        self._timeout = timeout

    def problem(self) -> tuple[bytes, str] | None:
        """Level and text of what is wrong at present; None if nothing is."""
        if conflict := self._conflict():
            return ERROR, f"{conflict}. No command of theirs is taken"
        if self._problem.current:
            return self._problem.current
        if topic := self._overdue():
            return WARN, f"no recent command on {self._node.resolve_topic_name(topic)}"
        return None

    def values(self) -> dict[str, Any]:
        """Numbers of taken and refused thrusts, for the diagnostics."""
        return {"taken": self._taken, "refused": self._refused}

    def _take(self, topic: str, message: Float64) -> None:
        if not math.isfinite(message.data):
            self._refused += 1
            text = f"{self._node.resolve_topic_name(topic)} = {message.data} is not allowed: it takes a finite number; ignored"
            self._problem.report(WARN, text)
            self._node.get_logger().error(text, throttle_duration_sec=1.0)
            return
        self._taken += 1
        self._latest[topic] = message.data, time.monotonic()

    def _overdue(self) -> str:
        oldest = time.monotonic() - self._timeout
        return next((topic for topic in self._topics if self._latest.get(topic, (0.0, -math.inf))[1] < oldest), "")

    def _conflict(self) -> str:
        return self._node.connections.shared(*self._topics)
