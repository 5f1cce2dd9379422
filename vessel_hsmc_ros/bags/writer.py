"""Bags: MCAP files in a folder, written as rosbag2 and its friends expect. Nothing here needs a running ROS."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from vessel_hsmc_ros.bags.mcap_writer import McapFile
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.core.version import __version__

METADATA = "metadata.yaml"
VERSION = 9
"""Of metadata.yaml, as Jazzy writes it."""

SCENARIO, PARAMETERS, RECORDING = "scenario.yaml", "parameters.yaml", "vessel_hsmc_ros"
"""Names in the bag: of the attachments with the resolved scenario and every node's parameters, and of our metadata record."""

_INFINITE = (9223372036, 854775807)
_DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


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


class FileFacts(NamedTuple):
    """What metadata.yaml says of one file: its name, first and last log time [ns], messages."""

    name: str
    start: int | None
    end: int
    messages: int


@dataclass(frozen=True)
class Splitting:
    """When to begin another file: after so many bytes, or so much of log time [s]; 0 never."""

    size: int = 0
    duration: float = 0.0


class BagWriter:
    """A rosbag2 directory being written: `<name>/<name>_0.mcap`, `_1` and so on, and `<name>/metadata.yaml`.

    Whatever is written may fail with a BagError, when the disk is full for instance.

    Args:
        directory: The bag's folder, made here.
        compression: none, lz4 or zstd.
        splitting: When to begin another file.
        notes: What the bag is to say of its recording, by name.

    Attributes:
        notes: The same, to be kept up to date.

    Raises:
        BagError: the folder exists or cannot be made.
    """

    def __init__(
        self,
        directory: Path,
        compression: str = "zstd",
        splitting: Splitting | None = None,
        notes: Mapping[str, str] | None = None,
    ) -> None:
        self.directory = directory
        self.notes = {"version": __version__, **(notes or {})}
        self.message_count = 0
        self._compression = compression
        self._splitting = splitting or Splitting()
        self._topics: list[Topic] = []
        self._attachments: dict[str, str] = {}
        self._finished: list[FileFacts] = []
        self._split_after = -1
        try:
            directory.mkdir(parents=True)
            self._begin_file()
        except OSError as error:
            raise BagError(f"bag folder {directory} cannot be made: {error.strerror}") from None
        with self._told():
            self._write_metadata()

    def add_topic(self, topic: Topic) -> None:
        """Open a channel for a topic."""
        self._open_channel(topic)
        self._topics.append(topic)
        with self._told():
            self._write_metadata()

    def attach(self, name: str, text: str) -> None:
        """Let a text travel in the bag, in each of its files; a new one of the same name replaces the old."""
        if self._attachments.get(name) != text:
            self._attachments[name] = text
            with self._told():
                self._file.add_attachment(name, "application/yaml", text.encode())
                self._file.commit()

    def write(self, topic: Topic, data: bytes, log_time: int, publish_time: int) -> None:
        """Append one message: CDR with its encapsulation header, times in nanoseconds."""
        try:
            if self._splitting.size and self._file.size >= self._splitting.size:
                self._split()
            elif self._splitting.duration:
                self._split_at(log_time)
            self._file.add_message(topic.channel, log_time, data, publish_time)
        except OSError as error:
            raise self._failure(error) from None
        topic.count += 1
        self.message_count += 1

    def flush(self) -> None:
        """Hand everything to the operating system, so that it survives this process."""
        with self._told():
            self._file.commit()

    def flush_metadata(self) -> None:
        """Bring metadata.yaml up to date, for whoever reads the bag of a recorder that was killed."""
        with self._told():
            self._write_metadata()

    def close(self) -> None:
        """Complete the bag: notes, summary, footer and metadata."""
        with self._told():
            self._finish_file(last=True)
            self._write_metadata()

    # -- files --------------------------------------------------------------------------------------------------------

    def _begin_file(self) -> None:
        name = f"{self.directory.name}_{len(self._finished)}.mcap"
        self._file = McapFile(self.directory / name, self._compression)
        for topic in self._topics:
            self._open_channel(topic)
        self._file.add_metadata(RECORDING, self.notes)
        for attached, text in self._attachments.items():
            self._file.add_attachment(attached, "application/yaml", text.encode())
        self._file.commit()

    def _open_channel(self, topic: Topic) -> None:
        known = {schema.name: number for number, schema in self._file.contents.schemas.items()}
        schema = known.get(topic.kind) or self._file.add_schema(topic.kind, topic.definition)
        qos = yaml.dump(topic.qos, Dumper=_DUMPER, sort_keys=False)
        described = {"offered_qos_profiles": qos, "topic_type_hash": topic.type_hash}
        topic.channel = self._file.add_channel(topic.name, schema, described)

    def _split(self) -> None:
        self._finish_file(last=False)
        self._begin_file()
        self._write_metadata()

    def _split_at(self, log_time: int) -> None:
        """Split when the file's time is over; it counts from the file's first message."""
        if self._split_after < 0:
            self._split_after = log_time + round(self._splitting.duration * NANOSECONDS)
        elif log_time >= self._split_after:
            self._split()
            self._split_after = log_time + round(self._splitting.duration * NANOSECONDS)

    def _finish_file(self, last: bool) -> None:
        self._file.commit()
        self._file.add_metadata(RECORDING, self.notes)
        told = metadata(self._topics, [*self._finished, self._facts()], self.notes)
        if last:
            self._file.add_metadata("rosbag2", {"serialized_metadata": _text(told)})
        self._file.close()
        self._finished.append(self._facts())

    def _facts(self) -> FileFacts:
        told = self._file.contents
        return FileFacts(told.path.name, told.start_time, told.end_time, told.counts.total())

    def _write_metadata(self) -> None:
        """Also at the start: a recorder that is killed leaves a folder that can be told to be a bag."""
        files = self._finished
        if len(files) == 0 or files[-1].name != self._file.contents.path.name:
            files = [*files, self._facts()]
        write_metadata(self.directory, metadata(self._topics, files, self.notes))

    @contextmanager
    def _told(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise self._failure(error) from None

    def _failure(self, error: OSError) -> BagError:
        return BagError(f"bag {self.directory} cannot be written: {error.strerror}")


def write_metadata(directory: Path, information: dict[str, Any]) -> None:
    """Write a bag's metadata.yaml; whoever reads it meanwhile finds the old or the new one, whole."""
    new = directory / f".{METADATA}"
    new.write_text(_text({"rosbag2_bagfile_information": information}), encoding="utf-8")
    new.replace(directory / METADATA)


def metadata(topics: Sequence[Topic], files: Sequence[FileFacts], notes: Mapping[str, str]) -> dict[str, Any]:
    """What rosbag2 wants to know of a bag, in its VERSION.

    Args:
        topics: The bag's topics with their counts.
        files: Its files in order.
        notes: What else it is to say, by name.
    """
    starts = [file.start for file in files if file.start is not None]
    start, end = min(starts, default=0), max(file.end for file in files)
    return {
        "version": VERSION,
        "storage_identifier": "mcap",
        **_span(start, end),
        "message_count": sum(file.messages for file in files),
        "topics_with_message_count": [{"topic_metadata": _described(t), "message_count": t.count} for t in topics],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file.name for file in files],
        "files": [{"path": f.name, **_span(f.start or 0, f.end), "message_count": f.messages} for f in files],
        "custom_data": dict(notes),
        "ros_distro": "jazzy",
    }


