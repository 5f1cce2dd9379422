"""Waypoints: from the parameters file, and those of planners and track logs that are needed.

The parameters of goals and paths schedule goals and waypoints, for runs without a publisher of them.

A planner gives a point every few centimetres, and the first behind the vessel. Of waypoints with one speed, between stops, those
remain from the legs of which the others are at most a tolerance off [1].

[1] Douglas, D. H.; Peucker, T. K.: Algorithms for the reduction of the number of points required to represent a digitized line or
its caricature. Cartographica 10(2), 1973, pp. 112-122.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.fence import from_ways
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.guidance.route import TravelLimits, Turning
from vessel_hsmc_ros.plant.dynamics import Vessel

THROUGH, OVER, STOP = "through", "over", "stop"


class Waypoint(NamedTuple):
    """A waypoint."""

    position: complex  # where it is, m
    corner: str  # THROUGH, OVER or STOP
    speed: float  # on the leg to it, m/s
    passed: tuple[complex, ...] = ()  # points near the leg to it that were left out, m
    turning: Turning | None = None  # its own turn; None for the smallest at the speed of its legs
    number: int = 1  # from 1 on, among those that were given
    hold: float = 0.0  # time at rest there, s; a waypoint with a hold is a stop
    heading: float | None = None  # at rest there, rad; None for any


Part = tuple[Waypoint, ...]  # up to a stop


class Ship(NamedTuple):
    """Whose path it is."""

    vessel: Vessel  # coefficients of the hull
    limits: TravelLimits  # limits of the motion
    radius: float  # of all corners, m; 0 for the smallest
    owner: str  # name of the mode, for error messages

    @property
    def gyration(self) -> float:
        """The radius of gyration of the hull, m."""
        return math.sqrt(self.vessel.m33 / self.vessel.m22)


NONE = (0.0,)
"""A list without a pose or waypoint: one number, which is neither, because the parameters files of ROS have no empty lists."""

Point = tuple[float, float]
PATH = "reference_ship.path"
CORNERS = (THROUGH, OVER, STOP)
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


@dataclass(frozen=True)
class GoalParameters:
    """Goals from the parameters file, for runs without a publisher of `goal_pose`."""

    poses: tuple[float, ...] = parameter(
        NONE, "Goals: x [m], y [m], heading of the first, of the second and so on; [0.0] for none.", low=-1e6, high=1e6
    )
    times: tuple[float, ...] = parameter(
        (0.0,), "Time at which each goal is set, increasing; below 0 for never.", unit="s", low=-1.0, high=1e9
    )
    astern_distance: float = parameter(
        -1.0,
        "Goals abaft the beam and nearer than this are approached astern; below 0 for 1.2 radii of gyration, 0.3 lengths of most"
        " hulls.",
        unit="m",
        low=-1.0,
        high=1e6,
    )


def scheduled_goals(p: GoalParameters) -> list[tuple[float, tuple[float, float, float]]]:
    """Times and poses of the goals in the parameters."""
    times = given_times(p.times, p.poses, "reference_ship.goal.times", "reference_ship.goal.poses")
    if len(p.poses) != 3 * len(times) and p.poses != NONE:
        raise ParameterError(
            f"reference_ship.goal.poses must have x, y, heading for each of the {len(times)} goal.times"
            f" (got {len(p.poses)} numbers)"
        )
    if any(later <= earlier for earlier, later in pairwise(time for time in times if time >= 0.0)):
        raise ParameterError(f"reference_ship.goal.times must increase (got {list(times)})")
    return [(time, (p.poses[3 * i], p.poses[3 * i + 1], p.poses[3 * i + 2])) for i, time in enumerate(times)]


def given_times(times: tuple[float, ...], places: tuple[float, ...], name: str, places_name: str) -> tuple[float, ...]:
    """The times at which poses or waypoints are set; none without them. `times`: the times, s; below 0 for never."""
    if places != NONE:
        return times
    if max(times, default=0.0) > 0.0:
        raise ParameterError(f"{places_name} must be given with {name} (got {name} = {list(times)} alone)")
    return ()


@dataclass(frozen=True)
class PathParameters:
    """Waypoints from the parameters file, for runs without a publisher of `path`."""

    waypoints: tuple[float, ...] = parameter(
        NONE, "Waypoints: x, y of the first, of the second and so on; [0.0] for none.", unit="m", low=-1e6, high=1e6
    )
    speeds: tuple[float, ...] = parameter(
        (0.0,), "Speed on the leg to each waypoint, or one for all; 0 for `motion.speed`.", unit="m/s", low=0.0, high=1e3
    )
    corners: tuple[str, ...] = parameter(
        (THROUGH,),
        "What to do at each waypoint, or at all: through, cut the corner; over, turn after it; stop, come to rest there.",
    )
    holds: tuple[float, ...] = parameter(
        (0.0,), "Time at rest at each waypoint, or at all; above 0 it is a stop.", unit="s", low=0.0, high=1e6
    )
    headings: tuple[float, ...] = parameter(
        (-1.0,),
        "Heading to turn to on the spot at each waypoint that is a stop, or the last; below 0 for none.",
        unit="rad",
        low=-1.0,
        high=6.3,
    )
    corner_radius: float = parameter(
        0.0, "Radius of the corners; 0 for the smallest at the speed of the legs.", unit="m", low=0.0, high=1e6
    )
    time: float = parameter(0.0, "Time at which the path is set; below 0 for never.", unit="s", low=-1.0, high=1e9)


def scheduled_path(p: PathParameters, speed: float) -> tuple[float, list[Waypoint]] | None:
    """Time and waypoints of the path in the parameters; None without one. `speed`: on legs without a speed of their own, m/s."""
    if not given_times((p.time,), p.waypoints, f"{PATH}.time", f"{PATH}.waypoints"):
        return None
    waypoints = waypoints_of(p, speed)
    return (p.time, waypoints) if p.time >= 0.0 else None


def waypoints_of(p: PathParameters, speed: float) -> list[Waypoint]:
    """The waypoints of the parameters. `speed`: on legs without a speed of their own, m/s."""
    numbers = p.waypoints
    if len(numbers) % 2:
        raise ParameterError(f"{PATH}.waypoints must be x, y for each waypoint (got {len(numbers)} numbers)")
    unknown = [corner for corner in p.corners if corner not in CORNERS]
    if unknown:
        raise ParameterError(f"{PATH}.corners must be any of {', '.join(CORNERS)} (got {unknown[0]})")
    n = len(numbers) // 2
    speeds, corners = _each("speeds", p.speeds, n), _each("corners", p.corners, n)
    holds, headings = _each("holds", p.holds, n), _each("headings", p.headings, n)
    points = []
    for i, (corner, own, hold, heading) in enumerate(zip(corners, speeds, holds, headings, strict=True)):
        kind = STOP if hold else corner
        turns = heading >= 0.0 and (kind == STOP or i == n - 1)
        if heading >= 0.0 and not turns and len(p.headings) > 1:
            raise ParameterError(
                f"{PATH}.headings must be below 0 where the vessel does not stop, because under way it points along its course"
                f" (got {heading:g} rad at waypoint {i + 1}, with the corner {corner})"
            )
        place = complex(numbers[2 * i], numbers[2 * i + 1])
        points.append(Waypoint(place, kind, own or speed, hold=hold, heading=heading if turns else None))
    return points


def _each(name: str, values: Sequence[Any], n: int) -> Sequence[Any]:
    if len(values) not in (1, n):
        raise ParameterError(f"{PATH}.{name} must have one value, or {n} for {n} waypoints (got {len(values)})")
    return values if len(values) == n else list(values) * n
