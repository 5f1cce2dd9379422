"""The decay of the drift in vessel files: it is of the hull data of the same file."""

import pytest

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.scenario.own_ship import ship_of
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.scenario.ship_rules import circle_for, coriolis_ratio, scale_of, sway_damping_rate
from vessel_hsmc_ros.scenario.vessels import read_vessel, vessel_names


@pytest.mark.parametrize("name", vessel_names())
def test_a_vessel_file_states_the_decay_of_the_drift_that_follows_from_its_hull(name: str) -> None:
    values = read_vessel(name).values
    ship = ship_of(values)
    scale = scale_of(ship)
    stated = values.get("vessel.sway_damping_rate", KnownVessel().sway_damping_rate)
    assert stated == pytest.approx(sway_damping_rate(ship, scale, circle_for(ship, scale)), rel=0.01)
    assert ("vessel.coriolis_ratio" in values) == ("vessel.sway_damping_rate" in values)
    assert values.get("vessel.coriolis_ratio", 0.0) in (
        0.0,
        pytest.approx(coriolis_ratio(ship, circle_for(ship, scale)), rel=0.01),
    )


def test_the_law_knows_the_decay_of_the_drift_of_a_vessel_by_its_name() -> None:
    scenario = load_scenario(
        "case2_tracking", {"vessel": "gunnerus", "reference_ship.surge_force": 1e4, "reference_ship.yaw_moment": 1e4}
    )
    assert scenario.controller.vessel.sway_damping_rate == read_vessel("gunnerus").values["vessel.sway_damping_rate"]
