"""Parameter declarations: frozen dataclasses whose fields carry unit, range and description.

One declaration yields the ROS parameter (type, descriptor, range), the YAML key of a scenario, `--set node.name=value` on the
command line, the row in docs/parameters.md and the symbol of the equations. A dataclass nested in another is a group: its
parameters are named `group.field`.
"""

import dataclasses
import difflib
import functools
import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any, TypeVar, cast, get_args, get_origin, get_type_hints

from vessel_hsmc_ros.core.exceptions import ParameterError

Value = bool | int | float | str | tuple[float, ...] | tuple[int, ...] | tuple[str, ...]


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
        lists = {tuple[str, ...]: "a list of strings", tuple[int, ...]: "a list of integers"}
        many = lists.get(self.type, f"a list of {self.length or ''} {number}s")
        unit = f" {self.unit}" if self.unit else ""
        span = f" from {self.low:g} to {self.high:g}{unit}" if self.low is not None and self.high is not None else ""
        return " ".join(kinds.get(self.type, many).split()) + span


def check(entry: Entry, value: object, owner: str) -> Value:
    """Check one value and convert it to the declared type.

    `value`: value as read from YAML or ROS. `owner`: name of the node or group, for error messages. Returns the value in the
    declared type.
    """
    try:
        converted = _convert(entry.type, value)
    except (TypeError, ValueError, OverflowError):
        raise _refusal(entry, _brief(value), owner) from None
    numbers = converted if isinstance(converted, tuple) else (converted,)
    outside = any(_outside(entry, number) for number in numbers)
    wrong_length = entry.length is not None and len(numbers) != entry.length
    if outside or wrong_length or (entry.choices and converted not in entry.choices):
        remedy = meant(str(converted), entry.choices) + (f"; {entry.remedy}" if entry.remedy else "")
        raise _refusal(entry, shown(converted), owner, remedy)
    return converted


def _refusal(entry: Entry, given: str, owner: str, remedy: str = "") -> ParameterError:
    """The error of a value that is not allowed, in the form of all such messages of this project."""
    return ParameterError(f"{owner}.{entry.name} must be {entry.allowed} (got {given}){remedy}")


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
    """Convert without loss: an integer is accepted as a float, a NumPy number as Python's; else a TypeError."""
    if get_origin(kind) is tuple:
        element = get_args(kind)[0]
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


__all__ = [
    "Entry",
    "Value",
    "build",
    "changed",
    "check",
    "entries",
    "flatten",
    "group",
    "meant",
    "parameter",
    "shown",
    "suggestion",
    "symbols",
]

T = TypeVar("T")

LONGEST_NAME = 100
"""Characters of an unknown name that are compared with known ones: the time of a comparison grows with their square."""


def parameter(
    default: T,
    description: str,
    *,
    unit: str = "",
    low: float | None = None,
    high: float | None = None,
    choices: tuple[str, ...] = (),
    length: int | None = None,
    symbol: str = "",
    tunable: bool = False,
    remedy: str = "",
) -> T:
    """Declare one parameter as a dataclass field.

    Args:
        default: Default value; its type is the parameter's type.
        description: One sentence, as `ros2 param describe` shows it.
        unit: Physical unit; empty for dimensionless numbers, flags and strings.
        low, high: Inclusive limits, of every element for a list; an upper limit of infinity allows infinity.
        choices: The allowed strings.
        length: The number of elements of a list; None for any.
        symbol: The symbol of this parameter in the equations.
        tunable: Whether it may be changed while the node runs.
        remedy: What to do about a value that is not allowed, at the end of the error message.

    Returns:
        A dataclass field; declared as the type of the default, so that type checkers accept it as the field's default.
    """
    info = {
        "description": description,
        "unit": unit,
        "low": low,
        "high": high,
        "choices": choices,
        "length": length,
        "symbol": symbol,
        "tunable": tunable,
        "remedy": remedy,
    }
    declared: T = dataclasses.field(default=default, metadata=info)
    return declared


def group(cls: type[T], *, tunable: bool = False) -> T:
    """Declare a group of parameters: a nested dataclass with its own declarations.

    Args:
        cls: The nested dataclass.
        tunable: Whether all of the group may change while the node runs, whatever its own declarations allow.
    """
    declared: T = dataclasses.field(default_factory=cls, metadata={"group": cls, "tunable": tunable})
    return declared


