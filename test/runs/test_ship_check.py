"""Every vessel of the library follows the circle that is written for it."""

import pytest

from vessel_hsmc_ros.core.metrics import position_error
from vessel_hsmc_ros.runs.offline import simulate
from vessel_hsmc_ros.scenario.own_ship import scenario_for
from vessel_hsmc_ros.scenario.scenario import parse_scenario
from vessel_hsmc_ros.scenario.vessels import read_vessel, vessel_names


@pytest.mark.parametrize("key", vessel_names())
def test_every_library_vessel_follows_its_circle_within_a_hundredth_of_its_length(key: str) -> None:
    scenario = parse_scenario(scenario_for(read_vessel(key).values, key, key), key)
    run = simulate(scenario)
    late = run.time > 0.75 * run.time[-1]
    assert position_error(run.state, run.reference)[late].max() < 0.01 * scenario.vessel_sim.vessel.length
