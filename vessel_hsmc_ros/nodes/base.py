"""Base class of the nodes: declared parameters and their changes, start-up handshake, diagnostics, orderly start and shutdown."""

import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.service import Service

from vessel_hsmc_ros.core.exceptions import BackpressureError, ParameterError, SimulationError
from vessel_hsmc_ros.messages.codec import decoder, encoder
from vessel_hsmc_ros.nodes.black_box import BlackBox
from vessel_hsmc_ros.nodes.connections import Awaited, Connections, Publishers
from vessel_hsmc_ros.nodes.executor import DirectExecutor, PromptExecutor
from vessel_hsmc_ros.nodes.node_parameters import declare, requested_changes, take_changes, take_given
from vessel_hsmc_ros.nodes.qos import Compatibility
from vessel_hsmc_ros.nodes.rclpy_parts import RCLError, RMWError, publish
from vessel_hsmc_ros.nodes.reporting import ERROR, OK, WARN, DiagnosticTask, RecentProblem, Reporter, summarised
from vessel_hsmc_ros.nodes.scheduling import claim
from vessel_hsmc_ros.scenario.parameter_groups import RealTimeParameters
from vessel_hsmc_ros.scenario.parameters_file import missed_sections

if TYPE_CHECKING:
    from rclpy.subscription import Subscription


SEND_LIMIT = 2.0  # longest wait for a subscriber whose queue is full, s
__all__ = ["ERROR", "OK", "WARN", "WATCHER_NICENESS", "DiagnosticTask", "VesselNode"]

LEVEL_PERIOD = 0.1
"""Longest delay of the diagnostics after the level of a task has changed, s; without a change they come every second."""

WARNING_PERIOD = 5.0  # least time between two warnings of the same missing connection, s
WATCHER_NICENESS = 10  # niceness of the nodes that only observe a run: the control loop has priority where cores are scarce
LAST_COMMANDS = 3
"""How often a node sends zero before it leaves the actuators to others, as in standby and at its end: a message may be lost."""

ACKNOWLEDGE_LIMITS = {"lockstep": 1.0, "real time": 0.2}
"""Longest wait, on shutdown, for subscribers to acknowledge what was published, s. With the default profile of Fast DDS they
do so only every 3 s."""


class Whole(type):
    """Makes a node whole or not at all: one that cannot start leaves the ROS graph at once, not when it is collected."""

    def __call__(cls, *arguments: Any, **options: Any) -> Any:
        node = cls.__new__(cls)  # type: ignore[call-overload]
        try:
            node.__init__(*arguments, **options)  # type: ignore[misc]
        except BaseException:
            with suppress(AttributeError):  # of parts that it does not have yet
                node.destroy_node()
            raise
        return node


