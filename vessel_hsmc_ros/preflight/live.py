"""A connection with a boat as the ROS graph and its topics show it, for the rules of `vessel-hsmc check`; and a short pulse."""

import time
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from vessel_hsmc_msgs.msg import ControlState, Event

from vessel_hsmc_ros.boats.parameters import Interface
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages import state_columns as types
from vessel_hsmc_ros.messages.raw import message_class, type_name
from vessel_hsmc_ros.messages.state_columns import columns_of_messages
from vessel_hsmc_ros.messages.topics import EVENTS
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import LAST_COMMANDS
from vessel_hsmc_ros.nodes.commands import NO_COMMAND
from vessel_hsmc_ros.nodes.remote import Remote, get_parameters
from vessel_hsmc_ros.preflight.connection import Connection, Endpoint, Role, Topic
from vessel_hsmc_ros.preflight.expected import Names, connection_of, exercised, values_of
from vessel_hsmc_ros.preflight.failsafe_rules import SILENCE, autopilot_of
from vessel_hsmc_ros.scenario.parameters import NODES, WATCHERS

OWN = ("controller", "drive", "navsat_odom")  # the nodes whose topics make a connection
SETTLED, GRAPH_LIMIT = 0.7, 5.0
"""Time without a change after which the ROS graph counts as complete, and the longest wait for that, s."""

STATE = "controller/state"
COLLECTED = qos.profile(500, reliable=False)

PULSE, PAUSE, PULSE_RATE = 2.0, 2.0, 20.0  # length of a pulse and of the pause after it, s, and the rate of its commands, Hz


