"""Waypoints to follow, at a speed, with a stop at the last.

From leg to leg by line of sight: a leg is left for the next when its end is within a radius or has been passed, and the filter
behind makes the corner round. The last leg ends as a goal does, at the last waypoint with the heading of that leg.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import GoalError, ParameterError
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.reference.goal import LEG_LOOKAHEAD, NEVER, GoalParameters, GoalReference, follow
from vessel_hsmc_ros.reference.motion_filter import FilteredMotion, approach

Array = NDArray[np.float64]

Point = tuple[float, float]

END = 8.0
"""Way before the last waypoint at which it becomes the goal, m."""

SAME = 0.01
"""Waypoints nearer to each other than this are one, m."""


@dataclass(frozen=True)
class PathParameters:
    """Waypoints from the parameters file, for runs without a publisher of `path`."""

    waypoints: tuple[float, ...] = parameter(
        (0.0, 0.0), "Waypoints one after the other: x, y, x, y.", unit="m", low=-1e6, high=1e6
    )
    time: float = parameter(NEVER, "When they become the path; below 0 for never.", unit="s", low=-1.0, high=1e9)
    radius: float = parameter(10.0, "A leg is left for the next this far from its end.", unit="m", low=0.1, high=1e6)


def points_of(parameters: PathParameters) -> list[Point]:
    """The waypoints of the parameters.

    Raises:
        ParameterError: a y is missing.
    """
    numbers = parameters.waypoints
    if len(numbers) % 2:
        raise ParameterError(
            f"reference_ship.path.waypoints with {len(numbers)} numbers is not allowed: it takes x, y for each waypoint"
        )
    return list(zip(numbers[::2], numbers[1::2], strict=True))


class PathReference:
    """A feasible motion along waypoints; before the first path it keeps its place.

    Attributes:
        state: x, y, psi, u, v, r, shape (6,).

    Args:
        motion: What moves.
        parameters: Waypoints known beforehand.
        goal: How its end is gone to.
        period: Time between two steps, s.

    Raises:
        ParameterError: the waypoints make no sense.
    """

    def __init__(self, motion: FilteredMotion, parameters: PathParameters, goal: GoalParameters, period: float) -> None:
        self._motion = motion
        self._parameters = parameters
        self._period = period
        self._known = points_of(parameters)
        self._end = GoalReference(motion, GoalParameters(astern_distance=goal.astern_distance), period)
        self.reset()

    @property
    def state(self) -> Array:
        """The pose x, y, psi and the body velocities u, v, r of the present step, shape (6,)."""
        return self._motion.state

    def reset(self) -> None:
        """Back to the start of the parameters' waypoints; a path that was set is forgotten."""
        self._end.reset()
        self._legs: list[tuple[Point, Point]] = []
        self._steps = 0
        self._take_due()

    def acceleration(self) -> Array:
        """The derivatives du, dv, dr of the body velocities, shape (3,): m/s², m/s², rad/s²."""
        return self._motion.acceleration()

    def set_path(self, points: Sequence[Point]) -> None:
        """Follow other waypoints, from where the reference is now to the first.

        Raises:
            GoalError: there is no waypoint.
        """
        if not points:
            raise GoalError("a path of 0 waypoints is not allowed: it takes at least one")
        x, y, psi = (float(value) for value in self.state[:3])
        course, corners = psi, [(x, y)]
        for point in points:
            if math.dist(corners[-1], point) > SAME:
                course = math.atan2(point[1] - corners[-1][1], point[0] - corners[-1][0])
                corners.append(point)
        self._legs = list(pairwise(corners))
        self._last = *corners[-1], course
        if not self._legs:
            self._end.go_to(*self._last)

    def advance(self) -> None:
        """Move on by one period."""
        self._move()
        self._steps += 1
        self._take_due()

    def _take_due(self) -> None:
        time = self._parameters.time
        if time >= 0.0 and round(time / self._period) == self._steps:
            self.set_path(self._known)

    def _move(self) -> None:
        while self._legs and self._leave_leg():
            del self._legs[0]
            if not self._legs:
                self._end.go_to(*self._last)
        if not self._legs:
            self._end.advance()
            return
        along, across, length, course = self._place()
        limits = self._motion.limits
        speed = limits.speed
        if len(self._legs) == 1:
            speed = approach(max(length - along, 0.0), 0.25, 0.5 * limits.acceleration, speed)
        self._motion.advance(*follow(self._motion, course, across, speed, lookahead=LEG_LOOKAHEAD))

    def _place(self) -> tuple[float, float, float, float]:
        """Way along the present leg, to its left, its length, its course: m, m, m, rad."""
        (ax, ay), (bx, by) = self._legs[0]
        course = math.atan2(by - ay, bx - ax)
        x, y = float(self.state[0]) - ax, float(self.state[1]) - ay
        c, s = math.cos(course), math.sin(course)
        return c * x + s * y, -s * x + c * y, math.hypot(bx - ax, by - ay), course

    def _leave_leg(self) -> bool:
        """Whether it is time for the next leg, or for the goal at the last one's end."""
        along, across, length, _ = self._place()
        if len(self._legs) > 1:
            return along >= length or math.hypot(length - along, across) < min(self._parameters.radius, 0.5 * self._next())
        return along >= length - END

    def _next(self) -> float:
        """Length of the next leg, m: a short one must not be left out."""
        return math.dist(*self._legs[1])
