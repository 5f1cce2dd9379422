"""The compiled loop with thrusters against the interpreted one."""

import numpy as np
import pytest

from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.simulation.offline import ClosedLoop

CASE2 = share_directory() / "config" / "thrusters" / "case2_thrusters.yaml"
SLOW = {
    "vessel_sim.duration": 5.0,
    "controller.law": "guided",
    "vessel.thrusters.thrust_ahead": [1e5],
    "vessel.thrusters.thrust_astern": [6e4],
    "vessel.thrusters.thrust_rate": [5e4],
    "vessel.thrusters.lag": [0.5],
}


def test_a_compiled_run_with_thrusters_is_bit_identical_to_the_interpreted_one() -> None:
    scenario = load_scenario(CASE2, SLOW)
    loops = [ClosedLoop(scenario, interpreted=interpreted) for interpreted in (False, True)]
    for loop in loops:
        loop.run()
    first, second = (loop.published() for loop in loops)
    np.testing.assert_array_equal(first.odometry, second.odometry)
    np.testing.assert_array_equal(first.applied, second.applied)
    assert first.applied.shape[1] == 3


def test_case_2_by_two_propellers_is_the_run_by_a_wrench() -> None:
    """As long as the propellers are strong enough, which are exact but for rounding errors."""
    runs = []
    for kind in ("thrusters", "wrench"):
        changes = {"vessel_sim.duration": 5.0, "controller.law": "guided", "vessel_sim.actuators.kind": kind}
        loop = ClosedLoop(load_scenario(CASE2, changes), interpreted=True)
        loop.run()
        runs.append(loop.result())
    by_thrusters, by_wrench = runs
    np.testing.assert_allclose(by_thrusters.state, by_wrench.state, atol=1e-9)
    np.testing.assert_allclose(by_thrusters.wrench, by_wrench.wrench, rtol=1e-9, atol=1e-3)


def test_thrusters_need_a_layout() -> None:
    with pytest.raises(ParameterError, match=r"actuators\.kind = thrusters needs vessel\.thrusters\.names"):
        load_scenario("case2_tracking", {"vessel_sim.actuators.kind": "thrusters"})


def test_allocation_and_plant_have_the_same_thrusters() -> None:
    with pytest.raises(ScenarioError, match="are not those of vessel_sim"):
        load_scenario(CASE2, {"thruster_allocation.vessel.thrusters.names": ["port", "starboard"]})
