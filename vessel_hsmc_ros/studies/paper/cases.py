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
CALM: Mapping[str, object] = {
    "vessel_sim.disturbance.periodic.surge_force": 0.0,
    "vessel_sim.disturbance.periodic.sway_force": 0.0,
    "vessel_sim.disturbance.periodic.yaw_moment": 0.0,
}


def learning(sway: float, yaw: float, surge: float) -> Mapping[str, object]:
    """Set the adaptation gains of the networks for f_v, f_r and f_u."""
    gains = {"sway": sway, "yaw": yaw, "surge": surge}
    return {f"controller.hierarchical_printed.{name}_adaptation_gain": gain for name, gain in gains.items()}


NO_LEARNING = learning(0.0, 0.0, 0.0)
LEARNING = learning(0.01, 0.001, 1.0)
FASTER = learning(1.0, 0.02, 10.0)


def switching(gain: float) -> Mapping[str, object]:
    """Set both switching gains to one value."""
    return {f"controller.hierarchical_printed.{name}_switching_gain": gain for name in ("yaw", "surge")}


def slopes(slope: float) -> Mapping[str, object]:
    """Set the slopes c1, c2, c3 of the surfaces to one value."""
    return {f"controller.hierarchical_printed.{name}_surface_slope": slope for name in ("sway", "heading", "surge")}


def damping(factor: float) -> Mapping[str, object]:
    """Multiply the plant's linear damping by a factor; the virtual ship keeps its own."""
    # The linear damping of section 6.2.
    values = {"surge": 215e2, "sway": 147e3, "yaw": 802e4}
    return {f"vessel_sim.vessel.{name}_damping": factor * value for name, value in values.items()}


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


DURATION = "vessel_sim.duration"
SHORT: Mapping[str, object] = {DURATION: 60.0}
TRACKING, STRAIGHT, SLALOM = "case2_tracking", "case2_straight", "case2_slalom"
LIMITS: Mapping[str, object] = {"vessel_sim.actuators.surge_force_limit": 2e5, "vessel_sim.actuators.yaw_moment_limit": 3e6}
SWAY_WEIGHT = "controller.hierarchical_printed.sway_weight"
# 0.299 rad/s² and 0.213 m/s² at the largest z1 and z2 of the circle, rounded up. Without networks eta1 must exceed b·|f_r| too,
# in all 1.9 rad/s² on the circle.
ETA_OF_34, ETA_WITHOUT_NETWORKS = 0.3, 2.0
ADAPTATION_GAINS = (0.01, 0.1, 1.0, 100.0)  # adaptation gains of the course's network beside the scenario's, 1/s
STIFF: Mapping[str, object] = {"controller.pd.heading_gain": 2.3e7, "controller.pd.yaw_rate_gain": 7.6e7}
"""Gains of a PD controller that is not tuned to resemble the paper's figures."""


def course_learning(gain: float) -> str:
    """Name of the disturbed course with an adaptation gain."""
    return f"course_disturbed_learning_{gain:g}"


