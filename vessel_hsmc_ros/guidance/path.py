"""Paths: waypoints joined by legs and corners that the hull can sail, from the present motion to rest at the last waypoint.

A stop divides a path into parts that begin at rest, with a turn on the spot towards the next waypoint. Each part is a route: its
legs, and corners with the smallest radius at the speed of the legs, or slower where the legs are too short for that. The
reference is a timetable from the present motion on, planned anew with each path.
"""

import cmath
import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import GoalError, ParameterError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, wrap
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.guidance.dense_paths import Scale, ahead, thinned, wide_corners
from vessel_hsmc_ros.guidance.planned_track import (
    PlannedTrack,
    Stretch,
    Timetable,
    TimetableConstants,
    TimetableMemory,
    TimetableReference,
    at_rest,
    blended,
    joined,
    motion_at,
    replaced,
    stretch,
    stretches_of,
    world_rows,
)
from vessel_hsmc_ros.guidance.route import FREE, Element, Route, Section, changes_of, straight
from vessel_hsmc_ros.guidance.sailing import Sailing, TravelLimits, check_straight, halt, largest_acceleration, sail, spot_turn
from vessel_hsmc_ros.guidance.waypoints import (
    STOP,
    THROUGH,
    Part,
    Planned,
    Point,
    Ship,
    Waypoint,
    begun,
    fitted_turning,
    join,
    polyline,
)

SLOW = 0.5  # share of the required speed below which the mean speed of a path is named
DISTINCT = 2e-3  # waypoints nearer to each other than this are one, relative to the radius of gyration of the hull
TOLERANCE, REACH = 0.4, 4.0
"""How far points that are left out may be from the way, and how far off a leg a ship may be to be on it, relative to the radius
of gyration, a quarter of the length of most hulls."""

TURN_WAY = 2.5
"""Way in which a ship under way turns to a point and its drift decays, in radii of the turn of the largest yaw rate."""

NEAR = 2.0  # distance within which a ship passes a point of a leg, in radii of gyration: half of the length of most hulls
AT_REST = 1e-3  # shares of speed and largest yaw rate below which the ship counts as at rest where a path begins
SPEED_GAIN, SHORTEST = 0.07, 0.01
"""Speed that an acceleration brings while it decays in a time, relative to their product; and the least share of that of a
transition in which it decays."""

JOIN_SPEEDS = (1.0, 0.6, 0.35, 0.2)
"""Speeds of the turn with which a path begins under way, relative to that of the path, in the order of preference."""

FAR = 1e9  # distance of a point that has the same bearing from wherever a vessel turns on the spot, m
SET_OFF, SET_OFF_SHARE = 0.3, 0.1
"""Speed of the beginning after a turn on the spot, in terms of the radius of gyration and the yaw acceleration, and largest share
of the leg that it takes."""


class Plan(NamedTuple):
    """A path as a motion over time and its geometry, both from the time 0 on; and a remark where it is much slower."""

    table: Timetable
    track: PlannedTrack
    slow: str = ""


class PathPiece(NamedTuple):
    """A part of a plan: its motion, and the sailing that it is; None for a halt or a turn on the spot."""

    table: Timetable
    sailing: Sailing | None = None


def plan_path(waypoints: Sequence[Waypoint], motion: Motion, acceleration: Acceleration, ship: Ship, speed: float) -> Plan:
    """The motion along a path, and its geometry.

    `waypoints`: the waypoints in their order; without one the ship comes to rest. `speed`: its usual speed, m/s.
    """
    waypoints = [point._replace(number=k) for k, point in enumerate(waypoints, 1)]
    speeds = {point.speed for point in waypoints}
    for one in sorted(speeds):
        check_straight(f"{ship.owner}: speed", one, ship.vessel, ship.limits)
    fastest = max(speeds, default=speed)
    slow = _resting(motion, AT_REST, fastest, ship.limits)
    points = _needed(waypoints, motion, slow, fastest, ship)
    # A ship under way returns to a path of no waypoint but where it is.
    parts = _parts(points if points or slow else waypoints[-1:])
    pieces: list[PathPiece] = []
    required = _required_time(complex(motion.x, motion.y), points, ship.limits.acceleration)
    row, resting = world_rows(motion, acceleration), slow if parts else _resting(motion, 0.0, fastest, ship.limits)
    if not resting:
        pieces += _under_way(parts, motion, acceleration, fastest, ship)
    elif waypoints and abs(waypoints[0].position - complex(motion.x, motion.y)) <= DISTINCT * ship.gyration:
        pieces += _rest(waypoints[0], motion, ship)
    for given in parts:
        pieces += _from_stop(given, rest_of(pieces[-1].table) if pieces else motion, ship)
    if pieces and resting:
        pieces[0] = _settling(pieces[0], row, ship.limits)
    track = PlannedTrack(_stretches(pieces), tuple(point.position for point in waypoints), NEAR * ship.gyration)
    table = joined([piece.table for piece in pieces]) if pieces else at_rest(motion, 0.0)
    return Plan(table, track, _slow(required, sum(float(piece.table.times[-1]) for piece in pieces if piece.sailing)))


