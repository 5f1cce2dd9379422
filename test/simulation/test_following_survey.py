"""A survey of a vessel that loses thrust under way: with a reference that waits it still passes every leg."""

from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.report.record import measured
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.simulation.offline import ClosedLoop

RATE, LOST_FROM = 10.0, 20.0
SURVEY: dict[str, Any] = {
    **{f"{node}.rate_hz": RATE for node in ("vessel_sim", "controller", "reference_ship")},
    **{"vessel": "otter", "controller.law": "guided", "vessel_sim.actuators.kind": "thrusters", "vessel_sim.duration": 160.0},
    **{"vessel_sim.initial_pose": [0.0, 0.0, 0.0], "reference_ship.initial_pose": [0.0, 0.0, 0.0]},
    **{"reference_ship.motion.yaw_rate": 0.3, "reference_ship.motion.yaw_acceleration": 0.2},
    **{"reference_ship.mode": "lawnmower", "reference_ship.lawnmower.legs": 3, "reference_ship.lawnmower.leg_length": 40.0},
    **{"reference_ship.lawnmower.spacing": 8.0, "reference_ship.lawnmower.speed": 2.0},
}


def sailed(follow: str) -> tuple[float, float]:
    """Share of the legs that was missed, and largest distance from the reference, m; port has half its thrust from a time on."""
    scenario = load_scenario("waypoints", {**SURVEY, "reference_ship.follow": follow})
    loop = ClosedLoop(scenario, interpreted=True)
    plant: Any = loop._loop._plant  # type: ignore[attr-defined]
    applied = plant.applied_thrusts

    def weakened(thrust: Any, angle: Any) -> Any:
        lost = loop.done > LOST_FROM * RATE
        return applied([0.5 * thrust[0], *thrust[1:]] if lost else thrust, angle)

    plant.applied_thrusts = weakened
    loop.run()
    run = loop.result()
    metrics = measured(run, scenario)
    assert metrics is not None
    assert metrics.legs_missed is not None
    return metrics.legs_missed, float(np.hypot(*(run.state - run.reference)[:, :2].T).max())


@pytest.mark.long
def test_with_half_of_a_thruster_a_survey_skips_parts_of_its_legs_only_where_the_reference_does_not_wait() -> None:
    (missed_by_time, farthest_by_time), (missed, farthest) = sailed("time"), sailed("vessel")
    assert missed_by_time > 0.04
    assert missed < 0.005
    assert farthest < 0.5 * farthest_by_time
