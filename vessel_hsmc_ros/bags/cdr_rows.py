"""Encoding of columns into serialised messages (CDR); the counterpart of `cdr_columns`.

One message is serialised as a template. The numbers of all messages are then written into copies of it, column by column.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from vessel_hsmc_ros.bags.cdr_columns import MessageType

Array = NDArray[Any]


class MessageEncoder:
    """Encodes messages of one type that have the same texts and the same lengths of lists.

    Args:
        kind: The message type, such as `nav_msgs/msg/Odometry`.
        definition: Its text in the form ros2msg with all types that it uses.
        texts: Values of its texts by dotted names; others are empty.
        lengths: Lengths of its lists of numbers by dotted names; others are empty.

    Attributes:
        type_hash: RIHS01 hash of the type.
        fields: Locations of its fields by dotted names.
    """

    def __init__(self, kind: str, definition: str, texts: Mapping[str, str], lengths: Mapping[str, int]) -> None:
        self._store: Any = get_typestore(Stores.EMPTY)
        self._store.register(get_types_from_msg(definition, kind))
        self._given = {**texts, **{name: np.zeros(length) for name, length in lengths.items()}}
        message = bytes(self._store.serialize_cdr(self._empty(kind, ""), kind))
        self._template = np.frombuffer(message, np.uint8)
        self.fields = MessageType(kind, definition).layout(message).fields
        self.type_hash: str = self._store.hash_rihs01(kind)

    def encode(self, columns: Mapping[str, Array]) -> list[bytes]:
        """Serialised messages with the values of some columns; all other numbers are zero.

        Args:
            columns: By dotted names of fields, with a row for each message.
        """
        count = len(next(iter(columns.values())))
        rows = np.tile(self._template, (count, 1))
        for name, values in columns.items():
            place = self.fields[name]
            numbers = np.ascontiguousarray(values, place.dtype)
            rows[:, place.offset : place.offset + place.size] = numbers.view(np.uint8).reshape(count, place.size)
        data, size = rows.tobytes(), rows.shape[1]
        return [data[start : start + size] for start in range(0, len(data), size)]

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
