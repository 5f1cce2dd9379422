"""Paths: waypoints joined by legs and corners that the hull can sail, from the present motion to rest at the last waypoint.

A stop divides a path into parts that begin at rest, with a turn on the spot towards the next waypoint. Each part is a route: its
legs, and corners with the smallest radius at the speed of the legs, or slower where the legs are too short for that. The
reference is a timetable from the present motion on, planned anew with each path.

Under way, a path begins with the present course and curvature: the curvature decays, and one turn points at the first waypoint.
"""

import cmath
import math
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np

from vessel_hsmc_ros.core.exceptions import GoalError, ParameterError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, wrap
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.guidance.corners import (
    DISTINCT,
    LEAST_ANGLE,
    PathPiece,
    Plan,
    Planned,
    fitted_turning,
    from_rest,
    polyline,
    rest_of,
    wide_corners,
)
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack, Stretch, TimetableReference, replaced, stretch, stretches_of
from vessel_hsmc_ros.guidance.route import (
    CONSTANT,
    FREE,
    Element,
    Piece,
    Pieces,
    Route,
    Section,
    TravelLimits,
    Turning,
    changes_of,
    displacement,
    turn,
)
from vessel_hsmc_ros.guidance.sailing import check_straight, halt, largest_acceleration, sail, spot_turn
from vessel_hsmc_ros.guidance.timetable import (
    Timetable,
    TimetableConstants,
    TimetableMemory,
    at_rest,
    blended,
    joined,
    motion_at,
    world_rows,
)
from vessel_hsmc_ros.guidance.waypoints import STOP, THROUGH, Part, Point, Scale, Ship, Waypoint, ahead, thinned

SLOW = 0.5  # share of the required speed below which the mean speed of a path is named
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

BISECTIONS, SCANNED = 50, 96  # bisections of an angle, and angles that are tried in a full turn to one side
FAR = 1e9  # distance of a point that has the same bearing from wherever a vessel turns on the spot, m


def join(target: complex, curvature: float, decay: float, radius: float, transition: float, run: float) -> tuple[Pieces, Pieces]:
    """The shortest turn from the present course, along which the position is 0 and the course 0, to a point.

    `target`: the point, m. `curvature`: present curvature, 1/m. `decay`: length in which it decays, m. `radius`, `transition`:
    smallest radius of the turn and length of its transitions, m. `run`: way between the two, m. Returns the decay of the
    curvature with the way after it, and the turn; without a way to the point, the turn leads past it.
    """
    first = tuple(piece for piece in (Piece(decay, curvature, 0.0), Piece(run, 0.0, 0.0)) if piece.length > 0.0)

    def left(angle: float) -> complex:
        """The way from the end of the turn to the point, in the frame of the course there."""
        pieces = (*first, *turn(angle, radius, transition))
        course = sum(0.5 * piece.length * (piece.begin + piece.end) for piece in pieces)
        return (target - displacement(pieces)) * cmath.exp(-1j * course)

    found = []
    for side in (1.0, -1.0):
        angles = side * np.linspace(0.0, 2.0 * math.pi, SCANNED + 1)
        ways = [left(float(angle)) for angle in angles]
        for i in range(SCANNED):
            before, after = ways[i], ways[i + 1]
            if before.imag * after.imag <= 0.0 and before.real > 0.0 and after.real > 0.0:
                angle = _zero(left, float(angles[i]), float(angles[i + 1]), before.imag > 0.0)
                found.append((abs(angle) * radius + left(angle).real, angle))
    angle = min(found)[1] if found else wrap(cmath.phase(left(0.0)))
    return first, turn(angle if abs(angle) > LEAST_ANGLE else 0.0, radius, transition)


def _zero(left: Callable[[float], complex], low: float, high: float, positive: bool) -> float:
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (left(middle).imag > 0.0) == positive else (low, middle)
    return 0.5 * (low + high)


def begun(before: Pieces, bend: Pieces, speed: float, turning: Turning) -> Planned:
    """The beginning under way, as `join` makes it: at the present speed, then at that of the turn.

    `before`: decay of the curvature, and the way on which the speed changes. `speed`: present speed, m/s.
    """
    elements, sections = [Element(before[:1], 0, turn=True)], [Section(before[0].length, speed, CONSTANT)]
    if before[1:]:
        elements.append(Element(before[1:], 0, turn=False))
        sections.append(Section(before[1].length, max(speed, turning.speed), FREE))
    if bend:
        elements.append(Element(bend, 0, turn=True))
        sections.append(Section(elements[-1].length, turning.speed, CONSTANT))
    return elements, sections


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
