"""The messages of a bag's topics as columns, read from its files when they are first used."""

import struct
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.bags.cdr_columns import Layout, MessageType, joined, strings, texts
from vessel_hsmc_ros.bags.files import BagFiles, channel_offsets
from vessel_hsmc_ros.bags.mcap_layout import MESSAGE_FIELDS, MESSAGE_HEADER, MESSAGE_HEADER_TYPE
from vessel_hsmc_ros.bags.rosbag2_metadata import offered_qos
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.core.timing import NANOSECONDS

Array = NDArray[Any]

MAX_NARROW_ARRAY = 8  # largest number of elements of an array that counts as narrow


class MessageDecoder:
    """Decodes the messages of one topic.

    `definition`: its text in the form ros2msg with all types that it uses.
    """

    def __init__(self, topic: str, kind: str, definition: str) -> None:
        self._topic, self._kind, self._definition = topic, kind, definition
        self._layouts: dict[int, Layout] = {}  # by the size of messages
        self._irregular = False

    @cached_property
    def fields(self) -> tuple[str, ...]:
        """The dotted names of all fields."""
        return self._type.fields()

    @cached_property
    def wide(self) -> set[str]:
        """Arrays of more than MAX_NARROW_ARRAY elements, and sequences, whose lengths differ from message to message."""
        return self._type.lists(MAX_NARROW_ARRAY)

    def deserialize(self, data: bytes) -> Any:
        """One message as an object with its fields as attributes. Raises BagError if the bytes are not a message of the type."""
        try:
            return self._type.read(data)
        except (ValueError, struct.error) as error:
            raise self._refused(error) from None

    def _refused(self, error: Exception) -> BagError:
        return BagError(f"a message of {self._topic} is not a {self._kind}: {' '.join(str(error).split())}")

    def columns(self, data: bytes, starts: Array, sizes: Array, names: Sequence[str]) -> dict[str, Array]:
        """Decode some fields of many messages into columns.

        `starts`: offset of each message, (n,). `sizes`: bytes of each message, (n,). Returns columns by name, each with n rows.
        Raises BagError if a message cannot be decoded.
        """
        columns = None if self._irregular else self._by_size(np.frombuffer(data, np.uint8), starts, sizes, names)
        return self._one_by_one(data, starts, sizes, names) if columns is None else columns

    def _by_size(self, view: Array, starts: Array, sizes: Array, names: Sequence[str]) -> dict[str, Array] | None:
        """All messages of one size together; None when messages of a size have different layouts."""
        groups: list[Array] = []
        parts: dict[str, list[Array]] = {name: [] for name in names}
        for size in np.unique(sizes).tolist():
            chosen = np.flatnonzero(sizes == size)
            columns = self._gather(view, starts[chosen], size, names)
            if columns is None:
                self._irregular = True  # do not try again with the topic's next messages
                return None
            groups.append(chosen)
            for name, column in columns.items():
                parts[name].append(column)
        if len(groups) == 1:
            return {name: columns[0] for name, columns in parts.items()}
        order = np.argsort(np.concatenate(groups))
        return {name: joined(columns)[order] for name, columns in parts.items()}

    def _gather(self, view: Array, starts: Array, size: int, names: Sequence[str]) -> dict[str, Array] | None:
        try:
            if size not in self._layouts:
                self._layouts[size] = self._type.layout(view[starts[0] : starts[0] + size].tobytes())
            layout = self._layouts[size]
            columns = layout.gather(view, starts, names) if layout.shared else None
            return columns and {name: strings(c) if c.dtype.kind == "S" else c for name, c in columns.items()}
        except (ValueError, struct.error) as error:
            raise self._refused(error) from None

    def _one_by_one(self, data: bytes, starts: Array, sizes: Array, names: Sequence[str]) -> dict[str, Array]:
        ends = (starts + sizes).tolist()
        messages = [self.deserialize(data[start:end]) for start, end in zip(starts.tolist(), ends, strict=True)]
        return {name: _column([attrgetter(name)(message) for message in messages]) for name in names}

    @cached_property
    def _type(self) -> MessageType:
        return MessageType(self._kind, self._definition)


