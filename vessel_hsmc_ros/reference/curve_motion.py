"""The motion of a hull along a curve at constant speed: its states, and the force and moment that it needs.

| symbol | meaning | unit | equation |
|---|---|---|---|
| s, p, chi, kappa | arc length, position, course and curvature of the curve | m, m, rad, 1/m | - |
| U | speed along the curve | m/s | - |
| beta | drift angle, from the sway equation | rad | drift.py |
| psi | heading chi - beta | rad | (6) |
| u, v, r | U·cos(beta), U·sin(beta), U·(kappa - dbeta/ds) | m/s, m/s, rad/s | (6) |
| tau_1, tau_2 | m11·(du - f_u), m33·(dr - f_r) | N, N·m | (6) |

The state is a function of time and not integrated, so the position is on the curve however long the run.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vessel_hsmc_ros.reference.curves import Curve
from vessel_hsmc_ros.reference.drift import Drift, PeriodicDrift, samples, steady_drift, steady_load
from vessel_sim_node.plant import Vessel, unforced_acceleration

Array = NDArray[np.float64]


class Velocities(NamedTuple):
    """Body velocities and their time derivatives along a curve, numbers or arrays; m/s, m/s, rad/s and per second."""

    u: Any
    v: Any
    r: Any
    du: Any
    dv: Any
    dr: Any


class Demand(NamedTuple):
    """Largest magnitudes along a curve: drift angle of steady turns [rad], surge force [N], yaw moment [N·m]."""

    drift: float
    surge_force: float
    yaw_moment: float


def velocities(curve: Curve, speed: float, drift: Drift, s: ArrayLike) -> Velocities:
    """The body velocities along a curve, and their derivatives.

    Args:
        curve: The curve.
        speed: U, m/s.
        drift: The drift angle at the arc lengths.
        s: Arc lengths, m, a number or an array.

    Returns:
        Velocities and accelerations at the arc lengths.
    """
    rate = speed * drift.slope
    u, v = speed * np.cos(drift.beta), speed * np.sin(drift.beta)
    r = speed * curve.curvature(s) - rate
    return Velocities(u, v, r, -v * rate, u * rate, speed**2 * (curve.curvature_slope(s) - drift.slope_rate))


def demand(curve: Curve, speed: float, vessel: Vessel, largest_drift: float) -> Demand:
    """The largest drift angle, surge force and yaw moment that a curve demands of a hull in calm water.

    Args:
        curve: The curve.
        speed: U > 0, m/s.
        vessel: Coefficients of (6).
        largest_drift: Drift angle above which force and moment are not computed, rad.

    Returns:
        The demand; force and moment are infinite if the drift angle is too large.
    """
    drift = float(np.max(np.abs(steady_drift(steady_load(curve, speed, vessel), speed, vessel))))
    if drift > largest_drift:
        return Demand(drift, math.inf, math.inf)
    u, v, r, du, _, dr = velocities(curve, speed, PeriodicDrift(curve, speed, vessel).sampled(), samples(curve))
    f_u, _, f_r = unforced_acceleration(u, v, r, vessel)  # element by element
    surge_force, yaw_moment = vessel.m11 * (du - f_u), vessel.m33 * (dr - f_r)
    return Demand(drift, float(np.max(np.abs(surge_force))), float(np.max(np.abs(yaw_moment))))
