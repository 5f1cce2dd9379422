"""Motions of references, and the test that a ship can follow them."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.guidance.goal import MotionLimits, filter_of
from vessel_sim_node.plant import VesselParameters

PERIOD = 0.1
LIMITS = MotionLimits()
T_A = filter_of(LIMITS, VesselParameters().coefficients(), PERIOD).T_a


def motion_of(
    reference: Any, seconds: float, period: float = PERIOD, feed: Callable[[int, Any], None] | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """States (n, 6) and accelerations (n, 3)."""
    states, accelerations = [], []
    for k in range(round(seconds / period)):
        if feed is not None:
            feed(k, reference)
        states.append(reference.state.copy())
        accelerations.append(reference.acceleration())
        reference.advance()
    return np.array(states), np.array(accelerations)


def assert_feasible(states: NDArray[np.float64], accelerations: NDArray[np.float64], period: float = PERIOD) -> None:
    """The derivatives are consistent, the limits hold, and the acceleration is continuous."""
    psi, u, v, r = states.T[2:]
    velocity = np.column_stack((u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi), r))
    moved = np.diff(states[:, :3], axis=0) / period
    np.testing.assert_allclose(moved, 0.5 * (velocity[1:] + velocity[:-1]), atol=5e-3 * period / 0.1)
    np.testing.assert_allclose(np.diff(states[:, 3:], axis=0) / period, 0.5 * (accelerations[1:] + accelerations[:-1]), atol=0.02)
    assert np.abs(u).max() <= 1.05 * LIMITS.speed
    assert np.abs(r).max() <= 1.05 * LIMITS.yaw_rate
    assert np.abs(accelerations[:, 0]).max() <= LIMITS.acceleration
    assert np.abs(accelerations[:, 2]).max() <= LIMITS.yaw_acceleration
    jumps = np.abs(np.diff(accelerations, axis=0)).max(axis=0)
    assert jumps[0] <= 2.0 * LIMITS.acceleration * period / T_A
    assert jumps[2] <= 2.0 * LIMITS.yaw_acceleration * period / T_A
    assert jumps[1] <= 0.3 * period
