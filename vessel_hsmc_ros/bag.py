"""Bags: MCAP files in a folder, written as rosbag2 and its friends expect. Nothing here needs a running ROS."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from mcap.writer import CompressionType, Writer

from vessel_hsmc_ros.exceptions import BagError

METADATA = "metadata.yaml"
VERSION = 9
"""Of metadata.yaml, as Jazzy writes it."""

CHUNK_SIZE = 128 * 1024
"""Bytes of one chunk: what a crash can cost, at most, beside what the recorder has not taken yet."""

SCENARIO, PARAMETERS, RECORDING = "scenario.yaml", "parameters.yaml", "vessel_hsmc_ros"
"""Names in the bag: of the attachments with the resolved scenario and every node's parameters, and of our metadata record."""

INFINITE = {"sec": 9223372036, "nsec": 854775807}
_COMPRESSION = {"none": CompressionType.NONE, "lz4": CompressionType.LZ4, "zstd": CompressionType.ZSTD}


@dataclass
class Topic:
    """A recorded topic: what its channel says of it, and how many messages it has so far."""

    name: str
    kind: str
    definition: str
    type_hash: str
    qos: list[dict[str, Any]]
    count: int = field(default=0, init=False)
    channel: int = field(default=0, init=False)


class BagWriter:
    """A rosbag2 directory being written: `<name>/<name>_0.mcap` and `<name>/metadata.yaml`.

    Whatever is written may fail with a BagError, when the disk is full for instance.

    Args:
        directory: The bag's folder, made here.
        compression: none, lz4 or zstd.

    Raises:
        BagError: the folder exists or cannot be made.
    """

    def __init__(self, directory: Path, compression: str = "zstd") -> None:
        self.directory = directory
        try:
            directory.mkdir(parents=True)
            self._stream = (directory / f"{directory.name}_0.mcap").open("wb")
        except OSError as error:
            raise BagError(f"bag folder {directory} cannot be made: {error.strerror}") from None
        self._topics: list[Topic] = []
        self._first: int | None = None
        self._last = 0
        self._writer = Writer(self._stream, chunk_size=CHUNK_SIZE, compression=_COMPRESSION[compression])
        with self._told():
            self._writer.start(profile="ros2")
            self._stream.flush()
            self._write_metadata()

    @property
    def message_count(self) -> int:
        """Messages written so far."""
        return sum(topic.count for topic in self._topics)

    def add_topic(self, topic: Topic) -> None:
        """Open a channel for a topic."""
        schema = self._writer.register_schema(topic.kind, "ros2msg", topic.definition.encode())
        described = {"offered_qos_profiles": _qos_text(topic.qos), "topic_type_hash": topic.type_hash}
        topic.channel = self._writer.register_channel(topic.name, "cdr", schema, described)
        self._topics.append(topic)

    def write(self, topic: Topic, data: bytes, log_time: int, publish_time: int) -> None:
        """Append one message: CDR with its encapsulation header, times in nanoseconds."""
        try:
            self._writer.add_message(topic.channel, log_time, data, publish_time)
        except OSError as error:
            raise self._failure(error) from None
        topic.count += 1
        if self._first is None:
            self._first = self._last = log_time
        elif log_time > self._last:
            self._last = log_time
        elif log_time < self._first:
            self._first = log_time

    def flush(self) -> None:
        """Hand complete chunks to the operating system."""
        with self._told():
            self._stream.flush()

    def close(self) -> None:
        """Complete the bag: summary, footer and metadata."""
        with self._told():
            self._writer.add_metadata("rosbag2", {"serialized_metadata": yaml.safe_dump(self._metadata())})
            self._writer.finish()
            self._stream.close()
            self._write_metadata()

    @contextmanager
    def _told(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise self._failure(error) from None

    def _failure(self, error: OSError) -> BagError:
        return BagError(f"bag {self.directory} cannot be written: {error.strerror}")

    def _write_metadata(self) -> None:
        """Also at the start: a recorder that is killed leaves a folder that can be told to be a bag."""
        write_metadata(self.directory, self._metadata())

    def _metadata(self) -> dict[str, Any]:
        return metadata(f"{self.directory.name}_0.mcap", self._topics, self._first or 0, self._last)


def write_metadata(directory: Path, information: dict[str, Any]) -> None:
    """Write a bag's metadata.yaml."""
    text = yaml.safe_dump({"rosbag2_bagfile_information": information}, sort_keys=False)
    (directory / METADATA).write_text(text, encoding="utf-8")


def metadata(file: str, topics: Sequence[Topic], start: int, end: int) -> dict[str, Any]:
    """What rosbag2 wants to know of a bag of one file, in its VERSION.

    Args:
        file: The MCAP file's name.
        topics: Its topics with their counts.
        start, end: Its first and last log time, ns.
    """

    def span() -> dict[str, Any]:
        return {"starting_time": {"nanoseconds_since_epoch": start}, "duration": {"nanoseconds": end - start}}

    count = sum(topic.count for topic in topics)
    return {
        "version": VERSION,
        "storage_identifier": "mcap",
        **span(),
        "message_count": count,
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.kind,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": topic.qos,
                    "type_description_hash": topic.type_hash,
                },
                "message_count": topic.count,
            }
            for topic in topics
        ],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file],
        "files": [{"path": file, **span(), "message_count": count}],
        "custom_data": None,
        "ros_distro": "jazzy",
    }


def qos_entry(reliable: bool, transient_local: bool) -> dict[str, Any]:
    """A QoS profile as rosbag2 writes it; discovery tells neither history nor depth."""
    return {
        "history": "unknown",
        "depth": 0,
        "reliability": "reliable" if reliable else "best_effort",
        "durability": "transient_local" if transient_local else "volatile",
        "deadline": dict(INFINITE),
        "lifespan": dict(INFINITE),
        "liveliness": "automatic",
        "liveliness_lease_duration": dict(INFINITE),
        "avoid_ros_namespace_conventions": False,
    }


def _qos_text(profiles: Sequence[dict[str, Any]]) -> str:
    return yaml.safe_dump(list(profiles), sort_keys=False)
