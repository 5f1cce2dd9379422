"""One declared parameter, and the check of a value against its declaration."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any, cast

from vessel_hsmc_ros.core.exceptions import ParameterError

Value = bool | int | float | str | tuple[float, ...] | tuple[str, ...]


@dataclass(frozen=True)
class Entry:
    """One declared parameter."""

    name: str
    type: Any
    default: Value
    description: str
    unit: str
    low: float | None
    high: float | None
    choices: tuple[str, ...]
    length: int | None
    symbol: str
    tunable: bool
    remedy: str

    @property
    def allowed(self) -> str:
        """Description of the allowed values for error messages, descriptors and the docs."""
        if self.choices:
            return "one of " + ", ".join(self.choices)
        number = "number" if self.high == math.inf else "finite number"
        kinds = {bool: "true or false", int: "an integer", float: f"a {number}", str: "a string"}
        many = "a list of strings" if self.type == tuple[str, ...] else f"a list of {self.length or ''} {number}s"
        unit = f" {self.unit}" if self.unit else ""
        span = f" from {self.low:g} to {self.high:g}{unit}" if self.low is not None and self.high is not None else ""
        return " ".join(kinds.get(self.type, many).split()) + span


def check(entry: Entry, value: object, owner: str) -> Value:
    """Check one value and convert it to the declared type.

    Args:
        entry: The declaration.
        value: Value as read from YAML or ROS.
        owner: Name of the node or group, for error messages.

    Returns:
        The value in the declared type.

    Raises:
        ParameterError: the value has the wrong type, length or range; the message names the value and what is allowed.
    """
    try:
        converted = _convert(entry.type, value)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"{owner}.{entry.name} = {_brief(value)} is not allowed: it takes {entry.allowed}") from None
    numbers = converted if isinstance(converted, tuple) else (converted,)
    outside = any(_outside(entry, number) for number in numbers)
    wrong_length = entry.length is not None and len(numbers) != entry.length
    if outside or wrong_length or (entry.choices and converted not in entry.choices):
        remedy = f"; {entry.remedy}" if entry.remedy else ""
        raise ParameterError(f"{owner}.{entry.name} = {shown(converted)} is not allowed: it takes {entry.allowed}{remedy}")
    return converted


def _brief(value: object) -> str:
    try:
        return repr(value)
    except ValueError:  # Python writes integers of up to some thousand digits only
        return "an integer of very many digits"


def _outside(entry: Entry, number: object) -> bool:
    # bool is a subclass of int in Python, but a flag has no range.
    if isinstance(number, bool | str) or not isinstance(number, int | float):
        return False
    # NaN compares as false with both limits, so it needs a test of its own.
    if math.isnan(number) or (math.isinf(number) and entry.high != math.inf):
        return True
    return (entry.low is not None and number < entry.low) or (entry.high is not None and number > entry.high)


def shown(value: Value) -> str:
    """A value as text; `build` accepts what YAML reads from it."""
    return str(list(value)) if isinstance(value, tuple) else f"{value}"


def _convert(kind: Any, value: object) -> Value:
    """Convert without loss: an integer is accepted as a float, a NumPy number as Python's; any other change of type is an error.

    Raises:
        TypeError: the value is not of this kind.
    """
    if kind in (tuple[float, ...], tuple[str, ...]):
        element = float if kind == tuple[float, ...] else str
        if isinstance(value, str | Mapping) or not hasattr(value, "__iter__"):
            raise TypeError
        return cast("Value", tuple(_convert(element, item) for item in cast("Any", value)))
    # A float may be written without a decimal point, as in `rate_hz: 50`.
    if kind is float and isinstance(value, Real) and not isinstance(value, bool):
        return float(value)
    if kind is int and isinstance(value, Integral) and not isinstance(value, bool):
        return int(value)
    # Strings and flags are never converted: `lockstep: "false"` would otherwise be true.
    if type(value) is not kind:
        raise TypeError
    return cast("Value", value)
