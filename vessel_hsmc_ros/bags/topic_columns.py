"""The messages of one topic as columns, read when they are asked for."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from vessel_hsmc_ros.bags.cdr_columns import Layout, MessageType, NoLayout, Parts, Place, joined, texts
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.core.timing import NANOSECONDS

Array = NDArray[Any]

TIMES = ("log_time", "publish_time")

WIDE = 8
"""A field of more elements than this is read when it is asked for itself, not along with the others of its topic."""

MESSAGE_HEADER = 31
"""Bytes of a message record before the message: opcode, length, channel, sequence, two times."""

_LENGTH, _LOG_TIME, _PUBLISH_TIME = Place(1, "<u8", ()), Place(15, "<i8", ()), Place(23, "<i8", ())
_TIMES = Layout(MESSAGE_HEADER, {"size": _LENGTH, "log_time": _LOG_TIME, "publish_time": _PUBLISH_TIME})


@dataclass
class Series:
    """One topic of a bag. `series["pose.pose.position.x"]` is a column: a field of all its messages, in order of log time.

    Numbers are of the message's own type, (n,) or (n, k) for lists; texts are numpy texts; what differs in length from message
    to message, or is a list of messages, comes as objects.

    Attributes:
        name: The topic, with its leading slash.
        type: Such as `nav_msgs/msg/Odometry`.
        definition: The type's text.
        type_hash: RIHS01 hash of the type; empty if the bag does not tell.
        qos: The profiles that its publishers offered.
        count: Messages.
    """

    name: str
    type: str
    definition: str
    type_hash: str
    qos: list[dict[str, Any]]
    load: Callable[["Series", Sequence[str]], None] = field(repr=False)
    count: int = 0
    _columns: dict[str, Array] = field(default_factory=dict, repr=False)
    _layouts: dict[int, Layout] = field(default_factory=dict, repr=False)
    _irregular: bool = field(default=False, repr=False)
    _order: Array | None = field(default=None, repr=False)

    def __len__(self) -> int:
        return self.count

    def __contains__(self, name: str) -> bool:
        return name in self.fields

    def __getitem__(self, name: str) -> Array:
        if name not in self._columns:
            if name not in (*self.fields, *TIMES):
                raise BagError(f"{self.name} has no field {name}: it takes one of {', '.join(self.fields)}")
            self.load(self, (name,))
        return self._columns[name]

    @cached_property
    def fields(self) -> tuple[str, ...]:
        """The dotted names of all fields."""
        return self._message_type.fields()

    @cached_property
    def wide(self) -> set[str]:
        """Fields of more than WIDE elements, and lists whose lengths only the messages tell."""
        return self._message_type.lists(WIDE)

    @property
    def log_time(self) -> Array:
        """When each message was received, ns."""
        return self["log_time"]

    @property
    def publish_time(self) -> Array:
        """When each message was sent, ns."""
        return self["publish_time"]

    @property
    def stamp(self) -> Array:
        """The messages' own time, ns: that of the header or the clock, else the log time."""
        for name in ("header.stamp", "clock", "stamp"):
            if f"{name}.sec" in self.fields:
                return self[f"{name}.sec"].astype(np.int64) * NANOSECONDS + self[f"{name}.nanosec"]
        return self.log_time

    def stack(self, *names: str) -> Array:
        """Several columns of numbers side by side, (n, k)."""
        return np.column_stack([self[name] for name in names])

    # -- for the bag that reads ---------------------------------------------------------------------------------------

    def missing(self, names: Sequence[str]) -> list[str]:
        """What to read for some fields: those, the times, and the other narrow fields of the topic too."""
        if self._columns:
            return [name for name in names if name not in self._columns]
        return list(dict.fromkeys((*TIMES, *names, *(name for name in self.fields if name not in self.wide))))

    def take(self, data: bytes, starts: Sequence[int], names: Sequence[str]) -> dict[str, Array]:
        """The columns of the messages whose records start at some places of a chunk's records.

        Raises:
            BagError: a message cannot be decoded.
        """
        places, view = np.array(starts), np.frombuffer(data, np.uint8)
        columns = _TIMES.gather(view, places, tuple(_TIMES.places)) or {}
        sizes = columns.pop("size") - (MESSAGE_HEADER - 9)
        decoded = None if self._irregular else self._take_regular(view, places + MESSAGE_HEADER, sizes, names)
        if decoded is None:
            raw = [data[s + MESSAGE_HEADER : s + MESSAGE_HEADER + n] for s, n in zip(starts, sizes.tolist(), strict=True)]
            decoded = self._take_irregular(raw, names)
        return columns | decoded

    def put(self, columns: dict[str, Parts]) -> None:
        """Keep what has been read, part by part in the order of the files; empties `columns`, which may be most of memory."""
        whole = {name: columns.pop(name).whole() for name in list(columns)}
        if "log_time" in whole:
            order = np.argsort(whole["log_time"], kind="stable")
            self._order = None if (np.diff(order) == 1).all() else order
        for name, column in whole.items():
            self._columns[name] = column if self._order is None else column[self._order]

    def deserializer(self) -> Callable[[bytes], Any]:
        """A function from a message's bytes to an object with its fields.

        Raises:
            BagError: from the function, for bytes that are no such message.
        """
        store = get_typestore(Stores.EMPTY)
        store.register(get_types_from_msg(self.definition, self.type))

        def deserialize(data: bytes) -> Any:
            try:
                return store.deserialize_cdr(data, self.type)
            except (SerdeError, AssertionError, ValueError, IndexError) as error:
                raise BagError(f"a message of {self.name} is not a {self.type}: {' '.join(str(error).split())}") from None

        return deserialize

    def _take_regular(self, view: Array, starts: Array, sizes: Array, names: Sequence[str]) -> dict[str, Array] | None:
        """All at once, for each size of message; None when messages of a size have different layouts."""
        groups: list[Array] = []
        parts: dict[str, list[Array]] = {name: [] for name in names}
        for size in np.unique(sizes).tolist():
            chosen = np.flatnonzero(sizes == size)
            columns = self._take_size(view, starts[chosen], size, names)
            if columns is None:
                self._irregular = True
                return None
            groups.append(chosen)
            for name, column in columns.items():
                parts[name].append(column)
        if len(groups) == 1:
            return {name: columns[0] for name, columns in parts.items()}
        order = np.argsort(np.concatenate(groups))
        return {name: joined(columns)[order] for name, columns in parts.items()}

    def _take_size(self, view: Array, starts: Array, size: int, names: Sequence[str]) -> dict[str, Array] | None:
        try:
            if size not in self._layouts:
                self._layouts[size] = self._message_type.layout(view[starts[0] : starts[0] + size].tobytes())
        except NoLayout:
            return None
        columns = self._layouts[size].gather(view, starts, names)
        if columns is not None:
            columns = {name: texts(c) if c.dtype.kind == "S" else c for name, c in columns.items()}
        return columns

    def _take_irregular(self, raw: Sequence[bytes], names: Sequence[str]) -> dict[str, Array]:
        messages = [self._deserialize(data) for data in raw]
        return {name: _column([attrgetter(name)(message) for message in messages]) for name in names}

    @cached_property
    def _deserialize(self) -> Callable[[bytes], Any]:
        return self.deserializer()

    @cached_property
    def _message_type(self) -> MessageType:
        return MessageType(self.type, self.definition)


def _column(values: list[Any]) -> Array:
    """Values of one field: numbers and texts as such, anything else as objects."""
    if values and isinstance(values[0], bool | int | float | str):
        return np.array(values)
    column = np.empty(len(values), dtype=object)
    column[:] = values
    return column
