"""The classical fourth-order Runge-Kutta method for `plant.derivative`, with the inputs constant over a step."""

from typing import Any

from vessel_sim_node.plant import STILL_WATER, Array, Vessel, derivative


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
        wrench: tau_1 [N], tau_2 [N·m], constant over the step, shape (2,).
        disturbance: Disturbing accelerations, constant over the step, shape (3,), m/s², m/s², rad/s².
        vessel: Coefficients of (6).
        step: Length of the step, s.
        current: Current towards the east and the north, m/s.

    Returns:
        The state at the end of the step, shape (6,).
    """
    half = 0.5 * step
    k1 = derivative(state, wrench, disturbance, vessel, current)
    k2 = derivative(state + half * k1, wrench, disturbance, vessel, current)
    k3 = derivative(state + half * k2, wrench, disturbance, vessel, current)
    k4 = derivative(state + step * k3, wrench, disturbance, vessel, current)
    return state + (step / 6.0) * (k1 + 2.0 * (k2 + k3) + k4)
