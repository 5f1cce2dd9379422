"""Decodes messages of one type into columns: all at once if their layout allows it, else one by one."""

import struct
from collections.abc import Mapping, Sequence
from functools import cached_property, partial
from operator import attrgetter
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype

from vessel_hsmc_ros.bags.cdr_columns import (
    ENCAPSULATION,
    NUMBERS,
    UNUSED,
    Layout,
    MessageType,
    NoLayout,
    joined,
    read_definition,
    strings,
    texts,
)
from vessel_hsmc_ros.core.exceptions import BagError

_CODES = {"?": "?", "u1": "B", "i1": "b", "u2": "H", "i2": "h", "u4": "I", "i4": "i", "u8": "Q", "i8": "q", "f4": "f", "f8": "d"}

_STRUCTS = {order: {kind: struct.Struct(order + _CODES[code]) for kind, code in NUMBERS.items()} for order in "<>"}
"""How to read one number, by the order of its bytes and its kind."""


class MessageObjects:
    """Makes objects of the messages of one type, by walking its fields.

    No code is made of the definition, which may come from a stranger: the time is proportional to the bytes of the message,
    whatever lengths of arrays the definition declares. `types`: all types that it uses, as `read_definition` returns them.
    """

    def __init__(self, kind: str, types: Mapping[str, Any]) -> None:
        self._kind, self._types = kind, types

    @cached_property
    def classes(self) -> dict[str, type[SimpleNamespace]]:
        """A class for each type, with the constants of its definition."""
        return {
            kind: type(kind.rpartition("/")[2], (SimpleNamespace,), {"__msgtype__": kind} | {n: v for n, _, v in constants})
            for kind, (constants, _) in self._types.items()
        }

    def read(self, data: bytes) -> Any:
        """One message with its fields as attributes; lists of numbers are NumPy arrays, other lists are lists.

        Raises ValueError, struct.error if the bytes are not a message of the type.
        """
        if len(data) < ENCAPSULATION or data[0] or data[1] > 1:
            raise ValueError("its encapsulation is neither CDR_LE nor CDR_BE")
        walk = _Walk(data, "<" if data[1] else ">", self._types, self.classes)
        message = walk.message(self._kind)
        if walk.position + walk.unused < len(data):
            raise ValueError(f"{len(data) - walk.position} bytes follow its last field")
        return message


MAX_NESTED = 10_000  # nested messages of a message, besides one for each of its bytes


class _Walk:
    """Reads the values of one message in order."""

    def __init__(self, data: bytes, order: str, types: Mapping[str, Any], classes: Mapping[str, Any]) -> None:
        self.data, self.order, self.types, self.classes = data, order, types, classes
        self.position = ENCAPSULATION
        # A message without fields takes no bytes: lists of lists of such could go on for ever.
        self.left = MAX_NESTED + len(data)
        self.unused = UNUSED

    def message(self, kind: str) -> Any:
        self.left -= 1
        if self.left < 0:
            raise ValueError("it has more nested messages than bytes")
        return self.classes[kind](**{name: self.field(node, detail) for name, (node, detail) in self.types[kind][1]})

    def field(self, node: Nodetype, detail: Any) -> Any:
        if node == Nodetype.NAME:
            return self.message(detail)
        if node == Nodetype.BASE:
            return self.string() if detail[0] == "string" else self.number(detail[0])
        (element, inner), count = detail
        if node == Nodetype.SEQUENCE:  # whose count in the definition is at most a bound
            count = self.number("uint32")
        if element == Nodetype.BASE and inner[0] != "string":
            return self.numbers(inner[0], count)
        read = self.string if element == Nodetype.BASE else partial(self.message, inner)
        return [read() for _ in range(count)]

    def number(self, kind: str) -> Any:
        number = _STRUCTS[self.order][kind]
        self.align(number.size)
        (value,) = number.unpack_from(self.data, self.position)
        self.position += number.size
        return value

    def numbers(self, kind: str, count: int) -> NDArray[Any]:
        code = NUMBERS[kind]
        dtype = np.dtype(code if code in ("?", "u1", "i1") else self.order + code)
        if count:  # an empty sequence is not followed by padding
            self.align(dtype.itemsize)
        else:
            self.unused += dtype.itemsize
        if not 0 <= count * dtype.itemsize <= len(self.data) - self.position:
            raise ValueError(f"a list of {count} numbers at byte {self.position} ends behind the message")
        found = np.frombuffer(self.data, dtype, count, self.position) if count else np.empty(0, dtype)
        self.position += found.nbytes
        return found

    def string(self) -> str:
        length = self.number("uint32")
        content = self.data[self.position : self.position + length]
        if len(content) != length or content[-1:] != b"\0":
            raise ValueError(f"the text of {length} bytes at byte {self.position} has no end")
        self.position += length
        return content[:-1].decode()

    def align(self, size: int) -> None:
        # CDR aligns a number to its own size, counted from the end of the encapsulation header.
        self.position += -(self.position - ENCAPSULATION) % size


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
            return self._objects.read(data)
        except (ValueError, struct.error) as error:
            raise BagError(f"a message of {self._topic} is not a {self._kind}: {' '.join(str(error).split())}") from None

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
        except NoLayout:
            return None
        columns = self._layouts[size].gather(view, starts, names)
        if columns is not None:
            try:
                columns = {name: strings(c) if c.dtype.kind == "S" else c for name, c in columns.items()}
            except UnicodeDecodeError as error:
                raise BagError(f"a message of {self._topic} is not a {self._kind}: {error}") from None
        return columns

    def _one_by_one(self, data: bytes, starts: Array, sizes: Array, names: Sequence[str]) -> dict[str, Array]:
        ends = (starts + sizes).tolist()
        messages = [self.deserialize(data[start:end]) for start, end in zip(starts.tolist(), ends, strict=True)]
        return {name: _column([attrgetter(name)(message) for message in messages]) for name in names}

    @cached_property
    def _type(self) -> MessageType:
        return MessageType(self._kind, self._definition)

    @cached_property
    def _objects(self) -> MessageObjects:
        return MessageObjects(self._kind, read_definition(self._kind, self._definition))


def _column(values: list[Any]) -> Array:
    """Values of one field: numbers and strings as such, anything else as objects."""
    if values and isinstance(values[0], str):
        return texts(values)
    if values and isinstance(values[0], bool | int | float):
        return np.array(values)
    column = np.empty(len(values), dtype=object)
    column[:] = values
    return column
