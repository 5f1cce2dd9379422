"""Bags made without ROS: messages of every type that a run has, with random values."""

import fcntl
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from vessel_hsmc_ros.bags.writer import BagWriter, Topic, qos_entry
from vessel_hsmc_ros.messages.topics import RECORDED_TOPICS, definition

NAMES = "odom odom/truth dynamics/truth cmd_wrench applied_wrench disturbance reference reference/pose controller/state /clock"
TYPES = {name: RECORDED_TOPICS[name] for name in NAMES.split()}
CLOCK = "rosgraph_msgs/msg/Clock"
STATUS = "diagnostic_msgs/msg/DiagnosticArray"
PERIOD = 10_000_000

Recorded = tuple[Path, dict[str, list[bytes]]]
"""A bag and the bytes that were written into it, by topic."""

STORE: Any = get_typestore(Stores.ROS2_JAZZY)
for _kind in TYPES.values():
    STORE.register({k: v for k, v in get_types_from_msg(definition(_kind), _kind).items() if k not in STORE.types})


@cache
def _described(kind: str) -> tuple[str, str]:
    return definition(kind), STORE.hash_rihs01(kind)


def topic(name: str, kind: str) -> Topic:
    """A reliable topic of an installed type."""
    return Topic(name, kind, *_described(kind), [qos_entry(True, False)])


def message(kind: str, stamp: int, rng: np.random.Generator, **given: Any) -> Any:
    """A message with a stamp and random values, 27 in each list; fields that are given by name have that value."""
    fields: dict[str, Any] = {}
    for name, (node, detail) in STORE.fielddefs[kind][1]:
        if name in given:
            fields[name] = given[name]
        elif detail == "builtin_interfaces/msg/Time":
            fields[name] = STORE.types[detail](sec=stamp // 10**9, nanosec=stamp % 10**9)
        elif node == Nodetype.NAME:
            fields[name] = message(detail, stamp, rng)
        elif node == Nodetype.BASE:
            fields[name] = _value(detail[0], rng)
        else:
            fields[name] = rng.normal(size=detail[1] or 27)
    return STORE.types[kind](**fields)


def _value(kind: str, rng: np.random.Generator) -> object:
    if kind == "string":
        return "odom"
    return bool(rng.integers(2)) if kind == "bool" else int(rng.integers(9)) if "int" in kind else float(rng.normal())


def status(stamp: int, rng: np.random.Generator, text: str, node: str = "n") -> Any:
    """A diagnostics message with one node's status."""
    level = STORE.types["diagnostic_msgs/msg/DiagnosticStatus"](level=0, name=node, message=text, hardware_id="", values=[])
    return message(STATUS, stamp, rng, status=[level])


def serialized(made: Any, kind: str) -> bytes:
    """A message as CDR with its encapsulation header."""
    return bytes(STORE.serialize_cdr(made, kind))


@cache
def made_run(count: int) -> list[tuple[int, str, str, bytes]]:
    """Stamps, topics without their namespaces, types and bytes of a run of `count` steps."""
    rng = np.random.default_rng(count)
    made = []
    for k in range(count):
        stamp = k * PERIOD
        made += [(stamp, name, kind, serialized(message(kind, stamp, rng), kind)) for name, kind in TYPES.items()]
        if k % 100 == 0:
            made.append((stamp, "/diagnostics", STATUS, serialized(status(stamp, rng, "x" * (k // 100)), STATUS)))
    return made


def write_run(
    directory: Path | None,
    count: int,
    compression: str = "zstd",
    namespace: str = "/",
    close: bool = True,
    writer: BagWriter | None = None,
) -> dict[str, list[bytes]]:
    """Write a bag of `count` steps with every topic of a run; returns the written bytes by topic.

    Args:
        directory: The bag's folder, where no writer is given.
        count: Steps.
        compression: none, lz4 or zstd.
        namespace: The vessel's.
        close: Whether to close the bag; else it is left as by a recorder that was killed.
        writer: An open bag to write into.
    """
    if writer is None:
        assert directory is not None
        writer = BagWriter(directory, compression)
    topics: dict[str, Topic] = {}
    sent: dict[str, list[bytes]] = {}
    for name, kind in (*TYPES.items(), ("/diagnostics", STATUS)):
        topics[name] = topic(name if name.startswith("/") else namespace + name, kind)
        sent[topics[name].name] = []
        writer.add_topic(topics[name])
    for stamp, name, _, data in made_run(count):
        sent[topics[name].name].append(data)
        writer.write(topics[name], data, stamp, stamp)
    writer.flush()
    _end(writer, close)
    return sent


def _end(writer: BagWriter, close: bool) -> None:
    """Close a bag, or leave it as the end of its process does: without the lock."""
    if close:
        writer.close()
    else:
        fcntl.flock(writer._file._file._fd, fcntl.LOCK_UN)


def clock(stamp: int) -> bytes:
    """A serialised clock message."""
    time = STORE.types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
    return serialized(STORE.types[CLOCK](clock=time), CLOCK)


def write_clock(directory: Path, count: int, compression: str = "zstd", close: bool = True) -> BagWriter:
    """Write a bag with `count` clock messages and a topic without messages."""
    writer = BagWriter(directory, compression)
    ticks, empty = topic("/clock", CLOCK), topic("/odom", "nav_msgs/msg/Odometry")
    for each in (ticks, empty):
        writer.add_topic(each)
    for k in range(count):
        writer.write(ticks, clock(k * PERIOD), k * PERIOD, k * PERIOD)
    writer.flush()
    _end(writer, close)
    return writer
