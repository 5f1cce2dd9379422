"""Changes of single fields of a message, by their dotted names."""

import struct
from typing import Any

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.messages.raw import message_class

_DOUBLE, _BITS = struct.Struct("<d"), struct.Struct("<Q")


def edit(message: Any, field: str, change: str, value: Any) -> None:
    """Change one field of a message in place.

    Args:
        message: Any object with the fields of a ROS message.
        field: Its dotted name; an element of an array by its index, such as `pose.covariance.0`.
        change: `set`, `add`, `scale` or `flip` (a bit of the number's 64).
        value: The new value, the addend, the factor, or the index of the bit.
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

    Args:
        kind: A type such as `nav_msgs/msg/Odometry`.
        field: Dotted name of the field.
        owner: Name of the setting, for the error message.

    Raises:
        ParameterError: it has no such field.
    """
    value = message_class(kind)()
    try:
        for name in field.split("."):
            value = value[int(name)] if name.isdigit() else getattr(value, name)
    except (AttributeError, IndexError, KeyError, TypeError):
        value = None
    if not isinstance(value, float):
        raise ParameterError(f"{owner} = {field} is not allowed: it takes a floating-point number of {kind}")
