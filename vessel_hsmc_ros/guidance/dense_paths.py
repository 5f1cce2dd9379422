"""Waypoints of planners and track logs: those that are needed, and wide corners where there are many short legs.

A planner gives a point every few centimetres, and the first behind the vessel. Of waypoints with one speed, between stops, those
remain from the legs of which the others are at most a tolerance off [1].

A curve that is given by points is a polyline with many short legs. Taken by itself, each of its bends would have to begin and
end on half of a short leg, so slowly that the vessel nearly stops. Of the legs, those are kept with which the path takes least
time: two that follow each other are joined by the corner at their common point, or, where there are others between, by one turn
about the intersection of their lines, if it is nowhere further from the points than the tolerance.

| symbol | meaning | unit |
|---|---|---|
| V, a | intersection of two legs, distance from it at which the turn begins and ends | m |
| theta, R, c | angle of the turn, its radius, length of its transitions | rad, m, m |

The apex of the turn is R·(1/cos(theta/2) - 1) from V, as the nearest point of the polyline is, and a about R·tan(theta/2) + c/2.

[1] Douglas, D. H.; Peucker, T. K.: Algorithms for the reduction of the number of points required to represent a digitized line or
its caricature. Cartographica 10(2), 1973, pp. 112-122.
"""

import cmath
import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.fence import from_ways
from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.guidance.route import Element, Route
from vessel_hsmc_ros.guidance.sailing import Turning
from vessel_hsmc_ros.guidance.waypoints import LEAST_ANGLE, SHARPEST, THROUGH, Part, Ship, Waypoint, corner_of, fitted_turning

Points = NDArray[np.complex128]

ALONG = math.cos(math.radians(60.0))
"""Cosine of the largest angle between the course of a vessel that is on a leg and that of the leg."""

MOST_LEGS = 24  # legs between two that a corner joins, at most
SAMPLES = 25  # points of a corner at which its distance is computed
SHORTEST = 0.05  # least length of the transitions of a wide turn, in terms of its radius
SLOWEST = 0.1  # least speed of a wide turn, in terms of that of its legs
STEEP = 1e-3  # sine of the angle between two lines below which they have no intersection


class Scale(NamedTuple):
    """Lengths of a vessel, m."""

    tolerance: float  # how far points that are left out may be from their leg
    reach: float  # how far off a leg the vessel may be to be on it
    turn: float  # way in which it turns to a point under way; 0 at rest


def apart(points: Points, line: Points) -> NDArray[np.float64]:
    """The distance of each point from a polyline of at least two points, m."""
    found: NDArray[np.float64] = from_ways(points[:, None], line[:-1], np.diff(line)).min(axis=1)
    return found


def thinned(start: complex, points: Sequence[Waypoint], tolerance: float) -> list[Waypoint]:
    """The waypoints that are needed; each has those that were left out on the leg to it.

    `start`: where the first leg begins, m. `tolerance`: how far those that are left out may be from their leg, m.
    """
    place = np.array([start, *(point.position for point in points)])
    needed, last = [0], len(points)
    fixed = [k for k in range(1, last) if points[k - 1].corner != THROUGH or points[k - 1].speed != points[k].speed]
    spans = [(a, b) for a, b in zip([0, *fixed], [*fixed, last], strict=True)][::-1]
    while spans:
        a, b = spans.pop()
        off = apart(place[a + 1 : b], place[[a, b]])
        if len(off) and off.max() > tolerance:
            middle = a + 1 + int(np.argmax(off))
            spans += [(middle, b), (a, middle)]
        else:
            needed.append(b)
    return [points[b - 1]._replace(passed=tuple(complex(p) for p in place[a + 1 : b])) for a, b in pairwise(needed) if b]


def ahead(points: Sequence[Waypoint], here: complex, course: float, scale: Scale) -> list[Waypoint]:
    """The waypoints to which a vessel on the first leg has to go: not those behind it, and under way not those next to it.

    `here`: position of the vessel, m. `course`: its course, or its heading at rest, rad.
    """
    left = list(points)
    while len(left) > 1 and left[0].corner == THROUGH:
        begin, leg = left[0].position, thinned(left[0].position, left[1:], scale.tolerance)[0]
        way = leg.position - begin
        along = way / abs(way)
        d = (here - begin) * along.conjugate()
        aligned = math.cos(course) * along.real + math.sin(course) * along.imag >= ALONG
        if not (aligned and abs(d.imag) <= scale.reach and -scale.turn <= d.real <= scale.reach + scale.turn):
            return left
        if d.real > 0.0:
            on = [k for k, place in enumerate(leg.passed, 1) if ((place - begin) * along.conjugate()).real > d.real]
            left = left[on[0] if on else len(leg.passed) + 1 :]
        if d.real <= abs(way):
            return _beyond_turn(left, here, scale)
    return left


def _beyond_turn(points: list[Waypoint], here: complex, scale: Scale) -> list[Waypoint]:
    """The waypoints from the first one on that is further away than a turn, as far as the others are near the way to it."""
    n = 0
    while n + 1 < len(points) and points[n].corner == THROUGH and abs(points[n].position - here) < scale.turn:
        n += 1
    while n and apart(np.array([one.position for one in points[:n]]), np.array([here, points[n].position])).max() > scale.reach:
        n -= 1
    return points[n:]


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
    return Turning(share * smallest.speed, radius, max(share * share * q / radius, SHORTEST * radius))