class VesselNode(Node, metaclass=Whole):
    """Base of the package's nodes.

    INTERFACE and OPTIONS are shown by `--help`: topics and services under names relative to the namespace, with ~ for the node's
    own, and options of its own. Each row of INTERFACE lists names with commas; what is in parentheses is a remark, `<topics>` are
    those of the parameter. The SROS2 policy is made of it (tools/docs/policy.py).

    A subclass defines NAME and PARAMETERS, publishes through `advertise`, subscribes through `listen`, and starts its work in
    `on_connected`. REAL_TIME says what works in real time only, of a node that is not for lockstep. In lockstep, `stamp` is the
    simulated time of its latest step, ns, with which diagnostics are stamped. `command_line`: that of the node's process; its
    rules give the parameters. `options`: of rclpy's node.

    Raises:
        ParameterError: a parameter is unknown or out of range.
    """

    NAME: ClassVar[str]
    INTERFACE: ClassVar[str]
    OPTIONS: ClassVar[str] = ""
    PARAMETERS: type
    POLL_PERIOD: ClassVar[float] = 0.0
    NICENESS: ClassVar[int] = 0
    REAL_TIME: ClassVar[str] = ""
    black_box: BlackBox | None = None

    @staticmethod
    def take_options(arguments: Sequence[str]) -> list[str]:
        """Take the options of OPTIONS from the arguments that are not of ROS; returns the others."""
        return list(arguments)

    def __init__(self, command_line: Sequence[str] = (), **options: Any) -> None:
        self.compatibility = Compatibility(self)
        super().__init__(self.NAME, **options)
        self.given = take_given(self, command_line)
        if missed := missed_sections(command_line, self.get_fully_qualified_name()):
            self.get_logger().warning(missed)
        self.missed = missed
        refuse_failed_requests(self, self.services)
        self.parameters: Any = declare(self, self.PARAMETERS)
        if self.REAL_TIME and self.parameters.lockstep:
            raise ParameterError(f"{self.NAME}.lockstep must be false (got true): {self.REAL_TIME} in real time")
        self.compatibility.check()
        self.add_on_set_parameters_callback(partial(take_changes, self))
        self.finished = False
        self.failure = ""
        self.problem = RecentProblem()
        self.stamp = 0
        self.connected = False
        self.connections = Connections(self, self.parameters.recorded)
        self.direct_subscriptions: list[Subscription] = self.connections.subscriptions
        self._topics: dict[str, list[str]] = {"publishes": [], "subscribes to": []}
        self._counted: dict[str, Publishers] = {}
        self._waiting = "waiting for the other nodes"
        # Not the node's clock: on simulated time no timer fires before the first /clock, which may wait for this very node.
        self.wall = Clock(clock_type=ClockType.STEADY_TIME)
        self.reporter = Reporter(self, lambda: self.stamp if self.parameters.lockstep else self.now(), self.PARAMETERS)
        self.create_timer(1.0, self.publish_diagnostics, clock=self.wall)
        self.create_timer(LEVEL_PERIOD, lambda: self.publish_diagnostics(only_changes=True), clock=self.wall)
        self._connecting = self.create_timer(0.01, self._check_connected, clock=self.wall)

    def create_publisher(self, msg_type: Any, topic: str, qos_profile: Any, **options: Any) -> Publisher:
        """As that of rclpy; readers that cannot be connected are reported, and a user may override the quality of service."""
        return super().create_publisher(
            msg_type, topic, **{**self.compatibility.options(topic, "publisher", qos_profile), **options}
        )

    def create_subscription(self, msg_type: Any, topic: str, callback: Any, qos_profile: Any, **options: Any) -> "Subscription":
        """As `create_publisher`, for a subscription."""
        own = self.compatibility.options(topic, "subscription", qos_profile)
        return super().create_subscription(msg_type, topic, callback, **{**own, **options})

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """As that of rclpy, which the services call; numbers may be written as `ros2 param` writes them."""
        try:
            changes = requested_changes(self, parameter_list)
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return super().set_parameters_atomically(changes) if changes else SetParametersResult(successful=True)

    # -- for subclasses -----------------------------------------------------------------------------------------------

    def advertise(self, kind: Any, topic: str, profile: QoSProfile, partner: str | tuple[str, ...] = ()) -> Publisher:
        """Create a publisher; the node starts its work only when the subscribers of the topic are connected.

        In lockstep, one of them must belong to a node that publishes the topic `partner`, such as the controller for the plant.
        Further subscribers receive every message too, but do not start the node. `topic`: name relative to the node's
        namespace. `partner`: a topic that the node of one of the subscribers must publish, or several of which it must publish
        one; empty if any subscriber is sufficient.
        """
        publisher = self.create_publisher(kind, topic, profile)
        partners = (partner,) if isinstance(partner, str) else partner
        self.connections.add_publisher(publisher, *partners if self.parameters.lockstep else ())
        self._topics["publishes"].append(publisher.topic_name)
        return publisher

    def listen(self, kind: Any, topic: str, callback: Callable[[Any], None], profile: QoSProfile, raw: bool = False) -> None:
        """Subscribe to a topic whose messages drive the node.

        In lockstep the subscription is created only when the topic has a publisher. It is then connected as soon as the
        publisher discovers it, so that a publisher that waits for its subscribers loses no message to one that is half
        connected. `topic`: name relative to the node's namespace. `raw`: whether the callback takes serialised messages.
        """
        name = self.resolve_topic_name(topic)
        damaged = partial(self.refuse, f"a message of {name} cannot be read: ignored")
        taking = callback if raw else decoded(kind, callback, damaged)
        if self.parameters.lockstep:
            self.connections.add_subscription(Awaited(kind, topic, taking, profile, raw=True))
        else:
            kept = self.black_box.receiver(name, kind, taking) if self.black_box else taking
            self.create_subscription(kind, topic, kept, profile, raw=True)
            self.sources(kind, topic)
        self._topics["subscribes to"].append(name)

    def sources(self, kind: Any, topic: str) -> Publishers:
        """What counts the publishers of a topic of which one may live; while there are more, the diagnostics warn."""
        return self._counted.setdefault(topic, Publishers(self, kind, topic))

    def framed(self, message: Any) -> Any:
        """Prefix the frame ids of a message with the parameter `frame_prefix`, in place; returns the message."""
        message.header.frame_id = self.parameters.frame_prefix + message.header.frame_id
        if hasattr(message, "child_frame_id"):
            message.child_frame_id = self.parameters.frame_prefix + message.child_frame_id
        return message

    def refuse(self, text: str) -> None:
        """Report a problem, on the log and for a while as `problem`."""
        self.problem.report(ERROR, text)
        self.get_logger().error(text, throttle_duration_sec=WARNING_PERIOD)

    def now(self) -> int:
        """ROS time, ns."""
        return int(self.get_clock().now().nanoseconds)

    def send(self, publisher: Publisher, message: Any) -> None:
        """Publish a message; in lockstep, where none may be lost, wait for a slow subscriber.

        Raises BackpressureError if the queue of a subscriber was full for longer than SEND_LIMIT.
        """
        # A reliable publisher that keeps all messages refuses one while a queue is full: DDS blocks for a while, then it fails.
        data, deadline = message if isinstance(message, bytes) else serialized(message), 0.0
        while True:
            try:
                publish(publisher, data)
            except RCLError:
                deadline = deadline or time.monotonic() + SEND_LIMIT
                if time.monotonic() > deadline:
                    raise BackpressureError(
                        f"a reader of {publisher.topic_name} has not kept up for {SEND_LIMIT:g} s: is it alive?"
                    ) from None
            else:
                break
        if self.black_box:
            self.black_box.keep(publisher.topic_name, publisher.msg_type, data)

    def describe(self) -> str:
        """The node's task and its main parameters, for the line that it logs at its start; empty by default."""
        return ""

    def on_own_process(self) -> None:
        """Hook, called once if the node runs in a process of its own."""

    def on_connected(self) -> None:
        """Hook, called once when all publishers and subscribers that the node waits for are connected."""

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """Level, message and values for /diagnostics, once the node is connected."""
        return OK, "running", {}

    def diagnostic_tasks(self) -> list[DiagnosticTask]:
        """The node's diagnostic tasks for /diagnostics, once it is connected; the first, without a name, is its `status`."""
        return [DiagnosticTask("", *self.status())]

    def retune(self, parameters: Any) -> None:
        """Apply changed tunable parameters.

        `parameters`: an instance of PARAMETERS with the new values, each within its range. Raises ParameterError if the
        combination is not allowed; the node then keeps its present parameters.
        """

    def close(self) -> None:
        """Publish the final status while the context is valid, and wait until the subscribers have acknowledged all messages."""
        self.publish_diagnostics()
        deadline = time.monotonic() + ACKNOWLEDGE_LIMITS["lockstep" if self.parameters.lockstep else "real time"]
        for publisher in self.publishers:
            if publisher.get_subscription_count():
                publisher.wait_for_all_acked(Duration(seconds=max(0.0, deadline - time.monotonic())))
        if self.black_box:
            self.black_box.close()

    # -- life cycle ---------------------------------------------------------------------------------------------------

    def announce(self) -> None:
        """Log what the node does, in which mode and on which topics."""
        mode = "lockstep" if self.parameters.lockstep else "real time"
        if self.get_parameter("use_sim_time").value and not self.parameters.lockstep:
            mode = "real time on the simulated time of /clock"
        topics = [f"{verb} {', '.join(names)}" for verb, names in self._topics.items() if names]
        self.get_logger().info("; ".join(part for part in (self.describe(), mode, *topics) if part))
        if unused := self.compatibility.unused():
            self.get_logger().warning(f"{unused}: the node has no such publisher or subscription")

    def claim_real_time(self) -> None:
        """Ask for the real-time options that are on; log what was granted, and what was refused and what to do."""
        if not self.parameters.lockstep and self.parameters.real_time != RealTimeParameters():
            outcome = claim(self.parameters.real_time)
            log = self.get_logger()
            (log.warning if outcome.refused else log.info)(str(outcome))

    def spin(self, running: Callable[[], bool]) -> None:
        """Serve callbacks until the node has finished or `running` returns False."""
        polls = self.parameters.lockstep or self.POLL_PERIOD
        with (
            DirectExecutor(self.direct_subscriptions, self.POLL_PERIOD, self.context) if polls else PromptExecutor(self.context)
        ) as executor:
            executor.add_node(self)
            executor.spin_while(lambda: running() and not self.finished)

    def fail(self, reason: str) -> None:
        """Log the failure that ends the node as FATAL, for /rosout and the bag, and store it for the final status."""
        self.failure = reason
        self.get_logger().fatal(reason)
        if self.black_box:
            self.black_box.write(reason, ends=True)

    def publish_diagnostics(self, only_changes: bool = False) -> None:
        """Publish the status of node and diagnostic tasks; with `only_changes`, if the level of one of them has changed."""
        own, *others = self.diagnostic_tasks()
        others = others if self.connected else []
        whole = self._overall(summarised(own, others))
        self.reporter.diagnose([whole, *others], only_changes)
        if self.black_box and whole.level == ERROR:
            self.black_box.write(whole.message)

    def _overall(self, own: DiagnosticTask) -> DiagnosticTask:
        """The most important of: failure, missing connection, conflicting publisher, and the status of the node's own work."""
        if self.failure:
            return own._replace(level=ERROR, message=self.failure)
        if not self.connected:
            return own._replace(level=WARN, message="; ".join(filter(None, (self._waiting, self.compatibility.problem()))))
        sources = () if self.parameters.lockstep else self._counted.values()
        conflicts = (self.connections.conflict(), *(source.conflict() for source in sources))
        if own.level == OK and (conflict := next(filter(None, conflicts), "")):
            self.get_logger().warning(conflict, throttle_duration_sec=WARNING_PERIOD)
            return own._replace(level=WARN, message=conflict)
        if incompatible := self.compatibility.problem():
            message = incompatible if own.level == OK else f"{own.message}; {incompatible}"
            return own._replace(level=max(own.level, WARN), message=message)
        return own

    def _check_connected(self) -> None:
        # A second run must not disturb the first: the later node fails, one that is already connected only warns.
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


