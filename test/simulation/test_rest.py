"""Station keeping in closed loop, compiled: a centre of percussion ahead of the origin, the vessels of the library."""

import math

import pytest
from station_keeping import IDEAL, LAG, coupled, error_at_rest, rest_of_the_library

from vessel_hsmc_ros.core.kinematics import GRAVITY
from vessel_hsmc_ros.scenario.vessels import vessel_names


@pytest.mark.parametrize("actuators", [IDEAL, LAG], ids=["ideal", "lag 2 s"])
def test_a_ship_with_its_pivot_ahead_keeps_its_position_under_a_force_that_turns_with_it(actuators: dict[str, object]) -> None:
    assert error_at_rest(coupled(1.2e6, **actuators)) < 0.1


def test_a_coupling_that_is_a_fifth_larger_than_declared_is_tolerated() -> None:
    assert error_at_rest(coupled(1.2e6, **{**IDEAL, "controller.vessel.sway_yaw_inertia": 0.96e6})) < 0.1


MINIMUM_PHASE = sorted({*vessel_names()} - {"cybership2", "cybership_enterprise"})


@pytest.mark.parametrize("name", MINIMUM_PHASE)
def test_every_vessel_but_the_non_minimum_phase_ones_comes_to_rest_in_calm_water(name: str) -> None:
    """Where the approach is as fast as the drift decays, light hulls circle the point at 0.1 to 0.7 lengths for ever."""
    scenario, length = rest_of_the_library(name)
    limit = 0.01 if name in ("otter", "supply_vessel") else 0.002
    assert error_at_rest(scenario) < limit * length


@pytest.mark.parametrize("name", MINIMUM_PHASE)
def test_they_come_to_rest_within_a_fortieth_of_their_length_in_a_current(name: str) -> None:
    """An integral of the error that has grown too large far from the point is unloaded: else it keeps the ship away."""
    scenario, length = rest_of_the_library(name)
    current = {"vessel_sim.disturbance.current.north": 0.03 * math.sqrt(GRAVITY * length)}
    assert error_at_rest(scenario.changed(current)) < 0.025 * length