PRINTED_CASES: tuple[Case, ...] = (
    Case("course", "course, sliding mode and networks, calm", "case1_course"),
    Case("course_disturbed", "course, sliding mode and networks, disturbed", "case1_course_disturbed"),
    Case("course_pd", "course, PD, calm", "case1_pd"),
    Case("course_pd_disturbed", "course, PD, disturbed", "case1_pd_disturbed"),
    Case("circle", "circle, disturbed: the paper's case 2", TRACKING),
    Case("straight", "straight line, disturbed", STRAIGHT),
    Case("slalom", "slalom, disturbed", SLALOM),
    Case("stabilisation", "stabilisation, disturbed: the paper's case 3", "case3_stabilisation"),
    Case("stabilisation_calm", "stabilisation, calm", "case3_calm"),
    Case("circle_calm", "circle, calm", TRACKING, CALM),
    Case("straight_calm", "straight line, calm", STRAIGHT, CALM),
    Case("slalom_long", "slalom, disturbed, 800 s", SLALOM, {DURATION: 800.0}),
    Case(
        "course_disturbed_no_learning",
        "course, sliding mode, adaptation gain 0, disturbed",
        "case1_course_disturbed",
        {"controller.course.adaptation_gain": 0.0},
    ),
    *(
        Case(
            course_learning(gain),
            f"course, sliding mode, adaptation gain {gain:g}, disturbed",
            "case1_course_disturbed",
            {"controller.course.adaptation_gain": gain},
        )
        for gain in ADAPTATION_GAINS
    ),
    Case("course_pd_stiff", "course, PD with stiff gains, calm", "case1_pd", STIFF),
    Case("course_pd_stiff_disturbed", "course, PD with stiff gains, disturbed", "case1_pd_disturbed", STIFF),
    Case("circle_no_learning", "circle, adaptation gains 0", TRACKING, NO_LEARNING),
    Case("circle_learning", "circle, networks of f_u and f_v that learn faster", TRACKING, LEARNING),
    Case("circle_learning_10", "circle, adaptation gains ten times larger", TRACKING, learning(0.01, 0.01, 0.01)),
    Case("circle_learning_faster", "circle, networks that learn faster still", TRACKING, FASTER),
    Case("circle_learning_120", "circle, 120 s, networks that learn faster still", TRACKING, {**FASTER, DURATION: 120.0}),
    Case(
        "circle_as_printed",
        "circle, adaptation by (29) as printed",
        TRACKING,
        {"controller.hierarchical_printed.adaptation": "as_printed"},
        ends=True,
    ),
    Case(
        "circle_switched",
        "circle, a of switching sign",
        TRACKING,
        {"controller.hierarchical_printed.sway_weight_sign": "switched"},
    ),
    Case("circle_weak_hull", "circle, the ship's linear damping halved", TRACKING, damping(0.5)),
    Case("circle_stiff_hull", "circle, the ship's linear damping times 1.5", TRACKING, damping(1.5)),
    Case("circle_limited", "circle, actuators limited to 2e5 N and 3e6 N·m", TRACKING, LIMITS),
    Case("circle_60", "circle, 60 s", TRACKING, SHORT),
    Case("circle_steep", "circle, 60 s, slopes c doubled", TRACKING, {**SHORT, **slopes(0.6)}),
    *(
        Case(f"circle_switching_{gain:g}", f"circle, 60 s, switching gains of {gain:g}", TRACKING, {**SHORT, **switching(gain)})
        for gain in (0.1, ETA_OF_34, ETA_WITHOUT_NETWORKS)
    ),
    Case("circle_no_learning_60", "circle, 60 s, adaptation gains 0", TRACKING, {**SHORT, **NO_LEARNING}),
    Case(
        "circle_no_learning_switching",
        f"circle, 60 s, adaptation gains 0, switching gains of {ETA_WITHOUT_NETWORKS:g}",
        TRACKING,
        {**SHORT, **NO_LEARNING, **switching(ETA_WITHOUT_NETWORKS)},
    ),
    Case("circle_exact", "circle, the ship known exactly", TRACKING, exact=True),
    Case("straight_exact", "straight line, the ship known exactly", STRAIGHT, exact=True),
    Case("slalom_exact", "slalom, the ship known exactly", SLALOM, exact=True),
    Case("circle_exact_calm", "circle, the ship known exactly, calm", TRACKING, CALM, exact=True),
    Case("straight_a_0.1", "straight line, a = 0.1", STRAIGHT, {SWAY_WEIGHT: 0.1, DURATION: 800.0}, ends=True),
    Case("straight_a_1", "straight line, a = 1", STRAIGHT, {SWAY_WEIGHT: 1.0}, ends=True),
    Case("circle_50_hz", "circle at 50 Hz, reaching gain times period 2", TRACKING, rate_hz=50.0, ends=True),
    Case("circle_60_hz", "circle at 60 Hz, reaching gain times period 1.67", TRACKING, SHORT, rate_hz=60.0, ends=True),
)


# The forces of the paper act at once, and the repaired law is told so: it need not identify the actuators.
TOLD: Mapping[str, object] = {
    "controller.law": REPAIRED,
    "controller.hierarchical.actuator_identification": False,
    **{f"controller.vessel.{name}": value for name, value in INSTANT.items()},
}
PREFIX = "repaired_"  # what precedes the name of a case where it is run with the repaired law
NO_NETWORKS = dict.fromkeys(("rho", "gamma1", "gamma2", "gamma3"), 0.0)
# sgn, and a gain that dominates all that networks would compensate, as in the case of the printed law.
PLAIN = {**NO_NETWORKS, "phi1": 1e-9, "phi2": 1e-9, "eta1": ETA_WITHOUT_NETWORKS, "eta2": ETA_WITHOUT_NETWORKS}
LARGER_ETA = {"circle_switching_0.1": 3.0, f"circle_switching_{ETA_OF_34:g}": 10.0, "circle_switching_2": 30.0}
"""Factors of the repaired law's switching gains, which meet (34) themselves, by the case of the printed law."""

BY_NAME = {case.name: case for case in PRINTED_CASES}


def repaired(name: str, changes: Mapping[str, object] | None = None, constants: Mapping[str, Any] | None = None) -> Case:
    """A case of the printed law with the repaired one."""
    case = BY_NAME[name]
    changes = case.changes if changes is None else changes
    return replace(
        case, name=PREFIX + name, title=f"repaired: {case.title}", changes={**TOLD, **changes}, constants=constants or {}
    )


