"""Every claim of the paper that a run can test, and the results of an independent prototype: both in config/paper/claims.yaml.

Measured numbers of runs are compared with thresholds, all of which must be met. The same check serves both forms of the law: it
takes the numbers of the runs of one of them, `cases.of_law`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.scenario.bounded_text import read_text, read_yaml
from vessel_hsmc_ros.studies.paper.numbers import Numbers

Results = Mapping[str, Numbers]  # the numbers of every run of one form of the law, by its name
NARROW = 1.3
"""A value within this factor of its threshold meets or misses it narrowly: another threshold could change the answer."""

TOLERANCE = 0.1  # numbers of the prototype and ours that differ by less than this fraction agree


@dataclass(frozen=True)
class Check:
    """One number, or the ratio of two numbers, against a threshold."""

    quantity: str  # what is measured
    # run, number: name of the run and of its number
    run: str
    number: str
    # below, above: upper and lower threshold, which the value may equal; at least one is given. NaN meets none
    below: float | None = None
    above: float | None = None
    unit: str = ""  # unit of the number, with a leading space where one is written
    over: tuple[str, str] | None = None  # divide by this number of this run
    # runs with other values of a gain that the paper does not give, where the law has them; the best of all runs counts
    also: tuple[str, ...] = ()

    def values(self, results: Results) -> list[float]:
        """The measured value of each run; infinite where the number to divide by is zero."""
        runs = [self.run, *(run for run in self.also if run in results)]
        divisor: float = 1.0 if self.over is None else getattr(results[self.over[0]], self.over[1])
        return [getattr(results[run], self.number) / divisor if divisor else math.inf for run in runs]

    def value(self, results: Results) -> float:
        """The measured value; of several, the best; NaN if none exists."""
        values = [value for value in self.values(results) if not math.isnan(value)]
        best = max if self.below is None else min
        return best(values, default=math.nan)

    def holds(self, results: Results) -> bool:
        """Whether the thresholds are met."""
        value = self.value(results)
        # Comparisons with NaN are false, so a number that does not exist meets no threshold.
        return (self.below is None or value <= self.below) and (self.above is None or value >= self.above)

    def narrow(self, results: Results) -> bool:
        """Whether the value is within a factor of NARROW of a threshold."""
        value = self.value(results)
        return any(limit is not None and limit / NARROW < value < limit * NARROW for limit in (self.below, self.above))

    @property
    def required(self) -> str:
        """What is measured and its thresholds, for people."""
        limits = [f"{sign} {limit:g}{self.unit}" for sign, limit in (("≤", self.below), ("≥", self.above)) if limit is not None]
        return f"{self.quantity} {'best ' if self.also else ''}{' and '.join(limits)}"

    def measured(self, results: Results) -> str:
        """The measured values, for people."""
        return ", ".join(formatted(value) for value in self.values(results)) + self.unit


@dataclass(frozen=True)
class Claim:
    """A statement of the paper about its controllers."""

    place: str  # section, equation or figure of the paper
    statement: str  # the claim, paraphrased
    checks: tuple[Check, ...]  # all of these must hold
    by_construction: tuple[str, ...] = ()  # the forms of the law for which it holds because the law was made so that it does
    remark: str = ""  # what the answers depend on, or what limits their meaning

    def holds(self, results: Results) -> bool:
        """Whether every check holds."""
        return all(check.holds(results) for check in self.checks)

    def answer(self, results: Results, law: str) -> str:
        """Whether it holds for a form of the law, in words: by construction, and whether narrowly."""
        missed = [check for check in self.checks if not check.holds(results)]
        if law in self.by_construction and not missed:
            return "by construction"
        # A claim holds narrowly if one of its checks does, and is missed narrowly if no check misses by more.
        narrow = all(c.narrow(results) for c in missed) if missed else any(c.narrow(results) for c in self.checks)
        return ("no" if missed else "yes") + (", narrowly" if narrow else "")

    @property
    def required(self) -> str:
        """What all checks require, for people."""
        return "; ".join(check.required for check in self.checks)

    def measured(self, results: Results) -> str:
        """The measured values of all checks, for people."""
        return "; ".join(check.measured(results) for check in self.checks)


@dataclass(frozen=True)
class Finding:
    """One number of the prototype."""

    quantity: str  # what was measured
    prototype: float  # the prototype's value
    unit: str  # its unit, with a leading space where one is written
    # run, number: name of our run and of its number
    run: str
    number: str
    at_most: bool = False  # the prototype's value is an upper bound, given to one digit, instead of a value to agree with

    def measured(self, results: Results) -> float:
        """Our value."""
        value: float = abs(getattr(results[self.run], self.number))
        return value

    def agrees(self, results: Results) -> bool:
        """Whether both values agree within TOLERANCE."""
        if self.at_most:
            return self.measured(results) <= self.prototype * (1.0 + TOLERANCE)
        # NaN, a number that our run does not have, does not agree.
        return abs(self.measured(results) / self.prototype - 1.0) <= TOLERANCE


def formatted(value: float) -> str:
    """A number with three significant digits; `never` for NaN, the value of a time that does not exist."""
    return "never" if math.isnan(value) else f"{value:.3g}".replace("inf", "∞")


def _check(given: Mapping[str, Any]) -> Check:
    return Check(**{key: tuple(value) if isinstance(value, list) else value for key, value in given.items()})


def _claim(given: Mapping[str, Any]) -> Claim:
    checks, forms = tuple(map(_check, given["checks"])), tuple(given.get("by_construction", ()))
    return Claim(**{**given, "checks": checks, "by_construction": forms})


_FILE = read_yaml(read_text(share_directory() / "config" / "paper" / "claims.yaml"))
CLAIMS = tuple(map(_claim, _FILE["claims"]))
FINDINGS = tuple(Finding(**each) for each in _FILE["findings"])
