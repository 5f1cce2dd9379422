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
from functools import lru_cache
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
    "bool": "?", "byte": "u1", "char": "u1", "octet": "u1", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip
"""NumPy types of the numbers of message definitions."""


class NoLayout(Exception):  # noqa: N818 - no error for the user: messages are then decoded one by one
    """A message has no layout that other messages could share, for instance because it holds a list of messages."""


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


class MessageType:
    """A message type as the schema in a bag describes it.

    `name`: such as `nav_msgs/msg/Odometry`. `definition`: its text in the form ros2msg, followed by those of all types that it
    uses.

    Raises:
        BagError: the text is not such a definition.
    """

    def __init__(self, name: str, definition: str) -> None:
        self.name = name
        self._types = read_definition(name, definition)

    def fields(self) -> tuple[str, ...]:
        """The dotted names of all fields, down to numbers, strings and lists."""
        return tuple(self._names(self.name, ""))

    def _names(self, kind: str, prefix: str) -> Iterator[str]:
        for name, (node, detail) in self._types[kind][1]:
            if node == Nodetype.NAME:
                yield from self._names(detail, f"{prefix}{name}.")
            else:
                yield prefix + name

    def lists(self, longest: int) -> set[str]:
        """The fields that are lists, except for arrays of at most `longest` elements."""
        return set(self._lists(self.name, "", longest))

    def _lists(self, kind: str, prefix: str, longest: int) -> Iterator[str]:
        for name, (node, detail) in self._types[kind][1]:
            if node == Nodetype.NAME:
                yield from self._lists(detail, f"{prefix}{name}.", longest)
            elif node != Nodetype.BASE and (node == Nodetype.SEQUENCE or detail[1] > longest):
                yield prefix + name

    def layout(self, message: bytes) -> Layout:
        """The layout of one message.

        Raises NoLayout if other messages cannot share it, or the message does not match the definition.
        """
        if len(message) < ENCAPSULATION or message[0] or message[1] > 1:  # neither CDR_BE nor CDR_LE
            raise NoLayout
        encapsulation = {Location(0, "u1", ()): message[0], Location(1, "u1", ()): message[1]}
        walk = _Walk(message, "<" if message[1] else ">", Layout(len(message), lengths=encapsulation), self._types)
        try:
            walk.struct(self.name, "")
        except (struct.error, KeyError):
            raise NoLayout from None
        if not walk.position <= len(message) <= walk.position + walk.unused:
            raise NoLayout
        return walk.layout


@dataclass
class _Walk:
    """Visits the fields of one message in order and notes their locations."""

    message: bytes
    order: str
    layout: Layout
    types: Mapping[str, Any]
    position: int = ENCAPSULATION
    unused: int = UNUSED

    def struct(self, kind: str, prefix: str) -> None:
        for name, (node, detail) in self.types[kind][1]:
            if node == Nodetype.NAME:
                self.struct(detail, f"{prefix}{name}.")
            elif node == Nodetype.BASE:
                self.value(detail[0], prefix + name)
            else:
                (element, inner), count = detail
                if element != Nodetype.BASE or inner[0] not in NUMBERS:
                    raise NoLayout
                count = count if node == Nodetype.ARRAY else self.length()
                self.numbers(inner[0], prefix + name, (count,))

    def value(self, kind: str, name: str) -> None:
        if kind != "string":
            self.numbers(kind, name, ())
            return
        length = self.length()
        if not 0 < length <= WIDEST:  # a string without even its terminating zero
            raise NoLayout
        self.layout.fields[name] = Location(self.position, f"S{length}", ())
        self.position += length

    def numbers(self, kind: str, name: str, shape: tuple[int, ...]) -> None:
        if kind not in NUMBERS:
            raise NoLayout
        code = NUMBERS[kind]
        if shape != (0,):  # an empty sequence is not followed by padding
            self.align(np.dtype(code).itemsize)
        else:
            self.unused += np.dtype(code).itemsize
        location = Location(self.position, code if code in ("?", "u1", "i1") else self.order + code, shape)
        if location.size > WIDEST:
            raise NoLayout
        self.layout.fields[name] = location
        self.position += location.size

    def length(self) -> int:
        self.align(4)
        length: int = struct.unpack_from(self.order + "I", self.message, self.position)[0]
        self.layout.lengths[Location(self.position, self.order + "u4", ())] = length
        self.position += 4
        return length

    def align(self, size: int) -> None:
        # CDR aligns a number to its own size, counted from the end of the encapsulation header.
        self.position += -(self.position - ENCAPSULATION) % size


def strings(column: Array) -> Array:
    """Decode a column of UTF-8 byte strings."""
    if len(column) and (column == column[0]).all():  # frame names: decoded once
        return np.full(len(column), column[0].decode())
    return np.char.decode(column, "utf-8")


def joined(parts: Iterable[Array]) -> Array:
    """Concatenate the parts of a column; an array of objects if their shapes differ."""
    columns = list(parts)
    if len({column.shape[1:] for column in columns}) <= 1 and not _too_wide(columns):
        return np.concatenate(columns) if columns else np.empty(0)
    rows = np.empty(sum(map(len, columns)), dtype=object)
    rows[:] = [row for column in columns for row in column]
    return rows


def texts(values: Sequence[str]) -> Array:
    """A column of texts; of objects where one of them is so long that all in its width would take too much memory."""
    column = np.empty(len(values), dtype=object)
    column[:] = values
    return column if len(values) * max(map(len, values), default=0) > LARGEST_TEXTS else np.array(values)


def _too_wide(columns: Sequence[Array]) -> bool:
    """Whether parts of a column of texts would take too much memory in the width of the widest."""
    widest = max((column.itemsize // 4 for column in columns if column.dtype.kind == "U"), default=0)
    return widest * sum(map(len, columns)) > LARGEST_TEXTS
