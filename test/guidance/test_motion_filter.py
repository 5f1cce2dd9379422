"""The reference filter on its own."""

import math

import numpy as np
import pytest

from vessel_hsmc_ros.guidance.goal import Filtered, MotionLimits, advance_filter, filter_of, read_filter
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters

LIMITS = MotionLimits()
SHIP = VesselParameters().coefficients()


def filtered(u_c: float, r_c: float, steps: int = 600, yaw_moment: float = math.inf) -> tuple[np.ndarray, np.ndarray]:
    """Velocities u, v, r and accelerations for constant setpoints, both (steps, 3)."""
    state, limits = Filtered(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), filter_of(LIMITS, SHIP, 0.1, yaw_moment)
    velocities, accelerations = [], []
    for _ in range(steps):
        state = advance_filter(state, u_c, r_c, limits)
        motion, acceleration = read_filter(state, limits)
        velocities.append(motion[3:])
        accelerations.append(acceleration)
    return np.array(velocities), np.array(accelerations)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_setpoints_beyond_the_limits_are_limited(sign: float) -> None:
    velocities, accelerations = filtered(10.0 * sign, 10.0 * sign)
    assert np.abs(velocities[:, 0]).max() <= LIMITS.speed * (1.0 + 1e-5)
    assert np.abs(velocities[:, 2]).max() <= LIMITS.yaw_rate * (1.0 + 1e-5)
    assert np.abs(accelerations[:, 0]).max() <= LIMITS.acceleration
    assert np.abs(accelerations[:, 2]).max() <= LIMITS.yaw_acceleration
    np.testing.assert_allclose(velocities[-1, [0, 2]], [sign * LIMITS.speed, sign * LIMITS.yaw_rate], rtol=1e-3)


def test_setpoints_within_the_limits_are_reached() -> None:
    velocities, accelerations = filtered(0.5, 0.03)
    np.testing.assert_allclose(velocities[-1, [0, 2]], [0.5, 0.03], rtol=1e-6)
    np.testing.assert_allclose(accelerations[-1], 0.0, atol=1e-5)


@pytest.mark.parametrize("yaw_acceleration", [2.0, 25.0, 1e4])
def test_the_filter_of_an_agile_ship_converges_at_a_low_rate(yaw_acceleration: float) -> None:
    velocities, _ = filtered(0.5, 0.03, yaw_moment=yaw_acceleration * SHIP.m33)
    np.testing.assert_allclose(velocities[-1, [0, 2]], [0.5, 0.03], rtol=1e-6)
