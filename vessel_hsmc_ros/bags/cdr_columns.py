"""Decoding of serialised messages (CDR) into columns: messages with the same byte layout are decoded all at once.

CDR has no table of contents: the location of a field depends on the lengths of the strings and sequences before it. Within a
topic these lengths hardly ever change, so the first message's layout serves for all messages that have the same lengths.

The layout follows from the message's definition. The parser of `rosbags` is used, but not its readers of messages: it compiles
Python code for them, a line for each element of an array, which takes long for a large one.
"""

import math
import re
import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.typesys import get_types_from_msg

from vessel_hsmc_ros.core.exceptions import BagError

_COMMENTS = re.compile(r"^[ \t]*(#.*)?\n", re.MULTILINE)
"""Lines without anything but a comment, most lines of many definitions."""


@lru_cache(maxsize=256)
def read_definition(kind: str, text: str) -> Mapping[str, Any]:
    """The types of a definition by their names, each with its constants and its fields.

    `kind`: the message type, such as `nav_msgs/msg/Odometry`. `text`: the definition in the form ros2msg, followed by those of
    all types that it uses. Raises BagError if the text is not such a definition, or lacks a type.
    """
    try:
        types: Mapping[str, Any] = get_types_from_msg(_COMMENTS.sub("", text), kind)
    except Exception as error:  # the parser's errors have no common base
        raise BagError(f"the definition of {kind} cannot be read: {error}") from None
    for name in (name for _, fields in types.values() for _, (node, detail) in fields for name in _nested(node, detail)):
        if name not in types:
            raise BagError(f"the definition of {kind} cannot be read: type {name} is missing")
    return types


def _nested(node: Nodetype, detail: Any) -> list[str]:
    """The message type of a field, or of the elements of a list; none for numbers and strings."""
    if node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        node, detail = detail[0]
    return [detail] if node == Nodetype.NAME else []


Array = NDArray[Any]

ENCAPSULATION = 4  # bytes of the encapsulation header before the first field; alignment counts from its end
UNUSED = 3
"""Bytes at the end of a message that a writer may add to align what follows. rclpy reserves the alignment of each empty list of
numbers besides, which it does not use."""

WIDEST = 1 << 20
"""Bytes of the largest field that is decoded together with those of other messages: their index takes eight times as much."""

