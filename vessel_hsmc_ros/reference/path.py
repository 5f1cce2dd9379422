"""Paths: waypoints joined by straight legs, followed at a constant speed, with a stop at the last waypoint.

The legs are followed by line-of-sight guidance. The reference switches to the next leg within an acceptance radius of the
waypoint or when it has passed it; the reference filter rounds the corner. The end of the last leg is a goal with the heading of
that leg.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import GoalError, ParameterError
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.reference.goal import GoalReference
from vessel_hsmc_ros.reference.goal_parameters import NEVER, GoalParameters
from vessel_hsmc_ros.reference.motion_filter import FilteredMotion
from vessel_hsmc_ros.reference.steering import LEG_LOOKAHEAD, follow_line, surge_setpoint

Array = NDArray[np.float64]

Point = tuple[float, float]

END = 8.0
"""Distance before the last waypoint at which it becomes the goal, m."""

DISTINCT = 0.01
"""Consecutive waypoints nearer to each other than this are treated as one, m."""


@dataclass(frozen=True)
class PathParameters:
    """Waypoints from the parameters file, for runs without a publisher of `path`."""

    waypoints: tuple[float, ...] = parameter(
        (0.0, 0.0), "Waypoints: x, y of the first, of the second and so on.", unit="m", low=-1e6, high=1e6
    )
    time: float = parameter(NEVER, "Time at which the path is set; below 0 for never.", unit="s", low=-1.0, high=1e9)
    radius: float = parameter(
        10.0, "Acceptance radius of a waypoint, for switching to the next leg.", unit="m", low=0.1, high=1e6
    )


def points_of(parameters: PathParameters) -> list[Point]:
    """The waypoints of the parameters.

    Raises:
        ParameterError: the number of coordinates is odd.
    """
    numbers = parameters.waypoints
    if len(numbers) % 2:
        raise ParameterError(
            f"reference_ship.path.waypoints with {len(numbers)} numbers is not allowed: it takes x, y for each waypoint"
        )
    return list(zip(numbers[::2], numbers[1::2], strict=True))


class PathReference:
    """A feasible motion along waypoints; before the first path it keeps its initial position.

    Args:
        motion: The motion to steer.
        parameters: Scheduled path.
        goal: Parameters of the approach to the last waypoint.
        period: Length of a step, s.

    Raises:
        ParameterError: the number of coordinates is odd.
    """

    def __init__(self, motion: FilteredMotion, parameters: PathParameters, goal: GoalParameters, period: float) -> None:
        self._motion = motion
        self._parameters = parameters
        self._period = period
        self._known = points_of(parameters)
        # The final approach shares the motion filter, so that the transition is continuous.
        self._end = GoalReference(motion, GoalParameters(astern_distance=goal.astern_distance), period)
        self.reset()

    @property
    def state(self) -> Array:
        """Pose x, y, psi and body velocities u, v, r of the present step, shape (6,)."""
        return self._motion.state

    def reset(self) -> None:
        """Return to the start: a path that was set is discarded, the scheduled path begins again."""
        self._end.reset()
        self._legs: list[tuple[Point, Point]] = []
        self._steps = 0
        self._set_scheduled()

    def acceleration(self) -> Array:
        """Derivatives du, dv, dr of the body velocities, shape (3,): m/s², m/s², rad/s²."""
        return self._motion.acceleration()

    def set_path(self, points: Sequence[Point]) -> None:
        """Set a new path; its first leg begins at the present position of the reference.

        Args:
            points: Waypoints x, y, m.

        Raises:
            GoalError: there are no waypoints.
        """
        if not points:
            raise GoalError("a path of 0 waypoints is not allowed: it takes at least one")
        x, y, psi = self.state[:3].tolist()
        course, corners = psi, [(x, y)]
        # Repeated waypoints would give legs without a direction.
        for point in points:
            if math.dist(corners[-1], point) > DISTINCT:
                course = math.atan2(point[1] - corners[-1][1], point[0] - corners[-1][0])
                corners.append(point)
        self._legs = list(pairwise(corners))
        self._last = *corners[-1], course
        if not self._legs:
            self._end.go_to(*self._last)

    def advance(self) -> None:
        """Advance by one period."""
        self._move()
        self._steps += 1
        self._set_scheduled()

    def _set_scheduled(self) -> None:
        time = self._parameters.time
        if time >= 0.0 and round(time / self._period) == self._steps:
            self.set_path(self._known)

    def _move(self) -> None:
        while self._legs and self._leg_completed():
            del self._legs[0]
            if not self._legs:
                self._end.go_to(*self._last)
        if not self._legs:
            self._end.advance()
            return
        along, across, length, course = self._track_position()
        speed = self._motion.limits.speed
        if len(self._legs) == 1:
            # On the last leg the ship brakes along the curve that ends at the waypoint.
            speed = surge_setpoint(self._motion, max(length - along, 0.0))
        self._motion.advance(*follow_line(self._motion, course, across, speed, lookahead=LEG_LOOKAHEAD))

    def _track_position(self) -> tuple[float, float, float, float]:
        """Distance along the present leg and to its left, its length, its course: m, m, m, rad."""
        (ax, ay), (bx, by) = self._legs[0]
        course = math.atan2(by - ay, bx - ax)
        x, y = float(self.state[0]) - ax, float(self.state[1]) - ay
        c, s = math.cos(course), math.sin(course)
        return c * x + s * y, -s * x + c * y, math.hypot(bx - ax, by - ay), course

    def _leg_completed(self) -> bool:
        """Whether to switch to the next leg, or to the goal at the end of the last one."""
        # The last leg ends before its waypoint, where the approach to the goal plans the stop.
        along, across, length, _ = self._track_position()
        if len(self._legs) == 1:
            return along >= length - END
        # Half the length of the next leg bounds the radius, so that a short leg is not skipped.
        radius = min(self._parameters.radius, 0.5 * math.dist(*self._legs[1]))
        return along >= length or math.hypot(length - along, across) < radius
