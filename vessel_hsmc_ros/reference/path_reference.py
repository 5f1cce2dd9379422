"""The reference that follows paths: a timetable from the present motion on, planned anew with each path."""

from collections.abc import Sequence

import numpy as np

from vessel_hsmc_ros.core.exceptions import GoalError, ParameterError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.reference.corners import THROUGH
from vessel_hsmc_ros.reference.path import plan_path
from vessel_hsmc_ros.reference.path_parameters import Point
from vessel_hsmc_ros.reference.polyline import Ship, Waypoint
from vessel_hsmc_ros.reference.timetable import (
    Timetable,
    TimetableConstants,
    TimetableMemory,
    TimetableReference,
    later,
    motion_at,
)


class PathReference(TimetableReference):
    """A motion along waypoints to rest at the last one; before the first path it keeps its initial position.

    Args:
        start: Initial state; a ship that is under way at the start comes to rest ahead.
        ship: Whose path it is.
        speed: Largest speed on legs without one of their own, m/s.
        scheduled: Time, s, and waypoints of a path that is set without a message; None for none.
        period: Length of a step, s.

    Raises:
        ParameterError: the scheduled path cannot be sailed.
    """

    def __init__(
        self, start: Motion, ship: Ship, speed: float, scheduled: tuple[float, Sequence[Waypoint]] | None, period: float
    ) -> None:
        self._ship, self._speed = ship, speed
        table = plan_path([], start, Acceleration(0.0, 0.0, 0.0), ship, speed)
        if scheduled:
            due = round(scheduled[0] / period) * period
            after = _extended(table, due, scheduled[1], ship, speed)
            before = table.times < due
            table = Timetable(*(np.concatenate((a[before], b)) for a, b in zip(table, after, strict=True)))
        self._planned = table
        super().__init__(table, period)

    def reset(self) -> None:
        """Return to the start: a path that was set is discarded, the scheduled path begins again."""
        self.constants = TimetableConstants(self._planned, self.constants.period)
        super().reset()

    def set_path(self, points: Sequence[Point]) -> None:
        """Set a new path; its first leg begins with the present motion of the reference.

        Args:
            points: Waypoints x, y, m.

        Raises:
            GoalError: there are no waypoints, or the ship cannot sail along them.
        """
        if not points:
            raise GoalError("a path of 0 waypoints is not allowed: it takes at least one")
        waypoints = [Waypoint(complex(x, y), THROUGH, self._speed) for x, y in points]
        now, period = self.memory.steps * self.constants.period, self.constants.period
        try:
            table = _extended(self.constants.table, now, waypoints, self._ship, self._speed)
        except ParameterError as error:
            raise GoalError(str(error)) from None
        self.constants, self.memory = TimetableConstants(table, period), TimetableMemory(self.memory.steps)


def _extended(table: Timetable, now: float, waypoints: Sequence[Waypoint], ship: Ship, speed: float) -> Timetable:
    """A path that begins at a time with the motion of a table then."""
    motion, acceleration = motion_at(now, table)
    return later(plan_path(waypoints, motion, acceleration, ship, speed), now)
