"""The live node: serves topics, as serialized by their publishers, to clients of the Foxglove WebSocket protocol.

It subscribes to a topic only when a client has subscribed, and with best effort, so that it neither blocks a publisher nor takes
part in the start-up handshake of a run.
"""

from typing import Any

import foxglove
from foxglove.websocket import Capability, ServerListener

from vessel_hsmc_ros.core.exceptions import BagError, RunError
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.messages import raw
from vessel_hsmc_ros.messages.topics import FOREIGN_TOPICS, TYPES_OF_EVERY_NODE, WATCHED_TOPICS, definition
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import OK, WATCHER_NICENESS, VesselNode
from vessel_hsmc_ros.scenario.parameters import LiveParameters

NEW_RUN = 10 * NANOSECONDS
"""A stamp further in the past than this belongs to a new run, ns; a slightly older one is a message out of order."""


class Subscriptions(ServerListener):  # type: ignore[misc] # the library's protocol is untyped
    """Number of clients that have subscribed to each topic; kept by the server's own threads."""

    def __init__(self) -> None:
        self.topics: dict[str, int] = {}

    def on_subscribe(self, client: Any, channel: Any) -> None:  # noqa: ARG002 - the protocol's
        """Count a client in."""
        self.topics[channel.topic] = self.topics.get(channel.topic, 0) + 1

    def on_unsubscribe(self, client: Any, channel: Any) -> None:  # noqa: ARG002 - the protocol's
        """Count a client out."""
        self.topics[channel.topic] = max(0, self.topics.get(channel.topic, 0) - 1)


class LiveNode(VesselNode):
    """Advertises topics to clients and forwards the messages of those to which a client has subscribed.

    A run's own topics are advertised before there is a client: the server announces a topic that is added later before it
    accepts subscriptions to it, so that the subscription of a fast client would be lost. Other topics are advertised when their
    first publisher appears.
    """

    NAME = "live"
    INTERFACE = """
        subscribes to  <topics> (of the parameter topics, which it serves to Foxglove), thrusters/<name>/thrust
    """
    PARAMETERS = LiveParameters
    NICENESS = WATCHER_NICENESS
    POLL_PERIOD = 0.01

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        p = self.parameters
        self._subscribed = Subscriptions()
        self._client_context = foxglove.Context()
        self._channels: dict[str, tuple[foxglove.Channel, Any]] = {}
        self._foreign = {self.resolve_topic_name(topic) for topic in FOREIGN_TOPICS}
        self._missing = [self.resolve_topic_name(topic) for topic in p.topics if not self._offer_known(topic)]
        try:
            self._server = foxglove.start_server(
                name="vessel_hsmc_ros",
                host=p.host,
                port=p.port,
                capabilities=[Capability.Time],
                server_listener=self._subscribed,
                context=self._client_context,
            )
        except RuntimeError as error:
            raise RunError(f"the live view cannot listen on {p.host}:{p.port}: {error}") from None
        self.get_logger().info(f"live view on ws://{p.host}:{self._server.port}")
        self._read: set[str] = set()
        self._forwarded = self._broadcast = 0
        self.create_timer(0.1, self._discover, clock=self.wall)
        self.create_timer(0.03, self._broadcast_time, clock=self.wall)

    def _discover(self) -> None:
        for name in list(self._missing):
            if publishers := self.get_publishers_info_by_topic(name):
                self._missing.remove(name)
                if not self._offer(name, publishers[0].topic_type):
                    self.get_logger().warning(f"{name} is not shown: {publishers[0].topic_type} is not installed")
        for name, clients in list(self._subscribed.topics.items()):
            if clients and name in self._channels and name not in self._read:
                self._read.add(name)
                self._subscribe(name)

    def _broadcast_time(self) -> None:
        if self.stamp != self._broadcast:
            self._broadcast = self.stamp
            self._server.broadcast_time(self.stamp)

    def _offer_known(self, topic: str) -> bool:
        return topic in WATCHED_TOPICS and self._offer(self.resolve_topic_name(topic), WATCHED_TOPICS[topic])

    def _offer(self, name: str, kind: str) -> bool:
        """Advertise a topic to clients; returns whether its type is installed."""
        try:
            schema = foxglove.Schema(name=kind, encoding="ros2msg", data=definition(kind).encode())
            message_type = raw.message_class(kind)
        except (BagError, ImportError, AttributeError):  # the last: of a package of another version
            return False
        channel = foxglove.Channel(name, schema=schema, message_encoding="cdr", context=self._client_context)
        self._channels[name] = channel, message_type
        return True

    def _subscribe(self, name: str) -> None:
        """Subscribe to a topic; its messages are discarded while no client is subscribed."""
        channel, message_type = self._channels[name]
        of_the_run = channel.schema_name() not in TYPES_OF_EVERY_NODE and name not in self._foreign
        stamped = of_the_run and raw.begins_with_stamp(message_type)
        lockstep, clients = self.parameters.lockstep, self._subscribed.topics

        def forward(data: bytes, info: dict[str, int]) -> None:
            if not clients[name]:
                return
            stamp = self.stamp
            if not lockstep:
                stamp = info["received_timestamp"]
            elif stamped:
                stamp = raw.stamp(data)
            channel.log(bytes(data), log_time=stamp)
            # A viewer interprets a decreasing time as a jump backwards, and clears its plots.
            self.stamp = stamp if stamp < self.stamp - NEW_RUN else max(stamp, self.stamp)
            self._forwarded += 1

        self.direct_subscriptions.append(self.create_subscription(message_type, name, forward, qos.WATCHED, raw=True))

    def close(self) -> None:
        """Disconnect the clients."""
        self._server.stop()
        super().close()

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """Number of advertised topics, of subscribed topics and of forwarded messages."""
        values = {"port": self._server.port, "topics": len(self._channels), "read": len(self._read), "messages": self._forwarded}
        return OK, "serving", values
