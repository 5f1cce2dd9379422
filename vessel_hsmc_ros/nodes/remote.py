"""A client of running nodes: finds them in a ROS domain and namespace, calls their services and sends them goals."""

import os
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import rclpy
from rclpy.client import Client
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from vessel_hsmc_msgs.msg import Event

from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.core.install_paths import discovery
from vessel_hsmc_ros.messages.topics import EVENTS
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.ros_environment import start_error

DISCOVERY_LIMIT = 5.0
"""Longest search for a node, s; with the package's profile of Fast DDS nodes find each other within a second."""

ANSWER_LIMIT, REPEAT_AFTER = 6.0, 2.0
"""Longest wait for a response, s, and the time after which a request is repeated: a response is lost if the server has not
discovered the client yet."""

CONFIRMATION_LIMIT = 2.0
"""Longest wait for the event that confirms a message, s."""

T = TypeVar("T")


class Service(NamedTuple):
    """A service of a node: the node's name, the service's name below it, and its type."""

    node: str
    name: str
    kind: Any


class Remote:
    """A connection with the nodes of one vessel, on a ROS context of its own; a context manager.

    Args:
        namespace: The vessel's namespace, without slashes at its ends.

    Attributes:
        node: The node through which it communicates; its name is hidden, so that recorders ignore it.
    """

    def __init__(self, namespace: str = "") -> None:
        self._prefix = f"/{namespace}/" if namespace else "/"
        self._context = rclpy.Context()
        try:
            rclpy.init(context=self._context, args=[], signal_handler_options=SignalHandlerOptions.NO)
            with discovery():
                self.node = rclpy.create_node(
                    f"_vessel_hsmc_{os.getpid()}", context=self._context, start_parameter_services=False, enable_rosout=False
                )
        except RuntimeError as error:
            raise RunError(f"cannot connect: {start_error(error)}") from None
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)

    def __enter__(self) -> "Remote":
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)

    def name(self, relative: str) -> str:
        """The full name of a node or a topic of the vessel; one with a leading slash is returned as it is."""
        return relative if relative.startswith("/") else self._prefix + relative

    def until(self, condition: Callable[[], T], limit: float) -> T:
        """Serve callbacks until a condition holds, at most for a time, s; returns the condition's last value."""
        end = time.monotonic() + limit
        while not (result := condition()) and time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.02)
        return result

    def nodes(self) -> list[str]:
        """Full names of the nodes in the domain, without hidden ones."""
        names = self.node.get_node_names_and_namespaces()
        return sorted({f"{namespace.rstrip('/')}/{name}" for name, namespace in names if not name.startswith("_")})

    def require(self, *names: str) -> None:
        """Wait until nodes of the vessel are in the ROS graph.

        Raises:
            RunError: one is not found in time; the message names the nodes that were found.
        """

        def missing() -> list[str]:
            there = self.nodes()
            return [self.name(name) for name in names if self.name(name) not in there]

        if not self.until(lambda: not missing(), DISCOVERY_LIMIT):
            raise RunError(self._not_found(missing()))

    def connect(self, services: Sequence[Service]) -> list[Client]:
        """Clients of services that are all ready, so that a call of several nodes reaches all of them or none.

        Raises:
            RunError: a node or its service is not found in time.
        """
        self.require(*(service.node for service in services))
        names = [f"{self.name(service.node)}/{service.name}" for service in services]
        clients = [self.node.create_client(service.kind, name) for service, name in zip(services, names, strict=True)]
        if not self.until(lambda: all(client.service_is_ready() for client in clients), DISCOVERY_LIMIT):
            lacking = [name for client, name in zip(clients, names, strict=True) if not client.service_is_ready()]
            raise RunError(f"no service {', '.join(lacking)} within {DISCOVERY_LIMIT:g} s: is it a node of this package?")
        return clients

    def call(self, client: Client, request: Any) -> Any:
        """Call a service and return its response.

        Raises:
            RunError: no response was received in time.
        """
        end = time.monotonic() + ANSWER_LIMIT
        while (left := end - time.monotonic()) > 0.0:
            future = client.call_async(request)
            if self.until(future.done, min(left, REPEAT_AFTER)):
                return future.result()
        raise RunError(f"no response from {client.srv_name} within {ANSWER_LIMIT:g} s: does its node hang?")

    def publish(self, message: Any, topic: str, reader: str, profile: QoSProfile = qos.STREAM) -> str:
        """Publish one message for a node.

        Args:
            message: The message.
            topic: Relative to the vessel's namespace.
            reader: The node that has to receive it and confirms it by an event.
            profile: Quality of service.

        Returns:
            The text of the event; empty if none was received in time.

        Raises:
            RunError: the node does not subscribe to the topic.
        """
        events: list[Event] = []
        confirming = self.node.create_subscription(Event, self.name(EVENTS), events.append, qos.LOSSLESS)
        publisher = self.node.create_publisher(type(message), self.name(topic), profile)

        def connected() -> bool:
            readers = self.node.get_subscriptions_info_by_topic(publisher.topic_name)
            found = any(f"{info.node_namespace.rstrip('/')}/{info.node_name}" == self.name(reader) for info in readers)
            return found and publisher.get_subscription_count() >= len(readers) and confirming.get_publisher_count() > 0

        if not self.until(connected, DISCOVERY_LIMIT):
            raise RunError(f"{self.name(reader)} does not subscribe to {publisher.topic_name}")
        publisher.publish(message)
        confirmed = self.until(lambda: [event for event in events if event.node == reader], CONFIRMATION_LIMIT)
        return confirmed[-1].text if confirmed else ""

    def _not_found(self, missing: Sequence[str]) -> str:
        """Which nodes were not found where, and which were, in one line."""
        what = f"no node {', '.join(missing)} in ROS domain {os.environ.get('ROS_DOMAIN_ID', '0')}"
        if not (there := self.nodes()):
            return f"{what}, nor any other: does the run use the same ROS_DOMAIN_ID?"
        names = [name.rsplit("/", 1)[-1] for name in missing]
        elsewhere = sorted({full.rsplit("/", 1)[0] or "/" for full in there if full.rsplit("/", 1)[-1] in names})
        hint = f"; for these the namespace is {' or '.join(elsewhere)}" if elsewhere else ""
        return f"{what}: found are {', '.join(there)}{hint}"
