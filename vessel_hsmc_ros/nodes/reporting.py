"""What a node reports about itself: its diagnostics every second, and an event for each thing that happens to it."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger
from vessel_hsmc_msgs.msg import Event

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.topics import EVENTS
from vessel_hsmc_ros.nodes import qos

if TYPE_CHECKING:
    from rclpy.publisher import Publisher


class Reporter:
    """Publishes the diagnostics and the events of a node, and offers the services that cause events.

    Args:
        node: Whose diagnostics and events they are.
        stamp: Returns the time of a report, ns.
        parameters: The dataclass of its parameters. A node without parameters that may change while it runs, such as an observer
            of a run, has no events.
    """

    def __init__(self, node: Node, stamp: Callable[[], int], parameters: type) -> None:
        self._node, self._stamp = node, stamp
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
        self._events: Publisher | None = None
        if any(entry.tunable for entry in schema.entries(parameters).values()):
            self._events = node.create_publisher(Event, EVENTS, qos.LOSSLESS)

    def diagnose(self, level: bytes, message: str, values: Mapping[str, Any]) -> None:
        """Publish the node's status: level, message and values of /diagnostics."""
        array = DiagnosticArray()
        array.header.stamp = conversions.time_message(self._stamp())
        pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        name = self._node.get_fully_qualified_name().lstrip("/")
        array.status = [DiagnosticStatus(level=level, name=name, message=message, hardware_id="", values=pairs)]
        self._diagnostics.publish(array)

    def event(self, kind: str, text: str) -> None:
        """Publish and log an event."""
        self._node.get_logger().info(f"{kind}: {text}")
        if self._events is not None:
            message = Event(node=self._node.get_name(), kind=kind, text=text)
            message.header.stamp = conversions.time_message(self._stamp())
            self._events.publish(message)

    def changes(self, before: object, after: object) -> None:
        """Publish an event for each parameter whose value differs between two instances of a node's parameters."""
        old, new = schema.flatten(before), schema.flatten(after)
        for name in (name for name in new if new[name] != old[name]):
            self.event("parameter", f"{self._node.get_name()}.{name}: {schema.shown(old[name])} -> {schema.shown(new[name])}")

    def offer(self, kind: str, work: Callable[[], str]) -> None:
        """Offer a service that triggers `work`, whose result is the response's message and the event's text.

        Args:
            kind: Name of the service below the node's, and kind of the event.
            work: What the service does.
        """

        def serve(_request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            response.success, response.message = True, work()
            self.event(kind, response.message)
            return response

        self._node.create_service(Trigger, f"~/{kind}", serve)

    def offer_switch(self, kind: str, opposite: str, work: Callable[[bool], str]) -> None:
        """Offer a service that switches something on and off by `work`, as `offer` does.

        Args:
            kind: Name of the service below the node's, and kind of the event when it switches on.
            opposite: Kind of the event when it switches off.
            work: What the service does with the request's flag.
        """

        def serve(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
            response.success, response.message = True, work(request.data)
            self.event(kind if request.data else opposite, response.message)
            return response

        self._node.create_service(SetBool, f"~/{kind}", serve)
