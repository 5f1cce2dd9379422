import pytest

from vessel_hsmc_ros.core.metrics import position_error, rms
from vessel_hsmc_ros.runs.offline import simulate
from vessel_hsmc_ros.scenario.own_ship import scenario_for
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario
from vessel_hsmc_ros.scenario.vessels import read_vessel, vessel_names


def scenario_of(name: str) -> Scenario:
    scenario = parse_scenario(scenario_for(read_vessel(name).values, name), name)
    return scenario.changed({"vessel_sim.duration": min(scenario.vessel_sim.duration, 1200.0)})


def settled_error(scenario: Scenario) -> float:
    """The rms position error of the last quarter, in lengths."""
    run = simulate(scenario)
    error = position_error(run.state, run.reference)[run.time >= 0.75 * run.time[-1]]
    return rms(error) / scenario.vessel_sim.vessel.length


@pytest.mark.parametrize("name", vessel_names())
def test_every_vessel_of_the_library_keeps_its_circle(name: str) -> None:
    assert settled_error(scenario_of(name)) < 0.01


@pytest.mark.parametrize("name", ["cybership2", "gunnerus", "otter", "viknes_830"])
def test_vessels_follow_a_virtual_ship_of_their_own_hull(name: str) -> None:
    scenario = scenario_of(name)
    limits = scenario.controller.vessel
    inputs = {
        "reference_ship.mode": "virtual_ship",
        "reference_ship.surge_force": 0.3 * limits.surge_force_limit,
        "reference_ship.yaw_moment": 0.1 * limits.yaw_moment_limit,
    }
    assert settled_error(scenario.changed(inputs)) < 0.01
