"""The runs that reproduce the paper with both forms of its law: its cases, and variations that explain their results."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from vessel_hsmc_ros.control.interface.known_vessel import INSTANT
from vessel_hsmc_ros.control.laws.hierarchical_parameters import HierarchicalParameters
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.scenario.parameters_file import read_text, read_yaml

PRINTED, REPAIRED = "hierarchical_printed", "hierarchical"
LAWS = {PRINTED: "printed", REPAIRED: "repaired"}  # both forms of the law, and what the pages call them
PREFIX = "repaired_"  # what precedes the name of a case where it is run with the repaired law


@dataclass(frozen=True)
class Case:
    """A run that the reproduction needs."""

    name: str  # key by which claims, errata and figures refer to it
    title: str  # what it shows
    scenario: str  # scenario it is derived from
    changes: Mapping[str, object] = field(default_factory=dict)  # changed values by `node.parameter`
    exact: bool = False  # replace the networks by the exact model of the ship; offline only
    rate_hz: float = 0.0  # run all nodes at this rate although the law is unstable there; offline only
    ends: bool = False  # the run is expected to diverge before its end; offline only
    # constants of the repaired law, by their symbols, that replace those of its parameters; offline only
    constants: Mapping[str, Any] = field(default_factory=dict)

    @property
    def by_nodes(self) -> bool:
        """Whether the nodes can run it."""
        return not (self.exact or self.rate_hz or self.ends or self.constants)


def _read(name: str) -> Any:
    return read_yaml(read_text(share_directory() / "config" / "paper" / f"{name}.yaml"))


_FILE = _read("cases")
CALM, LIMITS, NO_NETWORKS = _FILE["sets"]["calm"], _FILE["sets"]["limits"], _FILE["no_networks"]
# The forces of the paper act at once, and the repaired law is told so: it need not identify the actuators.
TOLD: Mapping[str, object] = {
    "controller.law": REPAIRED,
    "controller.hierarchical.actuator_identification": False,
    **{f"controller.vessel.{name}": value for name, value in INSTANT.items()},
}
PRINTED_CASES = tuple(
    Case(name, changes=given.get("set", {}), **{key: value for key, value in given.items() if key != "set"})
    for name, given in _FILE["printed"].items()
)


def _repaired(name: str, given: Mapping[str, Any]) -> Case:
    """A case of the printed law with the repaired one."""
    case = next(case for case in PRINTED_CASES if case.name == name)
    default = HierarchicalParameters()
    changes = {**TOLD, **given.get("set", case.changes)}
    for parameter, factor in given.get("factors", {}).items():
        changes[f"controller.hierarchical.{parameter}"] = factor * getattr(default, parameter)
    title, constants = f"repaired: {case.title}", given.get("constants", {})
    return replace(case, name=PREFIX + name, title=title, changes=changes, constants=constants)


REPAIRED_CASES = tuple(_repaired(name, given) for name, given in _FILE["repaired"].items())
CASES = (*PRINTED_CASES, *REPAIRED_CASES)

Outcome = TypeVar("Outcome")


def of_law(law: str, outcomes: Mapping[str, Outcome]) -> dict[str, Outcome]:
    """The outcomes of the cases of one form of the law, by the names that its cases have for the law as printed.

    Case 1 is the same for both: it controls the course alone, by other laws. `law`: PRINTED or REPAIRED.
    """
    if law == PRINTED:
        return {name: found for name, found in outcomes.items() if not name.startswith(PREFIX)}
    own = {name.removeprefix(PREFIX): found for name, found in outcomes.items() if name.startswith(PREFIX)}
    return {name: found for name, found in outcomes.items() if name.startswith("course")} | own


NAN = float("nan")


@dataclass(frozen=True)
class Numbers:
    """The numbers of one run; NaN where a number does not exist.

    `late` denotes the root mean square over the last quarter of the run; `step` the root mean square, over that quarter, of the
    change from one control period to the next; `share` a fraction; `needed` a lower bound by (34). Units are SI unless a suffix
    such as `deg` or `in_g` names another.
    """

    duration: float = NAN
    ended_at: float = NAN
    singularity_share: float = NAN
    position_error_start: float = NAN
    position_error_early: float = NAN
    position_error_second_quarter: float = NAN
    position_error_late: float = NAN
    position_error_final: float = NAN
    position_error_smallest: float = NAN
    heading_error_rms_deg: float = NAN
    heading_error_second_half_deg: float = NAN
    heading_error_late_deg: float = NAN
    heading_error_final_deg: float = NAN
    heading_settling_time: float = NAN
    heading_reference_second_half_deg: float = NAN
    surge_force_peak: float = NAN
    yaw_moment_peak: float = NAN
    surge_peak_in_g: float = NAN
    surge_velocity_error_late: float = NAN
    sway_velocity_error_late: float = NAN
    surge_force_step: float = NAN
    yaw_moment_step: float = NAN
    nonlinear_damping_share: float = NAN
    surge_error_late: float = NAN
    sway_error_late: float = NAN
    sway_error_on_surfaces: float = NAN
    sway_error_final: float = NAN
    yaw_surface_start: float = NAN
    yaw_surface_late: float = NAN
    yaw_surface_reaching_time: float = NAN
    surge_surface_start: float = NAN
    surge_surface_late: float = NAN
    surge_surface_reaching_time: float = NAN
    surge_error_settling_time: float = NAN
    weighted_sway_surface_late: float = NAN
    weighted_heading_surface_late: float = NAN
    lyapunov_rising_share: float = NAN
    surge_estimate_error: float = NAN
    sway_estimate_error: float = NAN
    yaw_estimate_error: float = NAN
    weights: float = NAN
    activation_spread: float = NAN
    yaw_switching_gain: float = NAN
    yaw_switching_gain_needed: float = NAN
    surge_switching_gain: float = NAN
    surge_switching_gain_needed: float = NAN
    yaw_rate_d_late: float = NAN
    growth_rate: float = NAN
    reduced_sway_error_final: float = NAN
    reduced_deviation: float = NAN


Results = Mapping[str, Numbers]  # the numbers of every run of one form of the law, by its name
NARROW = 1.3
"""A value within this factor of its threshold meets or misses it narrowly: another threshold could change the answer."""


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


def formatted(value: float) -> str:
    """A number with three significant digits; `never` for NaN, the value of a time that does not exist."""
    return "never" if math.isnan(value) else f"{value:.3g}".replace("inf", "∞")


def _claim(given: Mapping[str, Any]) -> Claim:
    checks: list[dict[str, Any]] = [
        {key: tuple(value) if isinstance(value, list) else value for key, value in check.items()} for check in given["checks"]
    ]
    forms = tuple(given.get("by_construction", ()))
    return Claim(**{**given, "checks": tuple(Check(**check) for check in checks), "by_construction": forms})


CLAIMS = tuple(map(_claim, _read("claims")["claims"]))


_PAGE = """\
# The paper's claims, measured

