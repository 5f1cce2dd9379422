"""Serialised messages (CDR) to and from Python, several times faster than rclpy; of numbers, texts and lists of numbers.

rclpy converts element by element, and checks each. Here one `struct` packs a message of given lengths of texts and lists. The
bytes are those of rclpy. A message that is read is a tuple of tuples with the fields of the type, which cannot be changed.
"""

import struct
from collections import namedtuple
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache, partial
from itertools import count
from operator import attrgetter
from typing import Any, NamedTuple, cast

from vessel_hsmc_ros.messages.raw import message_class

LITTLE_ENDIAN = b"\0\1\0\0"  # the encapsulation of a serialised message, from whose end alignment counts
NUMBERS = {
    "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q",
    "float": "f", "double": "d",
}  # fmt: skip
CODES = {**NUMBERS, "boolean": "?"}  # of single values; rclpy has lists of booleans, unlike of numbers, as lists of Python
LENGTH, TEXT = "I", "string"


class Leaf(NamedTuple):
    """A field without fields of its own."""

    name: str  # dotted, of the attributes that hold the values: properties cost more than all else
    code: str  # of `struct`; empty for a text
    elements: int | None = None  # elements of an array; None for a single value, -1 for a list of any length

    @property
    def varies(self) -> bool:
        """Whether its length is part of a message."""
        return not self.code or self.elements == -1


def _leaves(kind: Any, prefix: str = "") -> Iterator[Leaf]:
    """The leaves of a message type. Raises KeyError for a type with other lists than of numbers, or bounded texts."""
    for field, name in zip(kind.__slots__, kind.get_fields_and_field_types().values(), strict=False):
        element, _, count = name.removeprefix("sequence<").rstrip(">]").partition("[")
        if name == TEXT:
            yield Leaf(prefix + field, "")
        elif "/" in name and element == name:
            package, _, short = name.partition("/")
            yield from _leaves(message_class(f"{package}/msg/{short}"), f"{prefix}{field}.")
        elif name.startswith("sequence<"):
            yield Leaf(prefix + field, NUMBERS[element], -1)
        elif count:
            yield Leaf(prefix + field, NUMBERS[element], int(count))
        else:
            yield Leaf(prefix + field, CODES[element])


def _format(leaves: Sequence[Leaf], lengths: Sequence[int]) -> str:
    """The format of a message whose texts, with the zero at their ends, and lists have some lengths."""
    parts, position, given = ["<4s"], 0, iter(lengths)

    def add(code: str, size: int, alignment: int) -> None:
        nonlocal position
        gap = -position % alignment
        parts.append(f"{gap}x{code}" if gap else code)
        position += gap + size

    for leaf in leaves:
        size = struct.calcsize(f"<{leaf.code}") if leaf.code else 1
        count = leaf.elements
        if leaf.varies:
            add(LENGTH, 4, 4)
            count = next(given)
        if count is None:
            add(leaf.code, size, size)
        else:
            add(f"{count * size}s", count * size, size if count else 1)
    return "".join(parts)


class Encoder:
    """Serialises messages of a type.

    Attributes:
        leaves: The leaves of the type.
        names: Of its leaves, dotted.
        values: Returns the values of a message's leaves.
    """

    def __init__(self, kind: Any) -> None:
        self.leaves = tuple(_leaves(kind))
        self.names = [leaf.name.replace("_", "", 1).replace("._", ".") for leaf in self.leaves]
        names = [leaf.name for leaf in self.leaves]
        self.values: Callable[[Any], Any] = attrgetter(*names)
        if len(names) == 1:
            self.values = lambda message: (getattr(message, names[0]),)
        lists = [(i, leaf) for i, leaf in enumerate(self.leaves) if leaf.varies or leaf.elements is not None]
        self._lists = [(i, not leaf.code, leaf.varies) for i, leaf in lists]
        self._formats: dict[tuple[int, ...], struct.Struct] = {}

    def __call__(self, message: Any) -> bytes:
        """The serialised form of a message."""
        return self.pack(self.values(message))

    def pack(self, values: Sequence[Any]) -> bytes:
        """The serialised form of a message, given by the values of its leaves."""
        made, given = self.prepare(values)
        return made.pack(*given)

    def prepare(self, values: Sequence[Any]) -> tuple[struct.Struct, list[Any]]:
        """The struct that packs a message, given by the values of its leaves, and what it packs: lengths too, texts as bytes."""
        given: list[Any] = [LITTLE_ENDIAN]
        lengths: list[int] = []
        done = 0
        for i, text, varies in self._lists:
            given += values[done:i]
            value = values[i]
            data = value.encode() + b"\0" if text else value.tobytes()
            if varies:
                length = len(data if text else value)
                given.append(length)
                lengths.append(length)
            given.append(data)
            done = i + 1
        key = tuple(lengths)
        if (made := self._formats.get(key)) is None:
            made = self._formats[key] = struct.Struct(_format(self.leaves, key))
        given += values[done:]
        return made, given


