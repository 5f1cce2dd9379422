"""What the messages of a connection contain, as columns by names that all forms of state and command share."""

from collections.abc import Callable, Sequence
from operator import attrgetter
from typing import Any

import numpy as np

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.timing import NANOSECONDS

Field = Callable[[str], Any]  # returns a field of all messages, by its dotted name
POSITION_VARIANCES = (0, 7)  # those of x and y in the covariance of a pose; filters in the plane put anything into that of z
ODOMETRY = "nav_msgs/msg/Odometry"
POSE, POSE_COVARIANCE = "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/PoseWithCovarianceStamped"
TWIST_STAMPED, TWIST = "geometry_msgs/msg/TwistStamped", "geometry_msgs/msg/Twist"
WRENCH = "geometry_msgs/msg/WrenchStamped"
FIX, IMU, QUATERNION = "sensor_msgs/msg/NavSatFix", "sensor_msgs/msg/Imu", "geometry_msgs/msg/QuaternionStamped"
NUMBER, PULSE = "std_msgs/msg/Float64", "std_msgs/msg/UInt16"
REFERENCE, CONTROL_STATE = "vessel_hsmc_msgs/msg/ReferenceState", "vessel_hsmc_msgs/msg/ControlState"
EVENT = "vessel_hsmc_msgs/msg/Event"


def columns_of(kind: str, field: Field, child: bool = True) -> dict[str, Array]:
    """The columns of messages of a type; none of a type without any.

    `kind`: such as `nav_msgs/msg/Odometry`. `child`: whether the type's child frame counts.
    """
    found: dict[str, Array] = {}
    if kind in _STAMPED:
        found["stamp"] = (
            np.asarray(field("header.stamp.sec"), float) + np.asarray(field("header.stamp.nanosec"), float) / NANOSECONDS
        )
        found["frame"] = np.asarray(field("header.frame_id"), dtype=object)
    if kind == EVENT:
        found["kind"] = np.asarray(field("kind"), dtype=object)
    if kind == ODOMETRY and child:
        found["child"] = np.asarray(field("child_frame_id"), dtype=object)
    if kind in _POSES:
        found |= _pose(field, _POSES[kind])
    if kind in _TWISTS:
        found |= {name: np.asarray(field(_TWISTS[kind] + part), float) for name, part in _VELOCITIES.items()}
    if kind in _COVARIANCES:
        rows = np.array([[float(row[i]) for i in POSITION_VARIANCES] for row in field(_COVARIANCES[kind])])
        found |= {"variance": rows.max(axis=1), "least_variance": rows.min(axis=1)} if len(rows) else {}
    if kind in _ORIENTATIONS:
        found |= _orientation(field, _ORIENTATIONS[kind])
    return found | {name: np.asarray(field(part), float) for name, part in _NUMBERS.get(kind, {}).items()}


def columns_of_messages(kind: str, messages: Sequence[Any]) -> dict[str, Array]:
    """The columns of messages of rclpy."""
    return columns_of(kind, lambda name: [attrgetter(name)(message) for message in messages])


_STAMPED = (ODOMETRY, POSE, POSE_COVARIANCE, TWIST_STAMPED, WRENCH, FIX, IMU, QUATERNION, REFERENCE, CONTROL_STATE)
_POSES = {ODOMETRY: "pose.pose.", POSE: "pose.", POSE_COVARIANCE: "pose.pose."}
_TWISTS = {ODOMETRY: "twist.twist.", TWIST_STAMPED: "twist.", TWIST: ""}
_VELOCITIES = {"u": "linear.x", "v": "linear.y", "r": "angular.z"}
_COVARIANCES = {ODOMETRY: "pose.covariance", POSE_COVARIANCE: "pose.covariance"}
_ORIENTATIONS = {IMU: "orientation.", QUATERNION: "quaternion."}
_NUMBERS = {
    WRENCH: {"force": "wrench.force.x", "moment": "wrench.torque.z"},
    FIX: {"status": "status.status", "latitude": "latitude", "longitude": "longitude"},
    IMU: {"r": "angular_velocity.z", "az": "linear_acceleration.z"},
    NUMBER: {"value": "data"},
    PULSE: {"value": "data"},
    CONTROL_STATE: {"operation": "operation", "reason": "reason"},
}

KNOWN = (*_STAMPED, TWIST, NUMBER, PULSE, EVENT)  # the types of which columns are made


def _pose(field: Field, prefix: str) -> dict[str, Array]:
    place = {name: np.asarray(field(f"{prefix}position.{name}"), float) for name in ("x", "y")}
    return place | _orientation(field, f"{prefix}orientation.")


def _orientation(field: Field, prefix: str) -> dict[str, Array]:
    x, y, z, w = (np.asarray(field(prefix + name), float) for name in "xyzw")
    norm = np.sqrt(x * x + y * y + z * z + w * w)
    psi = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return {"psi": psi, "norm": norm, "up": 1.0 - 2.0 * (x * x + y * y)}
