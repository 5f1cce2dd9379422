"""Labels of runs that are shown together."""

from typing import Any

import pytest
from records import record

from vessel_hsmc_ros.report import Record
from vessel_hsmc_ros.report.page import distinguished


def names(*records: Record) -> list[str]:
    return [each.name for each in distinguished(records)]


def case2(**changes: Any) -> Record:
    return record("case2_tracking", 1.0, **changes)


def test_a_single_run_keeps_the_name_of_its_scenario() -> None:
    assert names(case2()) == ["case2_tracking"]


def test_runs_of_different_scenarios_are_named_by_scenario() -> None:
    assert names(case2(), record("realistic", 1.0)) == ["case2_tracking", "realistic"]


def test_runs_of_one_scenario_are_named_by_law() -> None:
    assert names(case2(), case2(**{"controller.law": "guided"})) == ["hierarchical_printed", "guided"]


def test_runs_of_several_scenarios_and_laws_are_named_by_both() -> None:
    guided: dict[str, Any] = {"controller.law": "guided"}
    found = names(case2(), case2(**guided), record("realistic", 1.0, **guided))
    assert found == ["case2_tracking, hierarchical_printed", "case2_tracking, guided", "realistic, guided"]


def test_runs_with_one_law_are_named_by_the_parameters_that_differ() -> None:
    name = "controller.hierarchical_printed.sway_weight"
    assert names(case2(), case2(**{name: 0.002})) == ["sway_weight = 0.001", "sway_weight = 0.002"]


def test_only_the_first_of_many_differing_parameters_are_named() -> None:
    names_of_three = {f"vessel_sim.disturbance.periodic.{name}": 1.0 for name in ("surge_force", "sway_force", "yaw_moment")}
    assert names(case2(), case2(**names_of_three))[1] == "surge_force = 1, sway_force = 1, …"


@pytest.mark.parametrize("folder", ["recorder.directory", "controller.black_box.directory"])
def test_the_location_of_bags_does_not_distinguish_runs(folder: str) -> None:
    assert names(case2(), case2(**{folder: "elsewhere"})) == ["case2_tracking 1", "case2_tracking 2"]


def test_runs_without_a_scenario_are_numbered() -> None:
    bags = [Record("bag", case2().run), Record("bag", case2().run)]
    assert names(*bags) == ["bag 1", "bag 2"]
