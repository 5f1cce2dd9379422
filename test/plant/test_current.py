"""A ship in moving water: (6) with the velocity relative to the water."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.plant.dynamics import derivative, rk4, unforced_in_current
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters

SHIP = VesselParameters().coefficients()
CALM = (0.0, 0.0, 0.0)

speeds = st.floats(-3.0, 3.0)
motions = st.tuples(*[st.floats(-100.0, 100.0)] * 2, st.floats(-7.0, 7.0), speeds, speeds, speeds).map(np.array)
currents = st.tuples(speeds, speeds)


def on_water(state, current):
    """The state seen from a frame that moves with the water, both frames being together at time 0."""
    seen = state.copy()
    c, s = math.cos(state[2]), math.sin(state[2])
    seen[3] -= current[0] * c + current[1] * s
    seen[4] -= current[1] * c - current[0] * s
    return seen


@given(motions, currents)
def test_the_earth_fixed_acceleration_depends_on_the_velocity_through_the_water(state, current) -> None:
    def earth_fixed(seen, rates):
        """d/dt of R(psi)·(u, v)."""
        c, s, r = math.cos(seen[2]), math.sin(seen[2]), seen[5]
        along, across = rates[3] - r * seen[4], rates[4] + r * seen[3]
        return along * c - across * s, along * s + across * c, rates[5]

    seen = on_water(state, current)
    moving = earth_fixed(state, derivative(state, (1e5, 1e6), (0.1, 0.2, 0.3), SHIP, current))
    calm = earth_fixed(seen, derivative(seen, (1e5, 1e6), (0.1, 0.2, 0.3), SHIP))
    np.testing.assert_allclose(moving, calm, rtol=1e-9, atol=1e-9)


def test_a_run_in_a_current_is_the_run_in_still_water_plus_the_drift() -> None:
    current = (0.7, -0.4)
    over_ground = np.array([5.0, 1.0, 0.6, 1.0, 0.2, 0.1])
    seen = on_water(over_ground, current)
    for _ in range(2000):
        over_ground = rk4(over_ground, (1e5, 1e6), (0.01, 0.02, 0.001), SHIP, 0.01, current)
        seen = rk4(seen, (1e5, 1e6), (0.01, 0.02, 0.001), SHIP, 0.01)
    carried = on_water(over_ground, current)
    carried[:2] -= 20.0 * np.array(current)
    np.testing.assert_allclose(carried, seen, rtol=0.0, atol=1e-8)


def test_a_ship_without_inputs_finally_drifts_with_the_current() -> None:
    current = (0.5, 0.3)
    state = np.array([0.0, 0.0, 1.1, 0.0, 0.0, 0.0])
    for _ in range(3000):
        state = rk4(state, (0.0, 0.0), CALM, SHIP, 0.05, current)
    rates = derivative(state, (0.0, 0.0), CALM, SHIP, current)
    np.testing.assert_allclose(rates[:3], [0.5, 0.3, 0.0], atol=1e-6)
    np.testing.assert_allclose(unforced_in_current(state, SHIP, current), 0.0, atol=1e-6)


@given(motions)
def test_a_current_of_zero_is_still_water(state) -> None:
    np.testing.assert_array_equal(
        derivative(state, (1e5, 1e6), CALM, SHIP), derivative(state, (1e5, 1e6), CALM, SHIP, (0.0, 0.0))
    )


def test_a_current_on_the_beam_turns_the_ship_by_the_munk_moment() -> None:
    ahead = np.array([0.0, 0.0, 0.0, 2.0, 0.0, 0.0])
    f_r = unforced_in_current(ahead, SHIP, (0.0, 0.5))[2]
    assert f_r == pytest.approx((SHIP.m11 - SHIP.m22) * 2.0 * -0.5 / SHIP.m33)
