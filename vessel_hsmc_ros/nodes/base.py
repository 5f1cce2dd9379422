"""What all nodes share: declared parameters, the wait for their readers, diagnostics, and an orderly start and end."""

import signal
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSCompatibility, QoSProfile, ReliabilityPolicy, qos_check_compatible
from rclpy.signals import SignalHandlerOptions

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import BackpressureError, ParameterError, VesselHsmcError
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.executor import DirectExecutor
from vessel_hsmc_ros.nodes.ros_parameters import declare

if TYPE_CHECKING:
    from rclpy.subscription import Subscription

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR

RECORDER = "recorder"

SEND_LIMIT = 2.0
"""Longest wait for a reader whose queue is full, s."""

WATCHER_NICENESS = 10
"""Of nodes that only watch: the run itself goes first where cores are scarce."""

ACKNOWLEDGE_LIMIT = 1.0
"""Longest wait, at the end, for readers to acknowledge what was published, s."""


class VesselNode(Node):
    """Base of the package's nodes.

    A subclass names its node and its parameters, publishes through `advertise`, and starts its work in `on_connected`.
    In lockstep it keeps in `stamp` the time it has come to, ns.

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
        self.direct_subscriptions: list[Subscription] = []
        self.finished = False
        self.stamp = 0
        self.connected = False
        self._advertised: list[tuple[Publisher, str]] = []
        self._awaited: list[tuple[Any, str, Callable[[Any], None], QoSProfile]] = []
        self._wall = Clock(clock_type=ClockType.STEADY_TIME)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
        self.create_timer(1.0, self.publish_diagnostics, clock=self._wall)
        self._connecting = self.create_timer(0.02, self._check_connected, clock=self._wall)

    # -- for subclasses -----------------------------------------------------------------------------------------------

    def advertise(self, kind: Any, topic: str, profile: QoSProfile, partner: str = "") -> Publisher:
        """A publisher whose readers are waited for before work starts.

        In lockstep the node that publishes the topic `partner` must be among them. Others may read along from the start:
        they are no reason to begin.
        """
        publisher = self.create_publisher(kind, topic, profile)
        self._advertised.append((publisher, partner if self.parameters.lockstep else ""))
        return publisher

    def listen(self, kind: Any, topic: str, callback: Callable[[Any], None], profile: QoSProfile) -> None:
        """Subscribe to a topic that sets this node's pace.

        In lockstep only once its publisher is known: the reader is then connected before the writer hears of it, so that a writer
        which waits for its readers loses nothing to one that is half connected.
        """
        if self.parameters.lockstep:
            self._awaited.append((kind, topic, callback, profile))
        else:
            self.create_subscription(kind, topic, callback, profile)

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

    def on_own_process(self) -> None:
        """Called once, where the node has a process of its own."""

    def on_connected(self) -> None:
        """Called once, when every awaited reader and writer is connected."""

    def check_graph(self) -> None:
        """Raise a VesselHsmcError when the other nodes are not as they must be."""

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """Level, message and figures for /diagnostics."""
        return OK, "running" if self.connected else "waiting to be connected", {}

    def retune(self, parameters: Any) -> None:
        """Take changed tunable parameters; raise ParameterError to refuse them."""

    def close(self) -> None:
        """Last work of the node, its context still alive: say how it ended and see that every reader has everything."""
        self.publish_diagnostics()
        deadline = time.monotonic() + ACKNOWLEDGE_LIMIT
        for publisher in self.publishers:
            if publisher.get_subscription_count():
                publisher.wait_for_all_acked(Duration(seconds=max(0.0, deadline - time.monotonic())))

    # -- spinning -----------------------------------------------------------------------------------------------------

    def spin(self, running: Callable[[], bool]) -> None:
        """Serve callbacks until the node has finished or `running` says no."""
        if self.parameters.lockstep or self.POLL_PERIOD:
            with DirectExecutor(self.direct_subscriptions, self.POLL_PERIOD, self.context) as direct:
                direct.add_node(self)
                direct.spin_while(lambda: running() and not self.finished)
            return
        with SingleThreadedExecutor(context=self.context) as executor:
            executor.add_node(self)
            while running() and not self.finished:
                executor.spin_once(timeout_sec=0.1)

    def publish_diagnostics(self) -> None:
        """Publish the node's status."""
        level, message, figures = self.status()
        array = DiagnosticArray()
        stamp = self.stamp if self.parameters.lockstep else self.now()
        array.header.stamp = conversions.time_message(stamp)
        values = [KeyValue(key=key, value=str(value)) for key, value in figures.items()]
        name = self.get_fully_qualified_name().lstrip("/")
        array.status = [DiagnosticStatus(level=level, name=name, message=message, hardware_id="", values=values)]
        self._diagnostics.publish(array)

    def _check_connected(self) -> None:
        self.check_graph()
        for awaited in list(self._awaited):
            if self.count_publishers(awaited[1]):
                self._awaited.remove(awaited)
                self.direct_subscriptions.append(self.create_subscription(*awaited))
        if self._awaited or not all(self._has_readers(*advertised) for advertised in self._advertised):
            self.get_logger().info("waiting for the other nodes", throttle_duration_sec=5.0, skip_first=True)
            return
        self.connected = True
        self.destroy_timer(self._connecting)
        self.publish_diagnostics()
        self.on_connected()

    def _has_readers(self, publisher: Publisher, partner: str) -> bool:
        """Whether every reader the graph shows is connected, and those that are awaited are among them.

        The graph knows of a reader before the publisher is connected with it; what is published in between may be lost.
        """
        if not (partner or self.parameters.recorded):
            return True
        offered, infos = publisher.qos_profile, self.get_subscriptions_info_by_topic(publisher.topic_name)
        readers = [i for i in infos if qos_check_compatible(offered, i.qos_profile)[0] is not QoSCompatibility.ERROR]
        writers = self.get_publishers_info_by_topic(self.resolve_topic_name(partner)) if partner else []
        if partner and not set(map(_node_of, writers)) & set(map(_node_of, readers)):
            return False
        # A node that uses simulated time reads /clock for itself, best effort; the recorder's own subscription is reliable.
        qualities = [(info.node_name, info.qos_profile.reliability) for info in readers]
        if self.parameters.recorded and (RECORDER, ReliabilityPolicy.RELIABLE) not in qualities:
            return False
        return int(publisher.get_subscription_count()) >= len(readers)

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


