"""What VehicleOdometry of PX4 means: motion in the plane from position, quaternion and velocities in north-east-down.

PX4 counts the quaternion from the body (forward, right, down) to the earth (north, east, down), w first.
"""

import math
from collections.abc import Sequence
from typing import Any

from vessel_hsmc_ros.boats.mavlink_messages import Attitude, Position, motion
from vessel_hsmc_ros.core.kinematics import Motion

OFFBOARD = 14  # `nav_state` of the mode in which PX4 takes setpoints of another computer
ARMED = 2  # `arming_state` with running motors
NED, FRD, BODY = 1, 2, 3  # frames: aligned with north, turned from it by some fixed angle, and that of the body


def problem(message: Any) -> str:
    """Why a message has no motion; empty if it has one."""
    if message.pose_frame not in (NED, FRD) or message.velocity_frame not in (message.pose_frame, BODY):
        return (
            f"frames must be 1 or 2 (pose), and the same or 3 (velocity) (got {message.pose_frame} and {message.velocity_frame})"
        )
    parts = (message.position[:2], message.q, message.velocity, message.angular_velocity)
    names = ("position", "q", "velocity", "angular_velocity")
    wrong = [name for name, part in zip(names, parts, strict=True) if not all(map(math.isfinite, part))]
    if wrong:
        return f"{', '.join(wrong)} not finite"
    return "" if sum(part * part for part in message.q) > 0.5 else "q is not filled in"


def motion_of(message: Any) -> Motion:
    """The motion of a message without a problem, x to the east and y to the north or, with the frame FRD, turned with it."""
    attitude = attitude_of(message.q, message.angular_velocity)
    velocity = [float(v) for v in message.velocity]
    if message.velocity_frame == BODY:
        velocity = rotated(message.q, velocity)
    north, east = (float(p) for p in message.position[:2])
    return motion(Position(0.0, north, east, velocity[0], velocity[1]), attitude)


def attitude_of(q: Sequence[float], rates: Sequence[float]) -> Attitude:
    """Roll, pitch, yaw from north, clockwise, and rates about the axes of the body.

    `q`: the quaternion w, x, y, z of any length but 0. `rates`: rates about the axes of the body, rad/s.
    """
    w, x, y, z = map(float, q)
    size = w * w + x * x + y * y + z * z
    roll = math.atan2(2.0 * (w * x + y * z), w * w - x * x - y * y + z * z)
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - x * z) / size)))
    yaw = math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return Attitude(0.0, roll, pitch, yaw, *map(float, rates))


def rotated(q: Sequence[float], vector: Sequence[float]) -> list[float]:
    """A vector of the body along the axes of the earth, by the quaternion w, x, y, z of length 1."""
    w, x, y, z = map(float, q)
    a, b, c = vector
    return [
        (1.0 - 2.0 * (y * y + z * z)) * a + 2.0 * (x * y - w * z) * b + 2.0 * (x * z + w * y) * c,
        2.0 * (x * y + w * z) * a + (1.0 - 2.0 * (x * x + z * z)) * b + 2.0 * (y * z - w * x) * c,
        2.0 * (x * z - w * y) * a + 2.0 * (y * z + w * x) * b + (1.0 - 2.0 * (x * x + y * y)) * c,
    ]