def _from_stop(given: Part, motion: Motion, ship: Ship) -> list[PathPiece]:
    """A part from rest to rest: the turn on the spot towards it, its legs, and what the vessel does at its end."""
    part = _wide(complex(motion.x, motion.y), given, ship)
    turned = spot_turn((motion.x, motion.y, motion.psi), part[0].position, ship.vessel, ship.limits)
    before = rest_of(turned) if turned is not None else motion
    start = complex(before.x, before.y)
    legs = from_rest(polyline(start, part, ship), cmath.phase(part[0].position - start), before, ship, turned)
    found = [PathPiece(turned), legs] if turned is not None else [legs]
    return found + _rest(given[-1], rest_of(legs.table), ship)


def _rest(point: Waypoint, motion: Motion, ship: Ship) -> list[PathPiece]:
    """What a vessel at rest does at a waypoint: it turns to the heading there on the spot, and holds."""
    pieces = []
    if point.heading is not None:
        towards = complex(motion.x, motion.y) + FAR * cmath.exp(1j * point.heading)
        turned = spot_turn((motion.x, motion.y, motion.psi), towards, ship.vessel, ship.limits)
        if turned is not None:
            pieces.append(PathPiece(turned))
            motion = rest_of(turned)
    if point.hold:
        settled = min(point.hold, ship.limits.yaw_rate / ship.limits.yaw_acceleration)
        pieces.append(PathPiece(at_rest(motion, *np.unique([0.0, settled, point.hold]))))
    return pieces


def _required_time(start: complex, points: Sequence[Waypoint], acceleration: float) -> float:
    """The time of the legs at their speeds, with speeding up and slowing down at the ends and at each stop, s."""
    ways = np.abs(np.diff([start, *(point.position for point in points)]))
    stops = sum(point.corner == STOP for point in points)
    change = 2.0 * max((point.speed for point in points), default=0.0) / acceleration
    return sum(float(way) / point.speed for way, point in zip(ways, points, strict=True)) + (1.0 + stops) * change


def _slow(required: float, time: float) -> str:
    """A remark on a path that takes a time, s, where another one was required."""
    if required >= SLOW * time:
        return ""
    share = quantity(100.0 * required / time, "%")
    corners = "its corners are too sharp or too close together"
    return f"the path takes {quantity(time, 's')}, at {share} of the speed of its legs on average: {corners}"


def _resting(motion: Motion, share: float, fastest: float, limits: TravelLimits) -> bool:
    """Whether a ship is slower than a share of its speed and of its largest yaw rate."""
    return math.hypot(motion.u, motion.v) <= share * fastest and abs(motion.r) <= share * limits.yaw_rate


def _settling(piece: PathPiece, row: Array, limits: TravelLimits) -> PathPiece:
    """The first piece of a ship that counts as at rest: what is left of the motion before it decays."""
    decay = min(float(piece.table.times[-1]), limits.yaw_rate / limits.yaw_acceleration)
    return piece._replace(table=blended(piece.table, row, decay))


def _stretches(pieces: Sequence[PathPiece]) -> tuple[Stretch, ...]:
    ends = np.cumsum([float(piece.table.times[-1]) for piece in pieces])
    return tuple(
        stretch(piece.sailing.route, piece.sailing.profile, float(end - piece.table.times[-1]))
        for piece, end in zip(pieces, ends, strict=True)
        if piece.sailing
    )


def _needed(waypoints: Sequence[Waypoint], motion: Motion, slow: bool, fastest: float, ship: Ship) -> list[Waypoint]:
    """The waypoints that a ship, at rest or under way, has to go to."""
    gyration, here = ship.gyration, complex(motion.x, motion.y)
    course, turn = motion.psi, 0.0
    if not slow:
        course, turn = motion.psi + math.atan2(motion.v, motion.u), TURN_WAY * fastest / ship.limits.yaw_rate
    left = ahead(
        _distinct(here, waypoints, DISTINCT * gyration), here, course, Scale(TOLERANCE * gyration, REACH * gyration, turn)
    )
    return thinned(here, left, TOLERANCE * gyration)


def _wide(start: complex, part: Part, ship: Ship) -> Part:
    return wide_corners(start, part, ship, TOLERANCE * ship.gyration)


def _distinct(here: complex, waypoints: Sequence[Waypoint], least: float) -> list[Waypoint]:
    """The waypoints at least a distance apart, m: repetitions would give legs without a direction."""
    found: list[Waypoint] = []
    for point in waypoints:
        last = found[-1].position if found else here
        if abs(point.position - last) > least:
            found.append(point)
        elif found and point.corner == STOP:
            found[-1] = found[-1]._replace(corner=STOP)
            heading = found[-1].heading if point.heading is None else point.heading
            found[-1] = found[-1]._replace(hold=found[-1].hold + point.hold, heading=heading)
    return found


