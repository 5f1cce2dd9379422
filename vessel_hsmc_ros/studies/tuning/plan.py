"""What a tuning consists of: gains, cases and objective; and the evaluation of one set of gains.

The cases are the runs on which every set of gains is evaluated: a scenario, the rows of a suite, or the draws of a campaign.
Their seeds are those of the files, so all sets of gains meet the same noise: common random numbers. Held-out runs have other
seeds, or are other cases.

The objective is a metric over the same runs for every set, each relative to a scale of its own. For run i the ratio is
q_i = |m_i| / s_i, with the metric m_i and its scale s_i: the limit of the case where it has one for this metric, else the value
with the present gains. Ratios are clipped to [0.01, Q] with Q = 1000, and a run that fails or has no value counts as Q: precision
that is not needed does not outweigh the other runs, and a failure is never better than a poor run. With the share f of runs that
fail, the cost is

    J = (1 + Q·f)·exp(mean(log q_i))

or with the worst ratio, max(q_i), instead of the geometric mean.
"""

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.install_paths import __version__
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.core.schema import Entry
from vessel_hsmc_ros.scenario.named_files import CAMPAIGNS, SCENARIOS, SUFFIXES, SUITES
from vessel_hsmc_ros.scenario.parameters import controller_parameters
from vessel_hsmc_ros.scenario.parameters_file import read_text, read_yaml
from vessel_hsmc_ros.scenario.scenario import Scenario, dump_scenario, load_scenario, make_law
from vessel_hsmc_ros.studies.batch import Outcome, simulate_many
from vessel_hsmc_ros.studies.campaign.plan import Campaign
from vessel_hsmc_ros.studies.suite import Row, load_suite

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
    """Parse and check the gains of a tuning."""
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
    """The same scenario with other parameters of its controller."""
    changed = {name.removeprefix(NODE): value for name, value in values.items()}
    controller = schema.build(controller_parameters(), schema.flatten(scenario.controller) | changed, "controller")
    make_law(controller)  # constructed only to check what single parameters cannot show
    return replace(scenario, controller=controller, given=scenario.given | set(values))


LAW = "controller.law"

SEED_STEP, SEEDS = 1_000_003, 2**31  # held-out runs have the seed of their case plus this step, modulo the number of seeds
LIMITED = {"at_most": "position_error_rms_last_quarter", "largest": "position_error_peak_last_quarter"}
"""The metric that a limit of a suite bounds."""


@dataclass(frozen=True)
class Case:
    """One run of a tuning."""

    name: str  # its name in tables
    scenario: Scenario  # the scenario, with the present gains
    limits: Mapping[str, float] = field(default_factory=dict)  # limits by metric; they are the scales of the cost


def load_cases(source: str, changes: Mapping[str, object], law: str = "") -> list[Case]:
    """The runs of a scenario, a suite or a campaign."""
    changes = {**changes, **({LAW: law} if law else {})}
    kind = _kind(source)
    if kind == "campaign":
        return _of_campaign(Campaign.load(source), changes)
    if kind == "suite":
        return [_of_row(row, changes) for row in load_suite(source)]
    return [Case(Path(source).stem, load_scenario(source, changes))]


def _of_campaign(campaign: Campaign, changes: Mapping[str, object]) -> list[Case]:
    """The draws of a campaign, each with one law: that of the changes, else the first of the campaign."""
    runs = range(0, campaign.runs, len(campaign.variants))
    scenarios = [campaign.scenario(run, changes) for run in runs]
    return [Case(f"draw {draw}", each, campaign.limits_of(each)) for draw, each in enumerate(scenarios)]


def _of_row(row: Row, changes: Mapping[str, object]) -> Case:
    limits = {metric: getattr(row, key) for key, metric in LIMITED.items() if getattr(row, key) is not None}
    return Case(row.name, load_scenario(row.scenario, {**row.changes, **changes}), limits)


def _kind(source: str) -> str:
    """Whether a source is a scenario, a suite or a campaign; an unknown name is left to the loader of scenarios."""
    if Path(source).suffix not in SUFFIXES:
        return next((files.kind for files in (SCENARIOS, SUITES, CAMPAIGNS) if source in files.names()), "scenario")
    try:
        document = read_yaml(read_text(Path(source)))
    except (OSError, UnicodeDecodeError, yaml.YAMLError):
        return "scenario"
    keys = set(document) if isinstance(document, dict) else set()
    return "suite" if "rows" in keys else "campaign" if "draw" in keys else "scenario"


