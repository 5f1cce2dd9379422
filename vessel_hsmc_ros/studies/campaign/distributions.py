"""Distributions of drawn parameters, each evaluated by its inverse, and the points of the unit cube that it is evaluated at.

A continuous distribution is truncated to the range of its parameter, which keeps its shape inside:

    x = F⁻¹(F(low) + u·(F(high) − F(low))),    0 < u < 1
"""

import math
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib.metadata import entry_points
from typing import Any

import numpy as np
import yaml
from scipy.special import ndtr, ndtri
from scipy.stats import qmc

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import InstallationError, ParameterError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.schema import Entry, Value
from vessel_hsmc_ros.scenario.parameters import declared
from vessel_hsmc_ros.scenario.parameters_file import VESSEL, read_yaml
from vessel_hsmc_ros.scenario.scenario import Scenario

METHODS = ("random", "latin_hypercube", "sobol")

MAX_RUNS = 2**30  # largest number of draws: the length of the Sobol sequence
SEEDS = 2**31  # number of the seeds that the plant accepts
_BLOCK = 1024
_SMALLEST = 2.0**-53
_STREAM = 1  # separates the random numbers of a draw from those that the plant makes from its seed


def point(method: str, dimensions: int, seed: int, draws: int, draw: int) -> tuple[float, ...]:
    """A point of the open unit cube. Returns the coordinates, between 0 and 1 and neither of them."""
    if method == "latin_hypercube":
        row = _hypercube(dimensions, seed, draws)[draw]
    else:
        row = _block(method, dimensions, seed, draw // _BLOCK)[draw % _BLOCK]
    # The inverse of a normal distribution is infinite at 0 and 1.
    return tuple(min(max(u, _SMALLEST), 1.0 - _SMALLEST) for u in row.tolist())


def noise_seed(seed: int, draw: int) -> int:
    """Seed of the plant's random numbers in a draw; all draws of a campaign have different ones."""
    first = int(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0])
    return (first + draw) % SEEDS


@lru_cache(maxsize=4)
def _hypercube(dimensions: int, seed: int, draws: int) -> Array:
    """The table of a Latin hypercube, (draws, dimensions): its rows cannot be made one by one."""
    return np.asarray(qmc.LatinHypercube(dimensions, rng=np.random.default_rng(seed)).random(draws))


@lru_cache(maxsize=8)
def _block(method: str, dimensions: int, seed: int, number: int) -> Array:
    """A block of consecutive points, (_BLOCK, dimensions)."""
    first = number * _BLOCK
    if method == "random":
        return np.array([np.random.default_rng((seed, k, _STREAM)).random(dimensions) for k in range(first, first + _BLOCK)])
    sequence = qmc.Sobol(dimensions, rng=np.random.default_rng(seed))
    if first:
        sequence.fast_forward(first)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of the balance of a number that is no power of two
        # A point is the lower corner of its cell; the middle of the cell is never on the border of the cube.
        return np.asarray(sequence.random(_BLOCK)) + 0.5 / MAX_RUNS


@dataclass(frozen=True)
class Uniform:
    """A number, or the logarithm of one above 0, that is equally likely between the ends."""

    low: float
    high: float
    logarithmic: bool = False

    def truncated(self, low: float, high: float) -> "Uniform | None":
        """The same within limits; None if no value is."""
        inside = replace(self, low=max(self.low, low), high=min(self.high, high))
        return inside if inside.low <= inside.high else None

    def quantile(self, u: float) -> float:
        """The value below which a draw is with probability u."""
        if not self.logarithmic:
            return self.low + u * (self.high - self.low)
        return min(max(self.low * math.exp(u * math.log(self.high / self.low)), self.low), self.high)


@dataclass(frozen=True)
class Normal:
    """A number, or the logarithm of one above 0, that is Gaussian between limits."""

    mean: float
    deviation: float
    low: float = -math.inf
    high: float = math.inf
    logarithmic: bool = False

    def truncated(self, low: float, high: float) -> "Normal | None":
        """The same within limits; None if practically no value is: its probability is below the smallest number."""
        if self.logarithmic:
            low, high = (math.log(limit) if limit > 0.0 else -math.inf for limit in (low, high))
        inside = replace(self, low=max(self.low, low), high=min(self.high, high))
        lower, upper = inside._probabilities()
        return inside if upper > lower else None

    def quantile(self, u: float) -> float:
        """The value below which a draw is with probability u."""
        lower, upper = self._probabilities()
        if self._mirrored:
            u = 1.0 - u
        standard = float(ndtri(lower + u * (upper - lower)))
        value = self.mean + self.deviation * (-standard if self._mirrored else standard)
        value = min(max(value, self.low), self.high)
        return math.exp(value) if self.logarithmic else value

    @property
    def _mirrored(self) -> bool:
        # Above the mean probabilities are close to 1, where their differences cancel; the mirror image has them close to 0.
        return self.low > self.mean

    def _probabilities(self) -> tuple[float, float]:
        """Those of the limits in the standard normal distribution, or in its mirror image."""
        low, high = (self.low - self.mean) / self.deviation, (self.high - self.mean) / self.deviation
        return (float(ndtr(-high)), float(ndtr(-low))) if self._mirrored else (float(ndtr(low)), float(ndtr(high)))


