"""The point that a law controls: motion and reference are carried to it, the tracking errors back to the origin.

| symbol | meaning | unit |
|---|---|---|
| x_p | distance of the point ahead of the origin; `KnownVessel.pivot` | m |
| delta | heading of the ship minus that of the reference | rad |
| delta_f, d1, d2 | the same filtered, with its first and second derivative | rad, rad/s, rad/s² |
| omega | bandwidth of the filter: (|nu_d| + U_0)/L with U_0 = FROUDE·sqrt(g·L) | rad/s |
| q1, q2 | the point of the reference in its own axes, x_p·(cos delta_f, sin delta_f) | m |
| L, T | length of the hull, control period | m, s |

The ship's point is x_p ahead along the heading of the ship, that of the reference along psi_d + delta_f. Along psi_d alone, the
origin would be off by 2·x_p·sin(delta/2) wherever the ship has another heading than the reference, as in a side wind; along the
heading of the ship, the acceleration of the point would contain the yaw acceleration, and with it the moment that the law is to
compute. delta_f is a state: the carried position, velocity and acceleration are consistent, contain no moment, and leave no error
of the origin in steady state. docs/pivot.md derives the bandwidth.
"""

import math
from typing import NamedTuple

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, magnitude, wrap
from vessel_hsmc_ros.laws.known_vessel import KnownVessel
from vessel_hsmc_ros.laws.terms import Terms

FROUDE, GRAVITY = 0.03, 9.81
"""The speed U_0 as a Froude number, so that the filter does not rest with the reference; gravity, m/s²."""

ERRORS = "surge_error", "sway_error", "surge_error_rate", "sway_error_rate"
"""The terms of a law that are carried back to the origin."""


class Pivot(NamedTuple):
    """The controlled point: x_p, 1/L, U_0 and T."""

    x_p: float
    per_length: float
    slowest: float
    T: float


class Carried(NamedTuple):
    """Inputs of the law at its point.

    Attributes:
        motion: The ship.
        desired: The reference.
        acceleration: Derivatives of the body velocities of `desired`.
        back: What the ERRORS at the origin exceed those at the point by, m, m, m/s, m/s.
        delta: delta_f for the next period.
    """

    motion: Motion
    desired: Motion
    acceleration: Acceleration
    back: tuple[float, float, float, float]
    delta: float


def pivot_of(vessel: KnownVessel, period: float) -> Pivot:
    """The controlled point of a vessel, for a control period, s.

    Raises:
        ParameterError: as `KnownVessel.pivot`.
    """
    return Pivot(vessel.pivot, 1.0 / vessel.length, FROUDE * math.sqrt(GRAVITY * vessel.length), period)


ORIGIN = Pivot(0.0, 1.0, 0.0, 1.0)
"""No other point than the origin."""


@kernel
def carry(motion: Motion, desired: Motion, acceleration: Acceleration, delta: float, p: Pivot) -> Carried:
    """Carry the inputs of a law to its point; at the origin they are returned as they are.

    d1 = omega·(delta - delta_f), d2 = omega·(r - r_d - d1)
    (u, v) of the reference's point = (u_d + dq1 - r_d·q2, v_d + dq2 + r_d·q1), with dq = d1·(-q2, q1)

    Args:
        motion: State of the ship.
        desired: State of the reference.
        acceleration: Derivatives of the reference's body velocities.
        delta: delta_f.
        p: The point.

    Returns:
        The same at the point.
    """
    if p.x_p == 0.0:
        return Carried(motion, desired, acceleration, (0.0, 0.0, 0.0, 0.0), delta)
    x, y, psi, u, v, r = motion
    x_d, y_d, psi_d, u_d, v_d, r_d = desired
    omega = (magnitude(u_d, v_d) + p.slowest) * p.per_length
    omega = omega if omega * p.T < 1.0 else 1.0 / p.T
    d1 = omega * wrap(psi - psi_d - delta)
    d2 = omega * (r - r_d - d1)

    q1, q2 = p.x_p * math.cos(delta), p.x_p * math.sin(delta)
    dq1, dq2 = -q2 * d1, q1 * d1
    ddq1, ddq2 = -dq2 * d1 - q2 * d2, dq1 * d1 + q1 * d2
    c, s = math.cos(psi_d), math.sin(psi_d)
    point = Motion(x_d + q1 * c - q2 * s, y_d + q1 * s + q2 * c, psi_d, u_d + dq1 - r_d * q2, v_d + dq2 + r_d * q1, r_d)
    du, dv, dr = acceleration
    rate = Acceleration(du + ddq1 - dr * q2 - r_d * dq2, dv + ddq2 + dr * q1 + r_d * dq1, dr)

    ship = Motion(x + p.x_p * math.cos(psi), y + p.x_p * math.sin(psi), psi, u, v + p.x_p * r, r)
    return Carried(ship, point, rate, (q1 - p.x_p, q2, dq1, dq2), wrap(delta + p.T * d1))


def at_origin(terms: Terms, back: tuple[float, float, float, float]) -> Terms:
    """The terms of a law with the tracking errors of the origin; what a law does not have stays NaN.

    z1e = z1e_p + q1 - x_p, z2e = z2e_p + q2, and their derivatives

    Args:
        terms: Those at the point.
        back: From `Carried`.
    """
    e1, e2, de1, de2 = back
    return terms._replace(
        surge_error=terms.surge_error + e1,
        sway_error=terms.sway_error + e2,
        surge_error_rate=terms.surge_error_rate + de1,
        sway_error_rate=terms.sway_error_rate + de2,
    )
