"""Waypoints of planners and track logs: those that are needed, from the vessel on.

A planner gives a point every few centimetres, and the first behind the vessel. Of waypoints with one speed, between stops, those
remain from the legs of which the others are at most a tolerance off [1].

[1] Douglas, D. H.; Peucker, T. K.: Algorithms for the reduction of the number of points required to represent a digitized line or
its caricature. Cartographica 10(2), 1973, pp. 112-122.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.guidance.corners import THROUGH
from vessel_hsmc_ros.guidance.polyline import Waypoint

Points = NDArray[np.complex128]

ALONG = math.cos(math.radians(60.0))
"""Cosine of the largest angle between the course of a vessel that is on a leg and that of the leg."""


class Scale(NamedTuple):
    """Lengths of a vessel, m."""

    tolerance: float  # how far points that are left out may be from their leg
    reach: float  # how far off a leg the vessel may be to be on it
    turn: float  # way in which it turns to a point under way; 0 at rest


def apart(points: Points, line: Points) -> NDArray[np.float64]:
    """The distance of each point from a polyline of at least two points, m."""
    begin, way = line[:-1], np.diff(line)
    square = np.maximum(np.abs(way) ** 2, np.finfo(np.float64).tiny)
    d = points[:, None] - begin
    share = np.clip((d * way.conj()).real / square, 0.0, 1.0)
    found: NDArray[np.float64] = np.min(np.abs(d - share * way), axis=1)
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