@dataclass(frozen=True)
class Choice:
    """One of several values, all equally likely."""

    values: tuple[Any, ...]

    def quantile(self, u: float) -> Any:
        """The value that belongs to u."""
        return self.values[min(int(u * len(self.values)), len(self.values) - 1)]


@dataclass(frozen=True)
class Grid:
    """All of several values, in combination with those of the other grids."""

    values: tuple[Any, ...]


Continuous = Uniform | Normal
Distribution = Continuous | Choice | Grid

LARGEST_GRID = 100_000

FORMS = {
    "uniform": ("[low, high]", "finite numbers with low <= high"),
    "loguniform": ("[low, high]", "finite numbers with 0 < low <= high"),
    "normal": ("[mean, deviation]", "finite numbers with deviation > 0"),
    "lognormal": ("[median, sigma]", "finite numbers above 0"),
    "choice": ("[value, value, ...]", "at least one value"),
    "values": ("[value, value, ...]", "at least one value"),
    "grid": ("[start, stop, count]", f"finite numbers, with an integer count from 2 to {LARGEST_GRID}"),
    "loggrid": (
        "[start, stop, count]",
        f"finite numbers, start and stop of the same sign, with an integer count from 2 to {LARGEST_GRID}",
    ),
}
"""The distributions of a campaign file, what each takes, and under which conditions."""

RELATIVE = "relative"


def parse_distribution(given: Any) -> tuple[Distribution, bool]:
    """Make a distribution from an entry such as `{uniform: [0.8, 1.2], relative: true}`.

    Returns the distribution, not truncated; whether it is one of factors on the base value.
    """
    kinds = list(given.keys() - {RELATIVE}) if isinstance(given, Mapping) else []
    if len(kinds) != 1 or kinds[0] not in FORMS:
        forms = ", ".join(f"{kind}: {form}" for kind, (form, _) in FORMS.items())
        raise ParameterError(f"distribution must be one of {{{forms}}}, and relative: true for factors (got {given})")
    kind, arguments, relative = kinds[0], given[kinds[0]], given.get(RELATIVE, False)
    if not isinstance(relative, bool):
        raise ParameterError(f"relative must be true or false (got {relative})")
    made = _make(kind, arguments) if isinstance(arguments, list) else None
    if made is None:
        raise ParameterError(f"{kind} must be {', '.join(FORMS[kind])} (got {arguments})")
    return made, relative


AXIS = "node.param=start:stop:count, start:stop:count:log or a list such as 0.1,0.2,0.5"


def parse_axis(text: str) -> tuple[str, dict[str, list[Any]]]:
    """Parse a parameter on a grid, `node.param=` with a range or a list, into its name and its entry in a campaign file."""
    name, _, given = (part.strip() for part in text.partition("="))
    try:
        if ":" not in given:
            return name, {"values": read_yaml(f"[{given}]")}
        start, stop, count, *form = given.split(":")
        return name, {{(): "grid", ("log",): "loggrid"}[tuple(form)]: [float(start), float(stop), int(count)]}
    except (KeyError, ValueError, yaml.YAMLError):
        raise ParameterError(f"sweep must be {AXIS} (got {text})") from None


def _make(kind: str, arguments: list[Any]) -> Distribution | None:
    """A distribution, or None if the arguments do not suit it."""
    if kind in ("choice", "values"):
        return (Choice if kind == "choice" else Grid)(tuple(arguments)) if arguments else None
    if not all(isinstance(x, int | float) and not isinstance(x, bool) and math.isfinite(x) for x in arguments):
        return None
    made: Distribution | None = None
    match kind, arguments:
        case "uniform", [low, high] if low <= high:
            made = Uniform(float(low), float(high))
        case "loguniform", [low, high] if 0.0 < low <= high:
            made = Uniform(float(low), float(high), logarithmic=True)
        case "normal", [mean, deviation] if deviation > 0.0:
            made = Normal(float(mean), float(deviation))
        case "lognormal", [median, sigma] if median > 0.0 and sigma > 0.0:
            made = Normal(math.log(median), float(sigma), logarithmic=True)
        case "grid", [start, stop, int(count)] if 2 <= count <= LARGEST_GRID:
            made = _grid(np.linspace(start, stop, count))
        case "loggrid", [start, stop, int(count)] if 2 <= count <= LARGEST_GRID and start * stop > 0.0:
            made = _grid(np.geomspace(start, stop, count))
    return made


