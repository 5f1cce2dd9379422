"""What all nodes share: declared parameters, the start-up handshake, diagnostics, and an orderly start and end."""

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import BackpressureError, ParameterError, SimulationError
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.connections import Awaited, Connections
from vessel_hsmc_ros.nodes.executor import DirectExecutor
from vessel_hsmc_ros.nodes.ros_parameters import declare

if TYPE_CHECKING:
    from rclpy.subscription import Subscription

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR

SEND_LIMIT = 2.0
"""Longest wait for a reader whose queue is full, s."""

WARNING_PERIOD = 5.0
"""Least time between two log lines about the same thing that is waited for, s."""

WATCHER_NICENESS = 10
"""Of nodes that only watch: the run itself goes first where cores are scarce."""

ACKNOWLEDGE_LIMIT = 1.0
"""Longest wait, at the end, for readers to acknowledge what was published, s."""


class VesselNode(Node):
    """Base of the package's nodes.

    A subclass names its node and its parameters, publishes through `advertise`, subscribes through `listen`, and starts its work
    in `on_connected`. In lockstep it keeps in `stamp` the time it has come to, ns.

    Raises:
        ParameterError: a parameter is unknown or out of range.
    """

    NAME: ClassVar[str]
    PARAMETERS: ClassVar[type]
    POLL_PERIOD: ClassVar[float] = 0.0

    def __init__(self, **options: Any) -> None:
        super().__init__(self.NAME, **options)
        self.parameters: Any = declare(self, self.PARAMETERS)
        self.add_on_set_parameters_callback(self._on_set_parameters)
        self.finished = False
        self.failure = ""
        self.stamp = 0
        self.connected = False
        self.connections = Connections(self, self.parameters.recorded)
        self.direct_subscriptions: list[Subscription] = self.connections.subscriptions
        self._topics: dict[str, list[str]] = {"publishes": [], "subscribes to": []}
        self._waiting = "waiting for the other nodes"
        self._wall = Clock(clock_type=ClockType.STEADY_TIME)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
        self.create_timer(1.0, self.publish_diagnostics, clock=self._wall)
        self._connecting = self.create_timer(0.02, self._check_connected, clock=self._wall)

    # -- for subclasses -----------------------------------------------------------------------------------------------

    def advertise(self, kind: Any, topic: str, profile: QoSProfile, partner: str = "") -> Publisher:
        """Make a publisher whose readers are waited for before work starts.

        In lockstep a node that publishes the topic `partner` must be among them. Any other reader is welcome from the start, but
        is no reason to begin.

        Args:
            kind: Message class.
            topic: Name relative to the node's namespace.
            profile: Quality of service.
            partner: A topic that one of the readers must publish; empty where any reader will do.
        """
        publisher = self.create_publisher(kind, topic, profile)
        self.connections.add_publisher(publisher, partner if self.parameters.lockstep else "")
        self._topics["publishes"].append(publisher.topic_name)
        return publisher

    def listen(self, kind: Any, topic: str, callback: Callable[[Any], None], profile: QoSProfile) -> None:
        """Subscribe to a topic that sets this node's pace.

        In lockstep only once its publisher is known: the reader is then connected before the writer hears of it, so that a writer
        which waits for its readers loses nothing to one that is half connected.

        Args:
            kind: Message class.
            topic: Name relative to the node's namespace.
            callback: Takes each message.
            profile: Quality of service.
        """
        if self.parameters.lockstep:
            self.connections.add_subscription(Awaited(kind, topic, callback, profile))
        else:
            self.create_subscription(kind, topic, callback, profile)
        self._topics["subscribes to"].append(self.resolve_topic_name(topic))

    def framed(self, message: Any) -> Any:
        """The message with the vessel's prefix before the names of its frames."""
        message.header.frame_id = self.parameters.frame_prefix + message.header.frame_id
        if hasattr(message, "child_frame_id"):
            message.child_frame_id = self.parameters.frame_prefix + message.child_frame_id
        return message

    def now(self) -> int:
        """ROS time, ns."""
        return int(self.get_clock().now().nanoseconds)

    def send(self, publisher: Publisher, message: Any) -> None:
        """Publish; where nothing may be lost, wait for a slow reader.

        Raises:
            BackpressureError: a reader has not kept up for SEND_LIMIT.
        """
        deadline = time.monotonic() + SEND_LIMIT
        while True:
            try:
                publisher.publish(message)
            except rclpy_implementation.RCLError:
                if time.monotonic() > deadline:
                    raise BackpressureError(
                        f"a reader of {publisher.topic_name} has not kept up for {SEND_LIMIT:g} s: is it alive?"
                    ) from None
            else:
                return

    def describe(self) -> str:
        """What the node does with its parameters, for the line that it logs at its start."""
        return ""

    def on_own_process(self) -> None:
        """Called once, where the node has a process of its own."""

    def on_connected(self) -> None:
        """Called once, when every awaited reader and writer is connected."""

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """Level, message and values for /diagnostics, once the node is connected."""
        return OK, "running", {}

    def retune(self, parameters: Any) -> None:
        """Take changed tunable parameters; raise ParameterError to refuse them."""

    def close(self) -> None:
        """Publish the final status, the context still alive, and wait until every reader has everything."""
        self.publish_diagnostics()
        deadline = time.monotonic() + ACKNOWLEDGE_LIMIT
        for publisher in self.publishers:
            if publisher.get_subscription_count():
                publisher.wait_for_all_acked(Duration(seconds=max(0.0, deadline - time.monotonic())))

    # -- from start to end --------------------------------------------------------------------------------------------

    def announce(self) -> None:
        """Log what the node does, in which mode and on which topics."""
        mode = "lockstep" if self.parameters.lockstep else "real time"
        if self.get_parameter("use_sim_time").value and not self.parameters.lockstep:
            mode = "real time on the simulated time of /clock"
        topics = [f"{verb} {', '.join(names)}" for verb, names in self._topics.items() if names]
        self.get_logger().info("; ".join(part for part in (self.describe(), mode, *topics) if part))

    def spin(self, running: Callable[[], bool]) -> None:
        """Serve callbacks until the node has finished or `running` returns False."""
        if self.parameters.lockstep or self.POLL_PERIOD:
            with DirectExecutor(self.direct_subscriptions, self.POLL_PERIOD, self.context) as direct:
                direct.add_node(self)
                direct.spin_while(lambda: running() and not self.finished)
            return
        with SingleThreadedExecutor(context=self.context) as executor:
            executor.add_node(self)
            while running() and not self.finished:
                executor.spin_once(timeout_sec=0.1)

    def fail(self, reason: str) -> None:
        """Log why the node ends, so that /rosout and a bag have it, and keep it for the final status."""
        self.failure = reason
        self.get_logger().fatal(reason)

    def publish_diagnostics(self) -> None:
        """Publish the node's status."""
        level, message, values = self._overall_status()
        array = DiagnosticArray()
        stamp = self.stamp if self.parameters.lockstep else self.now()
        array.header.stamp = conversions.time_message(stamp)
        pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        name = self.get_fully_qualified_name().lstrip("/")
        array.status = [DiagnosticStatus(level=level, name=name, message=message, hardware_id="", values=pairs)]
        self._diagnostics.publish(array)

    def _overall_status(self) -> tuple[bytes, str, dict[str, Any]]:
        """What comes before the status of the node's own work: its failure, what it waits for, a second publisher."""
        level, message, values = self.status()
        if self.failure:
            return ERROR, self.failure, values
        if not self.connected:
            return WARN, self._waiting, values
        if level == OK and (conflict := self.connections.conflict()):
            self.get_logger().warning(conflict, throttle_duration_sec=WARNING_PERIOD)
            return WARN, conflict, values
        return level, message, values

    def _check_connected(self) -> None:
        # A second run must not disturb the first: the later node refuses, and one that is connected already goes on.
        if conflict := self.connections.conflict():
            raise SimulationError(conflict)
        if missing := self.connections.missing():
            self._waiting = f"waiting for {', '.join(missing)}"
            self.get_logger().warning(self._waiting, throttle_duration_sec=WARNING_PERIOD, skip_first=True)
            return
        self.connected = True
        self.destroy_timer(self._connecting)
        self.publish_diagnostics()
        self.on_connected()

    def _on_set_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        known = schema.entries(self.PARAMETERS)
        values = {p.name: p.value for p in changes if p.name in known}
        if not values:
            return SetParametersResult(successful=True)
        try:
            parameters: Any = schema.build(self.PARAMETERS, schema.flatten(self.parameters) | values, self.get_name())
            self.retune(parameters)
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        self.parameters = parameters
        return SetParametersResult(successful=True)