def multiplied(factor: float, *names: str) -> Mapping[str, object]:
    """Multiply parameters of the repaired law by a factor, over the first minute."""
    default = HierarchicalParameters()
    return {**SHORT, **{f"controller.hierarchical.{name}": factor * getattr(default, name) for name in names}}


SWITCHING_GAINS = "yaw_switching_gain", "surge_switching_gain"

REPAIRED_CASES: tuple[Case, ...] = (
    *map(repaired, ("circle", "straight", "slalom", "slalom_long", "stabilisation", "stabilisation_calm", "circle_calm")),
    *map(repaired, ("straight_calm", "circle_weak_hull", "circle_stiff_hull", "circle_60", "circle_exact", "circle_exact_calm")),
    repaired("circle_no_learning", {}, NO_NETWORKS),
    repaired("circle_no_learning_60", SHORT, NO_NETWORKS),
    repaired("circle_no_learning_switching", SHORT, PLAIN),
    repaired("circle_steep", multiplied(2.0, "approach_rate")),
    *(repaired(name, multiplied(factor, *SWITCHING_GAINS)) for name, factor in LARGER_ETA.items()),
)

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
    values: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in given.items()}
    return Check(**values)


def _claim(given: Mapping[str, Any]) -> Claim:
    checks, forms = tuple(map(_check, given["checks"])), tuple(given.get("by_construction", ()))
    return Claim(**{**given, "checks": checks, "by_construction": forms})


_FILE = read_yaml(read_text(share_directory() / "config" / "paper" / "claims.yaml"))
CLAIMS = tuple(map(_claim, _FILE["claims"]))
FINDINGS = tuple(Finding(**each) for each in _FILE["findings"])


Rows = list[tuple[str, ...]]

_PAGE = """\
# The paper's claims, measured

Written by `vessel-hsmc reproduce`. *Printed* is the law [to the letter](paper.md), *repaired* the law with
[five changes](hierarchical.md), within actuators of 2e5 N and 3e6 N·m. Both are evaluated with the same thresholds.
Errors are root mean squares over the last quarter of a run unless stated otherwise. The thresholds are ours; *narrowly* means
within {narrow:.0f} % of one. Where the paper does not give a gain, several values are listed and the best one counts.
[verdict.md](verdict.md) explains the results.

{counts}

{claims}

# The results of an independent prototype, and ours

An earlier prototype of the law as printed measured these; its adaptation gains, PD gains and course are not known.

{findings}
"""


def claims_page(results: Results) -> str:
    """Both tables, in Markdown."""
    claims: Rows = [("where", "claim", "required", *LAWS.values(), "remark")]
    claims += [
        (c.place, c.statement, c.required, *(_cell(c, law, of_law(law, results)) for law in LAWS), c.remark) for c in CLAIMS
    ]
    findings: Rows = [("what", "prototype", "here", "ratio", "")]
    findings += [finding_row(finding, results) for finding in FINDINGS]
    tables = {"claims": _markdown(claims), "findings": _markdown(findings)}
    counts = "\n".join(f"- {claims_that_hold(law, results)}" for law in LAWS)
    return _PAGE.format(counts=counts, narrow=100.0 * (NARROW - 1.0), **tables)


def claims_that_hold(law: str, results: Results) -> str:
    """How many claims hold for a form of the law, and how many of these by construction."""
    holding = [claim for claim in CLAIMS if claim.holds(of_law(law, results))]
    constructed = sum(law in claim.by_construction for claim in holding)
    return f"{LAWS[law]}: {len(holding)} of {len(CLAIMS)} claims hold, {constructed} of these by construction"


def claim_row(claim: Claim, results: Results) -> tuple[str, ...]:
    """A claim for the terminal: place, statement, and whether it holds for each form of the law."""
    return claim.place, claim.statement, *(claim.answer(of_law(law, results), law) for law in LAWS)


def finding_row(finding: Finding, results: Results) -> tuple[str, ...]:
    """A number of the prototype and ours: quantity, prototype, here, ratio, remark."""
    value = finding.measured(results)
    remark = "" if finding.agrees(results) else "differs"
    prototype = f"{finding.prototype:g}{finding.unit}"
    return finding.quantity, prototype, f"{formatted(value)}{finding.unit}", f"{value / finding.prototype:.2f}", remark


def _cell(claim: Claim, law: str, own: Results) -> str:
    answer = claim.answer(own, law)
    return f"{answer if claim.holds(own) else f'**{answer}**'}: {claim.measured(own)}"


def _markdown(rows: Rows) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]])