def qos_entry(reliable: bool, transient_local: bool, **others: Any) -> dict[str, Any]:
    """A QoS profile as rosbag2 writes it; discovery tells neither history nor depth.

    Args:
        reliable: Or best effort.
        transient_local: Or volatile.
        others: `deadline`, `lifespan` and `liveliness_lease_duration` as seconds and nanoseconds, infinite if not given;
            `liveliness`, automatic if not given.
    """
    times = {}
    for name in ("deadline", "lifespan", "liveliness_lease_duration"):
        sec, nsec = others.get(name, _INFINITE)
        times[name] = {"sec": sec, "nsec": nsec}
    return {
        "history": "unknown",
        "depth": 0,
        "reliability": "reliable" if reliable else "best_effort",
        "durability": "transient_local" if transient_local else "volatile",
        "deadline": times["deadline"],
        "lifespan": times["lifespan"],
        "liveliness": others.get("liveliness", "automatic"),
        "liveliness_lease_duration": times["liveliness_lease_duration"],
        "avoid_ros_namespace_conventions": False,
    }


def _described(topic: Topic) -> dict[str, Any]:
    return {
        "name": topic.name,
        "type": topic.kind,
        "serialization_format": "cdr",
        "offered_qos_profiles": topic.qos,
        "type_description_hash": topic.type_hash,
    }


def _span(start: int, end: int) -> dict[str, Any]:
    duration = max(0, end - start)
    return {"starting_time": {"nanoseconds_since_epoch": start}, "duration": {"nanoseconds": duration}}


def _text(document: dict[str, Any]) -> str:
    text: str = yaml.dump(document, Dumper=_DUMPER, sort_keys=False)
    return text
