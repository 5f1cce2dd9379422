"""The life of goals that clients send as actions: accepted or refused, sailed, and ended by exactly one result with its reason.

Each input (a goal, a cancel, a tick, a state of the controller, a reset) returns what is to be done for it, in order: results for
clients, reports of progress, and orders for the reference. Nothing here knows time but by the ticks, or ROS.

At most one goal is sailed, and at most one more is waited for while its path is planned; a newer goal ends the older one. A goal
that is refused leaves the one that is sailed alone. A goal that ends in any other way than by being reached, or by a newer goal,
leaves the reference at rest: it is held where it can stop.

How far a vessel has come along waypoints: the leg that it is on, and the way that is left.

Leg k leads to waypoint k. It is completed where the vessel crosses the line that halves the corner at its end, within half of the
shorter of the two legs there, which is as much as a corner may cut. Of waypoints that are close together some may be passed by.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import RefusalError


class Code(IntEnum):
    """How a goal has ended: the `error_code` of its result."""

    REACHED = 0
    REFUSED = 10001
    CANCELLED = 10002
    PREEMPTED = 10003
    CONTROLLER = 10004
    RESET = 10005
    NOT_REACHED = 10006
    ENDED = 10007


class Order(Enum):
    """What the reference has to do."""

    SAIL = "sail"  # plan the way to a goal; `sailed` or `failed` answers
    HOLD = "hold"  # come to rest where it can stop, and stay
    GO_ON = "go on"  # after a hold
    STOP = "stop"  # the controller commands zero until it is rearmed
    RETURN = "return"  # to the home


END_ORDERS = {"hold": Order.HOLD, "stop": Order.STOP, "return": Order.RETURN}
END_TEXTS = {"hold": "the vessel comes to rest and keeps station", "stop": "the controller stops", "return": "the vessel returns"}
HOLDS = END_TEXTS["hold"]
HELD = "the vessel is held, until ~/hold is called with false"


class Goal(NamedTuple):
    """A goal. Two are the same where their keys are."""

    key: Any
    is_mission: bool = True  # whether the action at the end of a mission follows when it is reached


class Done(NamedTuple):
    """The result of a goal."""

    goal: Goal
    code: Code
    text: str


class Sail(NamedTuple):
    """The order to plan and sail the way to a goal."""

    goal: Goal


class Report(NamedTuple):
    """A report of progress is due for the goal that is sailed."""

    goal: Goal


Output = Done | Sail | Report | Order


class Limits(NamedTuple):
    """When a goal counts as reached, or as failed."""

    reach: float  # distance of the vessel from the end within which it has arrived, m
    patience: float  # time without coming nearer once the reference has arrived, s
    tolerance: float  # longest safe action of the controller, and longest time without odometry, s
    at_end: str = "hold"  # after a mission: hold, stop or return


class Sight(NamedTuple):
    """What a tick sees."""

    time: float  # of the reference, s
    distance: float | None  # of the vessel from the end of the goal, m; None where its odometry is missing or old
    arrived: bool  # whether the reference is at rest at the end


NEARER = 0.1  # share of the reach by which a vessel has to come nearer within the patience


@dataclass
class _Watch:
    """What was seen since a goal is sailed: since when something lasts, s, or None."""

    best: float = math.inf  # nearest distance since the reference has arrived, m
    since: float | None = None  # time of the nearest distance
    blind: float | None = None  # first time without odometry


class Tasks:
    """The goals of one vessel.

    Attributes:
        active: The goal that is sailed; None without one.
        candidate: The goal whose way is planned; None without one.
        held: Whether a person holds the reference.
        recoveries: How often the controller was in its safe action since the goal is sailed.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self.active: Goal | None = None
        self.candidate: Goal | None = None
        self.held = False
        self.recoveries = 0
        self._blocks: dict[str, str] = {}
        self._fault = ""  # why the controller does not command at all
        self._safe = ""  # reason of its safe action
        self._safe_since: float | None = None
        self._watch = _Watch()

    # -- goals ----------------------------------------------------------------------------------------------------------

    def offer(self, goal: Goal, refusal: str = "") -> list[Output]:
        """Take a new goal, unless it is refused: for the given reason, or because the vessel cannot sail now."""
        why = refusal or self.blocked or self._fault
        if not why and goal in (self.active, self.candidate):
            why = "it is the goal that is sailed"
        if why:
            return [Done(goal, Code.REFUSED, why)]
        before, self.candidate = self.candidate, goal
        return [*self._ended(before, Code.PREEMPTED, "a newer goal took its place"), Sail(goal)]

    @property
    def blocked(self) -> str:
        """Why no goal is taken at present, such as a low battery; empty if goals are taken."""
        return "; ".join([*self._blocks.values(), *([HELD] if self.held else [])])

    def sailed(self, goal: Goal) -> list[Output]:
        """The way to a goal is planned, and the reference takes it from now on."""
        if goal != self.candidate:
            return []
        before, self.active, self.candidate = self.active, goal, None
        self.recoveries, self._watch, self._safe_since = 0, _Watch(), None
        return self._ended(before, Code.PREEMPTED, "a newer goal took its place")

    def failed(self, goal: Goal, why: str) -> list[Output]:
        """There is no way to a goal; the present one goes on."""
        if goal != self.candidate:
            return []
        self.candidate = None
        return [Done(goal, Code.REFUSED, why)]

    def cancel(self, goal: Goal) -> list[Output]:
        """A client cancels a goal."""
        if goal == self.candidate:
            self.candidate = None
            return [Done(goal, Code.CANCELLED, "cancelled before its way was planned")]
        if goal != self.active or self.active is None:
            return []
        self.active = None
        return [Done(goal, Code.CANCELLED, f"cancelled: {HOLDS}"), Order.HOLD]

    def displaced(self, what: str) -> list[Output]:
        """A message of another program takes the place of all goals; `what` names it."""
        return self._end_all(Code.PREEMPTED, f"{what} took its place")

    # -- what happens meanwhile -----------------------------------------------------------------------------------------

    def tick(self, sight: Sight) -> list[Output]:
        """Judge the progress of the goal that is sailed."""
        if self.active is None:
            return []
        if why := self._lost(sight):
            return [*self._end_all(Code.CONTROLLER, f"{why}: {HOLDS}"), Order.HOLD]
        if self.held or sight.distance is None:
            return [Report(self.active)]
        return self._judged(self.active, sight, sight.distance)

    def _judged(self, goal: Goal, sight: Sight, distance: float) -> list[Output]:
        reach, watch = self._limits.reach, self._watch
        if not sight.arrived:
            watch.best, watch.since = math.inf, None
            return [Report(goal)]
        if distance <= reach:
            self.active = None
            text = f"reached: the vessel is {distance:.2f} m from the end, within {reach:.2f} m"
            return [Done(goal, Code.REACHED, text), *self._after(goal)]
        if watch.since is None or distance < watch.best - NEARER * reach:
            watch.best, watch.since = distance, sight.time
        if sight.time - watch.since <= self._limits.patience:
            return [Report(goal)]
        self.active = None
        late = f"within {self._limits.patience:g} s it has not come nearer than {watch.best:.2f} m"
        return [Done(goal, Code.NOT_REACHED, f"the reference has arrived, the vessel has not: {late}"), Order.HOLD]

    def _after(self, goal: Goal) -> list[Output]:
        """What follows a goal that was reached, unless a newer one is planned."""
        if self.candidate or not goal.is_mission or self._limits.at_end == "hold":
            return []
        return [END_ORDERS[self._limits.at_end]]

    def _lost(self, sight: Sight) -> str:
        """Why the goal cannot be sailed any more: a safe action or missing odometry that lasts too long."""
        tolerance = self._limits.tolerance
        if self._safe:
            self._safe_since = sight.time if self._safe_since is None else self._safe_since
            if sight.time - self._safe_since > tolerance:
                return f"controller in its safe action for more than {tolerance:g} s: {self._safe}"
        if sight.distance is not None:
            self._watch.blind = None
            return ""
        self._watch.blind = sight.time if self._watch.blind is None else self._watch.blind
        return f"no odometry for more than {tolerance:g} s" if sight.time - self._watch.blind > tolerance else ""

    def controller(self, fault: str, safe: str) -> list[Output]:
        """The state of the controller.

        `fault`: why it does not command, such as standby; empty if it does. `safe`: the reason of its safe action; empty
        without one.
        """
        self.recoveries += bool(safe) and not self._safe
        self._safe_since = self._safe_since if safe else None
        self._fault, self._safe = fault, safe
        if not fault or not (self.active or self.candidate):
            return []
        return [*self._end_all(Code.CONTROLLER, f"{fault}: {HOLDS}"), Order.HOLD]

    def block(self, name: str, why: str, action: str) -> list[Output]:
        """End all goals and take no more, because of a battery or an operator.

        `name`: what blocks, for `unblock`. `why`: the reason. `action`: hold, stop or return.
        """
        if name in self._blocks:
            self._blocks[name] = why
            return []
        self._blocks[name], self.held = why, False
        return [*self._end_all(Code.ENDED, f"{why}: {END_TEXTS[action]}"), END_ORDERS[action]]

    def unblock(self, name: str) -> None:
        """Take goals again."""
        self._blocks.pop(name, None)

    def reset(self, why: str) -> list[Output]:
        """The reference has returned to its start, or its node ends."""
        self.held = False
        return self._end_all(Code.RESET, why)

    def hold(self) -> list[Output]:
        """Hold the reference until `go_on`; the goal remains."""
        self.held = True
        return [Order.HOLD]

    def go_on(self) -> list[Output]:
        """Go on after a hold. Raises RefusalError if nothing is held."""
        if not self.held:
            raise RefusalError("nothing is held")
        self.held, self._watch = False, _Watch()
        return [Order.GO_ON]

    def _ended(self, goal: Goal | None, code: Code, text: str) -> list[Output]:
        return [Done(goal, code, text)] if goal is not None else []

    def _end_all(self, code: Code, text: str) -> list[Output]:
        found = self._ended(self.active, code, text) + self._ended(self.candidate, code, text)
        self.active = self.candidate = None
        return found


