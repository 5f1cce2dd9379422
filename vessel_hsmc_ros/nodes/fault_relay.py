"""The relay node: passes the messages of a loop on, and carries out the faults of a script on their way.

In real time it also adds second publishers, and clocks that are off.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Float64
from vessel_hsmc_msgs.msg import Event

from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.core.node_list import RECORDER, RELAY, taking_part
from vessel_hsmc_ros.core.timing import NANOSECONDS, RateGrid, seconds
from vessel_hsmc_ros.faults import THRUSTERS, WRENCH, Delivery, Fault, FaultScript, TopicSchedule
from vessel_hsmc_ros.messages import conversions, raw
from vessel_hsmc_ros.messages.raw import edit
from vessel_hsmc_ros.messages.topics import EVENTS, RELAYED, message_type
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import OK, VesselNode
from vessel_hsmc_ros.nodes.executor import DirectExecutor
from vessel_hsmc_ros.scenario.fault_script import parse_script
from vessel_hsmc_ros.scenario.parameter_groups import FaultRelayParameters

if TYPE_CHECKING:
    from rclpy.publisher import Publisher


PUBLISHER_PERIOD = NANOSECONDS // 20  # time between two messages of a second publisher, ns
CLOCK_PERIOD = NANOSECONDS // 200  # time between two messages of a clock, ns
_LATCHED = qos.profile(10, latched=True)


class Source(Protocol):
    """Something that publishes on its own."""

    def act(self, now: int, elapsed: int) -> None:
        """Publish what is due."""


class SecondPublisher:
    """A second publisher of a topic, or an incompatible reader, of a node of its own; it exists while its fault is active.

    The publisher publishes where the receivers subscribe, below `relayed/`, and shows itself to the rightful publisher by a
    publisher of the original topic on which it is silent. `fault`: of kind second_publisher or mismatched_qos.
    """

    def __init__(self, relay: Node, fault: Fault, name: str) -> None:
        self._relay, self._fault, self._name = relay, fault, name
        self._node: Any = None
        self._talk: Publisher | None = None
        self._next = 0

    def act(self, now: int, elapsed: int) -> None:
        """Appear, publish, disappear."""
        active = self._fault.active(elapsed)
        if active and self._node is None:
            self._appear()
        elif not active and self._node is not None:
            self._node.destroy_node()
            self._node = None
        if active and self._talk is not None and now >= self._next:
            self._next = now + PUBLISHER_PERIOD
            self._talk.publish(self._message(now))

    def _appear(self) -> None:
        node = Node(self._name, namespace=self._relay.get_namespace(), context=self._relay.context, use_global_arguments=False)
        kind = raw.message_class(message_type(self._fault.topic))
        if self._fault.kind == "mismatched_qos":
            node.create_subscription(kind, self._fault.topic, lambda _: None, _LATCHED)
        else:
            profile = qos.data(lockstep=False)
            self._talk = node.create_publisher(kind, f"{RELAYED}{self._fault.topic}", profile)
            node.create_publisher(kind, self._fault.topic, profile)
        self._node = node

    def _message(self, now: int) -> Any:
        if self._fault.topic.startswith(THRUSTERS):
            return Float64(data=self._fault.amount)
        stamp = conversions.time_message(now)
        if self._fault.topic == WRENCH:
            message = conversions.new_wrench()
            conversions.write_wrench(message, stamp, (self._fault.amount, 0.0))
            return message
        made = {"odom": conversions.new_odometry, "reference": conversions.new_reference}
        message = made[self._fault.topic]()
        message.header.stamp = stamp
        return message


class SteppedClock:
    """The clock of a node, on `relayed/clock/<node>`: the system's, and off by the offset of its faults while they are active.

    `faults`: of kind clock_step.
    """

    def __init__(self, relay: Node, node: str, faults: Sequence[Fault]) -> None:
        self._faults = faults
        self._out = relay.create_publisher(Clock, clock_topic(node), qos.CLOCK)
        self._next = 0

    def act(self, now: int, elapsed: int) -> None:
        """Publish the time."""
        if now >= self._next:
            self._next = now + CLOCK_PERIOD
            offset = sum(round(f.offset * NANOSECONDS) for f in self._faults if f.active(elapsed))
            self._out.publish(Clock(clock=conversions.time_message(now + offset)))


def clock_topic(node: str) -> str:
    """The topic on which the relay publishes the time for a node whose clock a script steps."""
    return f"{RELAYED}clock/{node}"


def stepped_nodes(script: FaultScript, by_thrusters: bool) -> dict[str, list[Fault]]:
    """The nodes whose clocks a script steps, each with its faults; the recorder keeps the time of the system."""
    steps = [fault for fault in script.faults if fault.kind == "clock_step"]
    nodes = [node for node in taking_part(by_thrusters) if node != RECORDER]
    found = {node: [fault for fault in steps if fault.node in ("", node)] for node in nodes}
    return {node: faults for node, faults in found.items() if faults}


def make_sources(relay: Node, script: FaultScript, by_thrusters: bool) -> list[Source]:
    """The second publishers and the clocks of a script."""
    second = [fault for fault in script.faults if fault.kind in ("second_publisher", "mismatched_qos")]
    publishers = [SecondPublisher(relay, fault, f"second_publisher_{index}") for index, fault in enumerate(second)]
    return [*publishers, *(SteppedClock(relay, node, faults) for node, faults in stepped_nodes(script, by_thrusters).items())]


_NAN = (math.nan,) * 6


class RelayedTopic:
    """A topic that passes through the relay.

    `topic`: its name, without the namespace. `kind`: the message class. `stamped`: whether its messages have a header.
    `schedule`: its faults. `sent`: number of messages passed on.
    """

    out: "Publisher"

    def __init__(self, script: FaultScript, topic: str) -> None:
        self.topic = topic
        self.kind = raw.message_class(message_type(topic))
        self.stamped = raw.begins_with_stamp(self.kind)
        self.schedule = TopicSchedule(script, topic)
        self.sent = 0

    def stamp(self, data: bytes) -> int:
        """The stamp of a serialised message, ns; 0 where it has none."""
        return raw.stamp(data) if self.stamped else 0

    def altered(self, delivery: Delivery) -> bytes:
        """The serialised message of a delivery; without a fault, that which was received."""
        data: bytes = delivery.message
        if self.stamped and delivery.stamp != raw.stamp(data):
            data = raw.with_stamp(data, delivery.stamp)
        if delivery.edits:
            message = deserialize_message(data, self.kind)
            for change in delivery.edits:
                edit(message, *change)
            data = serialize_message(message)
        return data

    def nothing(self, step: int) -> Any:
        """The announcement that there is nothing of this topic in a step, ns: no frame, and NaN everywhere."""
        if not self.stamped:
            return Float64(data=math.nan)
        message, stamp = self.kind(), conversions.time_message(step)
        if self.topic == "odom":
            conversions.write_odometry(message, stamp, Motion(*_NAN))
        elif self.topic == "reference":
            conversions.write_reference(message, stamp, np.array(_NAN), np.array(_NAN[:3]))
        else:
            conversions.write_wrench(message, stamp, _NAN[:2])
        return message


POLL_PERIOD = 0.001
"""Real time: time between two searches for messages, for delayed ones that are due, and for faults that begin or end, s."""

TIMER_PERIOD = 0.02  # the same where another executor serves the node, s


class FaultRelayNode(VesselNode):
    """Publishes each message of its topics on `relayed/<topic>`, as the faults of the script leave it.

    Without an active fault the serialised message is passed on unchanged. Lockstep: whatever a fault drops, delays or gives
    another stamp, the receiver learns that there is nothing more for the step, from a message with the stamp of the step, without
    a frame and with NaN; so that every step is answered, and two runs are alike. An event names each fault as it begins and ends.
    """

    NAME = RELAY
    INTERFACE = """
        subscribes to  <topics> (of the parameter topics), thrusters/<name>/thrust
        publishes      relayed/<topic> (each of them), events
    """
    PARAMETERS = FaultRelayParameters

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        p = self.parameters
        self._script = _read(p.script)
        self._grid = RateGrid(p.rate_hz)
        self._start = 0 if p.lockstep else -1
        self._early: list[tuple[str, bytes]] = []
        self._log = self.create_publisher(Event, EVENTS, qos.EVENTS)
        self._ahead = _beginnings_and_ends(self._script)
        self._relayed = {topic: self._relay(topic) for topic in p.topics}
        self._sources = make_sources(self, self._script, any(topic.startswith(THRUSTERS) for topic in p.topics))
        if not p.lockstep:
            self.create_timer(TIMER_PERIOD, self._act, clock=self.wall)

    def _relay(self, topic: str) -> RelayedTopic:
        """Publish a topic below `relayed/` and subscribe to the original."""
        relayed = RelayedTopic(self._script, topic)
        profile = qos.data(self.parameters.lockstep)
        drives_plant = topic == "cmd_wrench" or topic.startswith(THRUSTERS)
        partner = ("odom", "allocated_wrench") if drives_plant else ("cmd_wrench", "allocated_wrench")
        relayed.out = self.advertise(relayed.kind, f"{RELAYED}{topic}", profile, partner=partner)
        receive = partial(self._on_message, topic)
        if self.parameters.lockstep:
            self.listen(relayed.kind, topic, receive, profile, raw=True)
        else:
            self.direct_subscriptions.append(self.create_subscription(relayed.kind, topic, receive, profile, raw=True))
        return relayed

    def describe(self) -> str:
        """The number of faults."""
        return f"relay with {len(self._script.faults)} faults, seed {self._script.seed}"

    def spin(self, running: Callable[[], bool]) -> None:
        """Serve messages, in real time by polling, which adds less than rclpy's own executor to their age."""
        if self.parameters.lockstep:
            super().spin(running)
            return
        with DirectExecutor(self.direct_subscriptions, POLL_PERIOD, self.context) as direct:
            direct.add_node(self)
            direct.spin_while(lambda: self._act() and running())

    def on_connected(self) -> None:
        """Pass on what was received before all receivers were connected."""
        early, self._early = self._early, []
        for topic, data in early:
            self._on_message(topic, data)

    # -- messages -----------------------------------------------------------------------------------------------------

    def _on_message(self, topic: str, data: bytes) -> None:
        if not self.connected:
            self._early.append((topic, data))
            return
        relayed = self._relayed[topic]
        stamp = relayed.stamp(data)
        if self._start < 0 and topic == "odom":
            self._start = stamp
        elapsed = self._elapsed(relayed, stamp)
        if topic == "odom":
            self._report(elapsed)
        if not relayed.stamped:
            stamp = elapsed
        deliveries = relayed.schedule.take(data, stamp, elapsed)
        if self.parameters.lockstep:
            self._answer(relayed, deliveries, stamp, elapsed)
        else:
            self._send(relayed, deliveries)

    def _elapsed(self, relayed: RelayedTopic, stamp: int) -> int:
        """The time by which faults begin and end, ns: in lockstep that of the step, whose number is that of the message."""
        if not self.parameters.lockstep:
            return self.now() - self._start if self._start >= 0 else -1
        # Odometry may be late by its stamp, and demands of thrusters have none; one of each is published in every step.
        counted = relayed.topic == "odom" or not relayed.stamped
        self.stamp = self._grid.stamp(relayed.schedule.number + 1) if counted else stamp
        return self.stamp

    def _answer(self, relayed: RelayedTopic, deliveries: list[Delivery], stamp: int, step: int) -> None:
        """Lockstep: deliver, and announce it if the receiver gets nothing more for this step."""
        if not relayed.stamped:  # a demand of a thruster is known by its place: one a step
            deliveries = deliveries[-1:]
        self._send(relayed, deliveries)
        if not (any(relayed.schedule.current(d, stamp) for d in deliveries) or (deliveries and not relayed.stamped)):
            self.send(relayed.out, relayed.nothing(step))

    def _send(self, relayed: RelayedTopic, deliveries: list[Delivery]) -> None:
        for delivery in deliveries:
            self.send(relayed.out, relayed.altered(delivery))
            relayed.sent += 1

    def _act(self) -> bool:
        """Real time: deliver what is due, and report the faults that begin or end; always true."""
        now = self.now()
        elapsed = now - self._start if self._start >= 0 else -1
        self._report(elapsed)
        for relayed in self._relayed.values():
            self._send(relayed, relayed.schedule.due(elapsed))
        for source in self._sources:
            source.act(now, elapsed)
        return True

    # -- events and diagnostics ---------------------------------------------------------------------------------------

    def _report(self, elapsed: int) -> None:
        """Publish an event for each fault that has begun or ended since the last call, with the time at which it did."""
        while self._ahead and self._ahead[0][0] <= elapsed:
            at, text = self._ahead.pop(0)
            self.get_logger().info(f"fault: {text} at t = {seconds(at):g} s")
            message = Event(node=self.NAME, kind="fault", text=text)
            message.header.stamp = conversions.time_message(self._start + at)
            self._log.publish(message)

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """Messages received and sent by topic, and the events to come."""
        counts = {topic: f"{r.schedule.number + 1} received, {r.sent} sent" for topic, r in self._relayed.items()}
        return OK, "relaying", {**counts, "events_ahead": len(self._ahead)}


def _beginnings_and_ends(script: FaultScript) -> list[tuple[int, str]]:
    """Times, ns, and texts of the events of a script, in their order."""
    found = [(fault.begin, f"{fault.describe()} begins") for fault in script.faults]
    found += [(int(fault.end), f"{fault.describe()} ends") for fault in script.faults if fault.duration]
    return sorted(found, key=lambda event: event[0])


def _read(path: str) -> FaultScript:
    """The script of a file; empty for none. Raises ScenarioError if it cannot be read."""
    if not path:
        return FaultScript()
    try:
        return parse_script(Path(path).read_text(encoding="utf-8"), f"fault script {path}")
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"fault_relay.script = {path} cannot be read: {error}") from None
