"""The gains that a tuning varies: names and ranges as given on the command line, checked against their declarations."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import Entry
from vessel_hsmc_ros.scenario.parameters import controller_parameters
from vessel_hsmc_ros.scenario.scenario import Scenario, make_law

FORM = "controller.law.name, or controller.law.name=low:high, with :log to search on a logarithmic scale"

NODE, SHARED = "controller.", "observer."
"""All gains are parameters of the controller: those of its law, and of the observer, which every law can have."""

HALF_DECADE = math.sqrt(10.0)
"""Without a range, a gain is searched from its present value divided by this factor to its present value times this factor."""


class Gain(NamedTuple):
    """A gain with its range."""

    parameter: str  # its name, as `controller.law.name`
    # low, high: the range, inclusive
    low: float
    high: float
    logarithmic: bool  # whether it is searched on a logarithmic scale
    whole: bool = False  # whether it takes integers only
    unit: str = ""  # its unit; empty for none

    @property
    def name(self) -> str:
        """The last part of its name."""
        return self.parameter.rpartition(".")[2]

    def at(self, share: float) -> float:
        """The value at a share of the range from 0 to 1, on its scale."""
        value = self.low * (self.high / self.low) ** share if self.logarithmic else self.low + share * (self.high - self.low)
        return round(value) if self.whole else min(max(value, self.low), self.high)


def parse_gains(texts: Sequence[str], law: str, present: Scenario) -> list[Gain]:
    """Parse and check the gains of a tuning.

    `texts`: `controller.law.name`, `controller.law.name=low:high` or `controller.law.name=low:high:log`; an asterisk in a name
    without a range stands for all gains that match. `present`: a scenario, whose values are the middle of the ranges that are
    not given. Raises ParameterError if a gain is unknown, not one of the law, not a number or given twice, or its range is not
    inside the declared one.
    """
    values = schema.flatten(present.controller)
    entries = schema.entries(controller_parameters())
    gains: dict[str, Gain] = {}
    for text in texts:
        name, equals, span = (part.strip() for part in text.partition("="))
        for parameter in _matching(name, law, entries, values) if "*" in name and not equals else [name]:
            entry = _declared(parameter, law, entries)
            if parameter in gains and "*" not in name:
                raise ParameterError(f"--gain must be given once for each gain (got {text}, and {parameter} before)")
            present_value = values[entry.name]
            gain = _in_range(entry, text, span) if equals else _around(entry, present_value)
            gains.setdefault(parameter, gain)
    return list(gains.values())


def _matching(pattern: str, law: str, entries: Mapping[str, Entry], values: Mapping[str, Any]) -> list[str]:
    """The gains of the law that match a pattern; those that are 0 have no range around their value."""
    own = [name for name, entry in entries.items() if name.startswith(f"{law}.") and entry.type is float and values[name]]
    if found := [NODE + name for name in own if fnmatchcase(NODE + name, pattern)]:
        return found
    raise ParameterError(f"--gain must match one of {', '.join(NODE + name for name in own)} (got {pattern})")


def _declared(parameter: str, law: str, entries: Mapping[str, Entry]) -> Entry:
    """The declaration of a gain of a law."""
    name = parameter.removeprefix(NODE)
    mine = [known for known in entries if known.startswith((f"{law}.", SHARED))]
    if name in mine and parameter.startswith(NODE):
        if entries[name].type in (int, float):
            return entries[name]
        raise ParameterError(f"--gain must be a number, and {parameter} is {entries[name].allowed}")
    if name in entries and parameter.startswith(NODE):
        raise ParameterError(f"--gain must be one of {law}, the law to tune (got {parameter})")
    hint = schema.suggestion(parameter, [NODE + known for known in mine])
    raise ParameterError(f"--gain {parameter} is not a gain of {law}: {hint}")


def _in_range(entry: Entry, text: str, span: str) -> Gain:
    """A gain with a given range."""
    parts = span.split(":")
    logarithmic = parts[2:] == ["log"]
    try:
        low, high = (entry.type(part) for part in parts[:2])
    except ValueError:
        raise ParameterError(f"--gain must be {FORM} (got {text})") from None
    if parts[2:] and not logarithmic:
        raise ParameterError(f"--gain must be {FORM} (got {text})")
    for value in (low, high):  # names the value and the declared range
        schema.check(entry, value, NODE.removesuffix("."))
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise ParameterError(f"--gain must have low below high, both finite (got {text})")
    if logarithmic and not low > 0.0:
        raise ParameterError(f"--gain with log must have low above 0 (got {text})")
    return Gain(NODE + entry.name, low, high, logarithmic, entry.type is int, entry.unit)


def _around(entry: Entry, value: Any) -> Gain:
    """A gain with a range of one decade around its present value, as far as that is inside the declared range."""
    parameter = NODE + entry.name
    if not (math.isfinite(value) and value > 0.0):
        raise ParameterError(f"--gain {parameter} needs a range: there is no decade around {value:g}; {FORM}")
    low, high = value / HALF_DECADE, value * HALF_DECADE
    if entry.low is not None:
        low = max(low, entry.low)
    if entry.high is not None:
        high = min(high, entry.high)
    if entry.type is int:
        low, high = max(1, math.floor(low)), math.ceil(high)
    return Gain(parameter, low, high, True, entry.type is int, entry.unit)


def with_gains(scenario: Scenario, values: Mapping[str, object]) -> Scenario:
    """The same scenario with other parameters of its controller.

    `values`: values by `controller.name`. Raises InstabilityError if a gain is unstable at the controller's rate;
    ParameterError if a value is out of range, or does not fit another one.
    """
    changed = {name.removeprefix(NODE): value for name, value in values.items()}
    controller = schema.build(controller_parameters(), schema.flatten(scenario.controller) | changed, "controller")
    make_law(controller)  # constructed only to check what single parameters cannot show
    return replace(scenario, controller=controller, given=scenario.given | set(values))
