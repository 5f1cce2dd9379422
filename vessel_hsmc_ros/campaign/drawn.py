"""A drawn parameter: its declaration, its base value, and the distribution of its values."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from vessel_hsmc_ros.campaign import ship_family
from vessel_hsmc_ros.campaign.distributions import Choice, Continuous, Grid, Uniform, parse_distribution
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import Entry, Value
from vessel_hsmc_ros.scenario.control import values_in_use
from vessel_hsmc_ros.scenario.parameters import VESSEL, declared
from vessel_hsmc_ros.scenario.scenario import Scenario

_ELEMENT = re.compile(r"(.*)\[(\d+)\]")

LISTS = (tuple[float, ...], tuple[str, ...])


@dataclass(frozen=True)
class Drawn:
    """A parameter with a distribution.

    Attributes:
        name: As in the campaign file: `node.parameter`, `vessel.parameter` for all nodes, `node.parameter[0]` for an element.
        parameter: The same without the element.
        element: Number of the element; None for the entire parameter.
        entry: Declaration of the parameter.
        distribution: Of the value, or of its factor; truncated to the range of the parameter.
        factor: What a drawn number is multiplied by: the base value where the file has `relative`, else 1.
    """

    name: str
    parameter: str
    element: int | None
    entry: Entry
    distribution: Continuous | Choice | Grid
    factor: float = 1.0

    @property
    def type(self) -> Any:
        """Type of a value: that of the parameter, or of its elements."""
        return self.entry.type if self.element is None else self.entry.type.__args__[0]

    @property
    def limits(self) -> tuple[float, float]:
        """The declared range; infinite where there is none."""
        low, high = self.entry.low, self.entry.high
        return -math.inf if low is None else low, math.inf if high is None else high

    def value(self, drawn: Any) -> Any:
        """The parameter's value from a drawn number, text or list."""
        value = self.scaled(drawn)
        if isinstance(value, bool) or not isinstance(value, int | float):
            return value
        low, high = self.limits
        return type(value)(min(max(value, low), high))  # rounding may have left the range

    def scaled(self, drawn: Any) -> Any:
        """A drawn number times the factor, rounded for an integer; what is no number as it is."""
        if self.type not in (int, float) or isinstance(drawn, bool) or not isinstance(drawn, int | float):
            return tuple(drawn) if isinstance(drawn, list) else drawn
        number = self.factor * drawn
        return math.floor(number + 0.5) if self.type is int else float(number)


def make_drawn(name: str, given: Any, scenario: Scenario) -> Drawn:
    """Make a drawn parameter from its entry in a campaign file.

    Args:
        name: As in the file.
        given: Its distribution, such as `{normal: [0.0, 1.0]}`.
        scenario: The base scenario, with the base values.

    Raises:
        ParameterError: there is no such parameter, or its distribution has a wrong form or no value in the parameter's range.
    """
    match = _ELEMENT.fullmatch(name)
    parameter, element = (match[1], int(match[2])) if match else (name, None)
    entry, base = _declaration(parameter, scenario)
    if element is not None:
        if entry.type not in LISTS or not isinstance(base, tuple) or element >= len(base):
            count = f"it has the elements 0 to {len(base) - 1}" if isinstance(base, tuple) else "it is not a list"
            raise ParameterError(f"draw {name} is not allowed: {parameter} = {schema.shown(base)}, {count}")
        base = base[element]
    try:
        distribution, relative = parse_distribution(given)
    except ParameterError as error:
        raise ParameterError(f"draw {name}: {error}") from None
    drawn = Drawn(name, parameter, element, entry, distribution, _factor(name, base, relative))
    return replace(drawn, distribution=_allowed(drawn, given))


def _declaration(parameter: str, scenario: Scenario) -> tuple[Entry, Value]:
    """The declaration of a parameter and its base value; hull data of all nodes are those of the first that has them."""
    nodes = declared()
    node, _, rest = parameter.partition(".")
    if parameter.startswith(ship_family.SHIP):
        family = schema.entries(ship_family.ShipFamily)
        if rest not in family:
            raise ParameterError(f"draw {parameter} is not a number of a ship: {schema.suggestion(rest, family)}")
        return family[rest], family[rest].default
    if parameter.startswith(VESSEL):
        node, rest = next((name for name, known in nodes.items() if parameter in known), ""), parameter
    if rest not in nodes.get(node, {}):
        known = [f"{owner}.{key}" for owner, names in nodes.items() for key in names]
        raise ParameterError(f"draw {parameter} is not a parameter: {schema.suggestion(parameter, known)}")
    if parameter == "controller.law":
        raise ParameterError("draw controller.law is not allowed: the keys `laws` and `variants` of the file take laws")
    return nodes[node][rest], values_in_use(scenario, node)[rest]


def _factor(name: str, base: Value, relative: bool) -> float:
    if not relative:
        return 1.0
    if isinstance(base, bool) or not isinstance(base, int | float) or base == 0 or not math.isfinite(base):
        raise ParameterError(
            f"draw {name}: relative is not allowed: the base value is {schema.shown(base)}, a factor takes a finite number, not 0"
        )
    return float(base)


def _allowed(drawn: Drawn, given: Mapping[str, Any]) -> Continuous | Choice | Grid:
    """The distribution of a parameter within its range; values that are listed must be in it.

    Raises:
        ParameterError: none of its values is, or one of those that are listed is not.
    """
    distribution, entry = drawn.distribution, drawn.entry
    if isinstance(distribution, Choice | Grid):
        for value in distribution.values:
            _check(drawn, value)
        return distribution
    if drawn.type not in (int, float):
        raise ParameterError(f"draw {drawn.name}: {given} is not allowed: the parameter takes {entry.allowed}, so give a choice")
    # An integer takes the share of the numbers that are rounded to it.
    half = 0.5 if drawn.type is int else 0.0
    if half and isinstance(distribution, Uniform):
        wider = half / abs(drawn.factor)
        distribution = Uniform(distribution.low - wider, distribution.high + wider)
    low, high = drawn.limits
    inside = distribution.truncated(*sorted(((low - half) / drawn.factor, (high + half) / drawn.factor)))
    if inside is None:
        raise ParameterError(f"draw {drawn.name}: no value of {given} is allowed: the parameter takes {entry.allowed}")
    return inside


def _check(drawn: Drawn, value: Any) -> None:
    """Check a listed value.

    Raises:
        ParameterError: it is of a wrong type or out of range.
    """
    length = drawn.entry.length if drawn.element is None else None
    schema.check(replace(drawn.entry, name=drawn.name, type=drawn.type, length=length), drawn.scaled(value), "draw")
