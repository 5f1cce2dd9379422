"""Messages to arrays and back; the only place that knows the fields of messages.

The writers fill a message that the caller keeps, because making one costs more than filling it. The readers take whatever has
the fields: messages of ROS, or those that a bag reader made without it; so ROS is imported only where a message is made.
Frames are REP-103: poses in the ENU frame `odom`, velocities and wrenches in the FLU frame `base_link`.
"""

from __future__ import annotations

import array
import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, heading_from_quaternion, quaternion_from_heading
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.laws import Terms

if TYPE_CHECKING:
    from builtin_interfaces.msg import Time
    from geometry_msgs.msg import AccelStamped, PoseStamped, Twist, WrenchStamped
    from nav_msgs.msg import Odometry
    from vessel_hsmc_msgs.msg import ControlState, ReferenceState

Array = NDArray[np.float64]

WORLD, BODY = "odom", "base_link"

CONTROL_FIELDS = (*Terms._fields, "compute_time", "missed_periods")

_AXES = ("surge", "sway", "yaw")
NAMES = ("x", "y", "heading", *(f"{axis} velocity" for axis in _AXES), *(f"{axis} acceleration" for axis in _AXES))


def nanoseconds(stamp: Any) -> int:
    """A message's stamp as whole nanoseconds."""
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def time_message(stamp: int) -> Time:
    """Whole nanoseconds as a message's stamp."""
    from builtin_interfaces.msg import Time

    sec, nanosec = divmod(stamp, NANOSECONDS)
    return Time(sec=sec, nanosec=nanosec)


def new_odometry() -> Odometry:
    """An empty odometry message in the right frames."""
    from nav_msgs.msg import Odometry

    message = Odometry(child_frame_id=BODY)
    message.header.frame_id = WORLD
    return message


def new_wrench() -> WrenchStamped:
    """An empty wrench message in the body frame."""
    from geometry_msgs.msg import WrenchStamped

    message = WrenchStamped()
    message.header.frame_id = BODY
    return message


def new_acceleration() -> AccelStamped:
    """An empty acceleration message in the body frame."""
    from geometry_msgs.msg import AccelStamped

    message = AccelStamped()
    message.header.frame_id = BODY
    return message


def new_pose() -> PoseStamped:
    """An empty pose message in the world frame."""
    from geometry_msgs.msg import PoseStamped

    message = PoseStamped()
    message.header.frame_id = WORLD
    return message


def new_reference() -> ReferenceState:
    """An empty reference message in the world frame."""
    from vessel_hsmc_msgs.msg import ReferenceState

    message = ReferenceState()
    message.header.frame_id = WORLD
    return message


def new_control_state() -> ControlState:
    """An empty control-state message."""
    from vessel_hsmc_msgs.msg import ControlState

    message = ControlState()
    message.header.frame_id = BODY
    return message


def write_pose(pose: Any, state: Motion | Array) -> None:
    """x, y, psi of a state into a geometry_msgs/Pose."""
    pose.position.x, pose.position.y = float(state[0]), float(state[1])
    pose.orientation.z, pose.orientation.w = quaternion_from_heading(float(state[2]))


def write_twist(twist: Twist, state: Motion | Array) -> None:
    """u, v, r of a state into a geometry_msgs/Twist."""
    twist.linear.x, twist.linear.y, twist.angular.z = float(state[3]), float(state[4]), float(state[5])


def write_odometry(message: Odometry, stamp: Time, state: Motion | Array) -> None:
    """A state, shape (6,), into an odometry message."""
    message.header.stamp = stamp
    write_pose(message.pose.pose, state)
    write_twist(message.twist.twist, state)


def write_reference(message: ReferenceState, stamp: Time, state: Array, acceleration: Array) -> None:
    """A state (6,) and a body acceleration (3,) into a reference message."""
    message.header.stamp = stamp
    write_pose(message.pose, state)
    write_twist(message.twist, state)
    a = message.acceleration
    a.linear.x, a.linear.y, a.angular.z = float(acceleration[0]), float(acceleration[1]), float(acceleration[2])


