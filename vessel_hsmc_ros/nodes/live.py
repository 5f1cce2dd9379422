"""The live node: whatever a client asks for, as it came over the wire, through the Foxglove WebSocket protocol.

It takes part in nothing: it reads a topic only once a client wants it, best effort, so it neither holds a writer back nor is
waited for by one that runs already.
"""

import os
import sys
from typing import Any

import foxglove
from foxglove.websocket import Capability, ServerListener

from vessel_hsmc_ros.core.exceptions import BagError, RunError
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.messages import raw
from vessel_hsmc_ros.messages.definitions import definition
from vessel_hsmc_ros.messages.topics import FOREIGN_TOPICS, TYPES_OF_EVERY_NODE, WATCHED_TOPICS
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import OK, WATCHER_NICENESS, VesselNode, run_node
from vessel_hsmc_ros.scenario.parameters import LiveParameters

NEW_RUN = 10 * NANOSECONDS
"""A stamp that is further back than this is a new run's; one that is a little older than the last is only late."""


class Wishes(ServerListener):  # type: ignore[misc] # the library's protocol is untyped
    """Which topics clients want; told by the server's own threads."""

    def __init__(self) -> None:
        self.topics: dict[str, int] = {}

    def on_subscribe(self, client: Any, channel: Any) -> None:  # noqa: ARG002 - the protocol's
        """A client wants a topic."""
        self.topics[channel.topic] = self.topics.get(channel.topic, 0) + 1

    def on_unsubscribe(self, client: Any, channel: Any) -> None:  # noqa: ARG002 - the protocol's
        """A client no longer wants it."""
        self.topics[channel.topic] = max(0, self.topics.get(channel.topic, 0) - 1)


class LiveNode(VesselNode):
    """Offers topics, and passes on what clients want of them.

    A run's own topics are offered before there is a client: the server tells a client of a later one before it takes his
    subscriptions to it, and a quick client's is lost. Other topics are offered when their first publisher appears.

    Raises:
        RunError: the port is taken.
    """

    NAME = "live"
    PARAMETERS = LiveParameters
    POLL_PERIOD = 0.01

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        p = self.parameters
        self._wishes = Wishes()
        self._context_of_clients = foxglove.Context()
        self._channels: dict[str, tuple[foxglove.Channel, Any]] = {}
        self._foreign = {self.resolve_topic_name(topic) for topic in FOREIGN_TOPICS}
        self._missing = [self.resolve_topic_name(topic) for topic in p.topics if not self._offer_known(topic)]
        try:
            self._server = foxglove.start_server(
                name="vessel_hsmc_ros",
                host=p.host,
                port=p.port,
                capabilities=[Capability.Time],
                server_listener=self._wishes,
                context=self._context_of_clients,
            )
        except RuntimeError as error:
            raise RunError(f"the live view cannot listen on {p.host}:{p.port}: {error}") from None
        self.get_logger().info(f"live view on ws://{p.host}:{self._server.port}")
        self._read: set[str] = set()
        self._passed_on = self._told = 0
        self.create_timer(0.1, self._look_around, clock=self._wall)
        self.create_timer(0.03, self._tell_time, clock=self._wall)

    def _look_around(self) -> None:
        for name in list(self._missing):
            if publishers := self.get_publishers_info_by_topic(name):
                self._missing.remove(name)
                if not self._offer(name, publishers[0].topic_type):
                    self.get_logger().warning(f"{name} is not shown: {publishers[0].topic_type} is not installed")
        for name, wanted in list(self._wishes.topics.items()):
            if wanted and name in self._channels and name not in self._read:
                self._read.add(name)
                self._subscribe(name)

    def _tell_time(self) -> None:
        if self.stamp != self._told:
            self._told = self.stamp
            self._server.broadcast_time(self.stamp)

    def _offer_known(self, topic: str) -> bool:
        return topic in WATCHED_TOPICS and self._offer(self.resolve_topic_name(topic), WATCHED_TOPICS[topic])

    def _offer(self, name: str, kind: str) -> bool:
        """Whether the topic can be offered: its type must be installed."""
        try:
            schema = foxglove.Schema(name=kind, encoding="ros2msg", data=definition(kind).encode())
            message_type = raw.message_class(kind)
        except (BagError, ImportError):
            return False
        channel = foxglove.Channel(name, schema=schema, message_encoding="cdr", context=self._context_of_clients)
        self._channels[name] = channel, message_type
        return True

    def _subscribe(self, name: str) -> None:
        """Read a topic from now on; what nobody wants any more is dropped here."""
        channel, message_type = self._channels[name]
        of_the_run = channel.schema_name() not in TYPES_OF_EVERY_NODE and name not in self._foreign
        stamped = of_the_run and raw.begins_with_stamp(message_type)
        lockstep, wanted = self.parameters.lockstep, self._wishes.topics

        def pass_on(data: bytes, info: dict[str, int]) -> None:
            if not wanted[name]:
                return
            stamp = self.stamp
            if not lockstep:
                stamp = info["received_timestamp"]
            elif stamped:
                stamp = raw.stamp(data)
            channel.log(bytes(data), log_time=stamp)
            # Viewers take a time that goes back for a jump, and clear what they show.
            self.stamp = stamp if stamp < self.stamp - NEW_RUN else max(stamp, self.stamp)
            self._passed_on += 1

        self.direct_subscriptions.append(self.create_subscription(message_type, name, pass_on, qos.WATCHED, raw=True))

    def close(self) -> None:
        """Let the clients go."""
        self._server.stop()
        super().close()

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """What is offered, what is read, how much was passed on."""
        figures = {"port": self._server.port, "topics": len(self._channels), "read": len(self._read), "messages": self._passed_on}
        return OK, "serving", figures


def main(arguments: list[str] | None = None) -> int:
    """Run the node until it is told to stop."""
    os.nice(WATCHER_NICENESS)
    return run_node(LiveNode, arguments)


if __name__ == "__main__":
    sys.exit(main())
