"""Conversions between ROS messages and NumPy arrays.

The `write_` functions fill a message that the caller keeps, because creating a message costs more than filling it; an `Outgoing`
serialises without one, which costs less still. The `read_` functions accept any object with the fields of the message: one of
rclpy's, or one that a bag reader has deserialised without ROS. ROS is imported only where a message is created.

Frames follow REP-103: poses in the ENU frame `odom`, velocities and wrenches in the FLU frame `base_link`.
"""

from __future__ import annotations

import functools
import math
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

from vessel_hsmc_ros.control.interface.law import Terms
from vessel_hsmc_ros.core.exceptions import GoalError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, heading_from_quaternion, quaternion_from_heading
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds
from vessel_hsmc_ros.messages.codec import Draft
from vessel_hsmc_ros.messages.raw import message_class

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Sequence

    from builtin_interfaces.msg import Time
    from geometry_msgs.msg import AccelStamped, PoseStamped, Twist, TwistStamped, WrenchStamped
    from nav_msgs.msg import Odometry
    from vessel_hsmc_msgs.msg import ControlState, ReferenceState

    from vessel_hsmc_ros.core.kernel import Array


WORLD, BODY = "odom", "base_link"

_AXES = ("surge", "sway", "yaw")
STATE_NAMES = ("x", "y", "heading", *(f"{axis} velocity" for axis in _AXES), *(f"{axis} acceleration" for axis in _AXES))


def nanoseconds(stamp: Any) -> int:
    """A builtin_interfaces/Time in nanoseconds."""
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def time_message(stamp: int) -> Time:
    """Nanoseconds as a builtin_interfaces/Time."""
    sec, nanosec = divmod(stamp, NANOSECONDS)
    return _time()(sec=sec, nanosec=nanosec)


@functools.cache
def _time() -> Any:
    """The class of a time; looked up late, so that bags can be read without ROS, and once, which costs less than each message."""
    return message_class("builtin_interfaces/msg/Time")


def _new(kind: str, frame: str) -> Any:
    """An empty message of a type with a header, in a frame."""
    message = message_class(kind)()
    message.header.frame_id = frame
    return message


def new_odometry() -> Odometry:
    """An empty odometry message: pose in the world frame, twist in the body frame."""
    message = _new("nav_msgs/msg/Odometry", WORLD)
    message.child_frame_id = BODY
    return message


def new_wrench() -> WrenchStamped:
    """An empty wrench message in the body frame."""
    return _new("geometry_msgs/msg/WrenchStamped", BODY)


def new_acceleration() -> AccelStamped:
    """An empty acceleration message in the body frame."""
    return _new("geometry_msgs/msg/AccelStamped", BODY)


def new_pose() -> PoseStamped:
    """An empty pose message in the world frame."""
    return _new("geometry_msgs/msg/PoseStamped", WORLD)


def new_reference() -> ReferenceState:
    """An empty reference message in the world frame."""
    return _new("vessel_hsmc_msgs/msg/ReferenceState", WORLD)


def new_control_state() -> ControlState:
    """An empty control-state message in the body frame, of a controller whose law commands."""
    message = _new("vessel_hsmc_msgs/msg/ControlState", BODY)
    message.operation = message.ACTIVE
    return message


class Content(NamedTuple):
    """The fields of a stamped message that change, by their dotted names, and a function that returns their values."""

    names: tuple[str, ...]
    values: Callable[..., Sequence[Any]]


def _names(group: str, *names: str) -> tuple[str, ...]:
    return tuple(f"{group}.{name}" for name in names)


_STAMP = ("header.stamp.sec", "header.stamp.nanosec")
_POSE = ("position.x", "position.y", "orientation.z", "orientation.w")
_TWIST = ("linear.x", "linear.y", "angular.z")


def _pose_values(state: Motion | Array) -> tuple[float, ...]:
    # A rotation about the vertical axis: x and y of the quaternion keep their default, 0. rclpy accepts Python floats only.
    return float(state[0]), float(state[1]), *quaternion_from_heading(float(state[2]))


def _motion_values(state: Motion | Array) -> tuple[float, ...]:
    return *_pose_values(state), float(state[3]), float(state[4]), float(state[5])


ODOMETRY = Content((*_names("pose.pose", *_POSE), *_names("twist.twist", *_TWIST)), _motion_values)
"""Of a state x, y, psi, u, v, r, (6,)."""

REFERENCE = Content(
    (*_names("pose", *_POSE), *_names("twist", *_TWIST), *_names("acceleration", *_TWIST)),
    lambda state, acceleration: (*_motion_values(state), *map(float, acceleration[:3])),
)
"""Of a state, (6,), and of surge, sway and yaw acceleration in the body frame, (3,)."""

