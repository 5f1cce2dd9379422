"""Decodes messages of one type into columns: all at once if their layout allows it, else one by one."""

import struct
from collections.abc import Sequence
from functools import cached_property
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.bags.cdr_columns import Layout, MessageType, joined, strings, texts
from vessel_hsmc_ros.core.exceptions import BagError

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
