"""Writes bags in the format of rosbag2: a folder of MCAP files with metadata.yaml. Needs no ROS installation."""

import platform
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Any

import numpy as np

from vessel_hsmc_ros.bags.mcap_writer import McapFile
from vessel_hsmc_ros.bags.rosbag2_metadata import metadata, qos_entry, write_metadata
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.core.install_paths import __version__
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.scenario.parameters_file import yaml_text

if TYPE_CHECKING:
    from vessel_hsmc_ros.bags.mcap_contents import Contents

__all__ = ["PARAMETERS", "RECORDING", "SCENARIO", "BagWriter", "Splitting", "Topic", "qos_entry"]

SCENARIO, PARAMETERS, RECORDING = "scenario.yaml", "parameters.yaml", "vessel_hsmc_ros"
"""Names in the bag: of the attachments with the resolved scenario and every node's parameters, and of our metadata record."""

VERSIONS = {"version": __version__, "numpy": np.__version__, "python": platform.python_version()}
"""Versions on which recorded numbers depend: another NumPy may round differently. `version` is that of this package."""


@dataclass(frozen=True)
class Splitting:
    """When to begin another file: after a size, bytes, or after a duration in log time, s; 0 means never."""

    size: int = 0
    duration: float = 0.0


@dataclass
class Topic:
    """A recorded topic."""

    name: str
    kind: str  # its message type, such as `nav_msgs/msg/Odometry`
    definition: str  # the type's text in the form ros2msg with all types that it uses
    type_hash: str  # RIHS01 hash of the type
    qos: list[dict[str, Any]]  # the profiles that its publishers offered, as `qos_entry` gives them
    channel: int = field(default=0, init=False)  # id of its channel in every file


