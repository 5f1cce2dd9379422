"""What a fault script adds to a run in real time: second publishers, and clocks that are off."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Float64

from vessel_hsmc_ros.core.node_list import RECORDER, taking_part
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.faults.fault import THRUSTERS, WRENCH, Fault, FaultScript
from vessel_hsmc_ros.messages import conversions, raw
from vessel_hsmc_ros.messages.topics import RELAYED, message_type
from vessel_hsmc_ros.nodes import qos

if TYPE_CHECKING:
    from rclpy.publisher import Publisher

PUBLISHER_PERIOD = NANOSECONDS // 20  # time between two messages of a second publisher, ns
CLOCK_PERIOD = NANOSECONDS // 200  # time between two messages of a clock, ns
_LATCHED = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=10,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)


class Source(Protocol):
    """Something that publishes on its own."""

    def act(self, now: int, elapsed: int) -> None:
        """Publish what is due.

        `now`: the present time, ns. `elapsed`: the time since the first odometry, ns; below 0 before it.
        """


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
    """The second publishers and the clocks of a script.

    `relay`: the relay node, which publishes in their place. `by_thrusters`: whether thrusters drive the ship.
    """
    second = [fault for fault in script.faults if fault.kind in ("second_publisher", "mismatched_qos")]
    publishers = [SecondPublisher(relay, fault, f"second_publisher_{index}") for index, fault in enumerate(second)]
    return [*publishers, *(SteppedClock(relay, node, faults) for node, faults in stepped_nodes(script, by_thrusters).items())]
