"""Writes the content of a black box as a bag, in a process of its own, so that the node's control period is not delayed.

    python -m vessel_hsmc_ros.bags.black_box < content

The content is pickled: first a `Head`, then each message as time, ns, topic, type and serialised message. The process prints the
folder of the bag. Libraries are imported where they are used: a node that makes a content need not load them.
"""

import itertools
import os
import pickle
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from shutil import rmtree
from typing import Any, BinaryIO, NamedTuple

from vessel_hsmc_ros.core.exceptions import BagError

WRITER = "vessel_hsmc_ros.bags.black_box"  # this module, for the process
NICENESS = 10  # niceness of the process: the control loop has priority

Message = tuple[int, str, str, bytes]


class Head(NamedTuple):
    """What a bag has besides messages."""

    folders: list[str]  # where it may be written, in the order of preference
    notes: dict[str, str]
    parameters: str  # those of the node, as a ROS parameters file


def write(content: BinaryIO) -> tuple[Path, str]:
    """Write the bag into the first folder that takes it; one that exists is left alone, and another name is taken beside it.

    Names repeat: two processes start in the same second, and a computer without a battery for its clock starts at the same
    time. Returns the bag's folder, and why none of the folders before it took the bag; empty if it is the first.
    """
    head, *messages = _loaded(content) or [None]
    if head is None:
        raise BagError("the content of the black box is cut off before its first message")
    refused = ""
    for wanted in map(Path, head.folders):
        others = (wanted.with_name(f"{wanted.name}_{number}") for number in itertools.count(2))
        folder = next(name for name in itertools.chain([wanted], others) if not name.exists())
        try:
            _write(folder, head, messages)
        except BagError as error:
            refused = str(error)
        else:
            return folder, refused
    raise BagError(refused)


def _loaded(content: BinaryIO) -> list[Any]:
    """The parts of a content without one that is cut off, because the node was killed while it passed the content on."""

    def parts() -> Iterator[Any]:
        with suppress(EOFError, pickle.UnpicklingError):
            while True:
                yield pickle.load(content)  # noqa: S301 - the process that starts this one has written it

    return [*parts()]


def _write(folder: Path, head: Head, messages: list[Message]) -> None:
    """Write the bag into a folder that does not exist; if it cannot be written, what has been made of it is removed."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    from vessel_hsmc_ros.bags.writer import PARAMETERS, BagWriter, Topic, qos_entry
    from vessel_hsmc_ros.messages.topics import definition

    writer = BagWriter(folder, notes=head.notes)
    try:
        writer.attach(PARAMETERS, head.parameters)
        topics: dict[str, Topic] = {}
        for time, name, kind, data in messages:
            if name not in topics:
                text, store = definition(kind), get_typestore(Stores.EMPTY)
                store.register(get_types_from_msg(text, kind))
                topics[name] = Topic(name, kind, text, store.hash_rihs01(kind), [qos_entry(True, False)])
                writer.add_topic(topics[name])
            writer.write(topics[name], data, time, time)
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
