"""Scenarios whose reference follows the vessel: what does not fit is refused at the start."""

import pytest

from vessel_hsmc_ros.core.exceptions import VesselHsmcError
from vessel_hsmc_ros.scenario.scenario import load_scenario


@pytest.mark.parametrize(
    ("scenario", "changes", "reason"),
    [
        ("goal", {}, "must be time in mode goal"),
        ("case2_tracking", {}, "must be time in mode virtual_ship"),
        (
            "waypoints",
            {"vessel_sim.sensors.delay": 0.5},
            "only allowed in lockstep with vessel_sim.sensors.delay = 0 .got 0.5 s.",
        ),
        ("waypoints", {"vessel_sim.clock.source": "follow"}, "only allowed for a fleet in real time"),
        ("waypoints", {"vessel_sim.clock.followers": ["b"]}, "only allowed for a fleet in real time"),
        (
            "waypoints",
            {"controller.lockstep": False, "controller.odometry.form": "pose_twist"},
            "form = odometry .got pose_twist.",
        ),
    ],
)
def test_what_does_not_fit_a_reference_that_waits_is_refused(scenario: str, changes: dict[str, object], reason: str) -> None:
    load_scenario(scenario, changes)
    with pytest.raises(VesselHsmcError, match=reason):
        load_scenario(scenario, {**changes, "reference_ship.follow": "vessel"})
