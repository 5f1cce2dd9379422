"""Vectors in the plane and the motion of a point of a ship, for laws that track a position by its derivatives."""

import math
from typing import NamedTuple

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion


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
    """Rotate a vector counter-clockwise: body-fixed to earth-fixed by the heading, back by its negative.

    Args:
        x, y: Components.
        angle: Angle of the rotation.
    """
    c, s = math.cos(angle), math.sin(angle)
    return Vector(c * x - s * y, s * x + c * y)


@kernel
def point_ahead(motion: Motion, acceleration: Acceleration, distance: float) -> PointMotion:
    """The motion of the point a distance l ahead of the origin.

    h = p + R·(l, 0), dh = R·(u, v + l·r), ddh = R·(du - r·(v + l·r), dv + l·dr + r·u).

    Args:
        motion: State of the ship.
        acceleration: Derivatives of its body velocities.
        distance: Distance l of the point ahead of the origin, m.

    Returns:
        Position, velocity and acceleration, earth-fixed.
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

    Args:
        motion: State of the ship.
        acceleration: Derivatives of its body velocities.
    """
    u, v, r = motion.u, motion.v, motion.r
    du, dv, dr = acceleration
    along = -dr * v - r * dv - r * (dv + r * u)
    across = dr * u + r * du + r * (du - r * v)
    return rotated(along, across, motion.psi)