def _column(values: list[Any]) -> Array:
    """Values of one field: numbers and strings as such, anything else as objects."""
    if values and isinstance(values[0], str):
        return texts(values)
    if values and isinstance(values[0], bool | int | float):
        return np.array(values)
    column = np.empty(len(values), dtype=object)
    column[:] = values
    return column


TIMES = ("log_time", "publish_time")


@dataclass
class Series:
    """One topic of a bag. `series["pose.pose.position.x"]` is a column: a field of all its messages, in order of log time.

    Columns of numbers have the message's own type and the shape (n,), or (n, k) for lists; strings are NumPy strings; lists
    whose length differs from message to message, and lists of messages, are columns of objects.
    """

    name: str  # the topic, with its leading slash
    type: str  # such as `nav_msgs/msg/Odometry`; empty for messages without a type
    definition: str  # the type's text in the form ros2msg; empty if the bag does not contain it in this form
    type_hash: str  # RIHS01 hash of the type; empty if the bag does not contain it
    qos: list[dict[str, Any]]  # the profiles that its publishers offered
    files: BagFiles = field(repr=False)
    count: int = 0
    encoding: str = "cdr"  # of the messages: cdr, that of ROS 2, or another one such as json
    others: str = ""  # what else than messages of this type and encoding the topic has; empty for nothing
    _columns: dict[str, Array] = field(default_factory=dict, init=False, repr=False)
    _order: Array | None = field(default=None, init=False, repr=False)  # of log times; None if they were in order

    def __len__(self) -> int:
        return self.count

    def __contains__(self, name: str) -> bool:
        return name in self.fields

    def __getitem__(self, name: str) -> Array:
        if name not in self._columns:
            if name not in (*self.fields, *TIMES):
                raise BagError(f"{self.name} has no field {name}: it takes one of {', '.join(self.fields)}")
            load_columns([self], (name,))
        return self._columns[name]

    @cached_property
    def undecodable(self) -> str:
        """Why the messages of this topic cannot be decoded; empty if they can be."""
        if self.others:
            return f"has messages of several types: {self.type or 'no type'} in {self.encoding} and {self.others}"
        if self.encoding != "cdr":
            return f"has messages in {self.encoding or 'an unnamed encoding'}, not in CDR"
        if not self.definition:
            return f"has no definition of its type {self.type} as ros2msg" if self.type else "has messages without a type"
        try:
            self._decoder.fields  # noqa: B018 - reads the definition
        except BagError as error:
            return f"has a definition that cannot be read: {error}"
        return ""

    @property
    def fields(self) -> tuple[str, ...]:
        """The dotted names of all fields."""
        return self._decoder.fields

    @property
    def wide(self) -> set[str]:
        """Long arrays and sequences, which are read only when they are accessed."""
        return self._decoder.wide

    @property
    def log_time(self) -> Array:
        """Time of receipt of each message, ns, (n,)."""
        return self["log_time"]

    @property
    def publish_time(self) -> Array:
        """Time of publication of each message, ns, (n,)."""
        return self["publish_time"]

    @property
    def stamp(self) -> Array:
        """Time stamp of each message, ns, (n,): that of its header or of the clock, else the log time."""
        for name in ("header.stamp", "clock", "stamp"):
            if f"{name}.sec" in self.fields:
                return self[f"{name}.sec"].astype(np.int64) * NANOSECONDS + self[f"{name}.nanosec"]
        return self.log_time

    def as_recorded(self, column: Array) -> Array:
        """A column in the order of the files instead of that of the log times."""
        if self._order is None:
            return column
        found = np.empty_like(column)
        found[self._order] = column
        return found

    def stack(self, *names: str) -> Array:
        """Several columns of numbers side by side, (n, k)."""
        return np.column_stack([self[name] for name in names])

    def deserialize(self, data: bytes) -> Any:
        """One of the topic's messages as an object with its fields as attributes.

        Raises BagError if the bytes are not a message of the topic's type.
        """
        return self._decoder.deserialize(data)

    def _missing(self, names: Iterable[str]) -> list[str]:
        """What to read for some fields: those not yet read; with the first ones also the times and all narrow fields."""
        if self._columns:
            return [name for name in names if name not in self._columns]
        return list(dict.fromkeys((*TIMES, *names, *(name for name in self.fields if name not in self.wide))))

    def _decode(self, block: bytes, offsets: Sequence[int], names: Iterable[str]) -> dict[str, Array]:
        """Columns of the messages whose records lie at some offsets of a block."""
        # All headers at once: a loop over messages in Python would take most of the time.
        starts = np.array(offsets)
        header_bytes = np.frombuffer(block, np.uint8)[starts[:, None] + np.arange(MESSAGE_HEADER.size)]
        headers = header_bytes.view(MESSAGE_HEADER_TYPE).reshape(-1)
        sizes = headers["length"].astype(np.int64) - MESSAGE_FIELDS
        columns = {name: headers[name] for name in TIMES}
        fields = [name for name in names if name not in TIMES]
        return columns | self._decoder.columns(block, starts + MESSAGE_HEADER.size, sizes, fields)

    def _keep(self, columns: dict[str, list[Array]]) -> None:
        """Keep what has been read in the order of log time; empties `columns`, which may be most of the memory in use."""
        read = {name: joined(columns.pop(name)) for name in list(columns)}
        if "log_time" in read:
            order = np.argsort(read["log_time"], kind="stable")  # stable: equal times stay in the recorded order
            self._order = None if (np.diff(order) == 1).all() else order
        for name, column in read.items():
            self._columns[name] = column if self._order is None else column[self._order]

    @cached_property
    def _decoder(self) -> MessageDecoder:
        if self.others or self.encoding != "cdr" or not self.definition:
            raise BagError(f"{self.name} cannot be decoded: it {self.undecodable}")
        return MessageDecoder(self.name, self.type, self.definition)