class BagWriter:
    """A rosbag2 directory being written: `<name>/<name>_0.mcap`, `_1` and so on, and `<name>/metadata.yaml`.

    Every method raises a BagError when it cannot write, for instance because the disk is full. From then on the bag remains as
    it is on the disk, and every method raises the same error: what is missing is not reported as recorded. A bag is closed
    once. `compression`: of the chunks: none, lz4 or zstd. `notes`: facts about the recording by name, stored in each file and
    in metadata.yaml besides VERSIONS.

    Attributes:
        directory: The bag's folder.
        notes: All facts about the recording; may be changed until the bag is closed.
        message_count: Messages written so far.
    """

    def __init__(
        self,
        directory: Path,
        compression: str = "zstd",
        splitting: Splitting | None = None,
        notes: Mapping[str, str] | None = None,
    ) -> None:
        self.directory = directory
        self.notes = {**VERSIONS, **(notes or {})}
        self.message_count = 0
        self._compression = compression
        self._splitting = splitting or Splitting()
        self._attachments: dict[str, str] = {}
        self._files: list[Contents] = []
        self._split_after = -1
        self._ended: BagError | None = None  # why nothing more can be written
        self._abandon: Callable[[], None] = lambda: None
        try:
            directory.mkdir(parents=True)
        except OSError as error:
            raise BagError(f"bag folder {directory} cannot be made: {error.strerror}") from None
        try:
            self._begin_file()
            self._write_metadata()
        except OSError as error:
            failure = self._failed(error)
            rmtree(directory, ignore_errors=True)  # it is our own
            raise failure from None

    def add_topic(self, topic: Topic) -> None:
        """Open a channel for a topic; metadata.yaml has it from the next flush on."""
        self._require_open()
        ids = {schema.name: number for number, schema in self._file.contents.schemas.items()}
        schema = ids.get(topic.kind) or self._file.add_schema(topic.kind, topic.definition)
        # The same profiles as in metadata.yaml: where the two differ, some readers find no message.
        described = {"offered_qos_profiles": yaml_text(topic.qos), "topic_type_hash": topic.type_hash}
        topic.channel = self._file.add_channel(topic.name, schema, described)
        self._described = False

    def attach(self, name: str, text: str) -> None:
        """Attach a YAML text to each of the bag's files; a new text replaces an old one of the same name."""
        if self._attachments.get(name) != text:
            self._attachments[name] = text
            with self._bag_errors():
                self._file.add_attachment(name, "application/yaml", text.encode())
                self._file.commit()

    def write(self, topic: Topic, data: bytes, log_time: int, publish_time: int) -> None:
        """Append one message.

        `log_time`: time of its receipt, ns. `publish_time`: time of its publication, ns.
        """
        if self._ended:
            raise self._ended
        try:  # not `_bag_errors`: a context manager costs time for every message
            if self._splitting.duration and self._split_after < 0:
                self._begin_duration(log_time)
            size, duration = self._splitting.size, self._splitting.duration
            if (size and self._file.size >= size) or (duration and log_time >= self._split_after):
                self._finish_file(last=False)
                self._begin_file()
                self._write_metadata()
                # From this message and not on a fixed grid: after a gap each message would else get a file of its own.
                self._begin_duration(log_time)
            self._file.add_message(topic.channel, log_time, data, publish_time)
        except OSError as error:
            raise self._failed(error) from None
        self.message_count += 1

    def flush(self) -> None:
        """Pass all messages to the operating system, so that they survive the end of this process."""
        with self._bag_errors():
            self._file.commit()
            if not self._described:  # not for each topic: the hundreds of a fleet appear at the same time
                self._write_metadata()

    def flush_metadata(self) -> None:
        """Bring metadata.yaml up to date, for readers of the bag of a recorder that was killed."""
        with self._bag_errors():
            self._file.commit()  # first: where the disk is full, the messages so far are worth more
            self._write_metadata()

    def close(self) -> None:
        """Complete the bag: notes, summary, footer and metadata.yaml."""
        with self._bag_errors():
            self._finish_file(last=True)
            self._write_metadata()
        self._ended = BagError(f"bag {self.directory} is closed: nothing can be added to it")

    # -- files --------------------------------------------------------------------------------------------------------

    def _begin_file(self) -> None:
        name = f"{self.directory.name}_{len(self._files)}.mcap"
        self._file = McapFile(self.directory / name, self._compression, self._files[-1] if self._files else None)
        self._files.append(self._file.contents)
        self._abandon = self._file.abandon
        # In every file, so that a file can be interpreted without its neighbours.
        self._file.add_metadata(RECORDING, self.notes)
        for attached, text in self._attachments.items():
            self._file.add_attachment(attached, "application/yaml", text.encode())
        self._file.commit()

    def _begin_duration(self, log_time: int) -> None:
        """Let the duration of a file count from its first message, ns."""
        self._split_after = log_time + round(self._splitting.duration * NANOSECONDS)

    def _finish_file(self, last: bool) -> None:
        self._file.commit()
        self._file.add_metadata(RECORDING, self.notes)
        if last:
            self._file.add_metadata("rosbag2", {"serialized_metadata": yaml_text(metadata(self._files, self.notes))})
        self._file.close()
        self._file.contents.attachments.clear()  # not needed any more: they would fill the memory of a long recording

    def _write_metadata(self) -> None:
        """Also at the start, so that the folder of a recorder that is killed can be recognised as a bag."""
        self._described = True
        write_metadata(self.directory, metadata(self._files, self.notes))

    @contextmanager
    def _bag_errors(self) -> Iterator[None]:
        """Turn the operating system's errors into BagErrors, the last of the bag."""
        self._require_open()
        try:
            yield
        except OSError as error:
            raise self._failed(error) from None

    def _require_open(self) -> None:
        """Raise the BagError that has ended the bag, if there is one."""
        if self._ended:
            raise self._ended

    def _failed(self, error: OSError) -> BagError:
        """End the bag by an error of the operating system; its last file remains readable as it is on the disk."""
        self._abandon()
        self._ended = BagError(f"bag {self.directory} cannot be written: {error.strerror}")
        return self._ended
