"""Legs and corners of a path without a stop: each corner as fast as its legs allow, and what is sailed from rest to rest.

Through a corner of the angle theta, the turn begins and ends at the same distance from the waypoint. Over the waypoint, the ship
turns only when it has passed it, by theta + eps, and back by eps, so that it is on the next leg again. A corner sharper than
SHARPEST cannot be cut through and is sailed over its waypoint.

A curve that is given by points is a polyline with many short legs. Taken by itself, each of its bends would have to begin and
end on half of a short leg, so slowly that the vessel nearly stops. Of the legs, those are kept with which the path takes least
time: two that follow each other are joined by the corner at their common point, or, where there are others between, by one turn
about the intersection of their lines, if it is nowhere further from the points than the tolerance.

| symbol | meaning | unit |
|---|---|---|
| V, a | intersection of two legs, distance from it at which the turn begins and ends | m |
| theta, R, c | angle of the turn, its radius, length of its transitions | rad, m, m |

The apex of the turn is R·(1/cos(theta/2) - 1) from V, as the nearest point of the polyline is, and a about R·tan(theta/2) + c/2.
"""

import cmath
import math
from collections.abc import Sequence
from contextlib import suppress
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import Motion, wrap
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack
from vessel_hsmc_ros.guidance.route import CONSTANT, FREE, Element, Pieces, Route, Section, Turning, displacement, straight, turn
from vessel_hsmc_ros.guidance.sailing import Sailing, sail, turning_at, turning_with
from vessel_hsmc_ros.guidance.timetable import Timetable, at_rest, blended
from vessel_hsmc_ros.guidance.waypoints import THROUGH, Part, Points, Ship, Waypoint, apart

SHARPEST = math.radians(120.0)
LEAST_ANGLE = 1e-9  # a corner with less is none, rad
LARGEST_EPS = 0.8 * math.pi
BISECTIONS = 50
RUN_UP = 0.25
"""Share of a leg from or to rest that corners leave free, for the change of speed. A corner that takes nearly all of a leg from
rest is sailed at the little speed that is reached before it: without this share, some routes take many times as long."""

SLOWER, RUNGS = 0.95, 80  # ratio of the speeds at which a corner is tried, and their number
SMALLER, RADII = 0.8, 12
"""Ratio of the radii of which the first that fits is named where a corner has no room, and their number."""

SHORTEST = 1e-9  # a leg between two corners that is shorter than this share of it is left out
Planned = tuple[list[Element], list[Section]]


class Corner(NamedTuple):
    """A corner: its pieces, and how far before and after the waypoint it begins and ends, m."""

    pieces: Pieces
    before: float
    after: float


def corner_of(kind: str, angle: float, radius: float, transition: float) -> Corner:
    """The corner at a waypoint.

    `kind`: THROUGH or OVER. `angle`: change of the course, rad, in (-pi, pi]. `radius`: smallest radius, m. `transition`:
    length of its transitions, m.
    """
    if abs(angle) < LEAST_ANGLE:
        return Corner((), 0.0, 0.0)
    if kind == THROUGH and abs(angle) <= SHARPEST:
        pieces = turn(angle, radius, transition)
        # By symmetry the chord has half the angle.
        reach = 0.5 * abs(displacement(pieces)) / math.cos(0.5 * angle)
        return Corner(pieces, reach, reach)
    return _over(angle, radius, transition)


def _over(angle: float, radius: float, transition: float) -> Corner:
    side, size = math.copysign(1.0, angle), abs(angle)

    def pieces(eps: float, to: float = 1.0) -> Pieces:
        return (*turn(to * (size + eps), radius, transition), *turn(-to * eps, radius, transition))

    def end(eps: float) -> complex:
        """Where it ends, in the frame of the next leg."""
        return displacement(pieces(eps)) * cmath.exp(-1j * size)

    low, high = 0.0, LARGEST_EPS
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        # On the outer side of the next leg at first, and the nearer the farther the ship turns.
        low, high = (middle, high) if end(middle).imag < 0.0 else (low, middle)
    return Corner(pieces(high, side), 0.0, end(high).real)