Written by `vessel-hsmc reproduce`. *Printed* is the law [to the letter](paper.md), *repaired* the law with
[five changes](hierarchical.md), within actuators of 2e5 N and 3e6 N·m. Both are evaluated with the same thresholds.
Errors are root mean squares over the last quarter of a run unless stated otherwise. The thresholds are ours; *narrowly* means
within {narrow:.0f} % of one. Where the paper does not give a gain, several values are listed and the best one counts.
[verdict.md](verdict.md) explains the results.

{counts}

{claims}
"""


def claims_page(results: Results) -> str:
    """The counts and the table, in Markdown."""
    claims: list[tuple[str, ...]] = [("where", "claim", "required", *LAWS.values(), "remark")]
    claims += [
        (c.place, c.statement, c.required, *(_cell(c, law, of_law(law, results)) for law in LAWS), c.remark) for c in CLAIMS
    ]
    lines = ["| " + " | ".join(row) + " |" for row in claims]
    table = "\n".join([lines[0], "|" + "---|" * len(claims[0]), *lines[1:]])
    counts = "\n".join(f"- {claims_that_hold(law, results)}" for law in LAWS)
    return _PAGE.format(counts=counts, narrow=100.0 * (NARROW - 1.0), claims=table)


def claims_that_hold(law: str, results: Results) -> str:
    """How many claims hold for a form of the law, and how many of these by construction."""
    holding = [claim for claim in CLAIMS if claim.holds(of_law(law, results))]
    constructed = sum(law in claim.by_construction for claim in holding)
    return f"{LAWS[law]}: {len(holding)} of {len(CLAIMS)} claims hold, {constructed} of these by construction"


def claim_row(claim: Claim, results: Results) -> tuple[str, ...]:
    """A claim for the terminal: place, statement, and whether it holds for each form of the law."""
    return claim.place, claim.statement, *(claim.answer(of_law(law, results), law) for law in LAWS)


def _cell(claim: Claim, law: str, own: Results) -> str:
    answer = claim.answer(own, law)
    return f"{answer if claim.holds(own) else f'**{answer}**'}: {claim.measured(own)}"
