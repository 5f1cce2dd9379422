"""Serialised messages: their Python class by type name, and the time stamp at their beginning."""

import struct
from importlib import import_module
from typing import Any

from vessel_hsmc_ros.core.timing import NANOSECONDS

_STAMP = struct.Struct("<iI")
# Both have the stamp as their first field, so that it lies at a constant offset in the serialised message.
_STAMPED = ("std_msgs/Header", "builtin_interfaces/Time")


def message_class(kind: str) -> Any:
    """The class of a type such as `nav_msgs/msg/Odometry`.

    Raises:
        ImportError: The package is not installed.
        AttributeError: The package has no such message.
    """
    package, _, name = kind.split("/")
    return getattr(import_module(f"{package}.msg"), name)


def begins_with_stamp(message_type: Any) -> bool:
    """Whether the serialised messages of a class begin with a time stamp, so that `stamp` reads it."""
    return next(iter(message_type.get_fields_and_field_types().values()), "") in _STAMPED


def stamp(data: bytes) -> int:
    """The time stamp, ns, at the beginning of a serialised message, after the four bytes of encapsulation."""
    sec, nanosec = _STAMP.unpack_from(data, 4)
    return int(sec * NANOSECONDS + nanosec)


def with_stamp(data: bytes, stamp: int) -> bytes:
    """A serialised message that begins with a time stamp, with another one, ns."""
    return data[:4] + _STAMP.pack(*divmod(stamp, NANOSECONDS)) + data[4 + _STAMP.size :]