def fitted_turning(speed: float, ship: Ship) -> Turning:
    """The turn of the ship's corners at a speed, or slower where the ship needs it."""
    try:
        if ship.radius:
            return turning_with(ship.radius, speed, ship.vessel, ship.limits)
        return turning_at(speed, ship.vessel, ship.limits)
    except ParameterError as error:
        if not ship.radius:
            raise ParameterError(f"{ship.owner}: {error}; a stop at each waypoint or larger limits of turning would do") from None
        tightest = fitted_turning(speed, ship._replace(radius=0.0))
        remedy = f"{tightest.radius:.3g} m at {tightest.speed:.3g} m/s would do"
        raise ParameterError(f"{ship.owner}.corner_radius: {error}; {remedy}") from None


def polyline(start: complex, points: Part, ship: Ship, under_way: bool = False) -> Planned:
    """The legs and corners to the last waypoint.

    `start`: where the first leg begins, m. `under_way`: whether it does not begin at rest.
    """
    ways = [b - a for a, b in zip((start, *(p.position for p in points)), (p.position for p in points), strict=False)]
    lengths = [abs(way) for way in ways]
    free = list(lengths)
    free[-1] *= 1.0 - RUN_UP
    if not under_way:
        free[0] *= 1.0 - RUN_UP if len(free) > 1 else 1.0
    corners = _corners(points, ways, free, ship)
    elements, sections = [], []
    for i, (length, point) in enumerate(zip(lengths, points, strict=True)):
        left = length - (corners[i - 1][0].after if i else 0.0) - (corners[i][0].before if i < len(corners) else 0.0)
        if left > SHORTEST * length:
            elements.append(Element(straight(left), point.number - 1, turn=False))
            sections.append(Section(left, point.speed, FREE))
        if i < len(corners) and corners[i][0].pieces:
            elements.append(Element(corners[i][0].pieces, point.number - 1, turn=True))
            sections.append(Section(elements[-1].length, corners[i][1], CONSTANT))
    return elements, sections


class _Bend(NamedTuple):
    """What stands at a waypoint."""

    number: int  # of its waypoint
    kind: str  # THROUGH or OVER
    angle: float  # change of the course, rad
    speed: float  # of its legs, m/s
    turning: Turning | None  # as that of the waypoint

    def corner(self, ship: Ship, slower: float = 1.0) -> tuple[Corner, float]:
        """The corner, and its speed, at a share of the speed."""
        # A turn that is smaller and slower alike has the same yaw rate, and less yaw acceleration.
        turning = (
            Turning(*(slower * value for value in self.turning)) if self.turning else fitted_turning(slower * self.speed, ship)
        )
        return corner_of(self.kind, self.angle, turning.radius, turning.transition), turning.speed


def _corners(points: Part, ways: Sequence[complex], free: Sequence[float], ship: Ship) -> list[tuple[Corner, float]]:
    """The corners with their speeds."""
    bends = []
    for i, (before, after) in enumerate(pairwise(ways)):
        angle = wrap(cmath.phase(after) - cmath.phase(before))
        speed = min(points[i].speed, points[i + 1].speed)
        bends.append(_Bend(points[i].number, points[i].corner, angle, speed, points[i].turning))
    wanted = [bend.corner(ship)[0] for bend in bends]
    # A leg belongs to its corners half and half, or one has what the other leaves.
    room = [
        (
            max(0.5 * free[i], free[i] - wanted[i - 1].after) if i else free[i],
            max(0.5 * free[i + 1], free[i + 1] - (wanted[i + 1].before if i + 1 < len(wanted) else 0.0)),
        )
        for i in range(len(bends))
    ]
    return [_fitted(bend, before, after, ship) for bend, (before, after) in zip(bends, room, strict=True)]


def _fitted(bend: _Bend, before: float, after: float, ship: Ship) -> tuple[Corner, float]:
    """The fastest corner that needs at most so much of the legs before and after it, m."""

    def fits(rung: int) -> bool:
        corner, _ = bend.corner(ship, SLOWER**rung)
        return corner.before <= before and corner.after <= after

    if fits(0):
        return bend.corner(ship)
    low, high = 0, _rungs(bend.speed, ship.limits.current)
    if not fits(high):
        raise ParameterError(_unsailable(bend, before, after, ship, high))
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if fits(middle) else (middle, high)
    return bend.corner(ship, SLOWER**high)


def _rungs(speed: float, current: float) -> int:
    """How many steps slower than a speed a corner may be: not slower than the current."""
    if not current:
        return RUNGS
    return min(RUNGS, max(0, math.floor(math.log(current / speed) / math.log(SLOWER))))


