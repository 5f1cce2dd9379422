"""Quality of service of every topic.

All data topics are published reliably. In lockstep no message may be lost: publishers and subscribers keep all messages, and a
slow subscriber blocks its publisher. In real time a slow subscriber loses the oldest messages, and inputs are read best effort,
which receives from reliable and from best-effort publishers alike. Towards other programs, what cannot be connected is named, and
a user may override what a topic has.
"""

import copy
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
    qos_policy_name_from_kind,
)
from rclpy.qos_overriding_options import QoSOverridingOptions

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.nodes.rclpy_parts import overrides

if TYPE_CHECKING:
    from rclpy.node import Node


def profile(depth: int, reliable: bool = True, latched: bool = False, **others: Any) -> QoSProfile:
    """The profile of the last messages of some number, 0 for all; latched: a reader that comes late receives them too."""
    kept = {"history": HistoryPolicy.KEEP_LAST, "depth": depth} if depth else {"history": HistoryPolicy.KEEP_ALL}
    return QoSProfile(
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        **kept,
        **others,
    )


LOSSLESS, STREAM = profile(0), profile(100)
DIAGNOSTICS = STREAM
CLOCK = profile(1000, latched=True)  # a late node receives the present time while the plant of a lockstep run waits
CLOCK_OF_LOCKSTEP = profile(0, latched=True)
"""The plant's own: a recorder without processor time for 1000 steps, which is 1.5 s, loses none of it as of the other topics."""

EVENTS = CLOCK  # events are few and latched: a recorder that connects after the first one receives it too
LATCHED = profile(1, latched=True)
WATCHED, LATEST = profile(50, reliable=False), profile(1, reliable=False)
"""Subscriptions of observers are best effort: a slow one loses messages and never blocks a publisher."""

NEWEST = profile(10, reliable=False)
"""Drivers of sensors publish best effort, as `SensorDataQoS` does; a reliable subscription would receive nothing from them."""


def data(lockstep: bool) -> QoSProfile:
    """The profile of the data topics: lossless in lockstep, the last 100 messages in real time."""
    return LOSSLESS if lockstep else STREAM


def newest(lockstep: bool) -> QoSProfile:
    """The profile of a subscription of which only the newest message counts; lossless in lockstep.

    A node on a busy machine may process messages no faster than they come. The oldest message of a full queue then is as old as
    the queue is long: with 100 messages at 100 Hz older than a time-out, so that every one would always be refused.
    """
    return LOSSLESS if lockstep else NEWEST


PERIODS_OF_DEADLINE = 10
LEASE = 1.0  # what the publishers of the loop offer in real time: a message in ten periods, and a sign of life every second


def offered(lockstep: bool, rate_hz: float) -> QoSProfile:
    """The profile of a publisher of the loop; in real time it offers a deadline and liveliness.

    A subscriber may request them; the middleware then reports when they are missed. Those of this package request neither: they
    would receive nothing from a publisher that offers none, and count the time themselves. `lockstep`: whether the node runs in
    lockstep, where nothing happens at a rate.
    """
    if lockstep:
        return LOSSLESS
    deadline, lease = Duration(seconds=PERIODS_OF_DEADLINE / rate_hz), Duration(seconds=LEASE)
    return profile(100, deadline=deadline, liveliness=LivelinessPolicy.AUTOMATIC, liveliness_lease_duration=lease)


def compatible(offered: QoSProfile, requested: QoSProfile) -> bool:
    """Whether a reader of one profile receives messages of a writer of another, by reliability and durability.

    rclpy's own check takes the infinite deadline that discovery gives to every reader for one that no writer meets.
    """
    reliable = requested.reliability is not ReliabilityPolicy.RELIABLE or offered.reliability is ReliabilityPolicy.RELIABLE
    latched = DurabilityPolicy.TRANSIENT_LOCAL
    return reliable and (requested.durability is not latched or offered.durability is latched)


def recorded(publishers: Sequence[QoSProfile]) -> QoSProfile:
    """The profile of a recorder's subscription: as reliable and as durable as all publishers of the topic offer."""
    # A subscription that requests more than a publisher offers receives nothing from it.
    reliable = all(offered.reliability is ReliabilityPolicy.RELIABLE for offered in publishers)
    latched = all(offered.durability is DurabilityPolicy.TRANSIENT_LOCAL for offered in publishers)
    return profile(0, reliable, latched)


