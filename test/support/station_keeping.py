"""Ships at rest in closed loop: the paper's with its pivot ahead of the origin, and those of the library."""

import math

from vessel_hsmc_ros.scenario.own_ship import scenario_for
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, parse_scenario
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.studies.batch import simulate_one

REST: dict[str, object] = {
    "controller.law": "guided",
    "reference_ship.mode": "virtual_ship",
    "reference_ship.surge_force": 0.0,
    "reference_ship.yaw_moment": 0.0,
}
IDEAL: dict[str, object] = {
    **{f"controller.vessel.{name}": 0.0 for name in ("surge_lag", "yaw_lag", "surge_dead_time", "yaw_dead_time")},
    "controller.vessel.surge_force_rate": math.inf,
    "controller.vessel.yaw_moment_rate": math.inf,
}
LAG: dict[str, object] = IDEAL | {
    f"{node}.{name}": 2.0 for node in ("controller.vessel", "vessel_sim.actuators") for name in ("surge_lag", "yaw_lag")
}


def error_at_rest(scenario: Scenario) -> float:
    """The rms position error of the last quarter, m."""
    outcome = simulate_one(scenario)
    assert outcome.metrics
    return outcome.metrics.position_error_rms_last_quarter


def coupled(coupling: float, **changes: object) -> Scenario:
    """The ship of the paper under its disturbance, 17 m from its setpoint, with a known m23 and cross damping."""
    hull = {"vessel_sim.vessel.sway_yaw_inertia": coupling, "controller.vessel.sway_yaw_inertia": coupling}
    damping = {f"vessel_sim.vessel.{name}": 0.4 * coupling for name in ("sway_damping_from_yaw", "yaw_damping_from_sway")}
    run = {"controller.rate_hz": 50.0, "vessel_sim.duration": 250.0}
    return load_scenario("case2_tracking", {**REST, **hull, **damping, **run, **changes})


def rest_of_the_library(name: str) -> tuple[Scenario, float]:
    """A vessel of the library in calm water, half a length from its setpoint, and its length, m."""
    scenario = parse_scenario(scenario_for(read_vessel(name).values, name), name)
    length = scenario.vessel_sim.vessel.length
    start = {"vessel_sim.initial_pose": [-0.3 * length, -0.4 * length, math.pi / 4.0]}
    duration = {"vessel_sim.duration": min(scenario.vessel_sim.duration, 1400.0)}
    return scenario.changed({**REST, **start, **duration}), length
