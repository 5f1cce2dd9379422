"""Waypoints: the legs and corners between them, and the parameters that schedule paths and goals.

Legs and corners of a path without a stop: each corner as fast as its legs leave room for.

Through a corner of the angle theta, the turn begins and ends at the same distance from the waypoint. Over the waypoint, the ship
turns only when it has passed it, by theta + eps, and back by eps, so that it is on the next leg again. A corner sharper than
SHARPEST cannot be cut through and is sailed over its waypoint.

Under way, a path begins with the present course and curvature: the curvature decays, and one turn points at the first waypoint.

The parameters of goals and paths, and the goals and waypoints that they schedule, for runs without a publisher of them.
"""

import cmath
import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.guidance.route import CONSTANT, FREE, Element, Piece, Pieces, Section, displacement, straight, turn
from vessel_hsmc_ros.guidance.sailing import TravelLimits, Turning, turning_at, turning_with
from vessel_hsmc_ros.plant.dynamics import Vessel

SHARPEST = math.radians(120.0)

LEAST_ANGLE = 1e-9  # a corner with less is none, rad
LARGEST_EPS = 0.8 * math.pi

BISECTIONS, SCANNED = 50, 96  # bisections of an angle, and angles that are tried in a full turn to one side
THROUGH, OVER, STOP = "through", "over", "stop"

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


def join(target: complex, curvature: float, decay: float, radius: float, transition: float, run: float) -> tuple[Pieces, Pieces]:
    """The shortest turn from the present course, along which the position is 0 and the course 0, to a point.

    Args:
        target: The point, m.
        curvature: Present curvature, 1/m.
        decay: Length in which it decays, m.
        radius: Smallest radius of the turn, m.
        transition: Length of its transitions, m.
        run: Way between the two, m.

    Returns:
        The decay of the curvature with the way after it, and the turn; without a way to the point, the turn leads past it.
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


def begun(before: Pieces, bend: Pieces, speed: float, turning: Turning) -> Planned:
    """The beginning under way, as `corners.join` makes it: at the present speed, then at that of the turn.

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


NONE = (0.0,)
"""A list without a pose or waypoint: one number, which is neither, because the parameters files of ROS have no empty lists."""

Point = tuple[float, float]
PATH = "reference_ship.path"
CORNERS = (THROUGH, OVER, STOP)


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