def _unsailable(bend: _Bend, before: float, after: float, ship: Ship, rungs: int) -> str:
    slower = SLOWER**rungs
    corner, speed = bend.corner(ship, slower)
    needs, has = max((corner.before, before), (corner.after, after), key=lambda pair: pair[0] - pair[1])
    radius = _fitting_radius(bend, before, after, ship, slower) if ship.radius else None
    remedy = f"a corner_radius of {radius:g} m, " if radius else ""
    angle = f"{abs(math.degrees(bend.angle)):.0f}°"
    return (
        f"{ship.owner}: corner {bend.number} of {angle} needs {quantity(needs, 'm')} of a leg even at"
        f" {speed:.2g} m/s, and has {quantity(has, 'm')}; {remedy}longer legs or a stop there would do"
    )


def _fitting_radius(bend: _Bend, before: float, after: float, ship: Ship, slower: float) -> float | None:
    """The largest radius, by steps and rounded down to three digits, of a corner that the legs leave room for, m."""
    radius = ship.radius
    for _ in range(RADII):
        radius *= SMALLER
        with suppress(ParameterError):
            corner, _ = bend.corner(ship._replace(radius=radius), slower)
            if corner.before <= before and corner.after <= after:
                digits = 2 - math.floor(math.log10(radius))
                return math.floor(radius * 10.0**digits) / 10.0**digits
    return None


MOST_LEGS = 24  # legs between two that a corner joins, at most
SAMPLES = 25  # points of a corner at which its distance is computed
SHORTEST_TRANSITION = 0.05  # least length of the transitions of a wide turn, in terms of its radius
SLOWEST = 0.1  # least speed of a wide turn, in terms of that of its legs
STEEP = 1e-3  # sine of the angle between two lines below which they have no intersection


class _Leg(NamedTuple):
    """A leg."""

    points: Points  # those on it, from its beginning to its end, m
    # place, course: a point of the line through them, m, and its direction, rad
    place: complex
    course: float
    # speed, number: of the waypoint at its end
    speed: float
    number: int

    @property
    def length(self) -> float:
        return float(abs(self.points[-1] - self.points[0]))


class _Joint(NamedTuple):
    """How two legs are joined: the waypoint of the corner, and the time that it takes more than the way at full speed, s."""

    waypoint: Waypoint
    lost: float


def wide_corners(start: complex, part: Part, ship: Ship, tolerance: float) -> Part:
    """The waypoints with wide corners instead of those whose legs are too short.

    `start`: where the first leg begins, m. `tolerance`: how far a wide corner may be from the points, m.
    """
    legs = _legs(start, part)
    n = len(legs)
    tight = [_lost(part[i], legs[i], legs[i + 1], ship) for i in range(n - 1)]
    if not any(tight):
        return part
    # The least time from each leg to the last one, and the joint that begins it.
    least, chosen = [0.0] * n, [(n, _Joint(part[-1], 0.0))] * n
    for i in reversed(range(n - 1)):
        joints = [(i + 1, _Joint(part[i], tight[i])), *_wide(i, legs, part, tight, ship, tolerance)]
        j, joint = min(joints, key=lambda one: one[1].lost + least[one[0]])
        least[i], chosen[i] = joint.lost + least[j], (j, joint)
    points, i = [], 0
    while i < n:
        i, joint = chosen[i]
        points.append(joint.waypoint)
    return tuple(points)


def _legs(start: complex, points: Sequence[Waypoint]) -> list[_Leg]:
    legs, begin = [], start
    for point in points:
        places = np.array([begin, *point.passed, point.position])
        line, course = places[0], cmath.phase(places[-1] - places[0])
        if point.passed:
            # The line of least squares: along the principal axis of the points.
            line = complex(places.mean())
            axis = 0.5 * cmath.phase(np.sum((places - line) ** 2))
            course = axis if math.cos(axis - course) > 0.0 else axis + math.pi
        legs.append(_Leg(places, line, course, point.speed, point.number))
        begin = point.position
    return legs


