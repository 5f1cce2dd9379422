"""The runs of a tuning: a scenario, the rows of a suite, the draws of a campaign."""

from pathlib import Path

import pytest
from durations import rest_long

from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.studies.tuning.plan import held_out_cases, law_of, load_cases

CAMPAIGN = """
scenario: case2_tracking
set: {vessel_sim.duration: 10.0}
laws: [guided, los_pid]
runs: 3
seed: 4
draw:
  vessel_sim.disturbance.earth_fixed.east_force: {uniform: [-2000.0, 2000.0]}
limits: {position_error_rms_last_quarter: 0.1}
"""

SUITE = """
set: {controller.law: los_pid, vessel_sim.duration: 10.0}
rows:
  - {name: circle, at_most: 0.5, largest: 2.0}
  - {name: straight, scenario: case2_straight, set: {vessel_sim.seed: 3}}
"""


@pytest.fixture
def suite(tmp_path: Path) -> str:
    (tmp_path / "suite.yaml").write_text(SUITE)
    return str(tmp_path / "suite.yaml")


@pytest.fixture
def campaign(tmp_path: Path) -> str:
    (tmp_path / "campaign.yaml").write_text(CAMPAIGN)
    return str(tmp_path / "campaign.yaml")


def test_a_scenario_is_one_run() -> None:
    (case,) = load_cases("case2_slalom", {"vessel_sim.duration": 5.0}, "guided")
    assert (case.name, case.scenario.controller.law, case.scenario.vessel_sim.duration) == ("case2_slalom", "guided", 5.0)


def test_each_row_of_a_suite_is_a_run_with_its_limits(suite: str) -> None:
    circle, straight = load_cases(suite, {"vessel_sim.duration": 5.0})
    assert circle.limits == {"position_error_rms_last_quarter": 0.5, "position_error_peak_last_quarter": 2.0}
    assert (straight.name, straight.limits) == ("straight", {})
    assert {case.scenario.vessel_sim.duration for case in (circle, straight)} == {5.0}
    assert law_of([circle, straight]) == "los_pid"


def test_a_suite_of_the_package_is_found_by_its_name() -> None:
    assert len(load_cases("guided", {})) > 20


def test_each_draw_of_a_campaign_is_a_run_of_one_law(campaign: str) -> None:
    cases = load_cases(campaign, {}, "los_pid")
    assert [case.name for case in cases] == ["draw 0", "draw 1", "draw 2"]
    assert law_of(cases) == "los_pid"
    forces = {case.scenario.vessel_sim.disturbance.earth_fixed.east_force for case in cases}
    assert len(forces) == 3
    assert cases == load_cases(campaign, {}, "los_pid")
    assert cases[0].limits == {"position_error_rms_last_quarter": 0.1}
    held_out = held_out_cases(campaign, {}, "los_pid", others=False)
    assert not forces & {case.scenario.vessel_sim.disturbance.earth_fixed.east_force for case in held_out}


def test_held_out_runs_of_a_suite_have_other_seeds(suite: str) -> None:
    before, after = (load_cases(suite, {}), held_out_cases(suite, {}, "los_pid", others=False))
    assert all(a.scenario.vessel_sim.seed != b.scenario.vessel_sim.seed for a, b in zip(before, after, strict=True))
    assert held_out_cases(suite, {}, "los_pid", others=True) == before


@pytest.mark.parametrize("kind", rest_long(["scenario", "suite", "campaign"]))
@pytest.mark.parametrize("others", rest_long([False, True]))
@pytest.mark.parametrize("law", rest_long(["guided", "los_pid", "hierarchical_printed"]))
def test_held_out_runs_have_the_law_and_the_changes_of_the_tuning(
    suite: str, campaign: str, kind: str, others: bool, law: str
) -> None:
    """Also a law that is not the first of the campaign, or none of it."""
    source = {"scenario": "case2_slalom", "suite": suite, "campaign": campaign}[kind]
    found = held_out_cases(source, {"vessel_sim.duration": 5.0}, law, others)
    assert {(case.scenario.controller.law, case.scenario.vessel_sim.duration) for case in found} == {(law, 5.0)}
    seen = {case.scenario.vessel_sim.seed for case in load_cases(source, {}, law)}
    assert bool(seen & {case.scenario.vessel_sim.seed for case in found}) == others


def test_runs_that_cannot_be_tuned_are_refused(suite: str) -> None:
    with pytest.raises(ScenarioError, match=r"scenario nowhere is unknown"):
        load_cases("nowhere", {})
    with pytest.raises(ScenarioError, match=r"nowhere.yaml does not exist"):
        load_cases("nowhere.yaml", {})
    with pytest.raises(ScenarioError, match="the runs have the laws guided, los_pid: choose one by --law"):
        law_of([*load_cases(suite, {}), *load_cases("case2_tracking", {}, "guided")])
    with pytest.raises(ScenarioError, match="the suite has no rows"):
        law_of([])
    with pytest.raises(ParameterError, match="duration must be above 0 s for tuning"):
        law_of(load_cases("case2_tracking", {"vessel_sim.duration": 0.0}))
