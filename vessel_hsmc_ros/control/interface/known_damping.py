"""The model of the ship of the laws that cancel its dynamics: equation (6) with its damping, which `guided` need not know.

| symbol | meaning | unit |
|---|---|---|
| m11, m22, m33 | inertias in surge, sway and yaw, of `KnownVessel` | kg, kg, kg·m² |
| d_u, d_v, d_r | linear damping | kg/s, kg/s, kg·m²/s |
| d_u2, d_v2, d_r2 | quadratic damping | kg/m, kg/m, kg·m² |
| d_u3, d_v3, d_r3 | cubic damping | kg·s/m², kg·s/m², kg·m²·s |
| f_u, f_v, f_r | accelerations without forces of the actuators and of the environment | m/s², m/s², rad/s² |

The equations repeat those of the plant on purpose: a law must not import the plant, because a mistake in shared equations would
cancel out in every closed-loop test.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.schema import parameter


def damping(default: float, description: str, unit: str, symbol: str) -> float:
    """Declare a damping coefficient of the model; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=0.0, high=1e15, symbol=symbol)


@dataclass(frozen=True)
class KnownDamping:
    """Damping as a law knows it; the defaults are the ship of the paper's section 6.2."""

    surge_damping: float = damping(215e2, "Linear damping in surge.", "kg/s", "d_u")
    sway_damping: float = damping(147e3, "Linear damping in sway.", "kg/s", "d_v")
    yaw_damping: float = damping(802e4, "Linear damping in yaw.", "kg·m²/s", "d_r")
    surge_damping_quadratic: float = damping(0.2 * 215e2, "Damping in surge with |u|u.", "kg/m", "d_u2")
    surge_damping_cubic: float = damping(0.1 * 215e2, "Damping in surge with u³.", "kg·s/m²", "d_u3")
    sway_damping_quadratic: float = damping(0.2 * 147e3, "Damping in sway with |v|v.", "kg/m", "d_v2")
    sway_damping_cubic: float = damping(0.1 * 147e3, "Damping in sway with v³.", "kg·s/m²", "d_v3")
    yaw_damping_quadratic: float = damping(0.2 * 802e4, "Damping in yaw with |r|r.", "kg·m²", "d_r2")
    yaw_damping_cubic: float = damping(0.1 * 802e4, "Damping in yaw with r³.", "kg·m²·s", "d_r3")


class Ship(NamedTuple):
    """Coefficients of (6) by their symbols, and the limits of the actuators."""

    m11: float
    m22: float
    m33: float
    d_u: float
    d_v: float
    d_r: float
    d_u2: float
    d_v2: float
    d_r2: float
    d_u3: float
    d_v3: float
    d_r3: float
    tau_1max: float
    tau_2max: float


def known_ship(vessel: KnownVessel, model: KnownDamping) -> Ship:
    """What a law knows of the ship: inertias and limits of `controller.vessel`, damping of its own group `model`."""
    limits = {"tau_1max": vessel.surge_force_limit, "tau_2max": vessel.yaw_moment_limit}
    return Ship(**schema.symbols(vessel), m22=vessel.sway_inertia, **schema.symbols(model), **limits)


@kernel
def drag(velocity: float, linear: float, quadratic: float, cubic: float) -> float:
    """The damping force d·v + d2·|v|·v + d3·v³.

    `velocity`: surge, sway or yaw velocity.
    """
    return velocity * (linear + quadratic * abs(velocity) + cubic * velocity * velocity)


@kernel
def drag_slope(velocity: float, linear: float, quadratic: float, cubic: float) -> float:
    """The derivative d + 2·d2·|v| + 3·d3·v² of the damping force by the velocity; the arguments are those of `drag`."""
    return linear + 2.0 * quadratic * abs(velocity) + 3.0 * cubic * velocity * velocity


@kernel
def free_acceleration(motion: Motion, s: Ship) -> Acceleration:
    """The acceleration without actuators and disturbance, from (6).

    f_u = (m22·v·r - D_u(u))/m11, f_v = (-m11·u·r - D_v(v))/m22, f_r = ((m11 - m22)·u·v - D_r(r))/m33. Returns f_u [m/s²], f_v
    [m/s²], f_r [rad/s²].
    """
    u, v, r = motion.u, motion.v, motion.r
    return Acceleration(
        (s.m22 * v * r - drag(u, s.d_u, s.d_u2, s.d_u3)) / s.m11,
        (-s.m11 * u * r - drag(v, s.d_v, s.d_v2, s.d_v3)) / s.m22,
        ((s.m11 - s.m22) * u * v - drag(r, s.d_r, s.d_r2, s.d_r3)) / s.m33,
    )


class Vector(NamedTuple):
    """A horizontal vector."""

    x: float
    y: float


class PointMotion(NamedTuple):
    """Position of a point with its first and second time derivative, earth-fixed."""

    position: Vector
    velocity: Vector
    acceleration: Vector


@kernel
def rotated(x: float, y: float, angle: float) -> Vector:
    """Rotate a vector counter-clockwise: body-fixed to earth-fixed by the heading, back by its negative."""
    c, s = math.cos(angle), math.sin(angle)
    return Vector(c * x - s * y, s * x + c * y)


@kernel
def point_ahead(motion: Motion, acceleration: Acceleration, distance: float) -> PointMotion:
    """The motion of the point a distance l ahead of the origin.

    h = p + R·(l, 0), dh = R·(u, v + l·r), ddh = R·(du - r·(v + l·r), dv + l·dr + r·u). `acceleration`: derivatives of its body
    velocities. `distance`: distance l of the point ahead of the origin, m. Returns position, velocity and acceleration,
    earth-fixed.
    """
    ahead = rotated(distance, 0.0, motion.psi)
    sideways = motion.v + distance * motion.r
    return PointMotion(
        Vector(motion.x + ahead.x, motion.y + ahead.y),
        rotated(motion.u, sideways, motion.psi),
        rotated(
            acceleration.du - motion.r * sideways, acceleration.dv + distance * acceleration.dr + motion.r * motion.u, motion.psi
        ),
    )


@kernel
def jerk(motion: Motion, acceleration: Acceleration) -> Vector:
    """The third derivative of a ship's position, earth-fixed, with the second derivatives of its velocities taken as zero.

    dddp = R·(-dr·v - r·dv - r·a_y, dr·u + r·du + r·a_x) with the body-fixed acceleration a = (du - r·v, dv + r·u).
    `acceleration`: derivatives of its body velocities.
    """
    u, v, r = motion.u, motion.v, motion.r
    du, dv, dr = acceleration
    along = -dr * v - r * dv - r * (dv + r * u)
    across = dr * u + r * du + r * (du - r * v)
    return rotated(along, across, motion.psi)
