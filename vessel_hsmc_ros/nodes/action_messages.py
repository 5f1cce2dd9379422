"""The messages of the actions: types, goals as ways to sail, feedback and results.

The types are those of nav2_msgs where it is installed, else the package's own of the same names. Only fields that a type has are
filled in, because the versions of nav2_msgs differ, and the package's own have further ones.
"""

import math
from collections.abc import Callable, Collection
from importlib import import_module
from typing import Any, NamedTuple

import vessel_hsmc_msgs.action
from nav_msgs.msg import Path

from vessel_hsmc_ros.core.exceptions import GoalError
from vessel_hsmc_ros.core.geodesy import FARTHEST, Plane, exchanged, same
from vessel_hsmc_ros.guidance.waypoints import NONE, Point
from vessel_hsmc_ros.messages.conversions import read_goal, read_path, time_message
from vessel_hsmc_ros.messages.topics import DATUM
from vessel_hsmc_ros.scenario.parameter_groups import OWNER

MAX_WAYPOINTS = 20_000  # of one goal, with its loops


class Way(NamedTuple):
    """What a goal asks for."""

    points: list[Point]  # x, y, m
    frame: str
    heading: float | None = None  # at the end, rad
    first: int = 0  # index of the first of the points among those of the goal
    total: int = 1  # number of the poses of the goal, which loops repeat
    poses: Any = ()  # of the goal, for the waypoints that are missed


class Frames(NamedTuple):
    """Where goals are read: the frames they may be in, the reference's place, m, and the datum, declared and stated."""

    allowed: Collection[str]
    here: Point
    datum: tuple[float, ...]
    stated: tuple[float, float] | None

    def plane(self) -> Plane:
        """The plane of places by latitude and longitude. Raises GoalError without a datum, or with two."""
        declared = None if self.datum == NONE else self.datum
        datum = self.stated or declared
        if datum is None:
            raise GoalError(f"{OWNER}.datum must be given for places by latitude and longitude, as no node states it on {DATUM}")
        if declared and not same(declared, datum):
            raise GoalError(f"{OWNER}.datum must be the datum of the odometry, {datum[0]}, {datum[1]} (got {list(declared)})")
        return Plane(*datum)


def _read_pose(goal: Any, f: Frames) -> Way:
    x, y, psi, _ = read_goal(goal.pose, f.allowed, f.here)
    return Way([(x, y)], goal.pose.header.frame_id, psi)


def _read_path(goal: Any, f: Frames) -> Way:
    return Way(read_path(goal.path, f.allowed, f.here), goal.path.header.frame_id)


def _read_waypoints(goal: Any, f: Frames) -> Way:
    path = Path(poses=goal.poses)
    path.header.frame_id = goal.poses[0].header.frame_id if goal.poses else next(iter(f.allowed), "")
    return _looped(goal, Way(read_path(path, f.allowed, f.here), path.header.frame_id, poses=goal.poses))


def _read_places(goal: Any, f: Frames) -> Way:
    plane, points = f.plane(), []
    for number, pose in enumerate(goal.gps_poses):
        place = pose.position.latitude, pose.position.longitude
        if not (abs(place[0]) <= 90.0 and abs(place[1]) <= 360.0):  # NaN too
            raise GoalError(f"pose {number} must be a latitude and a longitude, degrees (got {place[0]}, {place[1]})")
        if (distance := plane.distance(*place)) > FARTHEST:
            swapped = "; are latitude and longitude exchanged?" if exchanged(plane, *place) else ""
            where = f"{place[0]:.6f}, {place[1]:.6f}, {distance / 1e3:.0f} km away{swapped}"
            raise GoalError(f"pose {number} must be within {FARTHEST / 1e3:g} km of the datum (got {where})")
        points.append(plane.place(*place)[:2])
    if not points:
        raise GoalError("a goal must have at least one pose (got none)")
    return _looped(goal, Way(points, next(iter(f.allowed), "")))


def _looped(goal: Any, way: Way) -> Way:
    """The way from the first waypoint to sail on, with its loops."""
    count, first, loops = len(way.points), int(goal.goal_index), int(goal.number_of_loops)
    if first >= count:
        raise GoalError(f"goal_index must be below the number of poses, {count} (got {first})")
    if count * (loops + 1) > MAX_WAYPOINTS:
        raise GoalError(f"poses times loops must be at most {MAX_WAYPOINTS} (got {count} poses, number_of_loops {loops})")
    return way._replace(points=way.points[first:] + way.points * loops, first=first, total=count)


class Action(NamedTuple):
    """An action: its type, what reads its goals, and the modes of the reference that take it."""

    kind: str
    read: Callable[[Any, Frames], Way]
    modes: tuple[str, ...] = ("path",)


ACTIONS = {
    "navigate_to_pose": Action("NavigateToPose", _read_pose, ("goal", "path")),
    "follow_path": Action("FollowPath", _read_path),
    "follow_waypoints": Action("FollowWaypoints", _read_waypoints),
    "follow_gps_waypoints": Action("FollowGPSWaypoints", _read_places),
}
"""The actions by their names, which are those of Nav2."""


def action_type(kind: str) -> Any:
    """The type of an action, of nav2_msgs where it is installed and has it."""
    try:
        return getattr(import_module("nav2_msgs.action"), kind)
    except (ImportError, AttributeError):
        return getattr(vessel_hsmc_msgs.action, kind)


def filled(message: Any, values: dict[str, Any]) -> Any:
    """A message with those of the values for which it has fields."""
    for name in values.keys() & message.get_fields_and_field_types().keys():
        setattr(message, name, values[name])
    return message


def duration(message: Any, seconds: float) -> Any:
    """A builtin_interfaces/Duration with a time, s; as long as it can be where the time is infinite."""
    time = time_message(round(max(0.0, min(seconds, 2e9)) * 1e9) if not math.isnan(seconds) else 0)
    message.sec, message.nanosec = time.sec, time.nanosec
    return message


def missed(result: Any, way: Way, passed: int, code: int) -> None:
    """Note the waypoints of a result that were not passed, each once."""
    if not hasattr(result, "missed_waypoints"):
        return
    kind = import_module(f"{type(result).__module__.split('.')[0]}.msg").MissedWaypoint
    indices = {(way.first + k) % way.total for k in range(passed, len(way.points))}
    for index in sorted(indices):
        one = filled(kind(), {"index": index, "error_code": code})
        if way.poses:
            one.goal = way.poses[index]
        result.missed_waypoints.append(one)
