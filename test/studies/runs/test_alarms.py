"""Healthy runs under all checks of the safety layer, and runs in which a check must find something."""

from typing import Any

import pytest
from durations import rest_long
from supervised_runs import supervise

from vessel_hsmc_ros.scenario.named_files import SUITES
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.studies.suite import load_suite

FIRST = [(name, load_suite(name)[0]) for name in SUITES.names()]


@pytest.mark.parametrize(("suite", "row"), rest_long(FIRST, 4), ids=[name for name, _ in FIRST])
def test_a_healthy_run_raises_no_alarm_and_keeps_its_commands(suite: str, row: Any) -> None:
    del suite
    changes = {**row.changes, "controller.law": "guided", "vessel_sim.duration": 10.0}
    found = supervise(load_scenario(row.scenario, changes))
    assert found.steps > 100
    assert (found.alarms, found.differing) == ({}, 0)


@pytest.mark.parametrize(
    ("changes", "alarm"),
    [
        ({"controller.safety.monitors.saturation_warning": 0.1}, "monitor: saturated"),
        ({"controller.safety.jump_speed": 0.01}, "jump"),
        ({"controller.diagnostics.surface_limit": 1e-6}, "yaw_surface"),
    ],
)
def test_what_a_check_finds_is_counted(changes: dict[str, object], alarm: str) -> None:
    scenario = load_scenario("case2_tracking", {"controller.law": "guided", "vessel_sim.duration": 5.0, **changes})
    assert alarm in supervise(scenario).alarms