def held_out_cases(source: str, changes: Mapping[str, object], law: str, others: bool) -> list[Case]:
    """Runs to evaluate a tuning on, which its search has not seen."""
    if not others and _kind(source) == "campaign":
        campaign = Campaign.load(source)
        return _of_campaign(replace(campaign, seed=campaign.seed + SEED_STEP), {**changes, LAW: law})
    cases = load_cases(source, changes, law)
    if others:
        return cases
    seeds = [(case.scenario.vessel_sim.seed + SEED_STEP) % SEEDS for case in cases]
    return [
        replace(case, scenario=case.scenario.changed({"vessel_sim.seed": seed})) for case, seed in zip(cases, seeds, strict=True)
    ]


def law_of(cases: Sequence[Case]) -> str:
    """The law of all cases. Raises ScenarioError if there is no case, or the cases have several laws."""
    laws = sorted({case.scenario.controller.law for case in cases})
    if not laws:
        raise ScenarioError("a tuning needs runs: the suite has no rows")
    if len(laws) > 1:
        raise ScenarioError(f"the runs have the laws {', '.join(laws)}: choose one by --law")
    for case in cases:
        if case.scenario.vessel_sim.duration <= 0.0:
            raise ParameterError("vessel_sim.duration must be above 0 s for tuning (got 0 s, which has no end)")
    return laws[0]


FLOOR, PENALTY = 0.01, 1000.0  # the smallest ratio, and the largest, which a run that fails has
AGGREGATES = ("geometric_mean", "worst")

SETTLING = "settling_time"  # the metric that a run has no value of if it has not settled, which counts like a failure
ERROR, EFFORTS = "position_error_rms_last_quarter", ("yaw_moment_rms", "surge_force_rms")
"""The metric of the cost by default, and the metrics of the effort, the first of which is drawn beside another cost."""


class Cost(NamedTuple):
    """Cost and effort of a set of gains, dimensionless, and the number of runs that failed."""

    cost: float
    effort: float
    failed: int


@dataclass(frozen=True)
class Objective:
    """What is minimised."""

    metric: str = ERROR  # the metric of the cost, a name of core.metrics.Metrics
    second: str = EFFORTS[0]  # the metric of the effort
    two: bool = False  # whether the effort is minimised too; else it is only evaluated
    aggregate: str = AGGREGATES[0]

    def __post_init__(self) -> None:
        for option, name in (("--metric", self.metric), ("--second-metric", self.second)):
            if name not in Metrics._fields:
                raise ParameterError(f"{option} must be one of {', '.join(Metrics._fields)} (got {name})")
        if self.two and self.metric == self.second:
            raise ParameterError(f"--second-metric must be another metric than that of the cost (got {self.second})")

    def values(self, outcomes: Sequence[Outcome]) -> Array:
        """The two metrics of all runs, (n, 2); NaN for a run that failed or has no value."""
        return np.array([[_value(outcome, name) for name in (self.metric, self.second)] for outcome in outcomes], np.float64)

    def check(self, values: Array, failures: Sequence[str]) -> None:
        """Check that there is something to minimise. `values`: the metrics of all runs, (n, 2)."""
        for name, column in zip((self.metric, self.second), values.T, strict=True):
            if name != SETTLING and np.isnan(column).all() and not any(failures):
                raise ParameterError(f"metric {name} has no value in any run: the scenario sets no limit that it refers to")

    def scales(self, cases: Sequence[Case], present: Array) -> Array:
        """The scales of all runs, (n, 2).

        `present`: the two metrics with the present gains, (n, 2), NaN where they have none. Returns the limits of the cases,
        else the present values, else 1.
        """
        limits = [[case.limits.get(name, np.nan) for name in (self.metric, self.second)] for case in cases]
        scales = np.where(np.isnan(limits), present, np.array(limits))
        return np.where(np.isfinite(scales) & (scales > 0.0), scales, 1.0)

    def cost(self, values: Array, scales: Array) -> Cost:
        """The cost of a set of gains from its metrics and their scales, both (n, 2)."""
        failed = ~np.isfinite(values)
        ratios = np.clip(np.where(failed, PENALTY, values / scales), FLOOR, PENALTY)
        each = np.exp(np.log(ratios).mean(axis=0)) if self.aggregate == AGGREGATES[0] else ratios.max(axis=0)
        cost, effort = (1.0 + PENALTY * failed.mean(axis=0)) * each
        return Cost(float(cost), float(effort), int(np.count_nonzero(failed[:, 0])))


