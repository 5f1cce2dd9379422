"""Station keeping in closed loop, compiled: a centre of percussion ahead of the origin, the vessels of the library."""

import math

import pytest

from vessel_hsmc_ros.core.kinematics import GRAVITY
from vessel_hsmc_ros.runs.batch import simulate_one
from vessel_hsmc_ros.scenario.own_ship import scenario_for
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, parse_scenario
from vessel_hsmc_ros.scenario.vessels import read_vessel, vessel_names

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


@pytest.mark.parametrize("coupling", [3e5, 6e5, 1.2e6])
@pytest.mark.parametrize("actuators", [IDEAL, LAG], ids=["ideal", "lag 2 s"])
def test_a_ship_with_its_pivot_ahead_keeps_its_position_under_a_force_that_turns_with_it(
    coupling: float, actuators: dict[str, object]
) -> None:
    assert error_at_rest(coupled(coupling, **actuators)) < 0.1


def test_a_coupling_that_is_a_fifth_larger_than_declared_is_tolerated() -> None:
    assert error_at_rest(coupled(1.2e6, **{**IDEAL, "controller.vessel.sway_yaw_inertia": 0.96e6})) < 0.1


def test_a_force_that_only_the_damping_of_a_circle_can_balance_is_balanced_on_a_small_one() -> None:
    """Without cross damping: r = F_v/(d_v·rho)."""
    undamped = {f"vessel_sim.vessel.{name}": 0.0 for name in ("sway_damping_from_yaw", "yaw_damping_from_sway")}
    assert error_at_rest(coupled(6e5, **{**IDEAL, **undamped})) < 0.25


@pytest.mark.parametrize("name", vessel_names())
def test_every_vessel_of_the_library_comes_to_rest_within_two_thousandths_of_its_length_in_calm_water(name: str) -> None:
    scenario = parse_scenario(scenario_for(read_vessel(name).values, name), name)
    length = scenario.vessel_sim.vessel.length
    start = {"vessel_sim.initial_pose": [-0.3 * length, -0.4 * length, math.pi / 4.0]}
    duration = {"vessel_sim.duration": min(scenario.vessel_sim.duration, 1400.0)}
    assert error_at_rest(scenario.changed({**REST, **start, **duration})) < 0.002 * length


@pytest.mark.parametrize("name", sorted({*vessel_names()} - {"cybership2", "cybership_enterprise"}))
def test_lqg_brings_every_vessel_but_the_non_minimum_phase_ones_to_rest_within_a_hundredth_of_its_length(name: str) -> None:
    """Where the approach is as fast as the drift decays, light hulls circle the point at 0.1 to 0.7 lengths for ever."""
    scenario = parse_scenario(scenario_for(read_vessel(name).values, name), name)
    length = scenario.vessel_sim.vessel.length
    start = {"vessel_sim.initial_pose": [-0.3 * length, -0.4 * length, math.pi / 4.0], "controller.law": "lqg"}
    duration = {"vessel_sim.duration": min(scenario.vessel_sim.duration, 1400.0)}
    assert error_at_rest(scenario.changed({**REST, **start, **duration})) < 0.01 * length


@pytest.mark.parametrize("name", sorted({*vessel_names()} - {"cybership2", "cybership_enterprise"}))
def test_lqg_brings_them_to_rest_within_a_fortieth_of_their_length_in_a_current(name: str) -> None:
    """An integral of the error that has grown too large far from the point is unloaded: else it keeps her away for ever."""
    scenario = parse_scenario(scenario_for(read_vessel(name).values, name), name)
    length = scenario.vessel_sim.vessel.length
    start = {"vessel_sim.initial_pose": [-0.3 * length, -0.4 * length, math.pi / 4.0], "controller.law": "lqg"}
    current = {"vessel_sim.disturbance.current.north": 0.03 * math.sqrt(GRAVITY * length)}
    duration = {"vessel_sim.duration": min(scenario.vessel_sim.duration, 1400.0)}
    assert error_at_rest(scenario.changed({**REST, **start, **current, **duration})) < 0.025 * length
