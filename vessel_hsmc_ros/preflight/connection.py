"""What a connection with a boat's stack is made of, live or from a bag, as the rules judge it."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kernel import Array

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
    """A topic as it was observed."""

    name: str  # its full name
    # publishers, readers: its endpoints
    publishers: tuple[Endpoint, ...] = ()
    readers: tuple[Endpoint, ...] = ()
    received: Array = np.empty(0)  # times of receipt on the clock of the nodes, s, (n,)
    # what its messages contain, by names that all forms share: stamp, frame, child, x, y, psi, u, v, r, ... (n,)
    columns: Mapping[str, Array] = {}


EULER = "euler angles"  # the role of an IMU whose driver publishes roll, pitch and yaw in degrees in place of the quaternion


class Role(NamedTuple):
    """A topic that the connection needs."""

    name: str  # what it is: odometry, pose, twist, reference, command, fix, imu, ..
    topic: str  # its full name
    kinds: tuple[str, ...]  # the message types that it may have
    is_input: bool  # whether a node of this package reads it; else it writes it, and the stack reads it
    # frames, child_frames: those that it may have; empty for any
    frames: tuple[str, ...] = ()
    child_frames: tuple[str, ...] = ()
    timeout: float = 0.5  # time without a message from which on it counts as lost, s
    own: str = ""  # the name of the topic before remapping


class Autopilot(NamedTuple):
    """What an autopilot tells of its failsafes."""

    firmware: str = ""  # ArduPilot, PX4, or empty where none has told anything
    values: Mapping[str, float] = {}  # parameters by name
    system_id: int = 0  # the system as which this package commands
    silence: str = ""  # why it has told nothing, and what to do


class Connection(NamedTuple):
    """A connection as it was observed."""

    roles: tuple[Role, ...]  # what it needs
    topics: Mapping[str, Topic] = {}  # all topics by their full names
    twist_frame: str = "child"  # frame of the measured velocities: child, or parent
    length: float = 1.0  # of the ship, m
    # declared standard deviations of a sample of the position, m, and of the heading, rad
    noise: tuple[float, float] = (0.0, 0.0)
    # its declared surge and yaw inertia, kg and kg·m²; nan where they are not known
    inertias: tuple[float, float] = (np.nan, np.nan)
    future: float = 0.1  # time by which stamps may be ahead, s
    covariance_limit: float = np.inf  # largest variance of a position, m²
    is_live: bool = True  # whether nodes are running; a bag shows no subscriptions
    uses_observer: bool = False  # whether the controller estimates the velocities itself
    simulated: tuple[str, ...] = ()  # the nodes that keep to /clock
    events: tuple[str, ...] = ()  # kinds of the events of the nodes
    reasons: tuple[str, ...] = ()  # names of the reasons for which the controller has left the law
    autopilot: Autopilot | None = None  # None for a stack without one that this package reads
    statuses: Mapping[str, tuple[str, str]] = {}  # level and text of the nodes' diagnostics that are not OK, by node

    def topic(self, role: Role) -> Topic:
        """The topic of a role; an empty one if it does not exist."""
        return self.topics.get(role.topic, Topic(role.topic))

    def of(self, *names: str) -> Topic | None:
        """The topic of the first of some roles that has messages; None if none has."""
        found = {role.name: self.topic(role) for role in self.roles}
        return next((found[name] for name in names if name in found and len(found[name].received)), None)