def _lost(point: Waypoint, before: _Leg, after: _Leg, ship: Ship) -> float:
    """The time that a corner at a waypoint loses where half of its legs is too short for it, s."""
    speed = min(before.speed, after.speed)
    turning = fitted_turning(speed, ship)
    angle = wrap(cmath.phase(after.points[-1] - after.points[0]) - cmath.phase(before.points[-1] - before.points[0]))
    corner = corner_of(point.corner, angle, turning.radius, turning.transition)
    room = 0.5 * min(before.length / max(corner.before, 1e-9), after.length / max(corner.after, 1e-9))
    return _slowing(min(1.0, room), corner.before + corner.after, speed, ship)


def _slowing(share: float, way: float, speed: float, ship: Ship) -> float:
    """The time that is lost on a way at a share of the speed, with slowing down and speeding up, s."""
    rest = 1.0 - share
    return rest * way / (max(share, 1e-3) * speed) + rest * rest * speed / ship.limits.acceleration


def _wide(
    i: int, legs: Sequence[_Leg], points: Sequence[Waypoint], tight: Sequence[float], ship: Ship, tolerance: float
) -> list[tuple[int, _Joint]]:
    """The joints of a leg to the later ones that one corner can join to it."""
    found, bent = [], 0.0
    for j in range(i + 1, min(i + 2 + MOST_LEGS, len(legs))):
        if points[j - 1].corner != THROUGH or legs[j].speed != legs[i].speed:
            break
        bent += wrap(legs[j].course - legs[j - 1].course)
        if abs(bent) > SHARPEST:
            break
        joint = _joint(legs[i : j + 1], bent, ship, tolerance) if j > i + 1 and any(tight[i:j]) else None
        if joint:
            found.append((j, joint))
    return found


def _joint(legs: Sequence[_Leg], angle: float, ship: Ship, tolerance: float) -> _Joint | None:
    """One corner from the first to the last of some legs; None where it is too far from their points."""
    first, last = legs[0], legs[-1]
    sine = math.sin(last.course - first.course)
    if abs(sine) < STEEP or abs(angle) < LEAST_ANGLE:
        return None
    ahead, behind = cmath.exp(1j * first.course), cmath.exp(1j * last.course)
    along = ((last.place - first.place) * behind.conjugate()).imag / -sine
    V = first.place + along * ahead
    middles = [0.5 * (leg.points[0] + leg.points[-1]) for leg in (first, last)]
    room = min(((V - middles[0]) * ahead.conjugate()).real, ((middles[1] - V) * behind.conjugate()).real)
    points = np.concatenate([first.points[:1], *(leg.points[1:] for leg in legs)])
    apex = float(apart(np.array([V]), points)[0])
    own = _turning(first.speed, abs(angle), room, apex, ship) if room > 0.0 else None
    if own is None:
        return None
    corner = corner_of(THROUGH, angle, own.radius, own.transition)
    begin, end = V - corner.before * ahead, V + corner.after * behind
    route = Route([Element(corner.pieces, 0, turn=True)], (begin.real, begin.imag, first.course))
    curve = route.position(np.linspace(0.0, route.length, SAMPLES))
    among = ((points - begin) * ahead.conjugate()).real > 0.0
    among &= ((points - end) * behind.conjugate()).real < 0.0
    if max(apart(curve, points).max(), apart(points[among], curve).max(initial=0.0)) > tolerance:
        return None
    lost = _slowing(own.speed / first.speed, route.length, first.speed, ship)
    return _Joint(Waypoint(V, THROUGH, first.speed, turning=own, number=first.number), lost)


def _turning(speed: float, angle: float, room: float, apex: float, ship: Ship) -> Turning | None:
    """The widest turn with an apex at most at a distance from the intersection, and a room on both legs, m.

    At the share s of the speed, R·c >= s²·q keeps the yaw acceleration, with q that of the smallest turn.
    """
    smallest, tangent = fitted_turning(speed, ship), math.tan(0.5 * angle)
    q = smallest.radius * smallest.transition
    share = min(1.0, room / math.sqrt(2.0 * q * tangent))
    radius = (room + math.sqrt(max(0.0, room * room - 2.0 * q * share * share * tangent))) / (2.0 * tangent)
    radius = min(radius, apex / (1.0 / math.cos(0.5 * angle) - 1.0))
    share = min(share, radius / smallest.radius)
    if share < SLOWEST:
        return None
    return Turning(share * smallest.speed, radius, max(share * share * q / radius, SHORTEST_TRANSITION * radius))


DISTINCT = 2e-3  # waypoints nearer to each other than this are one, relative to the radius of gyration of the hull
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
