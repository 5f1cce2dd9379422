"""The regulator of the guided law: the Riccati equation, its closed loop, and the table between whose nodes it is taken."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.control.guided.controller import turn
from vessel_hsmc_ros.control.guided.guidance import Integrals, Track
from vessel_hsmc_ros.control.guided.parameters import (
    DECAYS,
    LARGEST_HEADING_GAIN,
    RATIOS,
    SPEEDS,
    GuidedParameters,
    bounded,
    gains,
    interpolate,
    regulator,
    table,
)
from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, ControlledVessel, KnownVessel
from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.core.kinematics import Motion

E_0, R_0 = 0.1, 0.5


def plant(W, a, kappa):
    A = np.array([[0.0, W, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, -a, -kappa * W], [0.0, 0.0, 0.0, 0.0]])
    return A, np.array([0.0, 0.0, 0.0, 1.0])


@given(st.floats(0.08, 2.0), st.floats(0.05, 12.8), st.floats(0.3, 1.6))
def test_every_hull_at_every_speed_has_a_stable_loop_with_the_margins_of_a_regulator(W, a, kappa):
    K, (A, B) = regulator(W, a, kappa, E_0, R_0), plant(W, a, kappa)
    assert np.linalg.eigvals(A - np.outer(B, K)).real.max() < 0.0
    # |1 + K·(jw - A)⁻¹·B| >= 1 at every frequency: half to infinitely many times the gain, and 60 degrees.
    for w in np.geomspace(1e-2, 1e2, 60):
        assert abs(1.0 + K @ np.linalg.solve(1j * w * np.eye(4) - A, B)) >= 1.0 - 1e-6


def test_the_cost_of_the_regulator_is_least():
    W, a, kappa = 0.4, 1.6, 0.7
    K, (A, B) = regulator(W, a, kappa, E_0, R_0), plant(W, a, kappa)

    def cost(gains):
        step, x = 1e-3, np.array([0.1, 0.2, 0.0, 0.0])
        M = np.eye(4) + step * (A - np.outer(B, gains))
        S = step * (np.diag([E_0**-2, 0.0, 0.0, R_0**-2]) + np.outer(gains, gains))
        for _ in range(15):  # the sum over twice as many steps
            S, M = S + M.T @ S @ M, M @ M
        return x @ S @ x

    assert all(cost(K) < cost(K * (1.0 + 0.05 * sign * np.eye(4)[i])) for i in range(4) for sign in (-1.0, 1.0))


@pytest.mark.parametrize(("i", "j", "k"), [(0, 0, 0), (3, 5, 2), (8, 8, 8)])
def test_the_table_has_the_gains_of_its_nodes(i, j, k):
    K = np.empty(4)
    interpolate(SPEEDS[i], DECAYS[j], RATIOS[k], table(E_0, R_0), K)
    assert pytest.approx(bounded(SPEEDS[i], DECAYS[j], RATIOS[k], E_0, R_0)) == K


@given(st.floats(0.08, 2.0), st.floats(0.05, 12.8), st.floats(0.3, 1.6))
def test_between_the_nodes_the_loop_is_stable_too(W, a, kappa):
    K, (A, B) = np.empty(4), plant(W, a, kappa)
    interpolate(W, a, kappa, table(E_0, R_0), K)
    assert np.linalg.eigvals(A - np.outer(B, K)).real.max() < 0.0


@given(st.floats(0.08, 2.0), st.floats(0.05, 12.8), st.floats(0.3, 1.6))
def test_the_gain_of_the_heading_is_bounded_by_that_of_the_distance_and_no_further_than_it_must(W, a, kappa):
    K, free = bounded(W, a, kappa, E_0, R_0), regulator(W, a, kappa, E_0, R_0)
    assert K[1] <= LARGEST_HEADING_GAIN
    if free[1] <= LARGEST_HEADING_GAIN:
        assert np.array_equal(K, free)
    else:
        assert K[0] < 1.0 / E_0
        assert regulator(W, a, kappa, 1.0 / K[0] / 1.25, R_0)[1] > LARGEST_HEADING_GAIN


def test_beyond_the_grid_the_gains_are_those_of_its_edge():
    edge, beyond = np.empty(4), np.empty(4)
    interpolate(SPEEDS[0], DECAYS[-1], RATIOS[-1], table(E_0, R_0), edge)
    interpolate(0.0, 99.0, 9.0, table(E_0, R_0), beyond)
    assert np.array_equal(beyond, edge)


def distance_worth_the_moment(ahead: float, **declared: float) -> float:
    """e_0, which is 1/K_e where the gain of the heading is not bounded, of a ship with its pivot at a distance ahead, m."""
    vessel = ControlledVessel(**vars(KnownVessel(**INSTANT | declared)), ahead=ahead)
    return float(1.0 / gains(GuidedParameters(), vessel, 0.1).table[0, 0, 3, 0])


def test_a_track_is_followed_tightly_only_by_a_ship_of_known_actuators_whose_pivot_is_not_far_ahead():
    tight, length = GuidedParameters().cross_track, KnownVessel().length
    assert distance_worth_the_moment(0.0) == pytest.approx(tight)
    assert [distance_worth_the_moment(0.0, **{name: -1.0}) for name in INSTANT] == pytest.approx([2.0 * tight] * len(INSTANT))
    assert [distance_worth_the_moment(share * length) for share in (0.05, 0.1, 0.2)] == pytest.approx(
        [1.5 * tight, 2.0 * tight, 2.0 * tight]
    )


@pytest.mark.parametrize("v", [0.02, -0.05])
def test_astern_the_regulator_is_that_of_ahead_with_bow_and_stern_exchanged(v: float) -> None:
    """The sway of a hull that sails astern is that of ahead, with the opposite turn: dv = -kappa·u·r - a·v."""
    law: Any = make_controller("guided", 0.1)

    def yaw_rate(way: float) -> float:
        sailed = Track(0.3, 0.0, 0.0, 0.0, way, 0.0, way * 0.3, 0.0, 0.0, Integrals(0.0, 0.0, 0.0, 0.0))
        ship = Motion(0.0, 0.0, 0.0 if way > 0.0 else math.pi, way * 0.3, v, 0.0)
        return float(turn(sailed, ship, (0.0, 0.0), 0.0, 0.0, law.memory, law.constants.gains).r_c)

    assert abs(yaw_rate(1.0)) > 0.1 * abs(v)
    assert yaw_rate(-1.0) == pytest.approx(-yaw_rate(1.0))
