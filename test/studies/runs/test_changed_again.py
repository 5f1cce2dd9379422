"""What counts in a run that is compared or repeated: law and rate of its task, and the time that was recorded."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.cli.options import compare_with_row
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.studies.comparison import Task, prepare
from vessel_hsmc_ros.studies.suite import Row
from vessel_hsmc_ros.studies.verification import _shortened

CHANGES: dict[str, object] = {"controller.law": "pd", "controller.rate_hz": 50.0, "vessel_sim.seed": 3}


@pytest.mark.parametrize(("rate", "expected"), [(None, 50.0), (20.0, 20.0)])
def test_law_and_rate_of_a_comparison_count_more_than_those_of_its_row(rate: float | None, expected: float) -> None:
    scenario, fell_back = prepare(Task(Row("a", "case2_straight", changes=CHANGES), "los_pid", rate))
    found = scenario.controller.law, scenario.controller.rate_hz, scenario.vessel_sim.seed, fell_back
    assert found == ("los_pid", expected, 3, False)


@pytest.mark.parametrize(("planned", "lasts"), [(400.0, 2.0), (0.0, 2.0), (2.0, 2.0), (1.5, 1.5)])
def test_a_repetition_lasts_as_long_as_the_recording_but_no_longer_than_planned(planned: float, lasts: float) -> None:
    stamps = np.array([7_000_000_000, 5_000_000_000, 6_000_000_000])
    bag: Any = SimpleNamespace(topics={"/boat/odom": SimpleNamespace(stamp=stamps)}, namespace=lambda _: "/boat/")
    scenario = load_scenario("case2_straight", {"vessel_sim.duration": planned})
    assert _shortened(scenario, bag, "boat").vessel_sim.duration == lasts


@pytest.mark.parametrize(
    ("values", "differences", "ended", "code"),
    [
        ({}, ["x"], 0, 0),
        ({}, ["x"], 130, 130),
        ({"ended_early": False}, [], 0, 0),
        ({"ended_early": True}, [], 1, 0),
        ({"ended_early": False}, ["x = 1 in the row, 2 in the run"], 0, 1),
        ({"ended_early": True}, ["the run: complete"], 0, 1),
    ],
)
def test_a_repeated_row_succeeds_where_it_is_as_before(values: Any, differences: list[str], ended: int, code: int) -> None:
    row: Any = SimpleNamespace(run=4, values=values, differences=lambda *_: differences)
    result: Any = SimpleNamespace(exit_code=ended, metrics=None, failure="")
    assert compare_with_row(row, result) == code
