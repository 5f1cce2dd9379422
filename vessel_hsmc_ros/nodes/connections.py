"""The start-up handshake of a node: which publishers and subscribers it waits for before it starts its work.

The ROS graph shows a subscriber before the publisher is connected with it, and messages published in between may be lost. A node
of a lockstep run therefore starts only when the number of connections equals the number of subscribers in the graph.
"""

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import LivelinessPolicy, QoSProfile, ReliabilityPolicy

from vessel_hsmc_ros.core.node_list import RECORDER
from vessel_hsmc_ros.nodes import qos

if TYPE_CHECKING:
    from rclpy.subscription import Subscription


class Awaited(NamedTuple):
    """A subscription that is created once its topic has a publisher; the arguments of `Node.create_subscription`."""

    kind: Any
    topic: str
    callback: Callable[[Any], None]
    profile: QoSProfile
    raw: bool = False


class Connections:
    """The connections that a node waits for at its start.

    `recorded`: whether the recorder must read every topic that the node publishes.

    Attributes:
        subscriptions: Those created so far by `add_subscription`.
    """

    def __init__(self, node: Node, recorded: bool) -> None:
        self.subscriptions: list[Subscription] = []
        self._node = node
        self._recorded = recorded
        self._publishers: list[tuple[Publisher, tuple[str, ...]]] = []
        self._awaited: list[Awaited] = []
        self._exclusive: list[str] = []
        self._conditions: list[Callable[[], str]] = []

    def add_publisher(self, publisher: Publisher, *partners: str) -> None:
        """Wait for the subscribers of a topic; the node of one of them must publish one of `partners`, if there are any."""
        self._publishers.append((publisher, tuple(self._node.resolve_topic_name(partner) for partner in partners)))

    def add_subscription(self, awaited: Awaited) -> None:
        """Wait for the publisher of a topic, and subscribe as soon as it exists."""
        self._awaited.append(awaited)

    def add_condition(self, unmet: Callable[[], str]) -> None:
        """Wait, once all publishers and subscribers are there, until a function no longer returns what is awaited."""
        self._conditions.append(unmet)

    def allow_one_publisher(self, topic: str) -> None:
        """Let `conflict` report a second publisher of a topic."""
        self._exclusive.append(topic)

    def conflict(self) -> str:
        """Which topic has more publishers than the one it takes; empty when none has."""
        return self.shared(*self._exclusive)

    def shared(self, *topics: str) -> str:
        """Which of some topics has more than one publisher; empty when none has."""
        for topic in map(self._node.resolve_topic_name, topics):  # the graph has the names after remapping
            if (publishers := self._node.count_publishers(topic)) > 1:
                return shared_text(self._node, topic, publishers)
        return ""

    def missing(self) -> list[str]:
        """List what the node still waits for; topics that have a publisher by now are subscribed to."""
        for awaited in list(self._awaited):  # a copy: found ones are removed
            if self._node.count_publishers(self._node.resolve_topic_name(awaited.topic)):  # a remapped one by its new name
                self._awaited.remove(awaited)
                *arguments, raw = awaited
                self.subscriptions.append(self._node.create_subscription(*arguments, raw=raw))
        found = [f"a publisher of {self._node.resolve_topic_name(awaited.topic)}" for awaited in self._awaited]
        found += [lack for publisher, partner in self._publishers if (lack := self.missing_reader(publisher, *partner))]
        found = found or [text for unmet in self._conditions if (text := unmet())]
        return list(dict.fromkeys(found))

    def missing_reader(self, publisher: Publisher, *partners: str) -> str:
        """Describe the subscriber that a publisher still waits for; empty when all subscribers of the graph are connected.

        `partners`: full names of topics, of which the node of one of the subscribers must publish one; none if any will do.
        """
        if not (partners or self._recorded):
            return ""
        topic = publisher.topic_name
        infos = self._node.get_subscriptions_info_by_topic(topic)
        # An incompatible subscriber is never connected: waiting for it would always block the start.
        readers = [info for info in infos if qos.compatible(publisher.qos_profile, info.qos_profile)]
        writers = [info for partner in partners for info in self._node.get_publishers_info_by_topic(partner)]
        if partners and not set(map(_node_of, writers)) & set(map(_node_of, readers)):
            return f"a node that reads {topic} and publishes {' or '.join(partners)}"
        # A node on simulated time reads /clock for itself, best effort; the recorder's own subscription is reliable.
        qualities = [(info.node_name, info.qos_profile.reliability) for info in readers]
        if self._recorded and (RECORDER, ReliabilityPolicy.RELIABLE) not in qualities:
            return "the recorder"
        if publisher.get_subscription_count() < len(readers):
            return f"a connection with all {len(readers)} readers of {topic}"
        return ""


def _node_of(endpoint: Any) -> tuple[str, str]:
    """Namespace and name of the node that an endpoint of a topic belongs to."""
    return endpoint.node_namespace, endpoint.node_name


UNKNOWN = "_NODE_NAME_UNKNOWN_"  # what the middleware calls a node whose name has not been discovered


def publishing(node: Node, topic: str) -> list[str]:
    """The full names of the nodes that publish a topic, once for each publisher, as far as they are known.

    `node`: whose view of the ROS graph is used. `topic`: full name.
    """
    nodes = map(_node_of, node.get_publishers_info_by_topic(topic))
    return sorted(f"{space.rstrip('/')}/{name}" for space, name in nodes if name != UNKNOWN)


def shared_text(node: Node, topic: str, publishers: int) -> str:
    """That a topic has more publishers than the one it takes, with the names of their nodes."""
    names = ", ".join(publishing(node, topic))
    text = f"{topic} has {publishers} publishers and may have one: does another run use this ROS domain and namespace?"
    return f"{text} They are {names}" if names else text


SETTLED = 2.0  # time without a change after which a publisher that shows no life counts as gone, s; in addition to its lease
PREFIX = 12  # bytes of an endpoint's global identifier that are those of its participant, by the RTPS standard


class Publishers:
    """Counts the living publishers of a topic.

    A process that is killed stays in the ROS graph until its DDS lease ends, 20 s by default. Publishers of the loop offer
    liveliness (`qos.offered`); while the graph shows several publishers, a subscription that requests it shows how many of them
    are gone. It takes no part in what the node does with the topic, whose own subscription requests nothing. Publishers that
    offer no liveliness, or belong to this process, count as living for as long as the graph shows them. `node`: whose view of
    the ROS graph is used. `topic`: name relative to the node's namespace.
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
        return shared_text(self._node, self._topic, living)

    def others(self) -> str:
        """The names of the other nodes that publish the topic, among them one of the same name as this node."""
        names, own = publishing(self._node, self._topic), self._node.get_fully_qualified_name()
        if own in names:
            names.remove(own)
        return ", ".join(names) or "a node whose name is not known yet"

    def _own(self) -> int:
        """The number of publishers of this process, of whose life DDS sends it no sign."""
        infos = self._node.get_publishers_info_by_topic(self._topic)
        return sum(bytes(info.endpoint_gid)[:PREFIX] in self._participants for info in infos)

    def _readers(self) -> set[bytes]:
        return {bytes(info.endpoint_gid) for info in self._node.get_subscriptions_info_by_topic(self._topic)}

    def _begin(self) -> None:
        before = self._readers()
        self._matched = self._alive = 0
        alive = {"liveliness": LivelinessPolicy.AUTOMATIC, "liveliness_lease_duration": Duration(seconds=qos.LEASE)}
        requested = qos.profile(1, reliable=False, **alive)
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
