"""Paths that are planned in a thread of their own, while the reference goes on."""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any

from vessel_hsmc_ros.guidance.polyline import Waypoint
from vessel_hsmc_ros.guidance.scheduled import Point

FIRST_LEAD, LONGER = 0.5, 2.0
"""Time from the beginning of the planning to that of the path, s, and its factor after each plan that came too late."""


class PathPlanning:
    """Plans a path that begins at a coming step of the reference, at a later one if the plan comes too late.

    `reference`: a `PathReference`; one of another mode takes no path. `period`: of the reference, s.
    """

    def __init__(self, reference: Any, period: float) -> None:
        self._reference, self._lead = reference, FIRST_LEAD / period
        self._plan: Future[Any] | None = None
        self._points: Sequence[Point | Waypoint] = ()
        self._begin = 0

    @property
    def busy(self) -> bool:
        """Whether a path is planned or waits for its beginning."""
        return self._plan is not None

    @property
    def found(self) -> bool:
        """Whether there is a plan, which waits for its beginning."""
        plan = self._plan
        return plan is not None and plan.done() and plan.exception() is None

    @property
    def due(self) -> bool:
        """Whether a plan, or the reason why there is none, is to be taken now."""
        plan = self._plan
        return plan is not None and plan.done() and (self._begin <= self._reference.steps or plan.exception() is not None)

    def start(self, points: Sequence[Point | Waypoint]) -> None:
        """Plan a path along waypoints, in place of the one that is planned."""
        self._points, self._begin = points, self._reference.steps + max(1, round(self._lead))
        plan: Future[Any] = Future()
        self._plan = plan
        work = self._reference.planner(points, self._begin)
        # A daemon: the node does not wait for a plan when it ends.
        threading.Thread(target=_fulfil, args=(plan, work), name="path planning", daemon=True).start()

    def cancel(self) -> None:
        """Discard the path that is planned."""
        self._plan = None

    def take(self) -> Sequence[Any]:
        """Let the reference follow the plan that is due.

        Returns the waypoints; none where the plan came too late and is made again. Raises GoalError if the path cannot be
        sailed.
        """
        plan, self._plan = self._plan, None
        assert plan is not None  # noqa: S101 - due
        found = plan.result()
        if self._begin < self._reference.steps:
            self._lead *= LONGER
            self.start(self._points)
            return ()
        self._reference.take(found)
        return self._points


def _fulfil(plan: Future[Any], work: Callable[[], Any]) -> None:
    try:
        plan.set_result(work())
    except BaseException as error:
        plan.set_exception(error)
