"""Hours at rest under noise, then under way: noise must not teach the law what the ship is not."""

import math

import numpy as np
from compiling import only_compiled

from vessel_hsmc_ros.control.interface.known_vessel import INSTANT
from vessel_hsmc_ros.core.metrics import Run, position_error, rms
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.simulation.offline import simulate

HOURS, SETTLED, UNDER_WAY = 6.0, 300.0, 800.0
"""The rest, h, and the times that it takes to settle and to be under way, s."""

SHIP: dict[str, object] = {
    "controller.law": "guided",
    **{f"controller.vessel.{name}": value for name, value in INSTANT.items()},
    "vessel_sim.actuators.surge_force_limit": 2e5,
    "vessel_sim.actuators.yaw_moment_limit": 3e6,
    "vessel_sim.initial_pose": [0.0, 0.0, 0.0],
    "reference_ship.initial_pose": [0.0, 0.0, 0.0],
    "vessel_sim.sensors.position_noise": 0.1,
    "vessel_sim.sensors.heading_noise": 0.01,
    "vessel_sim.sensors.velocity_noise": 0.1,
    "vessel_sim.sensors.yaw_rate_noise": 0.01,
    **{f"{node}.rate_hz": 10.0 for node in ("vessel_sim", "reference_ship", "controller")},
}


def rested(rest: float, seed: int) -> Run:
    """A run at rest, and then on the circle of 90 kN and 600 kN·m.

    Args:
        rest: Duration of the rest, s.
        seed: Of the noise.
    """
    program = {
        "vessel_sim.duration": rest + UNDER_WAY,
        "vessel_sim.seed": seed,
        "reference_ship.surge_force": 0.0,
        "reference_ship.yaw_moment": 0.0,
        "reference_ship.surge_force_steps.times": [0.0, rest],
        "reference_ship.surge_force_steps.values": [0.0, 9e4],
        "reference_ship.yaw_moment_steps.times": [0.0, rest],
        "reference_ship.yaw_moment_steps.values": [0.0, 6e5],
    }
    return simulate(load_scenario("case2_tracking", {**SHIP, **program}))


def error_under_way(run: Run) -> float:
    """The rms position error of the second half under way, m."""
    return rms(position_error(run.state, run.reference)[run.time >= run.time[-1] - 0.5 * UNDER_WAY])


@only_compiled
def test_a_ship_that_has_rested_for_hours_under_noise_tracks_as_one_that_has_not() -> None:
    rest = 3600.0 * HOURS
    fresh = math.sqrt(np.mean([error_under_way(rested(SETTLED, seed)) ** 2 for seed in (1, 2, 3)]))
    assert error_under_way(rested(rest, 1)) <= 1.2 * fresh
