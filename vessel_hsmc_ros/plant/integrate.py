"""The classical fourth-order Runge-Kutta method for `dynamics.derivative`, with the inputs constant over a step."""

from typing import Any

import numpy as np

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Motion, as_motion
from vessel_hsmc_ros.plant.dynamics import STILL_WATER, Array, Vessel, Wrench, as_wrench, rate_of_motion


def rk4(
    state: Array,
    wrench: Any,
    disturbance: Any,
    vessel: Vessel,
    step: float,
    current: tuple[float, float] = STILL_WATER,
) -> Array:
    """Advance the state by one step; the local error is of order step⁵.

    Args:
        state: x, y, psi, u, v, r, shape (6,).
        wrench: tau_1 [N], tau_2 [N·m], shape (2,), or X [N], Y [N], N [N·m], shape (3,); constant over the step.
        disturbance: Disturbing accelerations, constant over the step, shape (3,), m/s², m/s², rad/s².
        vessel: Coefficients of the ship.
        step: Length of the step, s.
        current: Current towards the east and the north, m/s.

    Returns:
        The state at the end of the step, shape (6,).
    """
    disturbing = float(disturbance[0]), float(disturbance[1]), float(disturbance[2])
    return np.array(rk4_step(as_motion(state), as_wrench(wrench), disturbing, vessel, step, current))


@kernel
def rk4_step(
    motion: Motion,
    wrench: Wrench,
    disturbance: tuple[float, float, float],
    vessel: Vessel,
    step: float,
    current: tuple[float, float],
) -> Motion:
    """`rk4` of a motion; the arguments are the same.

    Args:
        motion: State.
        wrench, disturbance, vessel, current: As in `rate_of_motion`, constant over the step.
        step: Length of the step, s.

    Returns:
        The state at the end of the step.
    """
    half = 0.5 * step
    k1 = rate_of_motion(motion, wrench, disturbance, vessel, current)
    k2 = rate_of_motion(moved(motion, half, k1), wrench, disturbance, vessel, current)
    k3 = rate_of_motion(moved(motion, half, k2), wrench, disturbance, vessel, current)
    k4 = rate_of_motion(moved(motion, step, k3), wrench, disturbance, vessel, current)
    mean = Motion(
        k1.x + 2.0 * (k2.x + k3.x) + k4.x,
        k1.y + 2.0 * (k2.y + k3.y) + k4.y,
        k1.psi + 2.0 * (k2.psi + k3.psi) + k4.psi,
        k1.u + 2.0 * (k2.u + k3.u) + k4.u,
        k1.v + 2.0 * (k2.v + k3.v) + k4.v,
        k1.r + 2.0 * (k2.r + k3.r) + k4.r,
    )
    return moved(motion, step / 6.0, mean)


@kernel
def moved(motion: Motion, step: float, rate: Motion) -> Motion:
    """The motion after a step of a rate: motion + step·rate."""
    return Motion(
        motion.x + step * rate.x,
        motion.y + step * rate.y,
        motion.psi + step * rate.psi,
        motion.u + step * rate.u,
        motion.v + step * rate.v,
        motion.r + step * rate.r,
    )
