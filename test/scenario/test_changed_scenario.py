"""`Scenario.changed` gives what `load_scenario` gives with the same changes."""

from pathlib import Path
from typing import Any

import pytest
from durations import rest_long

from vessel_hsmc_ros.core.exceptions import ParameterError, VesselHsmcError
from vessel_hsmc_ros.scenario.scenario import load_scenario, scenario_names

CHANGES: list[dict[str, Any]] = [
    {},
    {"vessel_sim.seed": 7, "vessel_sim.initial_pose": [1, 2.0, 3.0], "vessel_sim.disturbance.earth_fixed.east_force": 500},
    {"vessel.surge_inertia": 1.3e5, "controller.vessel.surge_inertia": 1.1e5, "vessel.length": 30.0},
    {"controller.vessel.surge_inertia": 1.1e5, "vessel.surge_inertia": 1.3e5},
    {"controller.law": "los_pid", "recorder.compression": "lz4", "vessel_sim.lockstep": False},
    {"reference_ship.motion.speed": 1.0, "reference_ship.surge_force_steps.values": (3.0,)},
]


@pytest.mark.parametrize("name", rest_long(scenario_names(), 5))
def test_a_changed_scenario_is_the_one_loaded_with_the_changes(name: str) -> None:
    scenario = load_scenario(name)
    for changes in CHANGES:
        try:
            loaded = load_scenario(name, changes)
        except ParameterError:  # a boat does not sail its survey with the mass of a ship
            with pytest.raises(ParameterError):
                scenario.changed(changes)
            continue
        changed = scenario.changed(changes)
        assert changed == loaded
        assert changed.given == loaded.given


def test_the_faults_of_a_changed_scenario_have_its_seed(tmp_path: Path) -> None:
    path = tmp_path / "own.yaml"
    path.write_text("faults:\n  - {at: 1.0, kind: drop, topic: odom}\n", encoding="utf-8")
    scenario = load_scenario(path)
    for changes in ({"vessel_sim.seed": 7}, {"vessel_sim.duration": 8.0}, {"controller.law": "guided"}):
        assert scenario.changed(changes) == load_scenario(path, changes)
    assert scenario == load_scenario(path)


@pytest.mark.parametrize("seed", [0, 4, 7])
def test_the_faults_of_a_scenario_that_is_changed_again_have_the_seed_of_each_time(tmp_path: Path, seed: int) -> None:
    path = tmp_path / "own.yaml"
    path.write_text("faults:\n  - {at: 1.0, kind: drop, topic: odom}\n", encoding="utf-8")
    scenario = load_scenario(path, {"vessel_sim.seed": seed})
    for later in (7, 8, 0, 4):
        scenario = scenario.changed({"vessel_sim.seed": later})
        assert scenario == load_scenario(path, {"vessel_sim.seed": later})
        assert scenario.faults is not None
        assert scenario.faults.seed == later


def test_changes_add_up_and_leave_the_original_as_it_is() -> None:
    scenario = load_scenario("case2_tracking")
    twice = scenario.changed({"vessel_sim.seed": 7}).changed({"vessel_sim.duration": 8.0})
    assert twice == load_scenario("case2_tracking", {"vessel_sim.seed": 7, "vessel_sim.duration": 8.0})
    assert scenario == load_scenario("case2_tracking")


@pytest.mark.parametrize(
    "changes",
    [
        {"vessel_sim.sed": 1},
        {"vessel_sim": 1},
        {"plant.seed": 1},
        {"vessel.mass": 1.0},
        {"vessel_sim.seed": 1.5},
        {"vessel_sim.initial_pose": [0.0, 0.0]},
        {"controller.law": "pid"},
        {"controller.rate_hz": 30.0},
        {"controller.hierarchical_printed.yaw_reaching_gain": 1e3},
        {"reference_ship.yaw_moment_steps.times": [0.0, 5.0]},
        {"reference_ship.mode": "circle", "vessel.yaw_moment_limit": 1.0},
    ],
)
def test_a_change_that_is_not_allowed_has_the_error_of_loading(changes: dict[str, Any]) -> None:
    with pytest.raises(VesselHsmcError) as of_loading:
        load_scenario("case2_tracking", changes)
    with pytest.raises(VesselHsmcError) as error:
        load_scenario("case2_tracking").changed(changes)
    assert (type(error.value), str(error.value)) == (type(of_loading.value), str(of_loading.value))
