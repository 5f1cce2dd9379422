"""The messages of a bag's topics as columns, read from its files when they are first used.

Serialised messages (CDR) have no table of contents: the location of a field depends on the lengths of the strings and sequences
before it. Within a topic these lengths hardly ever change, so the first message's layout serves for all messages that have the
same lengths, which are decoded all at once.

The parser of `rosbags` is used for definitions, but not its readers of messages: it compiles Python code for them, a line for
each element of an array, which takes long for a large one.
"""

import math
import re
import struct
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from operator import attrgetter
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.typesys import get_types_from_msg

from vessel_hsmc_ros.bags.files import BagFiles, channel_offsets
from vessel_hsmc_ros.bags.mcap_contents import MESSAGE_FIELDS, MESSAGE_HEADER, MESSAGE_HEADER_TYPE
from vessel_hsmc_ros.core.exceptions import BagError, BagWarning
from vessel_hsmc_ros.core.timing import NANOSECONDS

Array = NDArray[Any]

MAX_NARROW_ARRAY = 8  # largest number of elements of an array that counts as narrow
ENCAPSULATION = 4  # bytes of the encapsulation header before the first field; alignment counts from its end
UNUSED = 3
"""Bytes at the end of a message that a writer may add to align what follows. rclpy reserves the alignment of each empty list of
numbers besides, which it does not use."""
NUMBERS = {
    "bool": "?", "byte": "B", "char": "B", "octet": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H",
    "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
"""How `struct` and NumPy name the numbers of message definitions."""

_DTYPES = {order: {kind: np.dtype(order + code) for kind, code in NUMBERS.items()} for order in "<>"}
_COMMENTS = re.compile(r"^[ \t]*(#.*)?\n", re.MULTILINE)
"""Lines without anything but a comment, most lines of many definitions."""


@lru_cache(maxsize=256)
def read_definition(kind: str, text: str) -> Mapping[str, Any]:
    """The types of a definition by their names, each with its constants and its fields.

    `text`: the definition in the form ros2msg, followed by those of all types that it uses.
    """
    try:
        types: Mapping[str, Any] = get_types_from_msg(_COMMENTS.sub("", text), kind)
    except Exception as error:  # the parser's errors have no common base
        raise BagError(f"the definition of {kind} cannot be read: {error}") from None
    for node, detail in (each for _, fields in types.values() for _, each in fields):
        element, name = detail[0] if node in (Nodetype.ARRAY, Nodetype.SEQUENCE) else (node, detail)
        if element == Nodetype.NAME and name not in types:
            raise BagError(f"the definition of {kind} cannot be read: type {name} is missing")
    return types


class Location(NamedTuple):
    """Where a field lies in a serialised message: offset in bytes, NumPy type, shape."""

    offset: int
    dtype: str
    shape: tuple[int, ...]

    @property
    def size(self) -> int:
        """Bytes of the field."""
        return np.dtype(self.dtype).itemsize * math.prod(self.shape)

    def gather(self, data: Array, starts: Array) -> Array:
        """The field of many messages: a copy of its bytes, one row per message, reinterpreted as numbers."""
        chosen = data[starts[:, None] + np.arange(self.offset, self.offset + self.size)]
        column = chosen.view(self.dtype) if self.size else np.empty((len(starts), 0), self.dtype)
        return column.reshape((len(starts), *self.shape))


@dataclass
class Layout:
    """The locations of all fields of a message, for messages of one size with the same `lengths`."""

    fields: dict[str, Location] = field(default_factory=dict)  # locations by dotted names
    # locations of the encapsulation, of the lengths of strings and sequences, and of the ends of strings, and their values
    lengths: dict[Location, int] = field(default_factory=dict)
    shared: bool = True  # whether other messages can have it: not if there is a list of texts or messages

    def gather(self, data: Array, starts: Array, names: Sequence[str]) -> dict[str, Array] | None:
        """Columns of some fields of many messages; None if one of the messages has another layout.

        `data`: bytes that contain the messages, uint8, (m,). `starts`: offsets of the messages, (n,).
        """
        if not self.shared or any((each.gather(data, starts) != value).any() for each, value in self.lengths.items()):
            return None
        columns = {name: self.fields[name].gather(data, starts) for name in names}
        try:
            return {name: _strings(column) if column.dtype.kind == "S" else column for name, column in columns.items()}
        except UnicodeDecodeError:
            return None


class MessageDecoder:
    """Decodes the messages of one topic.

    `definition`: its text in the form ros2msg with all types that it uses.

    Attributes:
        fields: The dotted names of all fields, down to numbers, strings and lists.
        wide: Arrays of more than MAX_NARROW_ARRAY elements, and sequences, whose lengths differ from message to message.
        damage: What is wrong with the first message that `columns` has left out; empty for none.
    """

    def __init__(self, topic: str, kind: str, definition: str) -> None:
        self._topic, self._kind, self._types = topic, kind, read_definition(kind, definition)
        self._classes = {
            kind: type(kind.rpartition("/")[2], (SimpleNamespace,), {"__msgtype__": kind} | {n: v for n, _, v in constants})
            for kind, (constants, _) in self._types.items()
        }
        kinds = [*self._fields(kind, "")]
        self.fields = tuple(name for name, _, _ in kinds)
        self.wide = {
            name
            for name, node, detail in kinds
            if node == Nodetype.SEQUENCE or (node == Nodetype.ARRAY and detail[1] > MAX_NARROW_ARRAY)
        }
        self._layouts: dict[int, Layout] = {}  # by the size of messages
        self._irregular = False
        self.damage = ""

    def _fields(self, kind: str, prefix: str) -> Iterator[tuple[str, Nodetype, Any]]:
        for name, (node, detail) in self._types[kind][1]:
            if node == Nodetype.NAME:
                yield from self._fields(detail, f"{prefix}{name}.")
            else:
                yield prefix + name, node, detail

    def deserialize(self, data: bytes) -> Any:
        """One message with its fields as attributes; lists of numbers are NumPy arrays, other lists are lists."""
        return self._walked(data, None)

    def layout(self, message: bytes) -> Layout:
        """The layout of one message. Raises BagError if the bytes are not a message of the type."""
        layout = Layout(lengths={Location(i, "u1", ()): byte for i, byte in enumerate(message[:2])})
        self._walked(message, layout)
        return layout

    def _walked(self, data: bytes, layout: Layout | None) -> Any:
        try:
            if data[0] or data[1] > 1:
                raise ValueError("its encapsulation is neither CDR_LE nor CDR_BE")
            return _Walk(data, "<" if data[1] else ">", self._types, self._classes, layout).whole(self._kind)
        except (IndexError, ValueError, struct.error) as error:
            raise BagError(f"a message of {self._topic} is not a {self._kind}: {' '.join(str(error).split())}") from None

    def columns(
        self, data: bytes, starts: Array, sizes: Array, names: Sequence[str]
    ) -> tuple[dict[str, Array], NDArray[np.bool_]]:
        """Decode some fields of many messages into columns.

        `starts`: offset of each message, (n,). `sizes`: bytes of each message, (n,). Returns columns by name, with a row for
        each message that is not damaged, and which messages those are, (n,).
        """
        if not self._irregular:
            with suppress(BagError):  # of a damaged message
                columns = self._by_size(np.frombuffer(data, np.uint8), starts, sizes, names)
                if columns is not None:
                    return columns, np.full(len(starts), True)
        self._irregular = True  # the fast way is not tried again with the topic's next messages
        ends = (starts + sizes).tolist()
        found = [self._undamaged(data[start:end]) for start, end in zip(starts.tolist(), ends, strict=True)]
        messages = [message for message in found if message is not None]
        columns = {name: _column([attrgetter(name)(message) for message in messages]) for name in names}
        return columns, np.array([message is not None for message in found])

    def _undamaged(self, data: bytes) -> Any:
        """A message; None for one that is damaged, which is noted."""
        try:
            return self.deserialize(data)
        except BagError as error:
            self.damage = self.damage or str(error)
            return None

    def _by_size(self, view: Array, starts: Array, sizes: Array, names: Sequence[str]) -> dict[str, Array] | None:
        """All messages of one size together; None when messages of a size have different layouts."""
        groups: list[Array] = []
        parts: dict[str, list[Array]] = {name: [] for name in names}
        for size in np.unique(sizes).tolist():
            chosen = np.flatnonzero(sizes == size)
            first = starts[chosen[0]]
            if size not in self._layouts:
                self._layouts[size] = self.layout(view[first : first + size].tobytes())
            columns = self._layouts[size].gather(view, starts[chosen], names)
            if columns is None:
                return None
            groups.append(chosen)
            for name, column in columns.items():
                parts[name].append(column)
        if len(groups) == 1:
            return {name: columns[0] for name, columns in parts.items()}
        order = np.argsort(np.concatenate(groups))
        return {name: _joined(columns)[order] for name, columns in parts.items()}


class _Walk:
    """Reads the values of one message in order, and notes in `layout` where its fields lie."""

    def __init__(
        self, data: bytes, order: str, types: Mapping[str, Any], classes: Mapping[str, Any], layout: Layout | None
    ) -> None:
        self.data, self.order, self.types, self.classes, self.layout = data, order, types, classes, layout
        self.position = ENCAPSULATION
        self.unused = UNUSED

    def whole(self, kind: str) -> Any:
        """The message, which must fill the bytes."""
        message = self.message(kind, "")
        if self.position + self.unused < len(self.data):
            raise ValueError(f"{len(self.data) - self.position} bytes follow its last field")
        return message

    def message(self, kind: str, prefix: str) -> Any:
        return self.classes[kind](
            **{name: self.field(node, detail, prefix + name) for name, (node, detail) in self.types[kind][1]}
        )

    def field(self, node: Nodetype, detail: Any, name: str) -> Any:
        if node == Nodetype.NAME:
            return self.message(detail, f"{name}.")
        if node == Nodetype.BASE:
            return self.string(name) if detail[0] == "string" else self.numbers(detail[0], (), name)[()].item()
        (element, inner), count = detail
        if node == Nodetype.SEQUENCE:  # whose count in the definition is at most a bound
            count = self.length()
        if element == Nodetype.BASE and inner[0] != "string":
            return self.numbers(inner[0], (count,), name)
        if self.layout:
            self.layout.shared = False
        read = partial(self.string, name) if element == Nodetype.BASE else partial(self.message, inner, f"{name}.")
        return [read() for _ in range(count)]

    def numbers(self, kind: str, shape: tuple[int, ...], name: str) -> Array:
        dtype, count = _DTYPES[self.order][kind], math.prod(shape)
        if count:  # an empty sequence is not followed by padding
            self.align(dtype.itemsize)
        else:
            self.unused += dtype.itemsize
        found = np.frombuffer(self.data, dtype, count, self.position) if count else np.empty(0, dtype)
        self.note(name, dtype.str, shape, found.nbytes)
        return found.reshape(shape)

    def string(self, name: str) -> str:
        length = self.length()
        content = self.data[self.position : self.position + length]
        if len(content) != length or content[-1:] != b"\0":
            raise ValueError(f"the text of {length} bytes at byte {self.position} has no end")
        if self.layout:
            self.layout.lengths[Location(self.position + length - 1, "u1", ())] = 0
        self.note(name, f"S{length}", (), length)
        return content[:-1].decode()

    def length(self) -> int:
        self.align(4)
        (length,) = struct.unpack_from(self.order + "I", self.data, self.position)
        if self.layout:
            self.layout.lengths[Location(self.position, self.order + "u4", ())] = length
        self.position += 4
        return int(length)

    def note(self, name: str, dtype: str, shape: tuple[int, ...], size: int) -> None:
        """Note the field at the present position, and step over it."""
        if self.layout:
            self.layout.fields[name] = Location(self.position, dtype, shape)
        self.position += size

    def align(self, size: int) -> None:
        # CDR aligns a number to its own size, counted from the end of the encapsulation header.
        self.position += -(self.position - ENCAPSULATION) % size


def _strings(column: Array) -> Array:
    """Decode a column of UTF-8 byte strings."""
    if len(column) and (column == column[0]).all():  # frame names: decoded once
        return np.full(len(column), column[0].decode())
    return np.char.decode(column, "utf-8")


def _joined(parts: Iterable[Array]) -> Array:
    """Concatenate the parts of a column; an array of objects if their shapes differ."""
    columns = list(parts)
    if len({column.shape[1:] for column in columns}) <= 1:
        return np.concatenate(columns) if columns else np.empty(0)
    return _column([row for column in columns for row in column])


def _column(values: list[Any]) -> Array:
    """Values of one field: numbers, strings and lists of numbers of one length as such, anything else as objects."""
    if values and isinstance(values[0], bool | int | float | str):
        return np.array(values)
    if values and isinstance(values[0], np.ndarray) and len({value.shape for value in values}) == 1:
        return np.stack(values)
    column = np.empty(len(values), dtype=object)
    column[:] = values
    return column


TIMES = ("log_time", "publish_time")


@dataclass
class Series:
    """One topic of a bag. `series["pose.pose.position.x"]` is a column: a field of all its messages, in order of log time.

    Columns of numbers have the message's own type and the shape (n,), or (n, k) for lists; strings are NumPy strings; lists
    whose length differs from message to message, and lists of messages, are columns of objects. Damaged messages have no row;
    a BagWarning counts them.
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
                raise BagError(f"{self.name} has no field {name}: it must be one of {', '.join(self.fields)}")
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
            self._decoder  # noqa: B018 - reads the definition
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
        """One of the topic's messages as an object with its fields as attributes."""
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
        fields = [name for name in names if name not in TIMES]
        columns, readable = self._decoder.columns(block, starts + MESSAGE_HEADER.size, sizes, fields)
        return columns | {name: headers[name][readable] for name in TIMES}

    def _keep(self, columns: dict[str, list[Array]]) -> None:
        """Keep what has been read in the order of log time; empties `columns`, which may be most of the memory in use."""
        read = {name: _joined(columns.pop(name)) for name in list(columns)}
        if "log_time" in read:
            self._check_damage(len(read["log_time"]))
            order = np.argsort(read["log_time"], kind="stable")  # stable: equal times stay in the recorded order
            self._order = None if (np.diff(order) == 1).all() else order
        for name, column in read.items():
            self._columns[name] = column if self._order is None else column[self._order]

    def _check_damage(self, readable: int) -> None:
        """Report messages that were left out. Raises BagError if none is readable."""
        if self._decoder.damage and not readable:
            raise BagError(self._decoder.damage)
        if self._decoder.damage:
            left_out = f"{self.count - readable} of {self.count} messages of {self.name} are damaged and left out"
            warnings.warn(f"bag {self.files.path}: {left_out} ({self._decoder.damage})", BagWarning, stacklevel=2)

    @cached_property
    def _decoder(self) -> MessageDecoder:
        if self.others or self.encoding != "cdr" or not self.definition:
            raise BagError(f"{self.name} cannot be decoded: it {self.undecodable}")
        return MessageDecoder(self.name, self.type, self.definition)


def load_columns(topics: Iterable[Series], names: Iterable[str] = ()) -> None:
    """Read columns of topics of one bag in one pass over its files; those already read are not read again.

    `topics`: the topics. Of one that has not been read yet, all narrow fields and the times are read. `names`: further
    fields, which all these topics have.
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
