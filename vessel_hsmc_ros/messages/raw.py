"""Messages as bytes: their class by its name, and the stamp at their beginning."""

import struct
from importlib import import_module
from typing import Any

from vessel_hsmc_ros.core.timing import NANOSECONDS

_STAMP = struct.Struct("<iI")
_STAMPED = ("std_msgs/Header", "builtin_interfaces/Time")


def message_class(kind: str) -> Any:
    """The class of a type such as `nav_msgs/msg/Odometry`.

    Raises:
        ImportError, AttributeError: its package is not installed, or does not have it.
    """
    package, _, name = kind.split("/")
    return getattr(import_module(f"{package}.msg"), name)


def begins_with_stamp(message_type: Any) -> bool:
    """Whether `stamp` can be asked for a class's messages."""
    return next(iter(message_type.get_fields_and_field_types().values()), "") in _STAMPED


def stamp(data: bytes) -> int:
    """Nanoseconds of the stamp that CDR data begin with, after the four bytes of encapsulation."""
    sec, nanosec = _STAMP.unpack_from(data, 4)
    return int(sec * NANOSECONDS + nanosec)
