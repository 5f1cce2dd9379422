"""The model knowledge of a control law: inertias, the limits and dynamics of the actuators, and the point that a law controls.

| symbol | meaning | unit |
|---|---|---|
| m11, m22, m33 | inertias in surge, sway and yaw | kg, kg, kg·m² |
| m23, m32 | coupling of sway and yaw in the inertia matrix | kg·m |
| e | sway force that comes with a unit of yaw moment | 1/m |
| x_p | distance of the centre of percussion ahead of the origin | m |
| m_p | inertia that the yaw moment accelerates | kg·m² |

A yaw moment N accelerates sway and yaw by M·(v', r') = (e·N, N). The centre of percussion, at the distance
x_p = -v'/r' = (m23 - m33·e)/(m22 - m32·e), has the sway velocity v + x_p·r, which N does not accelerate; and r' = N/m_p with
m_p = m33 - x_p·m32. The pivot point of ship handling, without sway velocity in a steady turn, is another.
docs/percussion.md derives both.

The model of the ship of the laws that cancel its dynamics: equation (6) with its damping, which `guided` need not know.

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
from typing import Any, NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.hull import NamedVessel, Steering, steering, steering_loss, steering_speed
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.schema import parameter


def limit(what: str, unit: str, default: float, high: float) -> float:
    """Declare the largest force or moment that a law commands."""
    used = "in either direction; not used by the paper's own laws."
    return parameter(default, f"Largest {what} to command, {used}", unit=unit, low=1e-3, high=high)


def coupling(description: str) -> float:
    """Declare an element of the inertia matrix outside its diagonal, zero by default."""
    return parameter(0.0, description, unit="kg·m", low=-1e15, high=1e15)


NOT_DECLARED = -1.0  # the value of what is not known of an actuator: laws then count it as slow, not as instantaneous


INSTANT: dict[str, Any] = {
    **dict.fromkeys(("surge_lag", "yaw_lag", "surge_dead_time", "yaw_dead_time"), 0.0),
    **dict.fromkeys(("surge_force_rate", "yaw_moment_rate"), math.inf),
}
"""The declaration of actuators that follow every command at once, by the names of parameters."""


def rate(what: str, unit: str) -> float:
    """Declare the largest rate of change of an actuator, not declared by default."""
    return parameter(
        NOT_DECLARED,
        f"Largest rate of change of the {what}; inf: no limit; negative: not declared.",
        unit=unit,
        low=NOT_DECLARED,
        high=math.inf,
    )


def delay(what: str) -> float:
    """Declare a time constant or a dead time of an actuator, not declared by default."""
    return parameter(NOT_DECLARED, f"{what}; 0: none; negative: not declared.", unit="s", low=NOT_DECLARED, high=1e3)


@dataclass(frozen=True)
class KnownVessel(NamedVessel):
    """What a law knows of the ship; the defaults are the ship of the paper's section 6.2."""

    surge_inertia: float = parameter(120e3, "Mass with added mass in surge.", unit="kg", low=1e-3, high=1e12, symbol="m11")
    yaw_inertia: float = parameter(
        636e5, "Moment of inertia with added inertia in yaw.", unit="kg·m²", low=1e-3, high=1e15, symbol="m33"
    )
    surge_force_limit: float = limit("surge force", "N", 2e5, 1e12)
    yaw_moment_limit: float = limit("yaw moment", "N·m", 3e6, 1e15)
    # The parameters below have no symbols: laws build their gains from those of the vessel.
    length: float = parameter(32.0, "Length of the hull, the unit of length of the guided law.", unit="m", low=1e-3, high=1e4)
    sway_inertia: float = parameter(
        177.9e3, "Mass with added mass in sway, m22, for the centre of percussion.", unit="kg", low=1e-3, high=1e12
    )
    sway_yaw_inertia: float = coupling("Sway force per yaw acceleration, m23, for the centre of percussion.")
    yaw_sway_inertia: float = coupling(
        "Yaw moment per sway acceleration, m32, for the centre of percussion; 0: equal to sway_yaw_inertia."
    )
    sway_force_per_yaw_moment: float = parameter(
        0.0,
        "Sway force that comes with a unit of yaw moment, as that of a rudder, for the centre of percussion.",
        unit="1/m",
        low=-1e3,
        high=1e3,
    )
    controlled_point: str = parameter(
        "ahead",
        "The point that a law steers along a moving reference: the centre of percussion, where the yaw moment does not enter the"
        " sway; the origin; or, by default, the one of them that is further ahead.",
        choices=("ahead", "percussion", "origin"),
    )
    surge_lag: float = delay("Time constant of the first-order lag of the surge force")
    yaw_lag: float = delay("Time constant of the first-order lag of the yaw moment")
    surge_force_rate: float = rate("surge force", "N/s")
    yaw_moment_rate: float = rate("yaw moment", "N·m/s")
    surge_dead_time: float = delay("Dead time of the surge force")
    yaw_dead_time: float = delay("Dead time of the yaw moment")
    sway_damping_rate: float = parameter(
        NOT_DECLARED,
        "Decay rate of the sway velocity, for a hull with low sway damping, whose course follows its heading late; the guided law"
        " expects it. Negative: not declared, so that the law learns it.",
        unit="1/s",
        low=NOT_DECLARED,
        high=1e3,
    )
    coriolis_ratio: float = parameter(
        NOT_DECLARED,
        "Sway acceleration of such a hull per surge velocity times yaw rate. Negative: surge_inertia/sway_inertia, at most 1.",
        low=NOT_DECLARED,
        high=10.0,
    )
    steering_loss: float = steering_loss()
    steering_speed: float = steering_speed()

    @property
    def steering(self) -> Steering:
        """How the yaw moment depends on thrust and speed."""
        return steering(self.steering_loss, self.steering_speed, self.surge_force_limit, self.yaw_moment_limit)

    @property
    def percussion_point(self) -> float:
        """The distance x_p of the centre of percussion ahead of the origin, m."""
        m22, m33, m23, e = self.sway_inertia, self.yaw_inertia, self.sway_yaw_inertia, self.sway_force_per_yaw_moment
        m32 = self.yaw_sway_inertia or m23
        if m22 * m33 <= m23 * m32:
            raise ParameterError(
                "controller.vessel.sway_yaw_inertia·yaw_sway_inertia must be below sway_inertia·yaw_inertia ="
                f" {m22 * m33:g} kg²·m² (got {m23:g}·{m32:g})"
            )
        if m32 * e >= m22:
            raise ParameterError(
                "controller.vessel.sway_force_per_yaw_moment·yaw_sway_inertia must be below sway_inertia ="
                f" {m22:g} kg (got {e:g}·{m32:g})"
            )
        return (m23 - m33 * e) / (m22 - m32 * e)

    @property
    def controlled(self) -> float:
        """The distance of the controlled point ahead of the origin, m: x_p, or 0 for the origin."""
        x_p = self.percussion_point
        # One behind the origin is no better: then the moment accelerates the origin to the side to which the ship turns.
        at_origin = self.controlled_point == "origin" or (self.controlled_point == "ahead" and x_p < 0.0)
        return 0.0 if at_origin else x_p

    def as_controlled(self) -> "ControlledVessel":
        """The same vessel as a law knows it: its yaw inertia is m_p; uncoupled where the centre of percussion is controlled."""
        x_p, m32 = self.percussion_point, self.yaw_sway_inertia or self.sway_yaw_inertia
        known = {**vars(self), "yaw_inertia": self.yaw_inertia - x_p * m32}
        if self.controlled:
            known |= {"sway_yaw_inertia": 0.0, "yaw_sway_inertia": 0.0, "sway_force_per_yaw_moment": 0.0}
        return ControlledVessel(**known, ahead=self.controlled)


@dataclass(frozen=True)
class ControlledVessel(KnownVessel):
    """A vessel as a law knows it at the point that it controls."""

    ahead: float = 0.0  # distance of that point ahead of the origin, m


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
    """The damping force d·v + d2·|v|·v + d3·v³. `velocity`: surge, sway or yaw velocity."""
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
