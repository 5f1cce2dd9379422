"""Inverse dynamics against simulated ships, and what is judged infeasible."""

import math
from dataclasses import replace

import numpy as np
import pytest
from compiling import only_compiled
from durations import rest_long
from ship_family import REFERENCES, ShipFamily, expand, infeasible

from vessel_hsmc_ros.guidance.factory import trajectory
from vessel_hsmc_ros.plant.devices import ActuatorParameters
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.simulation.compilation import compiled
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies.forecast.feasibility import Demand, demand, exceeded

WINDY = ShipFamily(
    has_current=True, current=0.15, current_direction=2.0, has_wind=True, wind=0.1, wind_direction=-1.0, coupled=True
)
NO_GUSTS = {"vessel_sim.disturbance.earth_fixed.gust_deviation": 0.0}


def scenario(family: ShipFamily, **changes: object) -> Scenario:
    return load_scenario("case2_tracking", {"controller.law": "guided", **expand(family), **NO_GUSTS, **changes})


@only_compiled
@pytest.mark.parametrize(("ratio", "coupling"), rest_long([(0.6, 0.0), (0.6, 0.03), (1.0, 0.0), (1.08, -0.01)], 2))
def test_heading_force_and_moment_are_those_of_a_ship_that_is_on_its_reference(ratio: float, coupling: float) -> None:
    # Stable forwards in time, coupled, algebraic, and stable backwards; the law keeps the ship within 0.3 % of its length.
    s = scenario(replace(WINDY, surge_to_sway_inertia=ratio, percussion_point=coupling, knowledge="everything"))
    vessel, h = s.vessel_sim.vessel.coefficients(), 0.2
    run = simulate(s)
    rows = trajectory(s.reference_ship, 1.0 / h, int(run.time[-1] / h) + 200, compiled)
    current = np.array([s.vessel_sim.disturbance.current.east, s.vessel_sim.disturbance.current.north])
    wind = np.array([s.vessel_sim.disturbance.earth_fixed.east_force, s.vessel_sim.disturbance.earth_fixed.north_force])
    begin = len(rows) // 4
    found = demand(rows[begin:], current, wind, vessel, h)
    late = run.time > 0.6 * run.time[-1]
    at = (run.time[late] / h - begin).round().astype(int)
    a = s.vessel_sim.actuators
    heading = np.angle(np.exp(1j * (run.state[late, 2] - found.psi[at])))
    assert np.sqrt(np.mean(heading**2)) < math.radians(0.3)
    assert np.sqrt(np.mean((run.wrench[late, 0] - found.X[at]) ** 2)) < 0.005 * a.surge_force_limit
    assert np.sqrt(np.mean((run.wrench[late, 1] - found.N[at]) ** 2)) < 0.005 * a.yaw_moment_limit


@pytest.mark.parametrize("reference", REFERENCES)
def test_a_moderate_day_is_feasible_and_a_wild_one_is_not(reference: str) -> None:
    family = replace(WINDY, reference=reference)
    assert infeasible(scenario(family)) == ""
    assert infeasible(scenario(replace(family, wind=3.0, wind_direction=math.pi))) != ""


def test_slow_actuators_make_a_fast_slalom_infeasible() -> None:
    family = replace(ShipFamily(), reference="slalom", has_rate=True, time_to_full=1.0)
    sine = {"reference_ship.yaw_moment_sine.amplitude": 1.5e6, "reference_ship.yaw_moment_sine.frequency": 0.2}
    assert infeasible(scenario(family, **sine)) == ""
    late = infeasible(scenario(replace(family, time_to_full=10.0), **sine))
    assert late.startswith("the rate of the yaw moment needs")


def test_a_current_as_fast_as_the_reference_leaves_no_way() -> None:
    family = replace(ShipFamily(), reference="straight", speed=0.3, has_current=True, current=0.3, current_direction=0.0)
    assert infeasible(scenario(family)) == "the ship has no way through the water"


SURGE, YAW = (1.0, 0.1), (0.5, 0.4)
"""Amplitude [N, N·m] and frequency [rad/s] of what the inputs have to do."""


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, ""),
        ({"surge_force_limit": 1.05}, "the surge force needs 0.95"),
        ({"yaw_moment_limit": 0.52}, "the yaw moment needs 0.96"),
        ({"surge_force_rate": 0.105}, "the rate of the surge force needs 0.95"),
        ({"yaw_moment_rate": 0.21}, "the rate of the yaw moment needs 0.95"),
        ({"surge_lag": 30.0}, "the command of the surge force needs 1.05"),
        ({"yaw_lag": 30.0}, "the command of the yaw moment needs 1.5"),
    ],
)
def test_each_input_is_judged_by_its_own_limit_rate_and_lag(changes: dict[str, float], expected: str) -> None:
    time = np.arange(0.0, 400.0, 0.05)
    force, moment = (size * np.sin(omega * time) for size, omega in (SURGE, YAW))
    rest = np.zeros(len(time))
    wide = ActuatorParameters(
        surge_force_limit=3.0, yaw_moment_limit=4.0, surge_force_rate=1.0, yaw_moment_rate=2.0, surge_lag=0.5, yaw_lag=2.0
    )
    actuators = replace(wide, **changes)  # type: ignore[arg-type]
    assert exceeded(Demand(rest, rest, force, moment), actuators, 0.05).startswith(expected)
    assert bool(expected) == bool(exceeded(Demand(rest, rest, -force, -moment), actuators, 0.05))
