"""The living publishers of a topic.

A process that is killed stays in the ROS graph until its DDS lease ends, 20 s by default. Publishers of the loop offer liveliness
(`qos.offered`); while the graph shows several publishers, a subscription that requests it shows how many of them are gone. It
takes no part in what the node does with the topic, whose own subscription requests nothing. Publishers that offer no liveliness,
or belong to this process, count as living for as long as the graph shows them.
"""

import time
from typing import Any

from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy

from vessel_hsmc_ros.nodes import qos

SETTLED = 2.0
"""Time without a change after which a publisher that shows no life counts as gone, s; in addition to its lease."""

PREFIX = 12
"""Bytes of an endpoint's global identifier that are those of its participant, by the RTPS standard."""


class Publishers:
    """Counts the living publishers of a topic.

    Args:
        node: Whose view of the ROS graph is used.
        kind: Message class.
        topic: Name relative to the node's namespace.
    """

    def __init__(self, node: Node, kind: Any, topic: str) -> None:
        self._node, self._kind, self._topic = node, kind, node.resolve_topic_name(topic)
        self._watch: Any = None
        self._shown, self._matched, self._alive = 0, 0, 0
        self._changed = 0.0
        self._participants: set[bytes] = set()

    @property
    def watching(self) -> bool:
        """Whether a subscription of this counter reads the topic."""
        return self._watch is not None

    def count(self) -> int:
        """The number of living publishers."""
        shown = int(self._node.count_publishers(self._topic))
        if shown != self._shown:
            self._shown, self._changed = shown, time.monotonic()
        if shown > 1 and self._watch is None:
            self._begin()
        elif shown <= 1 and self._watch is not None:
            self._node.destroy_subscription(self._watch)
            self._watch = None
        if shown <= 1 or time.monotonic() - self._changed < SETTLED:
            return shown
        return shown - max(0, self._matched - self._own() - self._alive)

    def conflict(self) -> str:
        """That the topic has more publishers than the one it takes; empty if it has not."""
        if (living := self.count()) <= 1:
            return ""
        return f"{self._topic} has {living} publishers and takes one: does another run use this ROS domain and namespace?"

    def _own(self) -> int:
        """The number of publishers of this process, of whose life DDS sends it no sign."""
        infos = self._node.get_publishers_info_by_topic(self._topic)
        return sum(_participant(info) in self._participants for info in infos)

    def _readers(self) -> set[bytes]:
        return {bytes(info.endpoint_gid) for info in self._node.get_subscriptions_info_by_topic(self._topic)}

    def _begin(self) -> None:
        before = self._readers()
        self._matched = self._alive = 0
        lease = Duration(seconds=qos.LEASE)
        requested = QoSProfile(
            history=HistoryPolicy.KEEP_LAST,
            depth=1,
            reliability=ReliabilityPolicy.BEST_EFFORT,
            liveliness=LivelinessPolicy.AUTOMATIC,
            liveliness_lease_duration=lease,
        )
        events = SubscriptionEventCallbacks(
            matched=self._on_matched, liveliness=self._on_liveliness, incompatible_qos=lambda _: None, use_default_callbacks=False
        )
        self._watch = self._node.create_subscription(
            self._kind, self._topic, lambda _: None, requested, event_callbacks=events, raw=True
        )
        self._participants = {gid[:PREFIX] for gid in self._readers() - before}

    def _on_matched(self, status: Any) -> None:
        self._matched, self._changed = status.current_count, time.monotonic()

    def _on_liveliness(self, status: Any) -> None:
        self._alive, self._changed = status.alive_count, time.monotonic()


def _participant(info: Any) -> bytes:
    return bytes(info.endpoint_gid)[:PREFIX]