def write_pose_stamped(message: PoseStamped, stamp: Time, state: Array) -> None:
    """The pose of a state, shape (6,), into a stamped pose."""
    message.header.stamp = stamp
    write_pose(message.pose, state)


def write_wrench(message: WrenchStamped, stamp: Time, wrench: tuple[float, float]) -> None:
    """Surge force and yaw moment into a wrench message."""
    message.header.stamp = stamp
    message.wrench.force.x, message.wrench.torque.z = wrench


def write_disturbance(message: WrenchStamped, stamp: Time, wrench: tuple[float, float, float]) -> None:
    """Surge force, sway force and yaw moment into a wrench message."""
    message.header.stamp = stamp
    message.wrench.force.x, message.wrench.force.y, message.wrench.torque.z = wrench


def write_acceleration(message: AccelStamped, stamp: Time, acceleration: tuple[float, float, float]) -> None:
    """Surge, sway and yaw acceleration into an acceleration message."""
    message.header.stamp = stamp
    message.accel.linear.x, message.accel.linear.y, message.accel.angular.z = acceleration


def write_terms(message: ControlState, stamp: Time, terms: Terms) -> None:
    """What the law computed into a control-state message, field by field of the same name."""
    message.header.stamp = stamp
    for name, value in zip(Terms._fields, terms, strict=True):
        setattr(message, name, array.array("d", value.tobytes()) if isinstance(value, np.ndarray) else value)


def read_odometry(message: Any) -> Motion:
    """The state of an odometry message."""
    return _motion(message.pose.pose, message.twist.twist)


def read_reference(message: Any) -> tuple[Motion, Acceleration]:
    """The state and the body acceleration of a reference message."""
    a = message.acceleration
    return _motion(message.pose, message.twist), Acceleration(a.linear.x, a.linear.y, a.angular.z)


def read_wrench(message: Any) -> tuple[float, float]:
    """Surge force and yaw moment of a wrench message."""
    return message.wrench.force.x, message.wrench.torque.z


def read_disturbance(message: Any) -> tuple[float, float, float]:
    """Surge force, sway force and yaw moment of a wrench message."""
    return message.wrench.force.x, message.wrench.force.y, message.wrench.torque.z


def read_acceleration(message: Any) -> tuple[float, float, float]:
    """Surge, sway and yaw acceleration of an acceleration message."""
    return message.accel.linear.x, message.accel.linear.y, message.accel.angular.z


def read_control_state(message: Any) -> dict[str, Any]:
    """The numbers of a control-state message by their names."""
    return {name: getattr(message, name) for name in CONTROL_FIELDS}


def read_status(message: Any, namespace: str) -> dict[str, dict[str, str]]:
    """The figures of a diagnostics message by node, for the nodes directly in a namespace such as `` or `alpha/`."""
    return {
        status.name.removeprefix(namespace): {"message": status.message, **{v.key: v.value for v in status.values}}
        for status in message.status
        if status.name.startswith(namespace) and "/" not in status.name.removeprefix(namespace)
    }


def not_finite(motion: Motion, acceleration: Acceleration | None = None) -> str | None:
    """Names and values of the non-finite numbers in a state and an acceleration, as `x = nan`; None when all are finite."""
    values = (*motion, *(acceleration or ()))
    if all(map(math.isfinite, values)):
        return None
    named = zip(NAMES, values, strict=False)
    return ", ".join(f"{name} = {value}" for name, value in named if not math.isfinite(value))


def _motion(pose: Any, twist: Any) -> Motion:
    position, q = pose.position, pose.orientation
    psi = heading_from_quaternion(q.x, q.y, q.z, q.w)
    return Motion(position.x, position.y, psi, twist.linear.x, twist.linear.y, twist.angular.z)
