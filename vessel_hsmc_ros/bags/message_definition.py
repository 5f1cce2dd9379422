"""Message definitions from bags: parsed, and refused where they are endless, too large or incomplete.

The parser of `rosbags` is used, but not its readers of messages: it compiles Python code for them, a line for each element of an
array, so that a definition such as `string[300000] x` would take it for ever. `message_decoder` and `cdr_columns` do not.
"""

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import get_types_from_msg

from vessel_hsmc_ros.core.exceptions import BagError

LONGEST_DEFINITION = 1 << 20
"""Bytes of the text of a definition with all types that it uses."""

MOST_LINES = 5000
"""Lines of a definition without those of comments; each takes the parser a fraction of a millisecond."""

MOST_FIELDS = 10_000
"""Numbers, strings and lists of a message type, those of nested types counted each time."""

DEEPEST = 32
"""Levels of nested types."""

_COMMENTS = re.compile(r"^[ \t]*(#.*)?\n", re.MULTILINE)
"""Lines without anything but a comment, most lines of many definitions."""


@lru_cache(maxsize=256)
def read_definition(kind: str, text: str) -> Mapping[str, Any]:
    """The types of a definition by their names, each with its constants and its fields.

    Args:
        kind: The message type, such as `nav_msgs/msg/Odometry`.
        text: The definition in the form ros2msg, followed by those of all types that it uses.

    Raises:
        BagError: the text is not such a definition, or exceeds a bound.
    """
    if len(text) > LONGEST_DEFINITION:
        raise BagError(f"the definition of {kind} is refused: it has more than {LONGEST_DEFINITION >> 10} KiB")
    text = _COMMENTS.sub("", text)
    if text.count("\n") > MOST_LINES:
        raise BagError(f"the definition of {kind} is refused: it has more than {MOST_LINES} lines")
    try:
        types: Mapping[str, Any] = get_types_from_msg(text, kind)
    except Exception as error:  # the parser's errors have no common base
        raise BagError(f"the definition of {kind} cannot be read: {error}") from None
    _count(types, kind, kind, 0, {})
    return types


def _count(types: Mapping[str, Any], name: str, kind: str, level: int, known: dict[str, int]) -> int:
    """Number of fields of a type down to numbers and strings; each type is counted once, however often it is used.

    Raises:
        BagError: there are too many, a type contains itself, one is missing, or an array has a negative length.
    """
    if level > DEEPEST:
        raise BagError(f"the definition of {kind} is refused: types contain each other on more than {DEEPEST} levels")
    if name not in types:
        raise BagError(f"the definition of {kind} cannot be read: type {name} is missing")
    if name not in known:
        total = 0
        for _, (node, detail) in types[name][1]:
            if node == Nodetype.ARRAY and detail[1] < 0:
                raise BagError(f"the definition of {kind} cannot be read: an array of {detail[1]} elements")
            nested = detail if node == Nodetype.NAME else detail[0][1] if _lists_messages(node, detail) else None
            total += 1 if nested is None else _count(types, nested, kind, level + 1, known)
        known[name] = total
    if known[name] > MOST_FIELDS:
        raise BagError(f"the definition of {kind} is refused: it has more than {MOST_FIELDS} fields")
    return known[name]


def _lists_messages(node: Nodetype, detail: Any) -> bool:
    return node in (Nodetype.ARRAY, Nodetype.SEQUENCE) and detail[0][0] == Nodetype.NAME