def _grid(values: Array) -> Grid:
    """A grid of values, rounded to 12 digits: 0.3 instead of 0.30000000000000004."""
    return Grid(tuple(float(f"{x:.12g}") for x in values.tolist()))


SHIP = "ship."  # prefix of the numbers of a family of ships in a campaign file
FAMILIES = "vessel_hsmc_ros.ship_families"
"""Group of the entry points. A family is a dataclass of declared numbers. Its method `changes` gives the changes to a scenario
that make it that of their ship; `infeasible(scenario)` tells why no law can keep that ship on its reference, empty if one can."""


@lru_cache(maxsize=1)
def ship_family() -> Any:
    """The installed family of ships."""
    for entry in entry_points(group=FAMILIES):
        return entry.load()
    raise InstallationError(
        f"names such as {SHIP}length need a family of ships, and none is installed: in a checkout of vessel_hsmc_ros, run"
        " pip install ./benchmarks/ship_family"
    )


_ELEMENT = re.compile(r"(.*)\[(\d+)\]")

LISTS = (tuple[float, ...], tuple[str, ...])


@dataclass(frozen=True)
class Drawn:
    """A parameter with a distribution."""

    name: str  # as in the campaign file: `node.parameter`, `vessel.parameter` for all nodes, `node.parameter[0]` for an element
    parameter: str  # the same without the element
    element: int | None  # number of the element; None for the entire parameter
    entry: Entry  # declaration of the parameter
    distribution: Continuous | Choice | Grid  # of the value, or of its factor; truncated to the range of the parameter
    factor: float = 1.0  # what a drawn number is multiplied by: the base value where the file has `relative`, else 1

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
    """Make a drawn parameter from its entry in a campaign file."""
    match = _ELEMENT.fullmatch(name)
    parameter, element = (match[1], int(match[2])) if match else (name, None)
    entry, base = _declaration(parameter, scenario)
    if element is not None:
        if entry.type not in LISTS or not isinstance(base, tuple) or element >= len(base):
            count = f"has the elements 0 to {len(base) - 1}" if isinstance(base, tuple) else "is not a list"
            raise ParameterError(f"draw {name}: {parameter} = {schema.shown(base)} {count}")
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
    if parameter.startswith(SHIP):
        family = schema.entries(ship_family())
        if rest not in family:
            raise ParameterError(f"draw {parameter} is not a number of a ship: {schema.suggestion(rest, family)}")
        return family[rest], family[rest].default
    if parameter.startswith(VESSEL):
        node, rest = next((name for name, known in nodes.items() if parameter in known), ""), parameter
    if rest not in nodes.get(node, {}):
        known = [f"{owner}.{key}" for owner, names in nodes.items() for key in names]
        raise ParameterError(f"draw {parameter} is not a parameter: {schema.suggestion(parameter, known)}")
    if parameter == "controller.law":
        raise ParameterError("controller.law cannot be drawn: give several laws as `laws` (--laws of a sweep) or in `variants`")
    return nodes[node][rest], schema.flatten(getattr(scenario, node))[rest]


def _factor(name: str, base: Value, relative: bool) -> float:
    if not relative:
        return 1.0
    if isinstance(base, bool) or not isinstance(base, int | float) or base == 0 or not math.isfinite(base):
        raise ParameterError(f"draw {name}: the base value of relative must be a finite number, not 0 (got {schema.shown(base)})")
    return float(base)


def _allowed(drawn: Drawn, given: Mapping[str, Any]) -> Continuous | Choice | Grid:
    """The distribution of a parameter within its range; values that are listed must be in it."""
    distribution, entry = drawn.distribution, drawn.entry
    if isinstance(distribution, Choice | Grid):
        for value in distribution.values:
            _check(drawn, value)
        return distribution
    if drawn.type not in (int, float):
        raise ParameterError(f"draw {drawn.name} must be a choice (got {given}), as the parameter is {entry.allowed}")
    # An integer takes the share of the numbers that are rounded to it.
    half = 0.5 if drawn.type is int else 0.0
    if half and isinstance(distribution, Uniform) and not distribution.logarithmic:
        wider = half / abs(drawn.factor)
        distribution = Uniform(distribution.low - wider, distribution.high + wider)
    low, high = drawn.limits
    inside = distribution.truncated(*sorted(((low - half) / drawn.factor, (high + half) / drawn.factor)))
    if inside is None:
        raise ParameterError(f"draw {drawn.name} must have values that are {entry.allowed} (got {given})")
    return inside


def _check(drawn: Drawn, value: Any) -> None:
    """Check a listed value."""
    length = drawn.entry.length if drawn.element is None else None
    schema.check(replace(drawn.entry, name=drawn.name, type=drawn.type, length=length), drawn.scaled(value), "draw")
