"""Writes the content of a black box as a bag, in a process of its own, so that the node's control period is not delayed.

    python -m vessel_hsmc_ros.bags.black_box < content

The content is a line of JSON (`header`), followed by records. The process prints the folder of the bag. Libraries are imported
where they are used: a node that makes a content need not load them.
"""

import itertools
import json
import os
import struct
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from shutil import rmtree
from typing import Any, BinaryIO

from vessel_hsmc_ros.core.exceptions import BagError

WRITER = "vessel_hsmc_ros.bags.black_box"  # this module, for the process
NICENESS = 10  # niceness of the process: the control loop has priority
_RECORD = struct.Struct("<qHI")


def header(folders: Sequence[str], notes: Mapping[str, str], topics: Mapping[str, str], parameters: str) -> bytes:
    """The first line of the content: where the bag may be written, in the order of preference, and what it has besides messages.

    `topics`: message types by topic, in the order of the topics' numbers. `parameters`: those of the node, as a ROS parameters
    file.
    """
    content = {"folders": list(folders), "notes": dict(notes), "topics": list(topics.items()), "parameters": parameters}
    return json.dumps(content).encode() + b"\n"


def record(time: int, topic: int, data: bytes) -> bytes:
    """A message in the content."""
    return _RECORD.pack(time, topic, len(data)) + data


def records(content: bytes) -> Iterator[tuple[int, int, bytes]]:
    """The messages in a content without its first line: time, number of the topic, data.

    One that is cut off at the end, because the node was killed while it passed the content on, is left out.
    """
    begin = _RECORD.size
    while begin <= len(content):
        time, topic, length = _RECORD.unpack_from(content, begin - _RECORD.size)
        if begin + length > len(content):
            return
        yield time, topic, content[begin : begin + length]
        begin += length + _RECORD.size


def write(content: BinaryIO) -> tuple[Path, str]:
    """Write the bag into the first folder that takes it; one that exists is left alone, and another name is taken beside it.

    Returns the bag's folder, and why none of the folders before it took the bag; empty if it is the first. Raises BagError if
    no folder takes the bag, or there is no content.
    """
    head = content.readline()
    if not head.endswith(b"\n"):
        raise BagError("the content of the black box is cut off before its first message")
    about = json.loads(head)
    messages = content.read()
    refused = ""
    for wanted in map(Path, about["folders"]):
        folder = _unused(wanted)
        try:
            _write(folder, about, messages)
        except BagError as error:
            refused = str(error)
        else:
            return folder, refused
    raise BagError(refused)


def _unused(folder: Path) -> Path:
    """The folder, or the first of folder_2, folder_3 and so on that does not exist.

    Names repeat: two processes start in the same second, and a computer without a battery for its clock starts at the same time.
    """
    names = itertools.chain([folder], (folder.with_name(f"{folder.name}_{number}") for number in itertools.count(2)))
    return next(name for name in names if not name.exists())


def _write(folder: Path, about: Mapping[str, Any], messages: bytes) -> None:
    """Write the bag into a folder that does not exist; if it cannot be written, what has been made of it is removed."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    from vessel_hsmc_ros.bags.writer import PARAMETERS, BagWriter, Topic, qos_entry
    from vessel_hsmc_ros.messages.topics import definition

    writer = BagWriter(folder, notes=about["notes"])
    try:
        writer.attach(PARAMETERS, about["parameters"])
        topics = []
        for name, kind in about["topics"]:
            text, store = definition(kind), get_typestore(Stores.EMPTY)
            store.register(get_types_from_msg(text, kind))
            topics.append(Topic(name, kind, text, store.hash_rihs01(kind), [qos_entry(True, False)]))
            writer.add_topic(topics[-1])
        for time, number, data in records(messages):
            writer.write(topics[number], data, time, time)
        writer.close()
    except BagError:
        rmtree(folder, ignore_errors=True)
        raise


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
