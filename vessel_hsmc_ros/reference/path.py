"""Paths: waypoints joined by straight legs, followed at a constant speed, with a stop at the last waypoint.

The legs are followed by line-of-sight guidance. The reference switches to the next leg within an acceptance radius of the
waypoint or when it has passed it; the reference filter rounds the corner. The end of the last leg is a goal with the heading of
that leg.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, magnitude
from vessel_hsmc_ros.reference.goal import GoalConstants, GoalMemory, begin_stage
from vessel_hsmc_ros.reference.goal import move as move_to_goal
from vessel_hsmc_ros.reference.kernel_reference import write_row
from vessel_hsmc_ros.reference.motion_filter import Filter, Filtered, advance_filter, read_filter
from vessel_hsmc_ros.reference.steering import LEG_LOOKAHEAD, follow_line, surge_setpoint
from vessel_hsmc_ros.reference.target import stationary

Array = NDArray[np.float64]

END = 8.0
"""Distance before the last waypoint at which it becomes the goal, m."""

DISTINCT = 0.01
"""Consecutive waypoints nearer to each other than this are treated as one, m."""


class PathConstants(NamedTuple):
    """Constants of a path reference.

    Attributes:
        goal: Constants of the approach to the last waypoint.
        radius: Acceptance radius of a waypoint, m.
        due: Step at which the path is scheduled; below 0 for never.
        points: Its waypoints, shape (n, 2), m.
    """

    goal: GoalConstants
    radius: float
    due: int
    points: Array


class PathMemory(NamedTuple):
    """Memory of a path reference.

    Attributes:
        goal: The motion, and the approach to the last waypoint, which shares it, so that the transition is continuous.
        corners: Where the path begins, and its waypoints, shape (n, 2), m.
        leg: Number of the present leg, from corner `leg` to the next; n - 1 or above after the last one.
    """

    goal: GoalMemory
    corners: Array
    leg: int


class Track(NamedTuple):
    """Distance along the present leg and to its left, its length, its course: m, m, m, rad."""

    along: float
    across: float
    length: float
    course: float


@kernel
def corner(corners: Array, i: int) -> tuple[float, float]:
    """A corner of the path, m."""
    return float(corners[i, 0]), float(corners[i, 1])


@kernel
def set_path(m: PathMemory, points: Array, c: PathConstants) -> PathMemory:
    """Set a new path; its first leg begins at the present position of the reference.

    Args:
        m: Memory.
        points: Waypoints x, y, shape (n, 2), m.
        c: Constants.

    Returns:
        The memory with the new path.
    """
    corners = np.empty((len(points) + 1, 2))
    corners[0, 0], corners[0, 1] = m.goal.motion.x, m.goal.motion.y
    n = 1
    for i in range(len(points)):
        (ax, ay), (bx, by) = corner(corners, n - 1), corner(points, i)
        # Repeated waypoints would give legs without a direction.
        if magnitude(bx - ax, by - ay) > DISTINCT:
            corners[n, 0], corners[n, 1] = bx, by
            n += 1
    m = PathMemory(m.goal, corners[:n], 0)
    return end_path(m, c) if n == 1 else m


@kernel
def end_path(m: PathMemory, c: PathConstants) -> PathMemory:
    """Set the last waypoint as the goal, with the course of the last leg, or the present heading without a leg."""
    last = len(m.corners) - 1
    x, y = corner(m.corners, last)
    psi = m.goal.motion.psi
    if last > 0:
        ax, ay = corner(m.corners, last - 1)
        psi = math.atan2(y - ay, x - ax)
    target = stationary(x, y, psi, m.goal.steps * c.goal.filter.period, math.nan)
    return PathMemory(begin_stage(m.goal, target, target, c.goal), m.corners, m.leg)


@kernel
def track(m: PathMemory) -> Track:
    """Where the motion is relative to the present leg."""
    (ax, ay), (bx, by) = corner(m.corners, m.leg), corner(m.corners, m.leg + 1)
    course = math.atan2(by - ay, bx - ax)
    x, y = m.goal.motion.x - ax, m.goal.motion.y - ay
    c, s = math.cos(course), math.sin(course)
    return Track(c * x + s * y, -s * x + c * y, magnitude(bx - ax, by - ay), course)


@kernel
def leg_completed(m: PathMemory, radius: float) -> bool:
    """Whether to switch to the next leg, or to the goal at the end of the last one."""
    t = track(m)
    # The last leg ends before its waypoint, where the approach to the goal plans the stop.
    if m.leg == len(m.corners) - 2:
        return t.along >= t.length - END
    (ax, ay), (bx, by) = corner(m.corners, m.leg + 1), corner(m.corners, m.leg + 2)
    # Half the length of the next leg bounds the radius, so that a short leg is not skipped.
    half = 0.5 * magnitude(bx - ax, by - ay)
    return t.along >= t.length or magnitude(t.length - t.along, t.across) < (half if half < radius else radius)


@kernel
def follow_leg(m: PathMemory, c: Filter) -> Filtered:
    """The motion one period later, along the present leg."""
    t, speed = track(m), c.speed
    if m.leg == len(m.corners) - 2:
        # On the last leg the ship brakes along the curve that ends at the waypoint.
        left = t.length - t.along
        speed = surge_setpoint(left if left > 0.0 else 0.0, c)
    u_c, r_c = follow_line(m.goal.motion, t.course, t.across, speed, 0.0, LEG_LOOKAHEAD, c)
    return advance_filter(m.goal.motion, u_c, r_c, c)


@kernel
def move(m: PathMemory, c: PathConstants) -> PathMemory:
    """The reference one period later."""
    while m.leg < len(m.corners) - 1 and leg_completed(m, c.radius):
        m = PathMemory(m.goal, m.corners, m.leg + 1)
        if m.leg == len(m.corners) - 1:
            m = end_path(m, c)
    if m.leg < len(m.corners) - 1:
        g = m.goal
        goal = GoalMemory(follow_leg(m, c.goal.filter), g.target, g.arrived, g.direction, g.ahead, g.steps + 1)
    else:
        goal = move_to_goal(m.goal, c.goal)
    m = PathMemory(goal, m.corners, m.leg)
    return set_path(m, c.points, c) if goal.steps == c.due else m


@kernel
def read(m: PathMemory, c: PathConstants) -> tuple[Motion, Acceleration]:
    """State, and the derivatives of its velocities."""
    return read_filter(m.goal.motion, c.goal.filter)


@kernel
def follow(m: PathMemory, c: PathConstants, rows: Array) -> None:
    """Write the motion of each step into rows of shape (n, 9)."""
    for k in range(len(rows)):
        m = move(m, c) if k > 0 else m
        write_row(rows[k], read(m, c))
