"""A bag from the content of a run's messages, as the recorder writes it in lockstep; the counterpart of `run_from_bag`."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain, pairwise
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

from vessel_hsmc_ros.bags.topic_columns import MessageDecoder, read_definition
from vessel_hsmc_ros.bags.writer import SCENARIO, BagWriter, Topic, qos_entry
from vessel_hsmc_ros.control.safety.parameters import Operation
from vessel_hsmc_ros.core.kinematics import quaternion_from_heading
from vessel_hsmc_ros.core.metrics import Published
from vessel_hsmc_ros.core.node_list import CONTROLLER, PLANT, REFERENCE
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.messages.conversions import BODY, WORLD
from vessel_hsmc_ros.messages.topics import RECORDED_TOPICS, definition
from vessel_hsmc_ros.scenario.law_file import law_source
from vessel_hsmc_ros.scenario.scenario import Scenario, dump_scenario

Array = NDArray[Any]

BLOCK = 4096  # steps of the plant that are encoded together: the messages of a long run would not fit into memory
LATCHED = ("/clock",)  # topics whose publisher is transient local
NODES = {"reference": REFERENCE, "controller": CONTROLLER, "cmd_wrench": CONTROLLER}
"""The node that publishes a topic, by the first part of its name; others are the plant's."""


class MessageEncoder:
    """Encodes messages of one type that have the same texts and the same lengths of lists.

    `definition`: its text in the form ros2msg with all types that it uses. `texts`: values of its texts by dotted names; others
    are empty. `lengths`: lengths of its lists of numbers by dotted names; others are empty.

    Attributes:
        type_hash: RIHS01 hash of the type.
        fields: Locations of its fields by dotted names.
    """

    def __init__(self, kind: str, definition: str, texts: Mapping[str, str], lengths: Mapping[str, int]) -> None:
        self._store: Any = get_typestore(Stores.EMPTY)
        types: Any = read_definition(kind, definition)
        self._store.register(types)
        self._given = {**texts, **{name: np.zeros(length) for name, length in lengths.items()}}
        message = bytes(self._store.serialize_cdr(self._empty(kind, ""), kind))
        self._template = np.frombuffer(message, np.uint8)
        self.fields = MessageDecoder(kind, kind, definition).layout(message).fields
        self.type_hash: str = self._store.hash_rihs01(kind)

    def encode(self, columns: Mapping[str, Array]) -> Array:
        """Serialised messages with the values of some columns, uint8, (n, size); all other numbers are zero.

        `columns`: by dotted names of fields, with a row for each message.
        """
        count = len(next(iter(columns.values())))
        rows = np.tile(self._template, (count, 1))
        for name, values in columns.items():
            place = self.fields[name]
            numbers = np.ascontiguousarray(values, place.dtype)
            rows[:, place.offset : place.offset + place.size] = numbers.view(np.uint8).reshape(count, place.size)
        return rows

    def _empty(self, kind: str, prefix: str) -> Any:
        """A message of zeros with the given texts and lists."""
        fields = {name: self._value(node, detail, prefix + name) for name, (node, detail) in self._store.fielddefs[kind][1]}
        return self._store.types[kind](**fields)

    def _value(self, node: Nodetype, detail: Any, name: str) -> Any:
        if name in self._given:
            return self._given[name]
        if node == Nodetype.NAME:
            return self._empty(detail, f"{name}.")
        if node == Nodetype.BASE:
            return "" if detail[0] == "string" else 0
        (_, (element, _)), count = detail
        return np.zeros(count if node == Nodetype.ARRAY else 0, element)


@dataclass
class Stream:
    """The messages of one topic: their stamps, ns, and columns of their fields."""

    topic: Topic
    encoder: MessageEncoder
    stamps: NDArray[np.int64]
    columns: Mapping[str, Array]

    def messages(self, begin: int, end: int) -> Iterator[tuple[int, Topic, bytes]]:
        """Stamp, topic and serialised form of the messages with begin <= stamp < end."""
        first, last = np.searchsorted(self.stamps, (begin, end))
        stamps = self.stamps[first:last]
        sec, nanosec = np.divmod(stamps, NANOSECONDS)
        stamp = "clock" if "clock.sec" in self.encoder.fields else "header.stamp"
        columns = {name: values[first:last] for name, values in self.columns.items()}
        rows = self.encoder.encode({f"{stamp}.sec": sec, f"{stamp}.nanosec": nanosec, **columns})
        return ((time, self.topic, row.tobytes()) for time, row in zip(stamps.tolist(), rows, strict=True))