def entries(cls: type, prefix: str = "") -> dict[str, Entry]:
    """All declared parameters by their dotted names, in the order of declaration.

    `prefix`: prepended to every name, such as the name of the group and a dot.
    """
    return dict(_entries(cls, prefix))


@functools.cache
def _entries(cls: type, prefix: str) -> dict[str, Entry]:
    found: dict[str, Entry] = {}
    # field.type is a string where annotations are evaluated lazily; get_type_hints resolves it.
    hints = get_type_hints(cls)
    for field in dataclasses.fields(cast("Any", cls)):
        name = prefix + field.name
        if "group" in field.metadata:
            nested = entries(field.metadata["group"], name + ".")
            if field.metadata["tunable"]:
                nested = {key: dataclasses.replace(entry, tunable=True) for key, entry in nested.items()}
            found.update(nested)
        else:
            found[name] = Entry(name, hints[field.name], cast("Value", field.default), **field.metadata)
    return found


def build(cls: type[T], values: Mapping[str, object], owner: str) -> T:
    """Check values by their dotted names and make an instance from them.

    `values`: values as read from YAML or ROS; parameters that are missing keep their default. `owner`: name of the node or group
    that the values belong to, for error messages.
    """
    return changed(cls(), values, owner)


def changed(instance: T, values: Mapping[str, object], owner: str) -> T:
    """An instance with other values, by their dotted names; the arguments and errors are those of `build`."""
    return _replaced(instance, _checked(type(instance), values, owner))


def _checked(cls: type, values: Mapping[str, object], owner: str) -> dict[str, Value]:
    """The values in their declared types."""
    known = _entries(cls, "")
    # All values are checked before an instance is made, so that a rejected change leaves no partial result; before the unknown
    # names, because a choice that is not allowed may be the reason why names are unknown.
    checked = {name: check(known[name], value, owner) for name, value in values.items() if name in known}
    for name in values:
        if name not in known:
            raise ParameterError(f"{owner}.{name} is not a parameter: {suggestion(name, known)}")
    return checked


def _replaced(instance: T, values: Mapping[str, Value]) -> T:
    arguments: dict[str, Any] = {}
    groups: dict[str, dict[str, Value]] = {}
    for name, value in values.items():
        first, _, rest = name.partition(".")
        if rest:
            groups.setdefault(first, {})[rest] = value
        else:
            arguments[first] = value
    arguments |= {name: _replaced(getattr(instance, name), nested) for name, nested in groups.items()}
    return cast("T", dataclasses.replace(cast("Any", instance), **arguments))


def suggestion(name: str, known: Collection[str]) -> str:
    """The known name that is closest to an unknown one, or else all of them, as the end of an error message."""
    whole = [each for each in known if each.endswith(f".{name}")]  # a name without its group is less similar than it means
    close = whole[:1] or difflib.get_close_matches(name[:LONGEST_NAME], known, n=1, cutoff=0.6)
    if close:
        return f"did you mean {close[0]}?"
    # Names without a dot, and each group once as `group.*`: short enough for an error message.
    first_level = dict.fromkeys(f"{first}.*" if rest else first for first, _, rest in (each.partition(".") for each in known))
    return "allowed are " + ", ".join(first_level)


def meant(name: str, known: Collection[str]) -> str:
    """The known name that is closest to an unknown one, as a further part of an error message; empty if none is close."""
    close = difflib.get_close_matches(name[:LONGEST_NAME], known, n=1)
    return f"; did you mean {close[0]}?" if close else ""


def flatten(instance: object) -> dict[str, Value]:
    """Values of an instance by their dotted names, in the order of declaration; the inverse of `build`."""
    return dict(_flatten(instance, ""))


def _flatten(instance: object, prefix: str) -> Iterator[tuple[str, Value]]:
    for field in dataclasses.fields(cast("Any", instance)):
        value = getattr(instance, field.name)
        if "group" in field.metadata:
            yield from _flatten(value, prefix + field.name + ".")
        else:
            yield prefix + field.name, value


def symbols(instance: object) -> dict[str, Any]:
    """Values of an instance by their symbols, for all fields with a symbol outside of groups."""
    return {
        field.metadata["symbol"]: getattr(instance, field.name)
        for field in dataclasses.fields(cast("Any", instance))
        if field.metadata.get("symbol")
    }