POSE = Content(_names("pose", *_POSE), _pose_values)
"""Of a state, (6,), or its pose."""

WRENCH = Content(_names("wrench", "force.x", "torque.z"), tuple)
"""Of surge force, N, and yaw moment, N·m."""

BODY_WRENCH = Content(_names("wrench", "force.x", "force.y", "torque.z"), tuple)
"""Of surge and sway force, N, and yaw moment, N·m, such as a disturbance."""

ACCELERATION = Content(_names("accel", *_TWIST), tuple)
"""Of the accelerations of surge, sway and yaw in the body frame."""

CONTROL_STATE = Content(
    (*Terms._fields, "operation", "reason", "compute_time", "missed_periods"), lambda terms, *others: (*terms, *others)
)
"""Of the terms of the law, each in the field of the same name, and of the other fields of the message in their order."""


class Outgoing:
    """Serialises stamped messages of one content. `message`: has the fields that do not change, such as the frames."""

    def __init__(self, message: Any, content: Content) -> None:
        self._draft, self._values = Draft(message, (*_STAMP, *content.names)), content.values

    def __call__(self, stamp: int, *given: Any) -> bytes:
        """The serialised message with a stamp, ns, and the values of what is given."""
        return self._draft((*divmod(stamp, NANOSECONDS), *self._values(*given)))


def _write(message: Any, stamp: Time, content: Content, *given: Any) -> None:
    message.header.stamp = stamp
    for name, value in zip(content.names, content.values(*given), strict=True):
        group, _, leaf = name.rpartition(".")
        setattr(attrgetter(group)(message) if group else message, leaf, value)


def write_odometry(message: Odometry, stamp: Time, state: Motion | Array) -> None:
    """Write a state into a message from `new_odometry`."""
    _write(message, stamp, ODOMETRY, state)


def write_reference(message: ReferenceState, stamp: Time, state: Array, acceleration: Array) -> None:
    """Write a state and an acceleration into a message from `new_reference`."""
    _write(message, stamp, REFERENCE, state, acceleration)


def write_pose(pose: Any, state: Motion | Array) -> None:
    """Write x, y, psi of a state into a geometry_msgs/Pose."""
    pose.position.x, pose.position.y, pose.orientation.z, pose.orientation.w = _pose_values(state)


def write_pose_stamped(message: PoseStamped, stamp: Time, state: Array) -> None:
    """Write the pose of a state into a message from `new_pose`."""
    _write(message, stamp, POSE, state)


def write_wrench(message: WrenchStamped, stamp: Time, wrench: tuple[float, float]) -> None:
    """Write a control wrench into a message from `new_wrench`."""
    _write(message, stamp, WRENCH, wrench)


def write_body_wrench(message: WrenchStamped, stamp: Time, wrench: tuple[float, float, float]) -> None:
    """Write a wrench with a sway force into a message from `new_wrench`."""
    _write(message, stamp, BODY_WRENCH, wrench)


def velocity_command(velocities: tuple[float, float], frame: str, stamp: Time | None) -> Twist | TwistStamped:
    """A command of surge speed and yaw rate in a frame; without a stamp a Twist, which has no frame."""
    twist = message_class("geometry_msgs/msg/Twist")()
    twist.linear.x, twist.angular.z = map(float, velocities)
    if stamp is None:
        return twist
    message = message_class("geometry_msgs/msg/TwistStamped")(twist=twist)
    message.header.stamp, message.header.frame_id = stamp, frame
    return message


def read_odometry(message: Any) -> Motion:
    """The state of an odometry message."""
    return _motion(message.pose.pose, message.twist.twist)


def read_reference(message: Any) -> tuple[Motion, Acceleration]:
    """The state and the acceleration in the body frame of a reference message."""
    a = message.acceleration
    return _motion(message.pose, message.twist), Acceleration(a.linear.x, a.linear.y, a.angular.z)


def read_wrench(message: Any) -> tuple[float, float]:
    """Surge force and yaw moment of a wrench message."""
    return message.wrench.force.x, message.wrench.torque.z


def read_status(statuses: Iterable[Any], namespace: str) -> dict[str, dict[str, str]]:
    """The values in a diagnostics message by node, for the nodes directly in a namespace, not in one below it.

    Each is the status of a node as a whole; those of its diagnostic tasks, named `node: task`, are omitted. `statuses`: those
    of a diagnostic_msgs/DiagnosticArray. `namespace`: without its leading slash: empty for the root, or such as `alpha/`.
    """
    return {
        status.name.removeprefix(namespace): {"message": status.message, **{v.key: v.value for v in status.values}}
        for status in statuses
        if status.name.startswith(namespace) and not {"/", ":"}.intersection(status.name.removeprefix(namespace))
    }