LARGEST_TEXTS = 1 << 24  # characters of the largest column of texts in NumPy's form, in which each takes as much as the longest
NUMBERS = {
    "bool": "?", "byte": "B", "char": "B", "octet": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H",
    "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
"""How `struct` and NumPy name the numbers of message definitions."""

_DTYPES = {order: {kind: np.dtype(order + code) for kind, code in NUMBERS.items()} for order in "<>"}
_STRUCTS = {order: {kind: struct.Struct(order + code) for kind, code in NUMBERS.items()} for order in "<>"}


class Location(NamedTuple):
    """Where a field lies in a serialised message: offset in bytes, NumPy type, shape."""

    offset: int
    dtype: str
    shape: tuple[int, ...]

    @property
    def size(self) -> int:
        """Bytes of the field."""
        return np.dtype(self.dtype).itemsize * math.prod(self.shape)


@dataclass
class Layout:
    """The locations of all fields of a message, for messages of one size with the same `lengths`."""

    size: int  # bytes of the message with its encapsulation header
    fields: dict[str, Location] = field(default_factory=dict)  # locations by dotted names
    # locations of the encapsulation and of the lengths of strings and sequences, and their values
    lengths: dict[Location, int] = field(default_factory=dict)
    shared: bool = True  # whether other messages can have it: not if there is a list of texts or messages

    def gather(self, data: Array, starts: Array, names: Sequence[str]) -> dict[str, Array] | None:
        """Columns of some fields of many messages; None if one of the messages has another layout.

        `data`: bytes that contain the messages, uint8, (m,). `starts`: offsets of the messages, (n,); each message has `size`
        bytes. Returns columns by name, each with n rows.
        """
        for location, expected in self.lengths.items():
            if not (_gather(data, starts, location) == expected).all():
                return None
        if not all(_ended(data, starts, each) for each in self.fields.values() if each.dtype[0] == "S"):
            return None
        return {name: _gather(data, starts, self.fields[name]) for name in names}


def _gather(data: Array, starts: Array, location: Location) -> Array:
    # A copy of the field's bytes, one row per message, reinterpreted as numbers without a loop over messages.
    chosen = data[starts[:, None] + np.arange(location.offset, location.offset + location.size)]
    column = chosen.view(location.dtype) if location.size else np.empty((len(starts), 0), location.dtype)
    return column.reshape((len(starts), *location.shape))


def _ended(data: Array, starts: Array, text: Location) -> bool:
    """Whether a text ends with one zero in all messages; NumPy would take others for the same text."""
    last = starts + text.offset + text.size - 1
    return not data[last].any() and (text.size == 1 or bool(data[last - 1].all()))


MAX_NESTED = 10_000  # nested messages of a message, besides one for each of its bytes


class MessageType:
    """A message type as the schema in a bag describes it.

    No code is made of the definition, which may come from a stranger: the time is proportional to the bytes of a message,
    whatever lengths of arrays the definition declares. `name`: such as `nav_msgs/msg/Odometry`. `definition`: its text in the
    form ros2msg, followed by those of all types that it uses.

    Raises:
        BagError: the text is not such a definition.
    """

    def __init__(self, name: str, definition: str) -> None:
        self.name = name
        self._types = read_definition(name, definition)

    def fields(self) -> tuple[str, ...]:
        """The dotted names of all fields, down to numbers, strings and lists."""
        return tuple(name for name, _, _ in self._fields(self.name, ""))

    def lists(self, longest: int) -> set[str]:
        """The fields that are lists, except for arrays of at most `longest` elements."""
        kinds = self._fields(self.name, "")
        return {name for name, node, n in kinds if node == Nodetype.SEQUENCE or (node == Nodetype.ARRAY and n[1] > longest)}

    def _fields(self, kind: str, prefix: str) -> Iterator[tuple[str, Nodetype, Any]]:
        for name, (node, detail) in self._types[kind][1]:
            if node == Nodetype.NAME:
                yield from self._fields(detail, f"{prefix}{name}.")
            else:
                yield prefix + name, node, detail

    @cached_property
    def _classes(self) -> dict[str, type[SimpleNamespace]]:
        """A class for each type, with the constants of its definition."""
        return {
            kind: type(kind.rpartition("/")[2], (SimpleNamespace,), {"__msgtype__": kind} | {n: v for n, _, v in constants})
            for kind, (constants, _) in self._types.items()
        }

    def read(self, data: bytes) -> Any:
        """One message with its fields as attributes; lists of numbers are NumPy arrays, other lists are lists.

        Raises ValueError, struct.error if the bytes are not a message of the type.
        """
        return self._walked(data, None)

    def layout(self, message: bytes) -> Layout:
        """The layout of one message.

        Raises ValueError, struct.error if the bytes are not a message of the type.
        """
        encapsulation = {Location(i, "u1", ()): byte for i, byte in enumerate(message[:2])}
        layout = Layout(len(message), lengths=encapsulation)
        self._walked(message, layout)
        return layout

    def _walked(self, data: bytes, layout: Layout | None) -> Any:
        if len(data) < ENCAPSULATION or data[0] or data[1] > 1:
            raise ValueError("its encapsulation is neither CDR_LE nor CDR_BE")
        walk = _Walk(data, "<" if data[1] else ">", self._types, self._classes, layout)
        message = walk.message(self.name, "")
        if walk.position + walk.unused < len(data):
            raise ValueError(f"{len(data) - walk.position} bytes follow its last field")
        return message


class _Walk:
    """Reads the values of one message in order, and notes in `layout` where its fields lie."""

    def __init__(
        self, data: bytes, order: str, types: Mapping[str, Any], classes: Mapping[str, Any], layout: Layout | None
    ) -> None:
        self.data, self.order, self.types, self.classes, self.layout = data, order, types, classes, layout
        self.position = ENCAPSULATION
        # A message without fields takes no bytes: lists of lists of such would be read without an end.
        self.left = MAX_NESTED + len(data)
        self.unused = UNUSED

    def message(self, kind: str, prefix: str) -> Any:
        self.left -= 1
        if self.left < 0:
            raise ValueError("it has more nested messages than bytes")
        return self.classes[kind](
            **{name: self.field(node, detail, prefix + name) for name, (node, detail) in self.types[kind][1]}
        )

    def field(self, node: Nodetype, detail: Any, name: str) -> Any:
        if node == Nodetype.NAME:
            return self.message(detail, f"{name}.")
        if node == Nodetype.BASE:
            return self.string(name) if detail[0] == "string" else self.number(detail[0], name)
        (element, inner), count = detail
        if node == Nodetype.SEQUENCE:  # whose count in the definition is at most a bound
            count = self.length()
        if element == Nodetype.BASE and inner[0] != "string":
            return self.numbers(inner[0], count, name)
        if self.layout:
            self.layout.shared = False
        read = partial(self.string, name) if element == Nodetype.BASE else partial(self.message, inner, f"{name}.")
        return [read() for _ in range(count)]

    def number(self, kind: str, name: str) -> Any:
        dtype = _DTYPES[self.order][kind]
        self.align(dtype.itemsize)
        (value,) = _STRUCTS[self.order][kind].unpack_from(self.data, self.position)
        self.note(name, dtype.str, (), dtype.itemsize)
        return value

    def numbers(self, kind: str, count: int, name: str) -> Array:
        dtype = _DTYPES[self.order][kind]
        if count:  # an empty sequence is not followed by padding
            self.align(dtype.itemsize)
        else:
            self.unused += dtype.itemsize
        if not 0 <= count * dtype.itemsize <= len(self.data) - self.position:
            raise ValueError(f"a list of {count} numbers at byte {self.position} ends behind the message")
        found = np.frombuffer(self.data, dtype, count, self.position) if count else np.empty(0, dtype)
        self.note(name, dtype.str, (count,), found.nbytes)
        return found

    def string(self, name: str) -> str:
        length = self.length()
        content = self.data[self.position : self.position + length]
        if len(content) != length or content[-1:] != b"\0":
            raise ValueError(f"the text of {length} bytes at byte {self.position} has no end")
        self.note(name, f"S{length}", (), length)
        return content[:-1].decode()

    def length(self) -> int:
        self.align(4)
        (length,) = _STRUCTS[self.order]["uint32"].unpack_from(self.data, self.position)
        if self.layout:
            self.layout.lengths[Location(self.position, self.order + "u4", ())] = length
        self.position += 4
        return int(length)

    def note(self, name: str, dtype: str, shape: tuple[int, ...], size: int) -> None:
        """Note the field at the present position, and step over it."""
        if self.layout:
            self.layout.fields[name] = Location(self.position, dtype, shape)
            self.layout.shared &= size <= WIDEST
        self.position += size

    def align(self, size: int) -> None:
        # CDR aligns a number to its own size, counted from the end of the encapsulation header.
        self.position += -(self.position - ENCAPSULATION) % size


def strings(column: Array) -> Array:
    """Decode a column of UTF-8 byte strings."""
    if len(column) and (column == column[0]).all():  # frame names: decoded once
        return np.full(len(column), column[0].decode())
    return np.char.decode(column, "utf-8")


def joined(parts: Iterable[Array]) -> Array:
    """Concatenate the parts of a column; an array of objects if their shapes differ, or its texts would take too much memory."""
    columns = list(parts)
    count = sum(map(len, columns))
    widest = max((column.itemsize // 4 for column in columns if column.dtype.kind == "U"), default=0)
    if len({column.shape[1:] for column in columns}) <= 1 and widest * count <= LARGEST_TEXTS:
        return np.concatenate(columns) if columns else np.empty(0)
    rows = np.empty(count, dtype=object)
    rows[:] = [row for column in columns for row in column]
    return rows


def texts(values: Sequence[str]) -> Array:
    """A column of texts; of objects where one of them is so long that all in its width would take too much memory."""
    column = np.empty(len(values), dtype=object)
    column[:] = values
    return column if len(values) * max(map(len, values), default=0) > LARGEST_TEXTS else np.array(values)