def replayed(offered: Sequence[Mapping[str, Any]]) -> QoSProfile:
    """The profile of a replay's publisher, from the profiles of the recorded publishers in the bag."""
    reliable = all(profile["reliability"] != "best_effort" for profile in offered)
    latched = bool(offered) and all(profile["durability"] == "transient_local" for profile in offered)
    return profile(1000, reliable, latched)


OVERRIDES = "qos_overrides."  # prefix of rclpy's parameters, such as `qos_overrides./odom.subscription.reliability: reliable`
POLICIES = {
    "reliability": ("reliable", "best_effort"),
    "durability": ("volatile", "transient_local"),
    "history": ("keep_last", "keep_all"),
    "depth": (),
}
"""The policies that may be overridden, with their values; the depth is an integer."""


class Compatibility:
    """The quality of service of a node's endpoints: overrides, and what the middleware cannot connect.

    `node`: whose publishers and subscriptions they are.
    """

    def __init__(self, node: "Node") -> None:
        self._node = node
        self._found: dict[tuple[str, str], tuple[str, QoSProfile]] = {}
        self._used: set[str] = set()

    def options(self, topic: str, own: str, profile: Any) -> dict[str, Any]:
        """Further arguments of `create_publisher` and `create_subscription`, with a profile that a user may have overridden."""
        profile = copy.copy(profile)  # rclpy writes the overrides into it
        callbacks = PublisherEventCallbacks if own == "publisher" else SubscriptionEventCallbacks
        made: dict[str, Any] = {"event_callbacks": callbacks(incompatible_qos=partial(self._note, topic, own, profile))}
        prefix = f"{OVERRIDES}{self._node.resolve_topic_name(topic)}.{own}."
        if given := {name for name in self._given() if name.startswith(prefix)}:
            self._used |= given
            made["qos_overriding_options"] = QoSOverridingOptions([QoSPolicyKind[name.upper()] for name in POLICIES])
        return {**made, "qos_profile": profile}

    def check(self) -> None:
        """Check the values of all overrides. Raises ParameterError if a policy does not exist, or does not have the value."""
        for name in sorted(self._given()):
            policy = name.rpartition(".")[2]
            if policy not in POLICIES:
                raise ParameterError(f"{name} is not a policy: it must be one of {', '.join(POLICIES)}")
            value, values = overrides(self._node)[name].value, POLICIES[policy]
            if value not in values if values else type(value) is not int or value < 1:
                allowed = f"one of {', '.join(values)}" if values else "an integer of at least 1"
                raise ParameterError(f"{name} must be {allowed} (got {value})")

    def unused(self) -> str:
        """The overrides that belong to no publisher or subscription of the node; empty if all do."""
        return ", ".join(sorted(self._given() - self._used))

    def problem(self) -> str:
        """The endpoints that cannot be connected and are still there; empty if there are none."""
        for (name, own), (_, profile) in list(self._found.items()):
            if not self._others(name, own, profile):
                del self._found[name, own]
        return "; ".join(text for text, _ in self._found.values())

    def _given(self) -> set[str]:
        return {name for name in overrides(self._node) if name.startswith(OVERRIDES)}

    def _note(self, topic: str, own: str, profile: QoSProfile, event: Any) -> None:
        name = self._node.resolve_topic_name(topic)
        policy = qos_policy_name_from_kind(event.last_policy_kind).lower()
        nodes = ", ".join(dict.fromkeys(self._others(name, own, profile))) or "another node"
        other = "subscription" if own == "publisher" else "publisher"
        text = (
            f"{name}: nothing passes between this {own} and the {other} of {nodes}, because their {policy} is not compatible:"
            f" change it there, or here by {OVERRIDES}{name}.{own}.{policy}"
        )
        self._found[name, own] = text, profile
        self._node.get_logger().warning(text)

    def _others(self, name: str, own: str, profile: QoSProfile) -> list[str]:
        """The nodes whose endpoints of a topic the graph shows as incompatible with a profile of this node."""
        if own == "subscription":
            infos = self._node.get_publishers_info_by_topic(name)
            return [info.node_name for info in infos if not compatible(info.qos_profile, profile)]
        infos = self._node.get_subscriptions_info_by_topic(name)
        return [info.node_name for info in infos if not compatible(profile, info.qos_profile)]