def _parts(points: Sequence[Waypoint]) -> list[Part]:
    """The parts between stops."""
    parts, begin = [], 0
    for i, point in enumerate(points, 1):
        if point.corner == STOP or i == len(points):
            parts.append(tuple(points[begin:i]))
            begin = i
    return parts


def rest_of(table: Timetable) -> Motion:
    """The state at rest at the end of a table."""
    x, y, psi = map(float, table.rows[-1, :3])
    return Motion(x, y, psi, 0.0, 0.0, 0.0)


def from_rest(legs: Planned, course: float, motion: Motion, ship: Ship, turned: Timetable | None) -> PathPiece:
    """Legs and corners sailed from rest to rest.

    `course`: of the first leg, rad. `motion`: at rest where it begins. `turned`: the turn on the spot before it, if there is one.
    """
    elements, sections = legs
    if turned is not None:
        elements, sections = _set_off(elements, sections, float(turned.times[-1]), ship)
    # Not wrapped, so that the heading is continuous.
    course = motion.psi + wrap(course - motion.psi)
    route = Route(elements, (motion.x, motion.y, course))
    sailing = sail(ship.owner, route, sections, ship.vessel, ship.limits)
    # The heading at rest differs from the course of the leg by rounding, or by what is left of a drift angle.
    row = at_rest(motion, 0.0).rows[0]
    return PathPiece(blended(sailing.table, row, float(sailing.table.times[-1]) / len(elements)), sailing)


def _set_off(elements: list[Element], sections: list[Section], duration: float, ship: Ship) -> Planned:
    """The first leg with a slow beginning, in which a ship that has not kept its heading at rest turns to the leg."""
    length, speed = elements[0].length, SET_OFF * ship.gyration * math.sqrt(ship.limits.yaw_acceleration)
    way = min(speed * duration, SET_OFF_SHARE * length)
    if elements[0].turn or speed >= sections[0].speed:
        return elements, sections
    slow, rest = (elements[0]._replace(pieces=straight(part)) for part in (way, length - way))
    return [slow, rest, *elements[1:]], [Section(way, speed, FREE), sections[0]._replace(length=length - way), *sections[1:]]


def _under_way(parts: list[Part], motion: Motion, acceleration: Acceleration, fastest: float, ship: Ship) -> list[PathPiece]:
    """The first part from a motion; a halt where there is none, or where it is too short to slow down for its corners."""
    ahead = motion.u > abs(motion.v)
    for share in JOIN_SPEEDS if parts and ahead else ():
        try:
            piece = _joining(parts[0], motion, acceleration, share * fastest, ship)
        except ParameterError:
            continue
        return [piece, *_rest(parts.pop(0)[-1], rest_of(piece.table), ship)]
    return [PathPiece(halt(motion, world_rows(motion, acceleration), ship.vessel, ship.limits))]


def _joining(part: Part, motion: Motion, acceleration: Acceleration, speed: float, ship: Ship) -> PathPiece:
    """From a motion: its curvature decays, the speed becomes one to turn with, and the ship turns to the first waypoint."""
    row = world_rows(motion, acceleration)
    velocity, change = complex(row[3], row[4]), complex(row[6], row[7])
    W, start = abs(velocity), complex(motion.x, motion.y)
    beta = wrap(cmath.phase(velocity) - motion.psi)
    course = motion.psi + beta
    turning = fitted_turning(speed, ship)
    fastest = max(W, *(point.speed for point in part))
    run = changes_of(largest_acceleration(fastest, ship.vessel, ship.limits), fastest).way(W, turning.speed)
    kappa = (velocity.conjugate() * change).imag / W**3
    target = (part[0].position - start) * cmath.exp(-1j * course)
    # In the time of a transition, also where the ship is slow.
    decay = turning.transition * min(1.0, W / turning.speed)
    before, bend = join(target, kappa, decay, turning.radius, turning.transition, run)
    elements, sections = begun(before, bend, W, turning)
    begin = Route(elements, (motion.x, motion.y, course))
    start = complex(begin.position(begin.length))
    more, rest = polyline(start, _wide(start, part, ship), ship, under_way=True)
    route = Route([*elements, *more], (motion.x, motion.y, course))
    sailing = sail(ship.owner, route, [*sections, *rest], ship.vessel, ship.limits, (W, beta))
    decays, gain = turning.transition / turning.speed, SPEED_GAIN * (velocity.conjugate() * change).real / W
    if gain * decays > fastest - W:
        decays = max(SHORTEST * decays, (fastest - W) / gain)
    return PathPiece(blended(sailing.table, row, decays), sailing)


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

        `points`: waypoints, or their x, y, m. `steps`: number of the step.
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
    table = plan.table._replace(times=plan.table.times + now)
    return Plan(table, plan.track._replace(stretches=stretches_of(plan.track.stretches, now)), plan.slow)