def _expression(text: str, **names: Any) -> Callable[[Sequence[Any]], Any]:
    """A function of `v` as one expression, of our own text: a loop would take twice as long."""
    function: Callable[[Sequence[Any]], Any] = eval(f"lambda v: {text}", names)  # noqa: S307
    return function


class Draft:
    """Serialises messages that differ from one of their type in some fields only: no message is filled for each.

    `message`: has the values of all other fields. `names`: dotted names of the fields that differ, whose values it takes.
    """

    def __init__(self, message: Any, names: Sequence[str]) -> None:
        encode = Encoder(type(message))
        kept, form = list(encode.values(message)), "pack(({},))"
        places, pack = [encode.names.index(name) for name in names], cast("Callable[..., bytes]", encode.pack)
        if all(encode.leaves[i].elements is None and encode.leaves[i].code for i in places):  # the lengths stay
            made, kept = encode.prepare(kept)
            places, form, pack = [_place(encode.leaves, i) for i in places], "pack({})", made.pack
        parts = [f"kept[{i}]" for i in range(len(kept))]
        for number, place in enumerate(places):
            parts[place] = f"v[{number}]"
        self._pack = _expression(form.format(", ".join(parts)), pack=pack, kept=kept)

    def __call__(self, values: Sequence[Any]) -> bytes:
        """The serialised form of a message with some values of its fields that differ."""
        return self._pack(values)  # type: ignore[no-any-return]


def _place(leaves: Sequence[Leaf], i: int) -> int:
    """Where a leaf is among the values that `struct` packs: after the encapsulation, and the lengths up to its own."""
    return 1 + i + sum(leaf.varies for leaf in leaves[: i + 1])


class Decoder:
    """Reads serialised messages of a type without lists of any length."""

    def __init__(self, kind: Any) -> None:
        self._leaves = tuple(_leaves(kind))
        if any(leaf.elements == -1 for leaf in self._leaves):
            raise KeyError(f"{kind.__name__} has a list of any length")
        self._texts = [i for i, leaf in enumerate(self._leaves) if leaf.varies]
        self._made = _constructor(kind, self._leaves)
        lengths = "".join(f"v[{_place(self._leaves, i) - 1}], " for i in self._texts)
        self._form = _expression(f"(v[0], {lengths})")
        self._expect([0] * len(self._texts))

    def _expect(self, lengths: Sequence[int]) -> None:
        self._expected = (LITTLE_ENDIAN, *lengths)
        self._struct = struct.Struct(_format(self._leaves, lengths))

    def __call__(self, data: bytes) -> Any:
        """The message. Raises ValueError if it is not in the order of bytes, or not of the length, that is expected."""
        if len(data) != self._struct.size or self._form(values := self._struct.unpack(data)) != self._expected:
            self._expect(self._lengths(data))
            if len(data) != self._struct.size or self._form(values := self._struct.unpack(data)) != self._expected:
                raise ValueError("of another form")
        return self._made(values)

    def _lengths(self, data: bytes) -> list[int]:
        """The lengths of the texts in a message."""
        lengths: list[int] = []
        for i in self._texts:
            known = struct.calcsize(_format(self._leaves[:i], lengths))
            at = known + -(known - len(LITTLE_ENDIAN)) % 4
            lengths.append(int.from_bytes(data[at : at + 4], "little"))
            if not 0 < lengths[-1] <= len(data) - at:
                raise ValueError("a text is longer than the message")
        return lengths


def _constructor(kind: Any, leaves: Sequence[Leaf]) -> Callable[[Sequence[Any]], Any]:
    """What makes the tuples of a message from the values that `struct` has read."""
    makers: dict[str, Any] = {"view": memoryview}
    numbers = count()

    def value(i: int) -> str:
        leaf, read = leaves[i], f"v[{_place(leaves, i)}]"
        if not leaf.code:
            return f"{read}[:-1].decode()"
        return read if leaf.elements is None else f"view({read}).cast('{leaf.code}')"

    def made(kind: Any) -> str:
        fields = kind.get_fields_and_field_types()
        name = f"make_{len(makers)}"
        makers[name] = partial(tuple.__new__, namedtuple(kind.__name__, fields))
        parts = [made(message_class(f.replace("/", "/msg/"))) if "/" in f else value(next(numbers)) for f in fields.values()]
        return f"{name}(({', '.join(parts)},))"

    return _expression(made(kind), **makers)


@lru_cache(maxsize=256)
def encoder(kind: Any) -> Encoder | None:
    """What serialises messages of a type; None where the type has other lists than of numbers."""
    try:
        return Encoder(kind)
    except KeyError:
        return None


def decoder(kind: Any) -> Decoder | None:
    """What reads serialised messages of a type; None where the type has lists of any length."""
    try:
        return Decoder(kind)
    except KeyError:
        return None
