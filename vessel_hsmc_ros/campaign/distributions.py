"""Distributions of drawn parameters, each evaluated by its inverse: a value is a pure function of a number from 0 to 1.

A continuous distribution is truncated to the range of its parameter, which keeps its shape inside:

    x = F⁻¹(F(low) + u·(F(high) − F(low))),    0 < u < 1
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri

from vessel_hsmc_ros.core.exceptions import ParameterError


@dataclass(frozen=True)
class Uniform:
    """Equally likely from `low` to `high`."""

    low: float
    high: float

    def truncated(self, low: float, high: float) -> "Uniform | None":
        """The same within limits; None if no value is."""
        inside = Uniform(max(self.low, low), min(self.high, high))
        return inside if inside.low <= inside.high else None

    def quantile(self, u: float) -> float:
        """The value below which a draw is with probability u."""
        return self.low + u * (self.high - self.low)


@dataclass(frozen=True)
class LogUniform:
    """A positive number whose logarithm is equally likely between those of `low` and `high`."""

    low: float
    high: float

    def truncated(self, low: float, high: float) -> "LogUniform | None":
        """The same within limits; None if no value is."""
        inside = LogUniform(max(self.low, low), min(self.high, high))
        return inside if inside.low <= inside.high else None

    def quantile(self, u: float) -> float:
        """The value below which a draw is with probability u."""
        return min(max(self.low * math.exp(u * math.log(self.high / self.low)), self.low), self.high)


@dataclass(frozen=True)
class Normal:
    """Gaussian with a mean and a standard deviation, between `low` and `high`."""

    mean: float
    deviation: float
    low: float = -math.inf
    high: float = math.inf

    def truncated(self, low: float, high: float) -> "Normal | None":
        """The same within limits; None if practically no value is: its probability is below the smallest number."""
        inside = Normal(self.mean, self.deviation, max(self.low, low), min(self.high, high))
        lower, upper = inside._probabilities()
        return inside if upper > lower else None

    def quantile(self, u: float) -> float:
        """The value below which a draw is with probability u."""
        lower, upper = self._probabilities()
        if self._mirrored:
            u = 1.0 - u
        standard = float(ndtri(lower + u * (upper - lower)))
        value = self.mean + self.deviation * (-standard if self._mirrored else standard)
        return min(max(value, self.low), self.high)

    @property
    def _mirrored(self) -> bool:
        # Above the mean probabilities are close to 1, where their differences cancel; the mirror image has them close to 0.
        return self.low > self.mean

    def _probabilities(self) -> tuple[float, float]:
        """Those of the limits in the standard normal distribution, or in its mirror image."""
        low, high = (self.low - self.mean) / self.deviation, (self.high - self.mean) / self.deviation
        return (float(ndtr(-high)), float(ndtr(-low))) if self._mirrored else (float(ndtr(low)), float(ndtr(high)))


@dataclass(frozen=True)
class Lognormal:
    """A positive number whose logarithm is Gaussian."""

    logarithm: Normal

    def truncated(self, low: float, high: float) -> "Lognormal | None":
        """The same within limits; None if no value is."""
        if high <= 0.0:
            return None
        inside = self.logarithm.truncated(math.log(low) if low > 0.0 else -math.inf, math.log(high))
        return None if inside is None else Lognormal(inside)

    def quantile(self, u: float) -> float:
        """The value below which a draw is with probability u."""
        return math.exp(self.logarithm.quantile(u))


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

    values: tuple[float, ...]


Continuous = Uniform | LogUniform | Normal | Lognormal
Distribution = Continuous | Choice | Grid

FORMS = {
    "uniform": "[low, high]",
    "loguniform": "[low, high]",
    "normal": "[mean, deviation]",
    "lognormal": "[median, sigma]",
    "choice": "[value, value, ...]",
    "grid": "[start, stop, count]",
}
"""The distributions of a campaign file, and what each takes."""

RELATIVE = "relative"

LARGEST_GRID = 100_000


def parse_distribution(given: Any) -> tuple[Distribution, bool]:
    """Make a distribution from an entry such as `{uniform: [0.8, 1.2], relative: true}`.

    Returns:
        The distribution, not truncated; whether it is one of factors on the base value.

    Raises:
        ParameterError: the entry has another form; the message continues a text that names the parameter.
    """
    kinds = list(given.keys() - {RELATIVE}) if isinstance(given, Mapping) else []
    if len(kinds) != 1 or kinds[0] not in FORMS:
        forms = ", ".join(f"{kind}: {form}" for kind, form in FORMS.items())
        raise ParameterError(f"{given} is not allowed: it takes one of {{{forms}}}, and relative: true for factors")
    kind, arguments, relative = kinds[0], given[kinds[0]], given.get(RELATIVE, False)
    if not isinstance(relative, bool):
        raise ParameterError(f"relative: {relative} is not allowed: it takes true or false")
    made = _make(kind, arguments) if isinstance(arguments, list) else None
    if made is None:
        raise ParameterError(f"{kind}: {arguments} is not allowed: it takes {FORMS[kind]}{_CONDITIONS[kind]}")
    return made, relative


_CONDITIONS = {
    "uniform": ", finite numbers with low <= high",
    "loguniform": ", finite numbers with 0 < low <= high",
    "normal": ", finite numbers with deviation > 0",
    "lognormal": ", finite numbers above 0",
    "choice": ", at least one value",
    "grid": f", finite numbers, with an integer count from 2 to {LARGEST_GRID}",
}


def _make(kind: str, arguments: list[Any]) -> Distribution | None:
    """A distribution, or None if the arguments do not suit it."""
    if kind == "choice":
        return Choice(tuple(arguments)) if arguments else None
    if not all(isinstance(x, int | float) and not isinstance(x, bool) and math.isfinite(x) for x in arguments):
        return None
    if kind == "grid":
        whole = len(arguments) == 3 and isinstance(arguments[2], int) and 2 <= arguments[2] <= LARGEST_GRID
        # Rounded to 12 digits: 0.3 instead of 0.30000000000000004.
        return Grid(tuple(float(f"{x:.12g}") for x in np.linspace(*arguments).tolist())) if whole else None
    return _continuous(kind, *map(float, arguments)) if len(arguments) == 2 else None


def _continuous(kind: str, a: float, b: float) -> Continuous | None:
    if kind == "uniform":
        return Uniform(a, b) if a <= b else None
    if kind == "loguniform":
        return LogUniform(a, b) if 0.0 < a <= b else None
    if kind == "normal":
        return Normal(a, b) if b > 0.0 else None
    return Lognormal(Normal(math.log(a), b)) if a > 0.0 and b > 0.0 else None
