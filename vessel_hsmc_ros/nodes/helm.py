"""What sails the reference for messages and actions: ways that are planned or set at once, hold, and the way home.

Paths are planned in a thread of their own, while the reference goes on.
"""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import suppress
from importlib import import_module
from typing import Any

import numpy as np

from vessel_hsmc_ros.core.exceptions import GoalError, RefusalError
from vessel_hsmc_ros.core.fence import fence_of, leaving
from vessel_hsmc_ros.guidance.waypoints import NONE, THROUGH, Point, Waypoint
from vessel_hsmc_ros.nodes.action_messages import Way

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


Refused = Callable[[str], None]


def _unanswered(_why: str) -> None:
    """Of a refusal that no client waits for: the log and the diagnostics have it."""


class Helm:
    """The helm of a reference ship.

    `node`: the node. `ship`: its reference. `period`: of the reference, s.

    Attributes:
        planning: Of paths, in real time.
    """

    def __init__(self, node: Any, ship: Any, period: float) -> None:
        self._node, self._ship, self._p = node, ship, node.parameters
        self.planning = PathPlanning(ship, period)
        if self._p.mode == "path" and self._p.lockstep:
            with suppress(ImportError):  # the first plan names what is missing
                import_module("scipy.integrate")  # takes a second, for which the plant would wait at the first path
        self._taken: Callable[[Sequence[Any]], None] = lambda _points: None
        self._refused: Refused = _unanswered
        self._fence = fence_of(self._p.fence, "reference_ship.fence")
        self._interrupted: Any = None  # what a hold interrupts: the goal, or that it is a path; None for nothing

    def advance(self) -> None:
        """Take the path that is planned, once it is due; the reference has advanced."""
        if self.planning.found and not self._node.actions.tasks.held:
            self._ship.held = False  # also after a cancel: the reference stands until there is a new way
        if self.planning.due:
            self._node.take(self._take_plan, self._refused)

    def _take_plan(self) -> None:
        points = self.planning.take()
        if points:
            self._taken(points)

    def plan(self, points: Sequence[Any], taken: Callable[[Sequence[Any]], None], refused: Refused = _unanswered) -> None:
        """Plan a path in a thread; calls `taken` when the reference begins it, or `refused` if it cannot be sailed."""
        self.planning.start(points)
        self._taken, self._refused = taken, refused

    def set_path(self, points: Sequence[Any]) -> None:
        """Begin a path at once."""
        self._ship.set_path(points)
        self._ship.held = False

    def require_free(self, points: Sequence[Point]) -> None:
        """Refuse goals and paths of other programs like those of actions.

        Raises GoalError while none is taken, or with the leg and the distance of one that leaves the fence.
        """
        if why := self._node.actions.tasks.blocked:
            raise GoalError(why)
        self._require_within(points)

    def _require_within(self, points: Sequence[Point]) -> None:
        way = np.array([complex(*p[:2]) for p in (self._node.here, *points)])
        if self._fence and (problem := leaving(self._fence, way, range(1, len(way)))):
            raise GoalError(f"{self._p.mode} must stay within reference_ship.fence (got one whose {problem})")

    def sail(self, way: Way, taken: Callable[[], None], refused: Refused = _unanswered) -> None:
        """Sail a way; calls `taken` when the reference begins to, or `refused` with the reason if it cannot."""

        def begin(_points: Sequence[Any]) -> None:
            self._node.begin_way(way.frame)
            taken()

        points = [Waypoint(complex(*point), THROUGH, self._p.motion.speed) for point in way.points]
        points[-1] = points[-1]._replace(heading=way.heading)

        def work() -> None:
            self._require_within(way.points)
            if self._p.mode == "goal":
                self._ship.go_to(*way.points[0], way.heading)
                begin(way.points)
            elif self._p.lockstep:
                self.set_path(points)
                begin(points)
            else:
                self._node.forget_path()
                self.plan(points, begin, refused)

        self._node.take(work, refused)

    def sail_home(self, home: Sequence[float], frame: str) -> None:
        """Return to a place x, y, m, or to the initial pose where none is given."""
        (x, y), heading = self._p.initial_pose[:2] if home == NONE else home, self._p.initial_pose[2]
        way = Way([(float(x), float(y))], frame, float(heading) if self._p.mode == "goal" else None)
        self.sail(way, lambda: self._node.reporter.event("goal", f"home, x = {x:g}, y = {y:g}"))

    def hold(self) -> None:
        """Let the reference come to rest where it can, and stay there."""
        self._interrupted = None
        if not self._node.actions.tasks.candidate:
            self.reset()  # the path of a message that is being planned would end the hold
        if self._p.mode == "goal":
            self._ship.halt()
        elif self._can_hold:
            self._ship.held = True

    @property
    def _can_hold(self) -> bool:
        return self._p.mode not in ("virtual_ship", "course")

    def go_on(self) -> None:
        """Sail the way on that a hold has interrupted, unless it has been cancelled meanwhile."""
        if self._interrupted is None:
            return
        if self._p.mode == "goal":
            self._ship.go_to(*self._interrupted[:3])
        else:
            self._ship.held = False

    def hold_or_go_on(self, hold: bool) -> str:
        """Serve a person; returns what is done. Raises RefusalError if the reference cannot be held, or is not."""
        actions = self._node.actions
        if not self._can_hold:
            raise RefusalError(f"reference_ship.mode must be one that can be held (got {self._p.mode})")
        if not hold:
            actions.apply(actions.tasks.go_on())
            return "the reference goes on"
        if not actions.tasks.held:
            interrupted = self._ship.target() if self._p.mode == "goal" else None if self._ship.held else ()
            actions.apply(actions.tasks.hold())
            self._interrupted = interrupted
        return "the reference comes to rest, and the vessel keeps station there"

    def reset(self) -> None:
        """Forget the paths that are planned or wait for it."""
        self.planning.cancel()
        self._node.forget_path()

    @property
    def arrived(self) -> bool:
        """Whether the reference is at rest at the end of its goal or path."""
        return bool(self._ship.arrived if self._p.mode == "goal" else self._ship.time_left == 0.0)

    @property
    def time_left(self) -> float:
        """How long the reference takes about to the end of its goal or path, s."""
        return float(self._ship.time_left)
