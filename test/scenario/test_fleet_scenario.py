"""A scenario for several vessels: places, seeds, frames, clock, and one parameters file for all of them."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from durations import rest_long

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.guidance.factory import REFERENCES, make_reference, trajectory
from vessel_hsmc_ros.scenario.parameters import NODES, read_parameters
from vessel_hsmc_ros.scenario.scenario import MAX_VESSELS, dump_fleet, load_scenario, make_fleet, parse_scenario

CASE = load_scenario("case2_tracking", {"vessel_sim.seed": 7})

MODES: dict[str, dict[str, object]] = {
    "goal": {"goal.times": (0.0, 4.0), "goal.poses": (50.0, 10.0, 0.5, -20.0, 40.0, 2.0)},
    "path": {"path.time": 1.0, "path.waypoints": (60.0, -20.0, 90.0, 40.0)},
    "lawnmower": {"lawnmower.rectangle": (150.0, 40.0, 200.0, 90.0), "lawnmower.run_in": 80.0, "lawnmower.spacing": 50.0},
}
"""Settings of modes whose positions are given in the earth-fixed frame."""

LIMITS = {"vessel.surge_force_limit": 3e5, "vessel.yaw_moment_limit": 8e6, "motion.yaw_acceleration": 0.01}


def test_vessels_start_side_by_side_with_their_references_and_seeds_of_their_own() -> None:
    fleet = make_fleet(CASE, 3, spacing=40.0)
    plants = [scenario.vessel_sim for scenario in fleet.vessels.values()]
    assert [*fleet.vessels] == ["vessel_1", "vessel_2", "vessel_3"]
    assert [plant.initial_pose for plant in plants] == [(5.0, 1.0 + shift, math.pi / 4) for shift in (0.0, 40.0, 80.0)]
    references = [scenario.reference_ship.initial_pose for scenario in fleet.vessels.values()]
    assert references == [(15.0, 15.0 + shift, 0.0) for shift in (0.0, 40.0, 80.0)]
    assert [plant.seed for plant in plants] == [7, 8, 9]


def test_the_first_vessel_owns_the_clock_and_the_others_follow() -> None:
    clocks = [scenario.vessel_sim.clock for scenario in make_fleet(CASE, 3, "tug").vessels.values()]
    assert [clock.source for clock in clocks] == ["own", "follow", "follow"]
    assert [clock.others for clock in clocks] == [("tug_2", "tug_3"), (), ()]


def test_a_fleet_of_one_waits_for_no_other_vessel() -> None:
    (alone,) = make_fleet(CASE, 1).vessels.values()
    assert alone.vessel_sim.clock == CASE.vessel_sim.clock


def test_goals_and_waypoints_of_a_scenario_are_shifted_too() -> None:
    changes = {
        "reference_ship.mode": "path",
        "reference_ship.path.time": 0.0,
        "reference_ship.path.waypoints": (0.0, 0.0, 100.0, 20.0),
        "reference_ship.goal.times": (1.0,),
        "reference_ship.goal.poses": (50.0, 10.0, 0.5),
    }
    second = make_fleet(load_scenario("case2_tracking", changes), 2, spacing=30.0).vessels["vessel_2"].reference_ship
    assert second.path.waypoints == (0.0, 30.0, 100.0, 50.0)
    assert second.goal.poses == (50.0, 40.0, 0.5)


@pytest.mark.parametrize("mode", rest_long(REFERENCES, 2))
def test_in_every_mode_the_reference_of_a_vessel_is_that_of_the_scenario_shifted_by_the_spacing(mode: str) -> None:
    changes = {**LIMITS, **MODES.get(mode, {}), "mode": mode}
    base = load_scenario("case2_tracking", {f"reference_ship.{name}": value for name, value in changes.items()})
    first, second = (
        trajectory(scenario.reference_ship, 2.0, 20) for scenario in make_fleet(base, 2, spacing=30.0).vessels.values()
    )
    np.testing.assert_allclose(second - first, np.tile([0.0, 30.0, *[0.0] * 7], (20, 1)), atol=1e-6)


def test_the_rectangle_of_a_survey_is_shifted_as_a_whole_and_keeps_its_size() -> None:
    changes = {"reference_ship.lawnmower.rectangle": (10.0, 20.0, 300.0, 120.0)}
    fleet = make_fleet(load_scenario("case2_tracking", changes), 3, spacing=30.0)
    rectangles = [scenario.reference_ship.lawnmower.rectangle for scenario in fleet.vessels.values()]
    assert rectangles == [(10.0, 20.0 + shift, 300.0, 120.0) for shift in (0.0, 30.0, 60.0)]


def test_the_whole_survey_of_a_vessel_is_that_of_the_scenario_shifted_by_the_spacing() -> None:
    changes = {**LIMITS, **MODES["lawnmower"], "mode": "lawnmower"}
    base = load_scenario("case2_tracking", {f"reference_ship.{name}": value for name, value in changes.items()})
    fleet = make_fleet(base, 2, spacing=30.0).vessels.values()
    ships: list[Any] = [make_reference(scenario.reference_ship, 2.0) for scenario in fleet]
    tables = [ship.constants.table for ship in ships]
    np.testing.assert_allclose(tables[1].times, tables[0].times, rtol=1e-9)
    shift = np.zeros_like(tables[0].rows)
    shift[:, 1] = 30.0
    np.testing.assert_allclose(tables[1].rows - tables[0].rows, shift, atol=1e-6)


@pytest.mark.parametrize("times", [(0.0, 4.0), (0.0,), (2.0, 7.5, 9.0)])
def test_every_goal_is_shifted_in_y_alone_also_one_at_the_start(times: tuple[float, ...]) -> None:
    poses = tuple(float(10 * k + part) for k in range(len(times)) for part in (1, 2, 3))
    changes = {"reference_ship.mode": "goal", "reference_ship.goal.times": times, "reference_ship.goal.poses": poses}
    base = load_scenario("case2_tracking", changes)
    third = make_fleet(base, 3, spacing=30.0).vessels["vessel_3"].reference_ship
    expected = [value + (60.0 if k % 3 == 1 else 0.0) for k, value in enumerate(base.reference_ship.goal.poses)]
    assert third.goal.poses == tuple(expected)


def test_the_parameters_file_gives_each_vessel_its_scenario() -> None:
    fleet = make_fleet(CASE, 3)
    text = dump_fleet(fleet)
    for name, scenario in fleet.vessels.items():
        assert parse_scenario(text, CASE.name, namespace=f"/{name}/") == scenario
        assert scenario.controller.frame_prefix == f"{name}/"


def test_a_vessel_takes_nothing_of_one_whose_namespace_begins_like_its_own() -> None:
    names = ("vessel_1", "vessel_10", "vessel_1/tender")
    text = "".join(f"/{name}/controller: {{ros__parameters: {{rate_hz: {10.0 * k}}}}}\n" for k, name in enumerate(names, 1))
    for k, name in enumerate(names, 1):
        assert read_parameters(text, {"controller": ()}, "a file", f"/{name}/") == {"controller": {"rate_hz": 10.0 * k}}


def test_one_recorder_records_the_topics_of_every_vessel() -> None:
    base = load_scenario("case2_tracking", {"recorder.topics": ("odom", "/clock")})
    recorded = make_fleet(base, 2).with_bag(Path("bag"), Path("params.yaml"))
    assert recorded.base.recorder.topics == ("vessel_1/odom", "vessel_2/odom", "/clock")
    assert recorded.base == replace(base, recorder=recorded.base.recorder)


@pytest.mark.parametrize(("given", "expected"), [("", "run/black_box"), ("/var/boxes", "/var/boxes")])
def test_black_boxes_are_in_the_folder_of_the_run_unless_another_is_given(given: str, expected: str) -> None:
    real_time = {f"{node}.lockstep": False for node in NODES}
    base = load_scenario("case2_tracking", {**real_time, "controller.black_box.directory": given})
    recorded = "run/bag", "run/params.yaml"
    assert base.with_bag(*map(Path, recorded)).controller.black_box.directory == expected
    text = dump_fleet(make_fleet(base, 2).with_bag(*map(Path, recorded)))
    for namespace in ("vessel_1", "vessel_2"):
        assert parse_scenario(text, base.name, namespace=namespace).controller.black_box.directory == expected


@pytest.mark.parametrize("count", [0, -1, MAX_VESSELS + 1])
def test_a_number_of_vessels_out_of_range_is_refused(count: int) -> None:
    with pytest.raises(ParameterError, match=rf"--vessels must be 1 to {MAX_VESSELS} .got {count}"):
        make_fleet(CASE, count)


def test_a_start_beyond_the_allowed_positions_is_refused() -> None:
    with pytest.raises(ParameterError, match="initial_pose"):
        make_fleet(CASE, MAX_VESSELS, spacing=1e5)
