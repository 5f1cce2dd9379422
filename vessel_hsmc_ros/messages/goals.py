"""Goals and paths from messages of other programs; unlike the package's own messages, they are validated."""

import math
from collections.abc import Collection, Sequence
from typing import Any

from vessel_hsmc_ros.core.exceptions import GoalError
from vessel_hsmc_ros.core.kinematics import heading_from_quaternion
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.messages.conversions import WORLD, nanoseconds

SHORTEST_QUATERNION = 1e-6  # squared length below which a quaternion does not define an orientation
FARTHEST = 1e5
"""Largest distance of a goal or waypoint from the reference, m: eastings of UTM, and degrees taken for metres, are beyond it."""

Here = tuple[float, float]


def read_goal(
    message: Any, frames: Collection[str] = (WORLD,), here: Here = (0.0, 0.0)
) -> tuple[float, float, float, float | None]:
    """Validate and convert a goal pose.

    `message`: a geometry_msgs/PoseStamped. `here`: the present position x, y of the reference. Returns x, y, heading and stamp,
    s; the stamp is None where the message has none (0). Raises GoalError if a number is not finite or too far away, the
    quaternion has no length, or the message is in another frame.
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

    `message`: a nav_msgs/Path. `frames`: the frames in which paths are accepted; its poses have the same one, or none. `here`:
    the present position x, y of the reference. Raises GoalError if there is no pose, a number is not finite or too far away, or
    a pose is in another frame.
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
