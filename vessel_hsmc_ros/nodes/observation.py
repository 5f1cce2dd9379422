"""The present state of a running vessel, as its topics show it, at little cost to the run."""

import math
import time
from functools import partial
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from vessel_hsmc_msgs.msg import Event, ReferenceState

from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.core.node_list import ALLOCATION, CONTROLLER, LOOP, PLANT, RECORDER
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.topics import EVENTS
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.controller_inputs import read_odometry
from vessel_hsmc_ros.nodes.executor import Queues
from vessel_hsmc_ros.nodes.remote import Remote, get_parameters

INPUTS = {"odom": Odometry, "reference": ReferenceState, "cmd_wrench": WrenchStamped}
"""Topics of which the latest message is shown."""

SHORTEST_LOOK, LOOK, FIRST_LOOK = 1.2, 3.0, 5.0
"""Waits before the first state, s: for nodes that publish diagnostics once a second; for inputs of a vessel of which something
is received; for any message."""

NECESSARY = set(LOOP) - {RECORDER, ALLOCATION}  # the nodes without which there is no closed loop
EVENTS_SHOWN = 5

LIMITS = {
    PLANT: ("actuators.surge_force_limit", "actuators.yaw_moment_limit"),
    CONTROLLER: ("vessel.surge_force_limit", "vessel.yaw_moment_limit"),
}
"""Parameters that limit the wrench, in the order in which they are looked for."""

LEVELS = {DiagnosticStatus.OK: "ok", DiagnosticStatus.WARN: "warning", DiagnosticStatus.ERROR: "error"}


class NodeStatus(NamedTuple):
    """The latest diagnostics of a node: level, message and values."""

    level: str
    message: str
    values: dict[str, str]


class Snapshot(NamedTuple):
    """The state of a vessel at one moment."""

    time: float | None  # simulated time of the latest odometry, s; None without a plant of this package
    # ship, desired: states of ship and reference; None where no message has been received
    ship: Motion | None
    desired: Motion | None
    wrench: tuple[float, float] | None  # commanded surge force, N, and yaw moment, N·m; None likewise
    limits: tuple[float, float]  # of surge force and yaw moment; infinite without one
    ages: dict[str, float]  # wall time since the latest message of each input, s; without those of which there was none
    nodes: dict[str, NodeStatus]  # diagnostics by node
    events: list[str]  # the latest events, as `node kind: text`


class Observation:
    """Takes the latest message of each topic when it is looked at; those in between are dropped by DDS, unread."""

    def __init__(self, remote: Remote) -> None:
        self._remote = remote
        self._latest: dict[str, Any] = {}
        self._received: dict[str, float] = {}
        self._nodes: dict[str, NodeStatus] = {}
        self._clock: tuple[float, int] | None = None  # simulated time of the plant's latest diagnostics and their stamp
        self._events: list[tuple[int, str]] = []
        # Taken by `look` instead of by an executor, which would convert every message of a fast lockstep run.
        self._queues = Queues(
            [
                *(self._subscribe(kind, topic, qos.LATEST) for topic, kind in INPUTS.items()),
                self._subscribe(DiagnosticArray, "/diagnostics", qos.WATCHED),
                self._subscribe(Event, EVENTS, qos.EVENTS),
            ]
        )
        began = time.monotonic()
        remote.until(lambda: time.monotonic() - began > self._needed(), FIRST_LOOK)
        if not (self._nodes or self._latest):
            remote.require(PLANT, CONTROLLER)  # names what is there instead
            raise RunError(f"{remote.name('vessel_sim')} and {remote.name('controller')} published nothing for {FIRST_LOOK:g} s")
        self._limits = self._find_limits()
        self._twist_frame = self._find_twist_frame()

    def look(self) -> Snapshot:
        """The present state."""
        self._queues.serve()
        now = time.monotonic()
        motions = {name: self._motion(name) for name in ("odom", "reference")}
        command = self._latest.get("cmd_wrench")
        return Snapshot(
            self._time(),
            motions["odom"],
            motions["reference"],
            conversions.read_wrench(command) if command else None,
            self._limits,
            {name: now - at for name, at in self._received.items()},
            dict(self._nodes),
            [text for _, text in self._events],
        )

    def _subscribe(self, kind: Any, topic: str, profile: QoSProfile) -> Subscription:
        return self._remote.node.create_subscription(kind, self._remote.name(topic), partial(self._receive, topic), profile)

    def _needed(self) -> float:
        """The wait for what has been received up to now, s."""
        self._queues.serve()
        if not (self._nodes or self._latest):
            return FIRST_LOOK
        # A boat has no node of the plant. Discovery finds the nodes one after the other.
        there = {node for node in NECESSARY if self._remote.name(node) in self._remote.nodes()}
        return SHORTEST_LOOK if self._nodes.keys() >= there and self._latest.keys() >= INPUTS.keys() else LOOK

    def _receive(self, topic: str, message: Any) -> None:
        if topic in INPUTS:
            self._latest[topic], self._received[topic] = message, time.monotonic()
        elif topic == EVENTS:
            stamp = conversions.nanoseconds(message.header.stamp)
            # Latched: the earlier events of each node arrive together, so that they have to be sorted.
            self._events = sorted([*self._events, (stamp, f"{message.node} {message.kind}: {message.text}")])[-EVENTS_SHOWN:]
        else:
            levels = {status.name: status.level for status in message.status}
            prefix = self._remote.name("")[1:]
            for node, values in conversions.read_status(message.status, prefix).items():
                text = values.pop("message")
                self._nodes[node] = NodeStatus(LEVELS.get(levels[prefix + node], "stale"), text, values)
                if node == PLANT and "simulated_time" in values:
                    self._clock = float(values["simulated_time"]), conversions.nanoseconds(message.header.stamp)

    def _motion(self, topic: str) -> Motion | None:
        message = self._latest.get(topic)
        if message is None:
            return None
        if topic != "odom":
            return conversions.read_reference(message)[0]
        return read_odometry(message, self._twist_frame).motion

    def _time(self) -> float | None:
        """Simulated time of the latest odometry, counted on from the plant's diagnostics, which come once a second."""
        odometry = self._latest.get("odom")
        if self._clock is None or odometry is None:
            return None
        simulated, stamp = self._clock
        return simulated + max(0.0, seconds(conversions.nanoseconds(odometry.header.stamp) - stamp))

    def _find_twist_frame(self) -> str:
        if self._remote.name(CONTROLLER) not in self._remote.nodes():
            return "child"
        return str(get_parameters(self._remote, CONTROLLER, ["odometry.twist_frame"])["odometry.twist_frame"])

    def _find_limits(self) -> tuple[float, float]:
        there = self._remote.nodes()
        for node, names in LIMITS.items():
            if self._remote.name(node) in there:
                values = get_parameters(self._remote, node, names)
                if None not in values.values():
                    return values[names[0]], values[names[1]]
        return math.inf, math.inf
