"""A reference filter: surge-speed and yaw-rate setpoints become a motion that a ship with propeller and rudder can follow.

| symbol | meaning | unit |
|---|---|---|
| x, y, psi, u, v, r | pose and body velocities of the reference | m, m, rad, m/s, m/s, rad/s |
| a, alpha | surge and yaw acceleration | m/s², rad/s² |
| u_c, r_c | setpoints of surge speed and yaw rate | m/s, rad/s |
| T | time of the ship's turns, sqrt(m33/tau_2max) | s |
| T_f, T_a | time constants of velocity and acceleration | s, s |

da = (sat((u_c - u)/T_f) - a)/T_a and likewise for alpha; dv = f_v(u, v, r) of (7), because sway is not actuated: the sway
velocity is that of the unforced hull, whose yaw acceleration alpha also moves the sway where m23 is not zero. Position, velocity
and acceleration are continuous and limited. The heading is not wrapped.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.plant.dynamics import Vessel, unforced_sway

LAG, ACCELERATION_LAG = 0.4, 0.1
"""T_f and T_a in units of T; the damping ratio of velocity and acceleration is sqrt(T_f/T_a)/2 = 1, critical."""

GAIN = 0.75  # gain from distance to speed and from angle to yaw rate, in units of 1/T: with the two lags a damping ratio of 0.8
SHARE_OF_MOMENT = 0.25
"""Share of the yaw moment that the largest yaw acceleration is assumed to take, where the limit of the moment is not known."""


@dataclass(frozen=True)
class MotionLimits:
    """Limits of the reference's motion; the ship must be able to exceed them a little in order to correct errors."""

    speed: float = parameter(1.5, "Largest surge velocity.", unit="m/s", low=1e-3, high=1e3)
    acceleration: float = parameter(0.2, "Largest surge acceleration.", unit="m/s²", low=1e-6, high=1e3)
    yaw_rate: float = parameter(0.1, "Largest yaw rate.", unit="rad/s", low=1e-6, high=1e2)
    yaw_acceleration: float = parameter(0.02, "Largest yaw acceleration.", unit="rad/s²", low=1e-6, high=1e2)
    current: float = parameter(
        0.0,
        "Current that motions along routes allow for: they leave propulsion to go and turn against it.",
        unit="m/s",
        low=0.0,
        high=100.0,
    )


class Filter(NamedTuple):
    """A motion filter."""

    # speed, acceleration, yaw_rate, yaw_acceleration: limits of the motion
    speed: float
    acceleration: float
    yaw_rate: float
    yaw_acceleration: float
    # T_f, T_a: time constants of velocity and acceleration, s
    T_f: float
    T_a: float
    gain: float  # from distance to speed, and from angle to yaw rate, 1/s
    length: float  # radius of gyration of the hull, the unit of distances, m
    vessel: Vessel  # coefficients of the hull, for its sway
    period: float  # length of a step, s


class Filtered(NamedTuple):
    """State of the filter, or its time derivative: pose, body velocities, surge and yaw acceleration."""

    x: float
    y: float
    psi: float
    u: float
    v: float
    r: float
    a: float
    alpha: float


def filter_of(limits: MotionLimits, vessel: Vessel, period: float, yaw_moment: float = math.inf) -> Filter:
    """The filter of a hull.

    `period`: length of a step, s. `yaw_moment`: largest yaw moment, N·m; infinite where it is not known.
    """
    given = limits.speed, limits.acceleration, limits.yaw_rate, limits.yaw_acceleration
    acceleration = yaw_moment / vessel.m33 if math.isfinite(yaw_moment) else limits.yaw_acceleration / SHARE_OF_MOMENT
    # Runge-Kutta steps longer than twice the shortest time constant would not converge.
    T = max(1.0 / math.sqrt(acceleration), period / ACCELERATION_LAG)
    return Filter(*given, LAG * T, ACCELERATION_LAG * T, GAIN / T, math.sqrt(vessel.m33 / vessel.m22), vessel, period)


@kernel
def read_filter(s: Filtered, c: Filter) -> tuple[Motion, Acceleration]:
    """The motion, and the derivatives of its velocities."""
    dv = unforced_sway(s.u, s.v, s.r, s.alpha, c.vessel)
    return Motion(s.x, s.y, s.psi, s.u, s.v, s.r), Acceleration(s.a, dv, s.alpha)


@kernel
def advance_filter(s: Filtered, u_c: float, r_c: float, c: Filter) -> Filtered:
    """Advance by one period towards the setpoints, by one Runge-Kutta step.

    `u_c`: surge-speed setpoint, m/s; limited to the largest speed. `r_c`: yaw-rate setpoint, rad/s; limited to the largest yaw
    rate. `c`: limits, hull and period. Returns the state one period later.
    """
    u_c, r_c = clip(u_c, c.speed), clip(r_c, c.yaw_rate)
    # Velocity and acceleration are integrated with the pose, so that all published derivatives are consistent.
    h = c.period
    k1 = rate_of_filter(s, u_c, r_c, c)
    k2 = rate_of_filter(shifted(s, 0.5 * h, k1), u_c, r_c, c)
    k3 = rate_of_filter(shifted(s, 0.5 * h, k2), u_c, r_c, c)
    k4 = rate_of_filter(shifted(s, h, k3), u_c, r_c, c)
    total = Filtered(
        k1.x + 2.0 * (k2.x + k3.x) + k4.x,
        k1.y + 2.0 * (k2.y + k3.y) + k4.y,
        k1.psi + 2.0 * (k2.psi + k3.psi) + k4.psi,
        k1.u + 2.0 * (k2.u + k3.u) + k4.u,
        k1.v + 2.0 * (k2.v + k3.v) + k4.v,
        k1.r + 2.0 * (k2.r + k3.r) + k4.r,
        k1.a + 2.0 * (k2.a + k3.a) + k4.a,
        k1.alpha + 2.0 * (k2.alpha + k3.alpha) + k4.alpha,
    )
    return shifted(s, h / 6.0, total)


@kernel
def rate_of_filter(s: Filtered, u_c: float, r_c: float, c: Filter) -> Filtered:
    """The time derivative of the state; the arguments are those of `advance_filter`."""
    cosine, sine = math.cos(s.psi), math.sin(s.psi)
    # The acceleration demand is limited before the second lag, so that the acceleration itself stays within its limit.
    jerk = (clip((u_c - s.u) / c.T_f, c.acceleration) - s.a) / c.T_a
    yaw_jerk = (clip((r_c - s.r) / c.T_f, c.yaw_acceleration) - s.alpha) / c.T_a
    dv = unforced_sway(s.u, s.v, s.r, s.alpha, c.vessel)
    return Filtered(s.u * cosine - s.v * sine, s.u * sine + s.v * cosine, s.r, s.a, dv, s.alpha, jerk, yaw_jerk)


@kernel
def shifted(s: Filtered, step: float, rate: Filtered) -> Filtered:
    """The state moved by a step at a rate."""
    return Filtered(
        s.x + step * rate.x,
        s.y + step * rate.y,
        s.psi + step * rate.psi,
        s.u + step * rate.u,
        s.v + step * rate.v,
        s.r + step * rate.r,
        s.a + step * rate.a,
        s.alpha + step * rate.alpha,
    )
