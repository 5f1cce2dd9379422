"""The reference that follows paths: a timetable from the present motion on, planned anew with each path."""

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np

from vessel_hsmc_ros.core.exceptions import GoalError, ParameterError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.guidance.corners import THROUGH
from vessel_hsmc_ros.guidance.path import Plan, plan_path
from vessel_hsmc_ros.guidance.path_parameters import Point
from vessel_hsmc_ros.guidance.planned_track import replaced, stretches_of
from vessel_hsmc_ros.guidance.polyline import Ship, Waypoint
from vessel_hsmc_ros.guidance.timetable import (
    Timetable,
    TimetableConstants,
    TimetableMemory,
    TimetableReference,
    later,
    motion_at,
)


class PathReference(TimetableReference):
    """A motion along waypoints to rest at the last one; before the first path it keeps its initial position.

    `start`: initial state; a ship that is under way at the start comes to rest ahead. `speed`: largest speed on legs without
    one of their own, m/s. `scheduled`: time, s, and waypoints of a path that is set without a message; None for none. `period`:
    length of a step, s.

    Attributes:
        slow: A remark where the path is much slower than its legs were to be; empty where it is not.

    Raises:
        ParameterError: the scheduled path cannot be sailed.
    """

    def __init__(
        self, start: Motion, ship: Ship, speed: float, scheduled: tuple[float, Sequence[Waypoint]] | None, period: float
    ) -> None:
        self._ship, self._speed = ship, speed
        due = (round(scheduled[0] / period) * period, tuple(scheduled[1])) if scheduled else None
        self._planned = _scheduled(start, ship, speed, due)
        super().__init__(self._planned.table, self._planned.track, period)
        self.slow = self._planned.slow

    def reset(self) -> None:
        """Return to the start: a path that was set is discarded, the scheduled path begins again."""
        self.constants, self.track = TimetableConstants(self._planned.table, self.constants.period), self._planned.track
        self.slow = self._planned.slow
        super().reset()

    def set_path(self, points: Sequence[Point | Waypoint]) -> None:
        """Set a new path; its first leg begins with the present motion of the reference.

        `points`: waypoints, or their x, y, m. Raises GoalError if there are no waypoints, or the ship cannot sail along them.
        """
        self.take(self.planner(points, self.steps)())

    @property
    def steps(self) -> int:
        """Number of the present step; the last whole one, where the clock waits for the vessel."""
        return int(self.memory.steps)

    def planner(self, points: Sequence[Point | Waypoint], steps: int) -> Callable[[], Plan]:
        """What plans a path that begins at a present or coming step, with the motion then; it may run in another thread.

        `points`: waypoints, or their x, y, m. `steps`: number of the step. Raises GoalError if there are no waypoints; also by
        what it returns, if the ship cannot sail along them.
        """
        if not points:
            raise GoalError("a path must have at least one waypoint (got 0)")
        waypoints = [p if isinstance(p, Waypoint) else Waypoint(complex(*p), THROUGH, self._speed) for p in points]
        table, begin = self.constants.table, steps * self.constants.period

        def plan() -> Plan:
            try:
                return _extended(table, begin, waypoints, self._ship, self._speed)
            except ParameterError as error:
                raise GoalError(str(error)) from None

        return plan

    def take(self, plan: Plan) -> None:
        """Follow a plan that begins at the present step."""
        # A new memory, so that the motion is read anew.
        self.constants, self.memory = TimetableConstants(plan.table, self.constants.period), TimetableMemory(self.memory.steps)
        self.track, self.slow = replaced(self.track, self.steps * self.constants.period, plan.track), plan.slow


@lru_cache(maxsize=4)
def _scheduled(start: Motion, ship: Ship, speed: float, due: tuple[float, tuple[Waypoint, ...]] | None) -> Plan:
    """The plan at the start; a scenario is planned when it is checked, when it runs and when it is evaluated."""
    plan = plan_path([], start, Acceleration(0.0, 0.0, 0.0), ship, speed)
    if due is None:
        return plan
    after = _extended(plan.table, *due, ship, speed)
    before = plan.table.times < due[0]
    table = Timetable(*(np.concatenate((a[before], b)) for a, b in zip(plan.table, after.table, strict=True)))
    return Plan(table, replaced(plan.track, due[0], after.track), after.slow)


def _extended(table: Timetable, now: float, waypoints: Sequence[Waypoint], ship: Ship, speed: float) -> Plan:
    """A path that begins at a time with the motion of a table then."""
    plan = plan_path(waypoints, *motion_at(now, table), ship, speed)
    return Plan(later(plan.table, now), plan.track._replace(stretches=stretches_of(plan.track.stretches, now)), plan.slow)
