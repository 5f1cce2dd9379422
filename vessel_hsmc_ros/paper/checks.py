"""How a claim is judged: numbers of runs against thresholds, all of which must be met."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from vessel_hsmc_ros.paper.numbers import Numbers

Results = Mapping[str, Numbers]
"""The numbers of every run, by its name."""


@dataclass(frozen=True)
class Check:
    """One number, or the ratio of two, against a threshold.

    Attributes:
        words: What is measured.
        run, number: Which one.
        below, above: The threshold, one of the two; a number that does not exist meets none.
        unit: Its unit, with the space before it where it takes one.
        over: Divide by this number of this run.
    """

    words: str
    run: str
    number: str
    below: float | None = None
    above: float | None = None
    unit: str = ""
    over: tuple[str, str] | None = None

    def value(self, results: Results) -> float:
        """The measured value."""
        value: float = getattr(results[self.run], self.number)
        if self.over is not None:
            value /= getattr(results[self.over[0]], self.over[1])
        return value

    def holds(self, results: Results) -> bool:
        """Whether the threshold is met."""
        value = self.value(results)
        return (self.below is None or value < self.below) and (self.above is None or value > self.above)

    def measured(self, results: Results) -> str:
        """What was measured, and what it takes, in words."""
        limits = [f"{word} {limit:g}{self.unit}" for word, limit in (("<", self.below), (">", self.above)) if limit is not None]
        return f"{self.words} {figure(self.value(results))}{self.unit} (asked: {' and '.join(limits)})"


@dataclass(frozen=True)
class Claim:
    """Something the paper says of its controllers.

    Attributes:
        place: Where in the paper.
        words: What it says, in ours.
        checks: What it takes to hold.
    """

    place: str
    words: str
    checks: tuple[Check, ...]

    def holds(self, results: Results) -> bool:
        """Whether every check is met."""
        return all(check.holds(results) for check in self.checks)

    def measured(self, results: Results) -> str:
        """What was measured, in words."""
        return "; ".join(check.measured(results) for check in self.checks)


def figure(value: float) -> str:
    """A number with three significant digits, for people; `never` for one that does not exist."""
    return "never" if math.isnan(value) else f"{value:.3g}"