def _node_of(end: Any) -> tuple[str, str]:
    """The full name of the node that an end of a topic belongs to."""
    return end.node_namespace, end.node_name


def run_node(node_class: type[VesselNode], arguments: list[str] | None = None) -> int:
    """Run a node as a process does: until it has finished, fails or is told to stop by SIGINT or SIGTERM.

    The signals only ask for the end: the node then finishes what it is doing with its context alive, which rclpy's own handlers
    would not let it.

    Returns:
        The exit code: 0, or 1 when the node failed, or 2 when it could not start.
    """
    stopped: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _frame: stopped.append(received))
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except (RuntimeError, ValueError) as error:
        return _complain(node_class.NAME, f"cannot start: {' '.join(str(error).split())}", 2)
    try:
        node = node_class()
    except VesselHsmcError as error:
        rclpy.shutdown()
        return _complain(node_class.NAME, str(error), 2)
    node.on_own_process()
    code = 0
    try:
        for work in (partial(node.spin, lambda: not stopped), node.close):
            try:
                work()
            except VesselHsmcError as error:
                code = _complain(node_class.NAME, str(error), 1)
            except ExternalShutdownException:
                break
    finally:
        node.destroy_node()
        rclpy.shutdown()
    return code


def _complain(name: str, message: str, code: int) -> int:
    print(f"[ERROR] [{name}]: {message}", file=sys.stderr, flush=True)
    return code