def write_bag(directory: Path, published: Published, scenario: Scenario) -> int:
    """Write the messages of a run in the order of their stamps."""
    streams = [_stream(name, *content, scenario) for name, content in contents(published).items()]
    notes = {"mode": "offline", "scenario": scenario.name, "messages_dropped": "0"}
    notes |= {"law_source": source} if (source := law_source(scenario.controller.law)) else {}
    writer = BagWriter(directory, scenario.recorder.compression, notes=notes)
    writer.attach(SCENARIO, dump_scenario(scenario))
    for stream in streams:
        writer.add_topic(stream.topic)
    edges = [*published.stamp[::BLOCK].tolist(), np.iinfo(np.int64).max]
    for begin, end in pairwise(edges):
        messages = chain.from_iterable(stream.messages(begin, end) for stream in streams)
        for stamp, topic, data in sorted(messages, key=itemgetter(0)):
            writer.write(topic, data, stamp, stamp)
    writer.close()
    return writer.message_count


def contents(published: Published) -> dict[str, tuple[NDArray[np.int64], dict[str, Array]]]:
    """Stamps and fields of the messages of each topic that the run has, by the names of RECORDED_TOPICS."""
    p, reference = published, _motion(published.reference, "pose", "twist")
    pose = {name: values for name, values in reference.items() if name.startswith("pose.")}
    # What the node adds to the terms of a law that commands in every period; offline no time is taken.
    count = len(p.control_stamp)
    unsupervised = {"compute_time": np.full(count, math.nan), "operation": np.full(count, float(Operation.ACTIVE))}
    found = {
        "odom": (p.measured_at, _odometry(p.odometry)),
        "cmd_wrench": (p.stamp, _wrench(p.command)),
        "applied_wrench": (p.stamp, _wrench(p.applied)),
        "disturbance": (p.stamp, _wrench(p.disturbance)),
        "dynamics/truth": (p.stamp, _vectors("accel", p.unforced_acceleration)),
        "reference": (p.reference_stamp, {**reference, **_vectors("acceleration", p.reference_acceleration)}),
        "reference/pose": (p.reference_stamp, pose),
        "controller/state": (p.control_stamp, {**unsupervised, **p.control}),
        "/clock": (p.stamp, {}),
    }
    if p.truth is not None:
        found["odom/truth"] = p.stamp, _odometry(p.truth)
    if p.estimate is not None:
        found["controller/estimate"] = p.control_stamp, _odometry(p.estimate)
    return {name: found[name] for name in RECORDED_TOPICS if name in found}


def _stream(name: str, stamps: NDArray[np.int64], columns: dict[str, Array], scenario: Scenario) -> Stream:
    kind = RECORDED_TOPICS[name]
    text = definition(kind)
    prefix = getattr(scenario, NODES.get(name.split("/")[0], PLANT)).frame_prefix
    # Poses are in the world frame, with the twist in the body's; all else is in the body frame.
    posed = any(field.startswith("pose.") for field in columns)
    texts = {"header.frame_id": prefix + (WORLD if posed else BODY), "child_frame_id": prefix + BODY}
    lengths = {field: values.shape[1] for field, values in columns.items() if values.ndim > 1}
    encoder = MessageEncoder(kind, text, texts, lengths)
    topic = Topic("/" + name.lstrip("/"), kind, text, encoder.type_hash, [qos_entry(True, name in LATCHED)])
    return Stream(topic, encoder, stamps, columns)


def _odometry(states: Array) -> dict[str, Array]:
    return _motion(states, "pose.pose", "twist.twist")


def _motion(states: Array, pose: str, twist: str) -> dict[str, Array]:
    """Columns of a pose and of a twist, of x, y, psi, u, v, r, (n, 6)."""
    z, w = np.array([quaternion_from_heading(heading) for heading in states[:, 2].tolist()]).reshape(-1, 2).T
    position = {f"{pose}.position.x": states[:, 0], f"{pose}.position.y": states[:, 1]}
    return {**position, f"{pose}.orientation.z": z, f"{pose}.orientation.w": w, **_vectors(twist, states[:, 3:])}


def _vectors(group: str, values: Array) -> dict[str, Array]:
    """Columns of surge, sway and yaw of a twist or an acceleration."""
    return {f"{group}.{name}": values[:, i] for i, name in enumerate(("linear.x", "linear.y", "angular.z"))}


def _wrench(values: Array) -> dict[str, Array]:
    """Columns of surge force, sway force if there is one, and yaw moment."""
    names = ("force.x", "torque.z") if values.shape[1] == 2 else ("force.x", "force.y", "torque.z")
    return {f"wrench.{name}": values[:, i] for i, name in enumerate(names)}
