"""Serialised messages to columns: where each field lies in the bytes, worked out once for all messages of one layout.

CDR has no table of contents: a field's place depends on the lengths of the texts and sequences before it. Within a topic these
lengths hardly ever change, so the first message's layout serves for all that have the same lengths in the same places.
"""

import math
import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.typesys import get_types_from_msg

from vessel_hsmc_ros.core.exceptions import BagError

Array = NDArray[Any]

ENCAPSULATION = 4
"""Bytes before the first field; alignment counts from their end."""

_NUMBERS = {
    "bool": "?", "byte": "u1", "char": "u1", "octet": "u1", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip


class NoLayout(Exception):  # noqa: N818 - caught where a slower way is open
    """A message has parts whose places differ from message to message, such as a list of messages."""


class Place(NamedTuple):
    """Where a field lies, from the start of the serialised message: bytes, numpy type, shape."""

    offset: int
    dtype: str
    shape: tuple[int, ...]

    @property
    def size(self) -> int:
        """Bytes of the field."""
        return np.dtype(self.dtype).itemsize * math.prod(self.shape)


@dataclass
class Layout:
    """The places of all fields of a message, by dotted names, for messages of one size with the same `lengths`.

    Attributes:
        size: Bytes of the message, encapsulation included.
        lengths: The places of the lengths of texts and sequences, and what they are.
    """

    size: int
    places: dict[str, Place] = field(default_factory=dict)
    lengths: dict[Place, int] = field(default_factory=dict)

    def gather(self, data: Array, starts: Array, names: Sequence[str]) -> dict[str, Array] | None:
        """Fields of many messages at once; None if one of them has another layout.

        Args:
            data: Bytes that hold the messages.
            starts: Where each message starts in them; all have `size` bytes.
            names: The fields to take.
        """
        for place, expected in self.lengths.items():
            if not (_take(data, starts, place) == expected).all():
                return None
        return {name: _take(data, starts, self.places[name]) for name in names}


def _take(data: Array, starts: Array, place: Place) -> Array:
    wanted = data[starts[:, None] + np.arange(place.offset, place.offset + place.size)]
    column = wanted.view(place.dtype) if place.size else np.empty((len(starts), 0), place.dtype)
    return column.reshape((len(starts), *place.shape))


class MessageType:
    """A message type as a bag's schema describes it.

    Args:
        name: Such as `nav_msgs/msg/Odometry`.
        definition: Its text in the form ros2msg, all types that it uses included.

    Raises:
        BagError: the text is not such a definition.
    """

    def __init__(self, name: str, definition: str) -> None:
        self.name = name
        try:
            self._types: Mapping[str, Any] = get_types_from_msg(definition, name)
        except Exception as error:  # the parser's errors have no common base
            raise BagError(f"the definition of {name} cannot be read: {' '.join(str(error).split())}") from None

    def fields(self) -> tuple[str, ...]:
        """The dotted names of all fields down to numbers, texts and lists."""
        return tuple(self._names(self.name, ""))

    def _names(self, kind: str, prefix: str) -> Iterator[str]:
        for name, (node, detail) in self._types[kind][1]:
            if node == Nodetype.NAME:
                yield from self._names(detail, f"{prefix}{name}.")
            else:
                yield prefix + name

    def lists(self, longest: int) -> set[str]:
        """The fields that are lists, but for arrays of at most `longest` numbers."""
        return set(self._lists(self.name, "", longest))

    def _lists(self, kind: str, prefix: str, longest: int) -> Iterator[str]:
        for name, (node, detail) in self._types[kind][1]:
            if node == Nodetype.NAME:
                yield from self._lists(detail, f"{prefix}{name}.", longest)
            elif node != Nodetype.BASE and (node == Nodetype.SEQUENCE or detail[1] > longest):
                yield prefix + name

    def layout(self, message: bytes) -> Layout:
        """The layout of one message.

        Raises:
            NoLayout: there is none that could serve for others too, or the message is not what the definition says.
        """
        if len(message) < ENCAPSULATION or message[0] or message[1] > 1:
            raise NoLayout
        walk = _Walk(message, "<" if message[1] else ">", Layout(len(message)), self._types)
        try:
            walk.take_struct(self.name, "")
        except (struct.error, KeyError):
            raise NoLayout from None
        if walk.position > len(message):
            raise NoLayout
        return walk.layout


@dataclass
class _Walk:
    """Goes through one message and notes where everything is."""

    message: bytes
    order: str
    layout: Layout
    types: Mapping[str, Any]
    position: int = ENCAPSULATION

    def take_struct(self, kind: str, prefix: str) -> None:
        for name, (node, detail) in self.types[kind][1]:
            if node == Nodetype.NAME:
                self.take_struct(detail, f"{prefix}{name}.")
            elif node == Nodetype.BASE:
                self.take_value(detail[0], prefix + name)
            else:
                (element, inner), count = detail
                if element != Nodetype.BASE or inner[0] not in _NUMBERS:
                    raise NoLayout
                count = count if node == Nodetype.ARRAY else self.take_length()
                self.take_numbers(inner[0], prefix + name, (count,))

    def take_value(self, kind: str, name: str) -> None:
        if kind != "string":
            self.take_numbers(kind, name, ())
            return
        length = self.take_length()
        if not length:  # a text without even its closing zero
            raise NoLayout
        self.layout.places[name] = Place(self.position, f"S{length}", ())
        self.position += length

    def take_numbers(self, kind: str, name: str, shape: tuple[int, ...]) -> None:
        if kind not in _NUMBERS:
            raise NoLayout
        code = _NUMBERS[kind]
        if shape != (0,):
            self.align(np.dtype(code).itemsize)
        place = Place(self.position, code if code in ("?", "u1", "i1") else self.order + code, shape)
        self.layout.places[name] = place
        self.position += place.size

    def take_length(self) -> int:
        self.align(4)
        length: int = struct.unpack_from(self.order + "I", self.message, self.position)[0]
        self.layout.lengths[Place(self.position, self.order + "u4", ())] = length
        self.position += 4
        return length

    def align(self, size: int) -> None:
        self.position += -(self.position - ENCAPSULATION) % size


def texts(column: Array) -> Array:
    """A column of texts as CDR has them, in UTF-8, in Python's."""
    if len(column) and (column == column[0]).all():
        return np.full(len(column), column[0].decode())
    return np.char.decode(column, "utf-8")


class Parts:
    """A column that grows part by part. They are joined as they come: few large arrays take less memory than many small ones."""

    AT_ONCE = 256

    def __init__(self) -> None:
        self._large: list[Array] = []
        self._small: list[Array] = []

    def append(self, part: Array) -> None:
        """Add a part at the end."""
        self._small.append(part)
        if len(self._small) == self.AT_ONCE:
            self._large.append(joined(self._small))
            self._small.clear()

    def whole(self) -> Array:
        """The column."""
        return joined([*self._large, *self._small])


def joined(parts: Iterable[Array]) -> Array:
    """Parts of a column in one; as objects where their shapes differ."""
    columns = list(parts)
    if len({column.shape[1:] for column in columns}) <= 1:
        return np.concatenate(columns) if columns else np.empty(0)
    rows = np.empty(sum(map(len, columns)), dtype=object)
    rows[:] = [row for column in columns for row in column]
    return rows