class LiveConnection:
    """Observes a connection for a while.

    `stack`: the interface of the stack, if one is given: it stands for nodes that do not run.
    """

    def __init__(self, remote: Remote, stack: Interface | None = None) -> None:
        self._remote, self._stack = remote, stack
        self._received: dict[str, list[tuple[float, Any]]] = {}
        self._statuses: dict[str, tuple[bytes, str]] = {}
        self._failsafes: dict[str, str] = {}
        remote.until(self._settled(), GRAPH_LIMIT)
        there = remote.nodes()
        self._running = [node for node in OWN if remote.name(node) in there]
        self._connecting = next((node for node in SILENCE if remote.name(node) in there), stack.name if stack else "")
        read = {node: self._parameters(node) for node in self._running}
        self._simulated = tuple(node for node, values in read.items() if values.pop("use_sim_time"))
        if self._simulated:
            remote.node.set_parameters([Parameter("use_sim_time", value=True)])
        self._values = values_of(stack, read)
        draft = connection_of(self._values, stack.nodes if stack else {})
        self._names: Names = self._topics_of(draft.roles)
        self._subscribe(connection_of(self._values, self._names).roles)

    def _settled(self) -> Callable[[], bool]:
        """A condition that holds once nodes and endpoints have not changed for a while."""
        node = self._remote.node
        last: tuple[Any, float] = None, 0.0

        def settled() -> bool:
            nonlocal last
            topics = [name for name, _ in node.get_topic_names_and_types()]
            graph = self._remote.nodes(), [(t, node.count_publishers(t), node.count_subscribers(t)) for t in topics]
            if graph != last[0]:
                last = graph, time.monotonic()
            return time.monotonic() - last[1] > SETTLED

        return settled

    def _parameters(self, node: str) -> dict[str, Any]:
        """Those parameters of a running node that are numbers, words and lists of them."""
        names = [*schema.entries((NODES | WATCHERS)[node]), "use_sim_time"]
        read = get_parameters(self._remote, node, names)
        return {name: value for name, value in read.items() if value is not None} | {"use_sim_time": bool(read["use_sim_time"])}

    def _topics_of(self, roles: Iterable[Role]) -> dict[str, dict[str, str]]:
        """The topics of the nodes: those that they have in the ROS graph by the types of the roles, else those of the stack."""
        given = {node: dict(names) for node, names in (self._stack.nodes if self._stack else {}).items()}
        names: dict[str, dict[str, str]] = {node: dict(given.get(node, {})) for node in OWN}
        node, namespace = self._remote.node, self._remote.name("").rstrip("/") or "/"
        for owner in self._running:
            ends = (
                node.get_subscriber_names_and_types_by_node(owner, namespace),
                node.get_publisher_names_and_types_by_node(owner, namespace),
            )
            for role in roles:
                typed = [name for name, kinds in ends[0 if role.is_input else 1] if set(kinds) & set(role.kinds)]
                for full in (role.topic, self._remote.name(role.own)):
                    typed = [full] if full in typed else typed
                if len(typed) == 1:
                    names[owner][role.own] = typed[0]
        return names

    def _subscribe(self, roles: Iterable[Role]) -> None:
        node = self._remote.node
        for role in roles:
            if role.topic not in self._received:
                self._received[role.topic] = []
                node.create_subscription(message_class(role.kinds[0]), role.topic, partial(self._keep, role.topic), COLLECTED)
        for kind, own, profile in ((Event, EVENTS, qos.EVENTS), (ControlState, STATE, COLLECTED)):
            topic = self._remote.name(own)
            self._received[topic] = []
            node.create_subscription(kind, topic, partial(self._keep, topic), profile)
        node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, COLLECTED)

    def _keep(self, topic: str, message: Any) -> None:
        self._received[topic].append((self._remote.node.get_clock().now().nanoseconds / NANOSECONDS, message))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        prefix = self._remote.name("").strip("/")
        for status in message.status:
            name = status.name.removeprefix(f"{prefix}/" if prefix else "").strip("/")
            if name == "mavlink: failsafes":
                self._failsafes = {pair.key: pair.value for pair in status.values}
            if name in (*NODES, *WATCHERS):
                self._statuses[name] = status.level, status.message

    def listen(self, limit: float) -> None:
        """Collect messages for a time, s."""
        self._remote.until(lambda: False, limit)

    @property
    def units(self) -> tuple[str, str]:
        """The units of a pulse: velocities where a stack has loops of its own for them, else a wrench."""
        return ("m/s", "rad/s") if self._by_velocity else ("N", "N·m")

    @property
    def _by_velocity(self) -> bool:
        return "drive" in self._values and self._values["drive"]["form"] == "cmd_vel"

    def pulse(self, ahead: float, turn: float) -> None:
        """Command a pulse of force, then one of moment, and then nothing, so that the time-out of the drives is tried as well.

        Where the drive commands velocities, they are pulsed on its topic, which it leaves to others while nothing is commanded
        to it, and zero is commanded before and after each. `ahead`: surge force, N, or surge speed, m/s. `turn`: yaw moment,
        N·m, or yaw rate, rad/s.
        """
        roles = {role.name: role for role in self.connection().roles}
        role = roles["output" if self._by_velocity else "command"]
        self._refuse_others(roles)
        if self._by_velocity:
            self._refuse_above(ahead, turn)
        publisher = self._remote.node.create_publisher(message_class(role.kinds[0]), role.topic, qos.STREAM)
        send = self._sender(publisher, role)
        try:
            if not self._remote.until(publisher.get_subscription_count, GRAPH_LIMIT):
                raise RunError(f"--pulse: no node reads {role.topic}")
            for command, limit in (((ahead, 0.0), PULSE), ((0.0, 0.0), PAUSE), ((0.0, turn), PULSE)):
                self._command(send, command, limit)
            if self._by_velocity:  # the stack has a time-out of its own, which may be long
                self._command(send, (0.0, 0.0), PAUSE)
            self.listen(PULSE + PAUSE)
        finally:
            for _ in range(LAST_COMMANDS if self._by_velocity else 0):  # also where a person ends it
                send((0.0, 0.0))
            self._remote.node.destroy_publisher(publisher)

    def _refuse_others(self, roles: dict[str, Role]) -> None:
        """Raise an error where another node could command while a pulse does."""
        drive = self._remote.name("drive")
        for topic in {roles["command"].topic, roles["output" if self._by_velocity else "command"].topic}:
            infos = self._remote.node.get_publishers_info_by_topic(topic)
            names = [f"{info.node_namespace.rstrip('/')}/{info.node_name}" for info in infos]
            if others := [name.rpartition("/")[2] for name in names if name != drive]:
                raise RunError(f"--pulse is not possible while {', '.join(others)} publishes {topic}: end it first")

    def _refuse_above(self, ahead: float, turn: float) -> None:
        """Raise an error where a velocity is above the limit of the drive."""
        limits = ("surge_speed_limit", "yaw_rate_limit")
        for value, name, unit in zip((ahead, turn), limits, self.units, strict=True):
            if abs(value) > float(self._values["drive"][name]):
                limit = f"drive.{name} = {self._values['drive'][name]:g}"
                raise RunError(f"--pulse must be at most {limit} {unit} with drive.form = cmd_vel (got {value:g} {unit})")

    def _sender(self, publisher: Any, role: Role) -> Callable[[tuple[float, float]], None]:
        """What publishes a command as a message of the topic's type."""
        frame = str(self._values["drive" if self._by_velocity else "controller"]["frame_prefix"]) + conversions.BODY

        def send(command: tuple[float, float]) -> None:
            stamp = self._remote.node.get_clock().now().to_msg()
            if self._by_velocity:
                message = conversions.velocity_command(command, frame, None if role.kinds[0] == types.TWIST else stamp)
            else:
                message = conversions.new_wrench()
                conversions.write_wrench(message, stamp, command)
                message.header.frame_id = frame
            publisher.publish(message)

        return send

    def _command(self, send: Callable[[tuple[float, float]], None], command: tuple[float, float], limit: float) -> None:
        end = time.monotonic() + limit
        while time.monotonic() < end:
            send(command)
            self.listen(1.0 / PULSE_RATE)

    def connection(self) -> Connection:
        """The connection as it has been observed so far."""
        topics = {name: self._topic(name) for name, _ in self._remote.node.get_topic_names_and_types()}
        made = connection_of(
            self._values,
            self._names,
            topics=topics,
            simulated=self._simulated,
            **exercised(topics),
            autopilot=autopilot_of(self._connecting, self._failsafes),
            statuses=self._problems(),
        )
        # Before the controller is started, such as for a pulse, nothing needs a reference.
        needed = tuple(role for role in made.roles if role.name != "reference" or "controller" in self._running)
        return made._replace(roles=needed)

    def _problems(self) -> dict[str, tuple[str, str]]:
        """Level and text of what the nodes report; in standby, or without a controller, no command is as it must be."""
        levels = {DiagnosticStatus.WARN: "warning", DiagnosticStatus.ERROR: "error"}
        states = self._received.get(self._remote.name(STATE))
        waits = not states or states[-1][1].operation == ControlState.STANDBY
        found = {name: (levels[level], text) for name, (level, text) in self._statuses.items() if level in levels}
        return {name: (level, text) for name, (level, text) in found.items() if not (waits and NO_COMMAND in text)}

    def _topic(self, name: str) -> Topic:
        node, received = self._remote.node, self._received.get(name, [])
        publishers = _endpoints(node.get_publishers_info_by_topic(name))
        readers = _endpoints(node.get_subscriptions_info_by_topic(name))
        messages = [message for _, message in received]
        times = np.array([moment for moment, _ in received])
        columns = columns_of_messages(type_name(type(messages[0])), messages) if messages else {}
        return Topic(name, publishers, readers, times, columns)


def _endpoints(infos: Iterable[Any]) -> tuple[Endpoint, ...]:
    """Publishers or subscriptions, without those of hidden nodes, such as that of this command."""
    return tuple(
        Endpoint(
            info.node_name,
            info.topic_type,
            info.qos_profile.reliability is ReliabilityPolicy.RELIABLE,
            info.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL,
        )
        for info in infos
        if not info.node_name.startswith("_")
    )
