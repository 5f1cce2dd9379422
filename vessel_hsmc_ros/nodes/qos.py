"""Quality of service of every topic.

All data topics are published reliably. In lockstep no message may be lost: publishers and subscribers keep all messages, and a
slow subscriber blocks its publisher. In real time a slow subscriber loses the oldest messages, and inputs are read best effort,
which receives from reliable and from best-effort publishers alike.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, HistoryPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy

LOSSLESS = QoSProfile(
    history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.VOLATILE
)
STREAM = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=100,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.VOLATILE,
)
DIAGNOSTICS = STREAM

CLOCK = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1000,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""Transient local (latched): a late node receives the present time while the plant of a lockstep run waits."""

CLOCK_OF_LOCKSTEP = QoSProfile(
    history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
"""The plant's own: a recorder without processor time for 1000 steps, which is 1.5 s, loses none of it as of the other topics."""

EVENTS = CLOCK
"""Events are few and latched: a recorder that connects after the first one receives it too."""

WATCHED = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=50,
    reliability=ReliabilityPolicy.BEST_EFFORT,
    durability=DurabilityPolicy.VOLATILE,
)
LATEST = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.VOLATILE
)
"""Subscriptions of observers are best effort: a slow one loses messages and never blocks a publisher."""


def data(lockstep: bool) -> QoSProfile:
    """The profile of the data topics: lossless in lockstep, the last 100 messages in real time."""
    return LOSSLESS if lockstep else STREAM


NEWEST = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=10, reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.VOLATILE
)
"""Drivers of sensors publish best effort, as `SensorDataQoS` does; a reliable subscription would receive nothing from them."""


def newest(lockstep: bool) -> QoSProfile:
    """The profile of a subscription of which only the newest message counts; lossless in lockstep.

    A node on a busy machine may process messages no faster than they come. The oldest message of a full queue then is as old as
    the queue is long: with 100 messages at 100 Hz older than a time-out, so that every one would be refused, for ever.
    """
    return LOSSLESS if lockstep else NEWEST


PERIODS_OF_DEADLINE = 10
LEASE = 1.0
"""What the publishers of the loop offer in real time: a message in ten periods, and a sign of life every second."""


def offered(lockstep: bool, rate_hz: float) -> QoSProfile:
    """The profile of a publisher of the loop; in real time it offers a deadline and liveliness.

    A subscriber may request them; the middleware then reports when they are missed. Those of this package request neither: they
    would receive nothing from a publisher that offers none, and count the time themselves.

    Args:
        lockstep: Whether the node runs in lockstep, where nothing happens at a rate.
        rate_hz: Rate of the messages.
    """
    if lockstep:
        return LOSSLESS
    return QoSProfile(
        history=STREAM.history,
        depth=STREAM.depth,
        reliability=STREAM.reliability,
        durability=STREAM.durability,
        deadline=Duration(seconds=PERIODS_OF_DEADLINE / rate_hz),
        liveliness=LivelinessPolicy.AUTOMATIC,
        liveliness_lease_duration=Duration(seconds=LEASE),
    )


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
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def replayed(offered: Sequence[Mapping[str, Any]]) -> QoSProfile:
    """The profile of a replay's publisher, from the profiles of the recorded publishers in the bag."""
    reliable = all(profile["reliability"] != "best_effort" for profile in offered)
    latched = bool(offered) and all(profile["durability"] == "transient_local" for profile in offered)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=1000,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )
