"""Serialised messages: Python class by type name, time stamp at their beginning; and changes of single fields of a message."""

import struct
from importlib import import_module
from typing import Any

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.timing import NANOSECONDS

_STAMP = struct.Struct("<iI")
# Both have the stamp as their first field, so that it lies at a constant offset in the serialised message.
_STAMPED = ("std_msgs/Header", "builtin_interfaces/Time")


def message_class(kind: str) -> Any:
    """The class of a type such as `nav_msgs/msg/Odometry`."""
    package, _, name = kind.split("/")
    return getattr(import_module(f"{package}.msg"), name)


def type_name(message_type: Any) -> str:
    """The type of a class of messages, such as `nav_msgs/msg/Odometry`."""
    return f"{message_type.__module__.partition('.')[0]}/msg/{message_type.__name__}"


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


_DOUBLE, _BITS = struct.Struct("<d"), struct.Struct("<Q")


def edit(message: Any, field: str, change: str, value: Any) -> None:
    """Change one field of a message in place.

    `message`: any object with the fields of a ROS message. `field`: its dotted name; an element of an array by its index, such
    as `pose.covariance.0`. `change`: `set`, `add`, `scale` or `flip` (a bit of the number's 64). `value`: the new value, the
    addend, the factor, or the index of the bit.
    """
    *groups, leaf = field.split(".")
    owner = message
    for name in groups:
        owner = getattr(owner, name)
    old = owner[int(leaf)] if leaf.isdigit() else getattr(owner, leaf)
    new = _changed(old, change, value)
    if leaf.isdigit():
        owner[int(leaf)] = new
    else:
        setattr(owner, leaf, new)


def _changed(old: Any, change: str, value: Any) -> Any:
    if change == "set":
        return value
    if change == "flip":
        return _DOUBLE.unpack(_BITS.pack(_BITS.unpack(_DOUBLE.pack(old))[0] ^ (1 << value)))[0]
    return float(old + value) if change == "add" else float(old * value)


def check_field(kind: str, field: str, owner: str) -> None:
    """Check that a message type has a field that is a floating-point number.

    `kind`: a type such as `nav_msgs/msg/Odometry`. `owner`: name of the setting, for the error message.
    """
    value = message_class(kind)()
    try:
        for name in field.split("."):
            value = value[int(name)] if name.isdigit() else getattr(value, name)
    except (AttributeError, IndexError, KeyError, TypeError):
        value = None
    if not isinstance(value, float):
        raise ParameterError(f"{owner} must be a floating-point number of {kind} (got {field})")
