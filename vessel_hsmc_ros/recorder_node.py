"""The recorder node: every message of its topics as it came over the wire, into an MCAP bag."""

import struct
import sys
import time
from importlib import import_module
from pathlib import Path
from typing import Any

from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

from vessel_hsmc_ros import qos
from vessel_hsmc_ros.bag import BagWriter, Topic, qos_entry
from vessel_hsmc_ros.message_definitions import definition
from vessel_hsmc_ros.parameters import OPTIONAL_TOPICS, RecorderParameters
from vessel_hsmc_ros.timing import NANOSECONDS
from vessel_hsmc_ros.vessel_node import OK, WARN, VesselNode, run_node

FLUSH_PERIOD = 0.5
"""Time between two hand-overs of complete chunks to the operating system, s."""

DRAIN_QUIET, DRAIN_LIMIT = 0.1, 3.0
"""When told to stop, go on until nothing has come for the first time, but no longer than the second, s."""

_STAMP = struct.Struct("<iI")
_OF_EVERY_NODE = ("diagnostic_msgs/msg/DiagnosticArray", "rcl_interfaces/msg/Log")


class RecorderNode(VesselNode):
    """Subscribes to each topic when its first publisher appears, takes the raw messages in batches, writes them."""

    NAME = "recorder"
    PARAMETERS = RecorderParameters
    POLL_PERIOD = 0.01

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        p = self.parameters
        self._writer = BagWriter(Path(p.directory), p.compression)
        self._missing = [self.resolve_topic_name(topic) for topic in p.topics]
        self._dropped = 0
        self._last_message_at = time.monotonic()
        self._discovery = self.create_timer(0.02, self._discover, clock=self._wall)
        self.create_timer(FLUSH_PERIOD, self._writer.flush, clock=self._wall)

    def _discover(self) -> None:
        for topic in list(self._missing):
            if publishers := self.get_publishers_info_by_topic(topic):
                self._missing.remove(topic)
                self._subscribe(topic, publishers)
        if not self._missing:
            self.destroy_timer(self._discovery)

    def _subscribe(self, name: str, publishers: list[Any]) -> None:
        """Subscribe as reliably as all publishers of the topic allow."""
        kind = publishers[0].topic_type
        package, _, message = kind.split("/")
        offered = [
            (i.qos_profile.reliability is ReliabilityPolicy.RELIABLE,
             i.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL)
            for i in publishers
        ]  # fmt: skip
        profiles = [qos_entry(reliable, latched) for reliable, latched in offered]
        topic = Topic(name, kind, definition(kind), str(publishers[0].topic_type_hash), profiles)
        self._writer.add_topic(topic)
        profile = qos.RECORDED if all(reliable for reliable, _ in offered) else qos.RECORDED_BEST_EFFORT
        callback = self._recorder_of(topic)
        self.direct_subscriptions.append(
            self.create_subscription(getattr(import_module(f"{package}.msg"), message), name, callback, profile, raw=True)
        )

    def _recorder_of(self, topic: Topic) -> Any:
        """The callback of a topic; a data topic has one publisher, whose numbering must have no gap."""
        data_topic = topic.kind not in _OF_EVERY_NODE
        lockstep = self.parameters.lockstep
        expected = 1

        def record(data: bytes, info: dict[str, int]) -> None:
            nonlocal expected
            if data_topic:
                number = info["publication_sequence_number"]
                self._dropped += max(0, number - expected)
                expected = number + 1
            if lockstep and data_topic:
                sec, nanosec = _STAMP.unpack_from(data, 4)
                self.stamp = received = sent = sec * NANOSECONDS + nanosec
            elif lockstep:
                received = sent = self.stamp
            else:
                received, sent = info["received_timestamp"], info["source_timestamp"]
            self._writer.write(topic, data, received, sent)
            self._last_message_at = time.monotonic()

        return record

    def spin(self, running: Any) -> None:
        """Record until told to stop, then until nothing more comes, and last of all how it went."""
        super().spin(running)
        self._drain()
        self.publish_diagnostics()
        self._drain()

    def _drain(self) -> None:
        began = time.monotonic()
        self._last_message_at = began
        super().spin(lambda: time.monotonic() < min(self._last_message_at + DRAIN_QUIET, began + DRAIN_LIMIT))

    def close(self) -> None:
        """Complete the bag."""
        self._writer.close()
        count, name = self._writer.message_count, self._writer.directory
        self.get_logger().info(f"recorded {count} messages, {self._dropped} dropped, into {name}")
        super().close()

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """What has been recorded, and what was lost."""
        optional = {self.resolve_topic_name(topic) for topic in OPTIONAL_TOPICS}
        missing = [topic for topic in self._missing if topic not in optional]
        figures = {"messages": self._writer.message_count, "dropped": self._dropped, "missing": ", ".join(missing)}
        if self._dropped:
            return WARN, f"{self._dropped} messages were lost", figures
        return OK, "waiting for topics" if missing else "recording", figures


def main(arguments: list[str] | None = None) -> int:
    """Run the node until it is told to stop."""
    return run_node(RecorderNode, arguments)


if __name__ == "__main__":
    sys.exit(main())