BACK = 0.5  # length of the sum of two directions below which the second leads back along the first
CUT = 0.5  # share of the shorter leg within which a vessel passes a waypoint
WINDOW = 4.0  # way beyond the present waypoint within which later ones may be passed by, in terms of `room`


class Progress:
    """The way along waypoints.

    `start`: where leg 1 begins, m. `points`: the waypoints, at least one, m. `room`: distance within which a waypoint counts as
    passed however short its legs are, m.

    Attributes:
        leg: Number of the present leg, from 1 on.
    """

    def __init__(self, start: complex, points: Sequence[complex], room: float) -> None:
        line = np.array([start, *points])
        self._points, self._room, self.leg = line, room, 1
        lengths = np.abs(np.diff(line))
        # A leg without a length has the direction 0: a vessel that is near has passed it.
        directions = np.diff(line) / np.where(lengths > 0.0, lengths, 1.0)
        across = directions[:-1] + directions[1:]
        self._across = np.where(np.abs(across) > BACK, across, directions[:-1])
        self._rooms = np.maximum(room, CUT * np.minimum(lengths[:-1], lengths[1:]))
        self._left = np.concatenate((np.cumsum(lengths[::-1])[::-1], [0.0]))  # way from each point to the end

    @property
    def legs(self) -> int:
        """Number of legs."""
        return len(self._points) - 1

    def advance(self, position: complex) -> None:
        """Note where the vessel is, m."""
        while self.leg < self.legs:
            k = self.leg
            last = int(np.searchsorted(-self._left, WINDOW * self._room - self._left[k], side="right"))
            near = slice(k, max(k + 1, min(last, self.legs)))
            d = position - self._points[near]
            crossed = (d * np.conj(self._across[k - 1 : near.stop - 1])).real >= 0.0
            passed = np.flatnonzero(crossed & (np.abs(d) <= self._rooms[k - 1 : near.stop - 1]))
            if not len(passed):
                return
            self.leg = k + int(passed[-1]) + 1

    def distance_left(self, position: complex) -> float:
        """The way from a position to the end: to the waypoint of the present leg, and along the legs after it, m."""
        return float(abs(self._points[self.leg] - position) + self._left[self.leg])

    def distance_to_end(self, position: complex) -> float:
        """The distance of a position from the end, m."""
        return float(abs(self._points[-1] - position))