class _Channel(NamedTuple):
    """A channel of one file: name of its type and encoding of its messages, and what else is known of it."""

    kind: tuple[str, str]
    definition: str
    type_hash: str
    qos: list[dict[str, Any]]
    messages: int


def topics_of(files: BagFiles) -> dict[str, Series]:
    """The topics of a bag by their full names; those of other programs than ROS 2 too, whose messages are only passed on."""
    found: dict[str, list[_Channel]] = {}
    for contents in files.contents:
        for channel in contents.channels.values():
            schema = contents.schemas.get(channel.schema_id)
            known = schema is not None and schema.encoding == "ros2msg"
            text = schema.data.decode(errors="replace") if schema and known else ""
            kind, type_hash = schema.name if schema else "", channel.metadata.get("topic_type_hash", "")
            made = _Channel((kind, channel.message_encoding), text, type_hash, offered_qos(channel), contents.counts[channel.id])
            found.setdefault(channel.topic, []).append(made)
    return {name: _series(name, channels, files) for name, channels in found.items()}


def _series(name: str, channels: Sequence[_Channel], files: BagFiles) -> Series:
    """A topic of one or several channels: of those of several types, the type with the most messages."""
    counts: Counter[tuple[str, str]] = Counter()
    for channel in channels:
        counts[channel.kind] += channel.messages
    (kind, encoding), _ = counts.most_common(1)[0]
    alike = [channel for channel in channels if channel.kind == (kind, encoding)]
    definition = next((channel.definition for channel in alike if channel.definition), "")
    others = [f"{found[0] or 'no type'} in {found[1]} ({n})" for found, n in counts.items() if n and found != (kind, encoding)]
    first = alike[0]
    return Series(name, kind, definition, first.type_hash, first.qos, files, counts.total(), encoding, ", ".join(others))


def load_columns(topics: Iterable[Series], names: Iterable[str] = ()) -> None:
    """Read columns of topics of one bag in one pass over its files; those already read are not read again.

    `topics`: the topics. Of one that has not been read yet, all narrow fields and the times are read. `names`: further fields,
    which all these topics have. Raises BagError if a file is damaged, or a message cannot be decoded.
    """
    wanted = {series.name: (series, missing) for series in topics if (missing := series._missing(names))}
    parts: dict[str, dict[str, list[Array]]] = {name: {field: [] for field in missing} for name, (_, missing) in wanted.items()}
    files = next(iter(wanted.values()))[0].files.blocks() if wanted else ()
    for contents, block in files:
        for channel, offsets in channel_offsets(contents, block).items():
            name = contents.channels[channel].topic
            if name in wanted:
                series, missing = wanted[name]
                columns = series._decode(block, offsets, missing)
                for each, found in parts[name].items():
                    found.append(columns[each])
    for name, (series, _) in wanted.items():
        series._keep(parts.pop(name))
