"""Tests of claims: measured numbers of runs compared with thresholds, all of which must be met."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from vessel_hsmc_ros.paper.numbers import Numbers

Results = Mapping[str, Numbers]
"""The numbers of every run, by its name."""


@dataclass(frozen=True)
class Check:
    """One number, or the ratio of two numbers, against a threshold.

    Attributes:
        quantity: What is measured.
        run, number: Name of the run and of its number.
        below, above: Upper and lower threshold; at least one is given. NaN meets none.
        unit: Unit of the number, with a leading space where one is written.
        over: Divide by this number of this run.
    """

    quantity: str
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
        """Whether the thresholds are met."""
        value = self.value(results)
        # Comparisons with NaN are false, so a number that does not exist meets no threshold.
        return (self.below is None or value < self.below) and (self.above is None or value > self.above)

    def measured(self, results: Results) -> str:
        """The measured value and its thresholds, for people."""
        limits = [f"{sign} {limit:g}{self.unit}" for sign, limit in (("<", self.below), (">", self.above)) if limit is not None]
        return f"{self.quantity} {formatted(self.value(results))}{self.unit} (required: {' and '.join(limits)})"


@dataclass(frozen=True)
class Claim:
    """A statement of the paper about its controllers.

    Attributes:
        place: Section, equation or figure of the paper.
        statement: The claim, paraphrased.
        checks: All of these must hold.
    """

    place: str
    statement: str
    checks: tuple[Check, ...]

    def holds(self, results: Results) -> bool:
        """Whether every check holds."""
        return all(check.holds(results) for check in self.checks)

    def measured(self, results: Results) -> str:
        """The measured values of all checks, for people."""
        return "; ".join(check.measured(results) for check in self.checks)


def formatted(value: float) -> str:
    """A number with three significant digits; `never` for NaN, the value of a time that does not exist."""
    return "never" if math.isnan(value) else f"{value:.3g}"