def chosen_objective(metric: str = ERROR, second_metric: str | None = None, aggregate: str = AGGREGATES[0]) -> Objective:
    """The objective by the names of the command line; without a second metric the effort is only evaluated."""
    second = next(name for name in EFFORTS if name != metric) if second_metric is None else second_metric
    return Objective(metric, second, second_metric is not None, aggregate)


def _value(outcome: Outcome, metric: str) -> float:
    """The magnitude of a metric of a run; NaN where it has none."""
    value = getattr(outcome.metrics, metric) if outcome.metrics is not None and not outcome.failure else None
    return float("nan") if value is None else abs(value)


MIN_PARALLEL_RUNS = 100  # from this number of runs on, parallel processes save more time than their start takes


class Evaluation(NamedTuple):
    """A set of gains on a list of cases."""

    values: Array  # the metrics of cost and effort of every case, (n, 2); NaN for a run that failed
    scales: Array  # their scales, (n, 2)
    failures: tuple[str, ...]  # why a run ended early, in one line each; empty for one that did not
    cost: Cost


@dataclass(frozen=True)
class Tuning:
    """What is tuned."""

    cases: Sequence[Case]  # the runs of every trial; all have the same law
    gains: Sequence[Gain]  # the gains and their ranges
    objective: Objective
    seed: int = 1  # seed of the search; the noise of the runs has its own
    # number of processes for the runs, which the results do not depend on; None for one per core if a trial has
    # MIN_PARALLEL_RUNS runs, else one
    workers: int | None = None

    def __post_init__(self) -> None:
        if not self.gains:
            raise ParameterError("a tuning needs gains: give --gain controller.law.name")

    def simulate(self, scenarios: Sequence[Scenario], on_run: Callable[[Outcome], None] | None = None) -> list[Outcome]:
        """Simulate scenarios; `on_run` is called with each outcome as soon as it is known."""
        workers = self.workers or (None if len(self.cases) >= MIN_PARALLEL_RUNS else 1)
        return simulate_many(scenarios, workers=workers, on_result=on_run)

    @property
    def law(self) -> str:
        """The law that is tuned."""
        return self.cases[0].scenario.controller.law

    @cached_property
    def present(self) -> dict[str, float]:
        """The present gains: those of the first case."""
        values: dict[str, Any] = schema.flatten(self.cases[0].scenario.controller)
        return {gain.parameter: values[gain.parameter.removeprefix(NODE)] for gain in self.gains}

    def definition(self) -> dict[str, Any]:
        """What the trials depend on, in JSON types."""
        text = "".join(f"{dump_scenario(case.scenario)}{sorted(case.limits.items())}" for case in self.cases)
        names = [self.objective.metric, self.objective.second]
        return {
            "version": __version__,
            "law": self.law,
            "gains": {gain.parameter: [gain.low, gain.high, "log" if gain.logarithmic else "linear"] for gain in self.gains},
            "objectives": names[: 1 + self.objective.two],
            "effort": self.objective.second,
            "aggregate": self.objective.aggregate,
            "seed": self.seed,
            "runs": len(self.cases),
            "cases": hashlib.sha256(text.encode()).hexdigest()[:16],
        }

    def scenarios(self, gains: Mapping[str, float]) -> list[Scenario]:
        """The scenarios of all cases with other gains."""
        return [with_gains(case.scenario, gains) for case in self.cases]

    def evaluate(self, cases: Sequence[Case], gains: Mapping[str, float], scales: Array | None = None) -> Evaluation:
        """Simulate cases with a set of gains.

        `scales`: the scales of the metrics; None for the limits of the cases, else the values of these runs.
        """
        outcomes = self.simulate([with_gains(case.scenario, gains) for case in cases])
        values = self.objective.values(outcomes)
        if scales is None:
            scales = self.objective.scales(cases, values)
        return Evaluation(values, scales, tuple(each.failure for each in outcomes), self.objective.cost(values, scales))