def not_finite(motion: Motion, acceleration: Acceleration | None = None) -> str | None:
    """Names and values of the non-finite numbers in a state and an acceleration, as `x = nan`; None when all are finite."""
    # One test for the usual case; names are looked up only when something is wrong.
    values = (*motion, *(acceleration or ()))
    if all(map(math.isfinite, values)):
        return None
    named = zip(STATE_NAMES, values, strict=False)
    return ", ".join(f"{name} = {value}" for name, value in named if not math.isfinite(value))


def _motion(pose: Any, twist: Any) -> Motion:
    position, q = pose.position, pose.orientation  # heave, roll and pitch are not part of the 3-DOF model
    none = q.x == q.y == q.z == q.w == 0.0  # an orientation that was not filled in is not a heading of zero
    psi = math.nan if none else heading_from_quaternion(q.x, q.y, q.z, q.w)
    return Motion(position.x, position.y, psi, twist.linear.x, twist.linear.y, twist.angular.z)


SHORTEST_QUATERNION = 1e-6  # squared length below which a quaternion does not define an orientation
FARTHEST = 1e5
"""Largest distance of a goal or waypoint from the reference, m: eastings of UTM, and degrees taken for metres, are beyond it."""

Here = tuple[float, float]


def read_goal(
    message: Any, frames: Collection[str] = (WORLD,), here: Here = (0.0, 0.0)
) -> tuple[float, float, float, float | None]:
    """Validate and convert a goal pose.

    `message`: a geometry_msgs/PoseStamped. `here`: the present position x, y of the reference. Returns x, y, heading and
    stamp, s; the stamp is None where the message has none (0).
    """
    _require_frame(message.header.frame_id, frames, "goal")
    position, q = message.pose.position, message.pose.orientation
    _require_near(position, here, "goal")
    _require_finite({f"orientation.{name}": getattr(q, name) for name in "xyzw"}, "goal")
    # A quaternion need not be normalised, as its heading does not depend on its length; only 0 and infinity have no heading.
    squared = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w
    if not SHORTEST_QUATERNION <= squared < math.inf:
        raise GoalError(f"orientation of the goal must be a quaternion of length 1 (got length {math.sqrt(squared):.3g})")
    stamp = nanoseconds(message.header.stamp)
    return position.x, position.y, heading_from_quaternion(q.x, q.y, q.z, q.w), seconds(stamp) if stamp else None


def read_path(message: Any, frames: Collection[str] = (WORLD,), here: Here = (0.0, 0.0)) -> list[tuple[float, float]]:
    """Validate a path and return its waypoints x, y; orientations are ignored.

    `message`: a nav_msgs/Path. `frames`: the frames in which paths are accepted; its poses have the same one, or none.
    `here`: the present position x, y of the reference.
    """
    _require_frame(message.header.frame_id, frames, "path")
    if not message.poses:
        raise GoalError("a path must have at least one pose (got 0)")
    points = []
    for number, stamped in enumerate(message.poses):
        if stamped.header.frame_id:  # often left empty: then the path's own frame counts
            _require_frame(stamped.header.frame_id, (message.header.frame_id,), f"pose {number} of the path")
        position = stamped.pose.position
        _require_near(position, here, f"pose {number} of the path")
        points.append((position.x, position.y))
    return points


def path_event(points: Sequence[tuple[float, float]]) -> str:
    """The text of the event of a path that was set, by its waypoints x, y."""
    x, y = points[-1]
    return f"{len(points)} waypoints, the last at x = {x:g}, y = {y:g}"


def _require_frame(found: str, frames: Collection[str], what: str) -> None:
    if found not in frames:
        raise GoalError(f"{what} must be in frame {' or '.join(frames)} (got '{found}')")


def _require_near(position: Any, here: Here, what: str) -> None:
    _require_finite({"x": position.x, "y": position.y}, what)
    distance = math.hypot(position.x - here[0], position.y - here[1])
    if distance > FARTHEST:
        raise GoalError(
            f"{what} must be within {FARTHEST / 1e3:g} km of the reference at x = {here[0]:g}, y = {here[1]:g}"
            f" (got x = {position.x:g}, y = {position.y:g}, {distance / 1e3:g} km): is it in the frame of the odometry?"
        )


def _require_finite(numbers: dict[str, float], what: str) -> None:
    wrong = ", ".join(f"{name} = {value}" for name, value in numbers.items() if not math.isfinite(value))
    if wrong:
        raise GoalError(f"{what} must be finite numbers (got {wrong})")
