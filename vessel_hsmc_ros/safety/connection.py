"""What a connection with a boat's stack is made of, as the rules of `connection_rules` judge it, live or from a bag."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.arrays import Array

OK, TODO, WRONG = "ok", "todo", "wrong"
"""Levels of a finding: as it must be, not shown yet, or a mistake; the text of the last two has what to do."""


class Finding(NamedTuple):
    """A line of the page: its level, what it is about, and what was found."""

    level: str
    about: str
    text: str


class Endpoint(NamedTuple):
    """A publisher or a subscription: its node, message type, and quality of service."""

    node: str
    kind: str
    reliable: bool = True
    latched: bool = False


class Topic(NamedTuple):
    """A topic as it was observed.

    Attributes:
        name: Its full name.
        publishers, readers: Its endpoints.
        received: Times of receipt on the clock of the nodes, s, (n,).
        columns: What its messages contain, by names that all forms share: stamp, frame, child, x, y, psi, u, v, r, ... (n,).
    """

    name: str
    publishers: tuple[Endpoint, ...] = ()
    readers: tuple[Endpoint, ...] = ()
    received: Array = np.empty(0)
    columns: Mapping[str, Array] = {}


EULER = "euler angles"
"""The role of an IMU whose driver publishes roll, pitch and yaw in degrees in place of the quaternion."""


class Role(NamedTuple):
    """A topic that the connection needs.

    Attributes:
        name: What it is: odometry, pose, twist, reference, command, fix, imu, ...
        topic: Its full name.
        kinds: The message types that it may have.
        is_input: Whether a node of this package reads it; else it writes it, and the stack reads it.
        frames, child_frames: Those that it may have; empty for any.
        timeout: Time without a message from which on it counts as lost, s.
        own: The name of the topic before remapping.
    """

    name: str
    topic: str
    kinds: tuple[str, ...]
    is_input: bool
    frames: tuple[str, ...] = ()
    child_frames: tuple[str, ...] = ()
    timeout: float = 0.5
    own: str = ""


class Connection(NamedTuple):
    """A connection as it was observed.

    Attributes:
        roles: What it needs.
        topics: All topics by their full names.
        twist_frame: Frame of the measured velocities: child, or parent.
        length: Of the ship, m.
        noise: Declared standard deviations of a sample of the position, m, and of the heading, rad.
        inertias: Its declared surge and yaw inertia, kg and kg·m²; nan where they are not known.
        future: Time by which stamps may be ahead, s.
        covariance_limit: Largest variance of a position, m².
        is_live: Whether nodes are running; a bag shows no subscriptions.
        uses_observer: Whether the controller estimates the velocities itself.
        simulated: The nodes that keep to /clock.
        events: Kinds of the events of the nodes.
        reasons: Names of the reasons for which the controller has left the law.
        statuses: Level and text of the nodes' diagnostics that are not OK, by node.
    """

    roles: tuple[Role, ...]
    topics: Mapping[str, Topic] = {}
    twist_frame: str = "child"
    length: float = 1.0
    noise: tuple[float, float] = (0.0, 0.0)
    inertias: tuple[float, float] = (np.nan, np.nan)
    future: float = 0.1
    covariance_limit: float = np.inf
    is_live: bool = True
    uses_observer: bool = False
    simulated: tuple[str, ...] = ()
    events: tuple[str, ...] = ()
    reasons: tuple[str, ...] = ()
    statuses: Mapping[str, tuple[str, str]] = {}

    def topic(self, role: Role) -> Topic:
        """The topic of a role; an empty one if it does not exist."""
        return self.topics.get(role.topic, Topic(role.topic))

    def of(self, *names: str) -> Topic | None:
        """The topic of the first of some roles that has messages; None if none has."""
        found = {role.name: self.topic(role) for role in self.roles}
        return next((found[name] for name in names if name in found and len(found[name].received)), None)
