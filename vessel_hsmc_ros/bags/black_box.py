"""Writes the content of a black box as a bag, in a process of its own, so that the node's control period is not delayed.

    python -m vessel_hsmc_ros.bags.black_box < content

The content is a line of JSON, as `header` makes it, followed by records, as `record` makes them. The process prints the folder of
the bag.
"""

import json
import os
import struct
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from shutil import rmtree
from typing import Any, BinaryIO

from vessel_hsmc_ros.bags.writer import PARAMETERS, BagWriter, Topic, qos_entry
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.messages.definitions import definition

NICENESS = 10
"""Niceness of the process: the control loop has priority."""

_RECORD = struct.Struct("<qHI")


def header(folders: Sequence[str], notes: Mapping[str, str], topics: Mapping[str, str], parameters: str) -> bytes:
    """The first line of the content.

    Args:
        folders: Where the bag may be written, in the order of preference; the others are for a disk that is full.
        notes: Facts about the recording by name.
        topics: Message types by topic, in the order of the topics' numbers.
        parameters: Parameters of the node, as a ROS parameters file.
    """
    content = {"folders": list(folders), "notes": dict(notes), "topics": list(topics.items()), "parameters": parameters}
    return json.dumps(content).encode() + b"\n"


def record(time: int, topic: int, data: bytes) -> bytes:
    """A message in the content.

    Args:
        time: Its time, ns.
        topic: Number of its topic.
        data: The serialised message, CDR with its encapsulation header.
    """
    return _RECORD.pack(time, topic, len(data)) + data


def records(content: bytes) -> Iterator[tuple[int, int, bytes]]:
    """The messages in a content without its first line: time, number of the topic, data."""
    position = 0
    while position < len(content):
        time, topic, length = _RECORD.unpack_from(content, position)
        position += _RECORD.size
        yield time, topic, content[position : position + length]
        position += length


def write(content: BinaryIO) -> tuple[Path, str]:
    """Write the bag into the first folder that takes it.

    Args:
        content: Opened file of the content, which is read to its end.

    Returns:
        The bag's folder, and why none of the folders before it took the bag; empty if it is the first.

    Raises:
        BagError: no folder takes the bag.
    """
    about = json.loads(content.readline())
    messages = content.read()
    refused = ""
    for folder in map(Path, about["folders"]):
        try:
            _write(folder, about, messages)
        except BagError as error:
            rmtree(folder, ignore_errors=True)
            refused = str(error)
        else:
            return folder, refused
    raise BagError(refused)


def _write(folder: Path, about: Mapping[str, Any], messages: bytes) -> None:
    writer = BagWriter(folder, notes=about["notes"])
    writer.attach(PARAMETERS, about["parameters"])
    topics = [_topic(name, kind) for name, kind in about["topics"]]
    for topic in topics:
        writer.add_topic(topic)
    for time, number, data in records(messages):
        writer.write(topics[number], data, time, time)
    writer.close()


def _topic(name: str, kind: str) -> Topic:
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore  # takes a while to load

    text, store = definition(kind), get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(text, kind))
    return Topic(name, kind, text, store.hash_rihs01(kind), [qos_entry(True, False)])


def main() -> int:
    """Write the bag of the content on standard input; print its folder, or why it cannot be written."""
    with suppress(OSError):
        os.nice(NICENESS)
    try:
        folder, refused = write(sys.stdin.buffer)
    except BagError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    sys.stdout.write(f"{folder}\n{refused}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