def serialized(message: Any) -> bytes:
    """A message in its serialised form, faster than by rclpy where its type allows it."""
    encode = encoder(message.__class__)
    return encode(message) if encode else bytes(serialize_message(message))


UNREADABLE = RMWError, ValueError
"""What a damaged message raises; the latter also for a text that is not of UTF-8."""


def decoded(kind: Any, callback: Callable[[Any], None], refuse: Callable[[], None]) -> Callable[[bytes], None]:
    """The callback of a raw subscription that passes on each message, faster than rclpy where the type allows it.

    `refuse`: called instead for one that is damaged.
    """
    decode = decoder(kind)

    def take(data: bytes) -> None:
        try:
            message = decode(data) if decode else deserialize_message(data, kind)
        except UNREADABLE:
            try:
                message = deserialize_message(data, kind)  # it may be whole, in a form that is rare
            except UNREADABLE:
                refuse()
                return
        callback(message)

    return take


def refuse_failed_requests(node: Node, services: Iterable[Service]) -> None:
    """Answer a request with which the code of a service fails by its empty response and a line on the log.

    rclpy raises for a transition that the present state does not have, and for a parameter of an unknown type: whoever
    requested that would end the node.
    """
    for service in services:
        service.callback = partial(_answer, node, service.srv_name, service.callback)


def _answer(node: Node, name: str, serve: Callable[[Any, Any], Any], request: Any, response: Any) -> Any:
    try:
        return serve(request, response)
    except Exception as error:
        text = str(error).splitlines()
        node.get_logger().error(f"a request to {name} is refused: {type(error).__name__}: {text[0] if text else ''}")
        return response
