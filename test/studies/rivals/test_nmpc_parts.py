"""The parts of the predictive law, each with numbers that all differ: target, weights, disturbance estimate, flags."""

import math
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion

pytest.importorskip("casadi", reason="the predictive law is an extra")

PERIOD = 0.1
LENGTHS = [0.25, 0.25, 0.5, 0.5, 1.0, 1.0]
DESIRED = Motion(30.0, -8.0, 3.0, 1.5, -0.2, 0.05)


def law(**settings: Any) -> Any:
    return make_controller("nmpc", PERIOD, steps=2, **settings)


def test_the_inputs_of_the_reference_are_extrapolated_for_the_preview_and_steps_of_them_are_not() -> None:
    made = law(preview=0.9)
    middles = [0.125, 0.375, 0.75, 1.25, 2.0, 3.0]
    changes = [Acceleration(0.010, 0.002, 0.0010), Acceleration(0.017, 0.002, 0.0006), Acceleration(0.6, 0.0, -0.02)]
    seen = []
    for change in changes:
        target, present = made._extrapolate(DESIRED, change, np.zeros(3))
        seen.append((target.U.reshape(-1, 2), present))
        made.plan = made.plan._replace(state=DESIRED, U_d=present)
    np.testing.assert_allclose(seen[0][0], np.tile(seen[0][1], (6, 1)))  # no rate is known of the first
    rate = (seen[1][1] - seen[0][1]) / PERIOD
    assert (np.abs(rate) > 1e-3).all()
    np.testing.assert_allclose(seen[1][0], [seen[1][1] + min(t, 0.9) * rate for t in middles])
    assert seen[2][1][0] - seen[1][1][0] > 0.02
    assert seen[2][1][1] - seen[1][1][1] < -0.02
    np.testing.assert_allclose(seen[2][0], np.tile(seen[2][1], (6, 1)))


def test_the_target_compensates_the_force_ahead_and_the_moment_but_no_sway_force() -> None:
    made, b = law(), np.array([3e4, 7e4, 4e5])
    plain, with_force = (made._extrapolate(DESIRED, Acceleration(0.0, 0.0, 0.0), each)[0].U for each in (np.zeros(3), b))
    np.testing.assert_allclose((with_force - plain).reshape(-1, 2), np.tile([-3e4 / 2e5, -4e5 / 3e6], (6, 1)))


def test_errors_are_weighted_by_the_lengths_of_the_steps_the_speed_and_the_end() -> None:
    made = law(position_weight=2.0, heading_weight=0.3, course_weight=0.7, end_weight=5.0)
    target, _ = made._extrapolate(DESIRED, Acceleration(0.0, 0.0, 0.0), np.zeros(3))
    row = np.array([2.0, 2.0, 0.3 + 0.7 * (1.5**2 + 0.2**2), 0.0, 0.0, 0.0])
    np.testing.assert_allclose(target.q.reshape(-1, 6), np.outer([*LENGTHS[:-1], 5.0 * LENGTHS[-1]], row))


def test_inputs_are_weighted_by_the_lengths_of_the_steps_and_changes_from_step_to_step() -> None:
    made = law(effort_weight=3.0, change_weight=0.0)
    np.testing.assert_allclose(made._R, np.diag(3.0 * np.repeat(LENGTHS, 2)))
    changes, U = law(effort_weight=0.0, change_weight=2.0), np.arange(12.0) ** 2
    expected = 2.0 * np.sum(np.diff(U.reshape(-1, 2), axis=0) ** 2)
    cost = float(U @ changes._R @ U)
    assert cost == pytest.approx(expected)


def test_a_prediction_error_goes_half_to_the_hull_and_half_to_the_earth_with_the_bandwidth_of_the_estimate() -> None:
    made = law(disturbance_bandwidth=4.0)
    at = Motion(1.0, 2.0, 0.3, 1.0, 0.1, 0.02)
    made.step(at, at, Acceleration(0.0, 0.0, 0.0))
    predicted = made.horizon.step(at, made.plan.U[:2], made.plan.b, made.plan.e, PERIOD)[0][:, 0]
    error = np.array([0.03, -0.02, 0.004])
    after = Motion(*predicted[:3].tolist(), *(predicted[3:] + error).tolist())
    b, e = made._disturbance(after)
    force = error * [120e3, 177.9e3, 636e5] * (1.0 - math.exp(-0.4)) / PERIOD
    c, s = math.cos(after.psi), math.sin(after.psi)
    np.testing.assert_allclose(b, force * [0.5, 0.5, 1.0])
    np.testing.assert_allclose(e, [0.5 * (c * force[0] - s * force[1]), 0.5 * (s * force[0] + c * force[1])])


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_each_input_at_its_limit_is_reported_in_either_direction(side: float) -> None:
    desired, still = Motion(0.0, 0.0, 0.0, 1.0, 0.0, 0.0), Acceleration(0.0, 0.0, 0.0)
    seen = set()
    for k in range(1, 9):
        # The solver meets a limit but for rounding, from some places exactly.
        for ship, made in (
            (desired._replace(x=-9.0 * k * side), law()),
            (desired._replace(r=-0.2 * k * side), law(heading_weight=9.0)),
        ):
            for _ in range(2):
                (tau_1, tau_2), terms = made.step(ship, desired, still)
            flags = terms.surge_saturated, terms.yaw_saturated
            assert flags == (abs(tau_1) == 2e5, abs(tau_2) == 3e6)
            seen |= {(which, tau * side > 0.0) for which, tau, flag in zip("un", (tau_1, tau_2), flags, strict=True) if flag}
    assert {("u", True), ("n", True)} <= seen


def test_the_distance_over_which_a_reference_turns_is_that_of_its_next_whole_turn() -> None:
    """The heading of the ship is taken within half a turn of the reference's, wherever either of them has turned."""
    found = []
    for turns in (0.0, 2.0 * math.pi, -4.0 * math.pi):
        made = law(heading_weight=1.0)
        desired = Motion(0.0, 0.0, 3.0, 1.0, 0.0, 0.0)
        found.append(made.step(Motion(1.0, 0.5, -3.1 + turns, 1.0, 0.0, 0.0), desired, Acceleration(0.0, 0.0, 0.0))[0])
    assert found[1] == pytest.approx(found[0], rel=1e-6)
    assert found[2] == pytest.approx(found[0], rel=1e-6)
