"""The runs that a tuning evaluates every set of gains on: a scenario, the rows of a suite, or the draws of a campaign.

Their seeds are those of the files, so all sets of gains meet the same noise: common random numbers. Held-out runs have other
seeds, or are other cases.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import yaml

from vessel_hsmc_ros.campaign.plan import Campaign
from vessel_hsmc_ros.campaign.plan_file import campaign_names
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.scenario.bounded_text import read_text, read_yaml
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, scenario_names
from vessel_hsmc_ros.scenario.suite import Row, load_suite, suite_names

LAW = "controller.law"

SEED_STEP, SEEDS = 1_000_003, 2**31
"""Held-out runs have the seed of their case plus this step, modulo the number of seeds."""

LIMITED = {"at_most": "position_error_rms_last_quarter", "largest": "position_error_peak_last_quarter"}
"""The metric that a limit of a suite bounds."""


@dataclass(frozen=True)
class Case:
    """One run of a tuning.

    Attributes:
        name: Its name in tables.
        scenario: The scenario, with the present gains.
        limits: Limits by metric; they are the scales of the cost.
    """

    name: str
    scenario: Scenario
    limits: Mapping[str, float] = field(default_factory=dict)


def load_cases(source: str, changes: Mapping[str, object], law: str = "") -> list[Case]:
    """The runs of a scenario, a suite or a campaign.

    Args:
        source: The name of a scenario or of a suite, or the path of a scenario, suite or campaign file.
        changes: Further changes by `node.parameter`.
        law: The law; empty for that of the file.

    Raises:
        ScenarioError: there is no such scenario, suite or campaign, or it cannot be read.
        ParameterError: a parameter is unknown or out of range.
    """
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
    if Path(source).suffix not in (".yaml", ".yml"):
        kinds = {"scenario": scenario_names(), "suite": suite_names(), "campaign": campaign_names()}
        return next((kind for kind, names in kinds.items() if source in names), "scenario")
    try:
        document = read_yaml(read_text(Path(source)))
    except (OSError, UnicodeDecodeError, yaml.YAMLError):
        return "scenario"
    keys = set(document) if isinstance(document, dict) else set()
    return "suite" if "rows" in keys else "campaign" if "draw" in keys else "scenario"


def held_out_cases(source: str, changes: Mapping[str, object], law: str, others: bool) -> list[Case]:
    """Runs to evaluate a tuning on, which its search has not seen.

    Args:
        source: A scenario, a suite or a campaign.
        changes: Further changes by `node.parameter`.
        law: The law.
        others: Whether the source is another one than that of the tuning; else its runs have other seeds, a campaign other draws.
    """
    if not others and _kind(source) == "campaign":
        campaign = Campaign.load(source)
        return _of_campaign(replace(campaign, seed=campaign.seed + SEED_STEP), {**changes, LAW: law})
    cases = load_cases(source, changes, law)
    return cases if others else [replace(case, scenario=_reseeded(case.scenario)) for case in cases]


def _reseeded(scenario: Scenario) -> Scenario:
    seed = (scenario.vessel_sim.seed + SEED_STEP) % SEEDS
    return replace(scenario, vessel_sim=replace(scenario.vessel_sim, seed=seed))


def law_of(cases: Sequence[Case]) -> str:
    """The law of all cases.

    Raises:
        ScenarioError: there is no case, or the cases have several laws.
    """
    laws = sorted({case.scenario.controller.law for case in cases})
    if not laws:
        raise ScenarioError("a tuning without runs is not allowed: the suite has no rows")
    if len(laws) > 1:
        raise ScenarioError(f"the runs have the laws {', '.join(laws)}: choose one by --law")
    for case in cases:
        if case.scenario.vessel_sim.duration <= 0.0:
            raise ParameterError("vessel_sim.duration = 0 s goes on for ever: for tuning it must be above 0 s")
    return laws[0]
