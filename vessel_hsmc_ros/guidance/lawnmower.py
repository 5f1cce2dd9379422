"""A survey: parallel legs joined by U-turns, begun at `initial_pose` with its angle as the first leg's course, or of an area.

The U-turns have the radius that is set, or the smallest with which the ship can turn at the speed of the legs; where the legs are
closer together than that they are teardrops. The ship starts from rest at the beginning of the first leg, or of the run-in before
it, and stops at the end of the last.

| spacing | U-turn |
|---|---|
| at least that of two quarter turns | a quarter turn, a straight part, a quarter turn |
| at least that of a half turn | a half turn, with the radius that the spacing has |
| less | a teardrop: away by eps, back by 180 degrees + 2·eps, and by eps again |

Each next leg begins abreast of the end of the last.

Of a rectangle, the long sides of which are the outer legs, n = ceil(w/spacing) + 1 and d = w/(n - 1). Of a polygon, each leg lies
in the middle of a strip of it, and is as long as the polygon is in the strip: n = ceil(w/spacing) and d = w/n, so that all of the
polygon is within d/2 of a leg. A vessel goes from a leg to the next one abreast: whichever ends first is extended, so that the
turn is outside of the strip.

| symbol | meaning | unit |
|---|---|---|
| w | width across the legs | m |
| n, d | number of legs, distance between two, d <= spacing | -, m |

The survey of an area begins at the nearest end of an outer leg. A ship that lies elsewhere turns on the spot, goes to the
beginning of the run-in there, and turns to it under way.
"""

import cmath
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.core.metrics import NO_LEG
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.guidance.corners import DISTINCT, Plan, Planned, from_rest, polyline, rest_of
from vessel_hsmc_ros.guidance.curves import SMALLEST, magnitude
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack, Stretch, leg_ends, stretch
from vessel_hsmc_ros.guidance.route import (
    CONSTANT,
    FREE,
    Element,
    Pieces,
    Route,
    Section,
    TravelLimits,
    Turning,
    displacement,
    straight,
    turn,
)
from vessel_hsmc_ros.guidance.sailing import Sailing, check_straight, sail, spot_turn, turning_at, turning_with
from vessel_hsmc_ros.guidance.timetable import Timetable, joined
from vessel_hsmc_ros.guidance.waypoints import NONE, THROUGH, Ship, Waypoint
from vessel_hsmc_ros.plant.dynamics import Vessel

ROUNDING = 1e-9  # a width that exceeds a whole number of spacings by less, relative to a spacing, does not take another leg

MODE = "reference_ship.lawnmower"
NEAR = 0.1  # distance within which a ship passes a point of a leg, relative to the distance between two legs
BISECTIONS = 60


class Strip(NamedTuple):
    """A leg with the straight ways before and after it, m."""

    before: float
    leg: float
    after: float


class AreaLegs(NamedTuple):
    """The legs of an area."""

    strips: tuple[Strip, ...]  # in their order
    spacing: float  # between two, m, positive to port
    begin: complex  # where the first begins, m
    course: float  # of the first, rad


def polygon_legs(corners: tuple[float, ...], heading: float, spacing: float, here: complex, name: str) -> AreaLegs:
    """The legs of a polygon, begun at that of their four ends that is nearest to a place.

    Args:
        corners: x, y of each corner, m.
        heading: Direction of the legs, rad.
        spacing: Largest distance between two legs, m.
        here: The place, m.
        name: Of the parameter, for error messages.

    Raises:
        ParameterError: there are fewer than three corners or no area, or a leg would leave the polygon.
    """
    if len(corners) % 2 or len(corners) < 6:
        raise ParameterError(f"{name} must have x and y of at least 3 corners (got {len(corners)} numbers)")
    along = cmath.exp(1j * heading)
    local = [complex(x, y) / along for x, y in zip(corners[::2], corners[1::2], strict=True)]
    low, high = min(p.imag for p in local), max(p.imag for p in local)
    if not high - low > ROUNDING * abs(spacing):
        raise ParameterError(f"{name} must have an area (got a width of {high - low:g} m across the legs)")
    count = max(1, math.ceil((high - low) / abs(spacing) - ROUNDING))
    d = (high - low) / count
    spans = [_span(local, low + i * d, low + (i + 1) * d, name) for i in range(count)]
    return _nearest(spans, low + 0.5 * d, d, along, here, (True, False))


def _span(local: Sequence[complex], low: float, high: float, name: str) -> tuple[float, float]:
    """From where to where a polygon is in a strip."""
    sides = [*zip(local, [*local[1:], local[0]], strict=True)]
    found = [p.real for p in local if low <= p.imag <= high]
    middle = 0.5 * (low + high)
    for y in (low, middle, high):
        crossings = [
            a.real + (y - a.imag) / (b.imag - a.imag) * (b.real - a.real) for a, b in sides if (a.imag > y) != (b.imag > y)
        ]
        if y == middle and len(crossings) > 2:
            raise ParameterError(
                f"{name} must be crossed by each leg once (got one that leaves it and comes back):"
                " another heading, or two polygons would do"
            )
        found += crossings
    return min(found), max(found)


def rectangle_legs(rectangle: tuple[float, ...], heading: float, spacing: float, here: complex) -> AreaLegs:
    """The legs of a rectangle, begun at the corner that is nearest to a place.

    `rectangle`: x, y of the center, length and width, m. `heading`: direction of the length, rad. `spacing`: largest distance
    between two legs, m. `here`: the place, m.
    """
    if len(rectangle) != 4 or min(rectangle[2:]) <= 0.0:
        raise ParameterError(
            f"{MODE}.rectangle must be x, y of the center, a positive length and a positive width (got {list(rectangle)})"
        )
    x, y, length, width = rectangle
    gaps = max(1, math.ceil(width / abs(spacing) - ROUNDING))
    along = cmath.exp(1j * heading)
    center = complex(x, y) / along
    span = center.real - 0.5 * length, center.real + 0.5 * length
    return _nearest([span] * (gaps + 1), center.imag - 0.5 * width, width / gaps, along, here, (False, True))


def _nearest(
    spans: Sequence[tuple[float, float]], first: float, d: float, along: complex, here: complex, upwards: tuple[bool, bool]
) -> AreaLegs:
    """The legs from that of their four ends that is nearest to a place; of equally near ones in the order of `upwards`."""
    found = [_from_corner(spans, first, d, along, up, ahead) for up in upwards for ahead in (True, False)]
    return min(found, key=lambda legs: abs(legs.begin - here))


def _from_corner(
    spans: Sequence[tuple[float, float]], first: float, d: float, along: complex, upwards: bool, ahead: bool
) -> AreaLegs:
    """The legs from the first or the last strip on, the first of them ahead or astern of the heading."""
    rows = list(spans if upwards else spans[::-1])
    y = first if upwards else first + (len(rows) - 1) * d
    strips, before = [], 0.0
    for i, (low, high) in enumerate(rows):
        after, following = 0.0, 0.0
        if i + 1 < len(rows):
            out = ahead == (i % 2 == 0)  # along the heading
            ends = (high, rows[i + 1][1]) if out else (-low, -rows[i + 1][0])
            after, following = max(0.0, ends[1] - ends[0]), max(0.0, ends[0] - ends[1])
        strips.append(Strip(before, high - low, after))
        before = following
    begin = complex(rows[0][0] if ahead else rows[0][1], y) * along
    course = cmath.phase(along if ahead else -along)
    return AreaLegs(tuple(strips), d if upwards == ahead else -d, begin, course)


@dataclass(frozen=True)
class LawnmowerParameters:
    """Parallel legs joined by U-turns."""

    legs: int = parameter(4, "Number of legs.", low=1, high=1000)
    leg_length: float = parameter(200.0, "Length of a leg.", unit="m", low=SMALLEST, high=1e5)
    spacing: float = parameter(
        40.0, "Distance between two legs; positive turns to port first, negative to starboard.", unit="m", low=-1e5, high=1e5
    )
    speed: float = parameter(1.5, "Speed over ground on the legs.", unit="m/s", low=1e-3, high=100.0)
    run_in: float = parameter(
        0.0,
        "Way before the first leg, on its course, on which the ship gathers way and learns the current; it is no leg.",
        unit="m",
        low=0.0,
        high=1e5,
    )
    rectangle: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0, 0.0),
        "Rectangle to survey, in place of `legs` and `leg_length`: x, y of its center, length along the legs and width; all 0 for"
        " none. The survey begins at the corner nearest to `initial_pose`, from which the ship goes there.",
        unit="m",
        low=-1e6,
        high=1e6,
    )
    polygon: tuple[float, ...] = parameter(
        NONE,
        "Polygon to survey, in place of `rectangle`: x, y of its corners; [0.0] for none. Legs are in the middle of strips that"
        " are at most `spacing` wide, which is the swath.",
        unit="m",
        low=-1e6,
        high=1e6,
    )
    heading: float = parameter(
        0.0, "Direction of the length of `rectangle`, and of the legs in `polygon`.", unit="rad", low=-6.3, high=6.3
    )
    turn_radius: float = parameter(
        0.0,
        "Radius of the U-turns, which are slower where the ship needs it; 0 for the smallest at the speed of the legs.",
        unit="m",
        low=0.0,
        high=1e5,
    )


@lru_cache(maxsize=4)
def plan_lawnmower(p: LawnmowerParameters, vessel: Vessel, limits: TravelLimits, start: tuple[float, float, float]) -> Sailing:
    """The survey as a motion of a ship, which is planned once for a scenario that is checked, run and evaluated.

    `start`: position x, y [m] and course at the beginning.
    """
    elements, sections = survey_legs(p, vessel, limits)
    return sail(MODE, Route(elements, start), sections, vessel, limits)


def survey_legs(p: LawnmowerParameters, vessel: Vessel, limits: TravelLimits, strips: Sequence[Strip] = ()) -> Planned:
    """The run-in, legs and turns of a survey. `strips`: the legs, if they are not those of the parameters."""
    magnitude("lawnmower.spacing", p.spacing)
    check_straight(f"{MODE}.speed", p.speed, vessel, limits)
    turning = _turning(p, vessel, limits)
    elements = [Element(straight(p.run_in), NO_LEG, turn=False)] if p.run_in else []
    strips = strips or [Strip(0.0, p.leg_length, 0.0)] * p.legs
    for leg, (before, length, after) in enumerate(strips):
        ways = (before, NO_LEG), (length, leg), (after, NO_LEG)
        elements += [Element(straight(way), number, turn=False) for way, number in ways if way]
        if leg < len(strips) - 1:
            bend = u_turn((-1.0) ** leg * p.spacing, turning.radius, turning.transition)
            elements.append(Element(bend, leg, turn=True))
    return elements, [Section(e.length, turning.speed if e.turn else p.speed, CONSTANT if e.turn else FREE) for e in elements]


def _turning(p: LawnmowerParameters, vessel: Vessel, limits: TravelLimits) -> Turning:
    if not p.turn_radius:
        return _tightest(p.speed, vessel, limits)
    try:
        return turning_with(p.turn_radius, p.speed, vessel, limits)
    except ParameterError as error:
        least = _tightest(p.speed, vessel, limits).radius
        raise ParameterError(f"{MODE}.turn_radius: {error}; {least:.3g} m at {p.speed:g} m/s would do") from None


def _tightest(speed: float, vessel: Vessel, limits: TravelLimits) -> Turning:
    try:
        return turning_at(speed, vessel, limits)
    except ParameterError as error:
        raise ParameterError(f"{MODE}.speed: {error}; a lower speed would do") from None


def u_turn(spacing: float, radius: float, transition: float) -> Pieces:
    """The U-turn to a parallel leg, which begins abreast of the end of this one.

    `spacing`: distance to the next leg, m, positive to port. `radius`: smallest radius, m. `transition`: length of the
    transitions between straight and arc, m.
    """
    side, width = math.copysign(1.0, spacing), abs(spacing)
    quarter = displacement(turn(0.5 * math.pi, radius, transition))
    if width >= quarter.real + quarter.imag:
        corner = turn(side * 0.5 * math.pi, radius, transition)
        return (*corner, *straight(width - quarter.real - quarter.imag), *corner)
    if width >= displacement(turn(math.pi, radius, transition)).imag:
        # Half the spacing is the radius of a half circle without transitions, and so too large.
        fitting = _root(lambda r: displacement(turn(math.pi, r, transition)).imag - width, radius, 0.5 * width)
        return turn(side * math.pi, fitting, transition)
    eps = _root(lambda angle: width - displacement(_teardrop(angle, radius, transition)).imag, 0.0, 0.5 * math.pi)
    return _teardrop(eps, radius, transition, side)


def _teardrop(eps: float, radius: float, transition: float, side: float = 1.0) -> Pieces:
    away = turn(-side * eps, radius, transition)
    return (*away, *turn(side * (math.pi + 2.0 * eps), radius, transition), *away)


def _root(increasing: Callable[[float], float], low: float, high: float) -> float:
    """The zero of an increasing function by bisection."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if increasing(middle) < 0.0 else (low, middle)
    return 0.5 * (low + high)


@lru_cache(maxsize=4)
def plan_survey(p: LawnmowerParameters, vessel: Vessel, limits: TravelLimits, start: tuple[float, float, float]) -> Plan:
    """The survey of parameters, of a rectangle or of legs from the start on.

    `start`: position x, y [m] and heading at the beginning; the course of the first leg where there is no rectangle.
    """
    here, ship = complex(start[0], start[1]), Ship(vessel, limits, 0.0, MODE)
    magnitude("lawnmower.spacing", p.spacing)
    if any(p.polygon):
        if any(p.rectangle):
            raise ParameterError(f"{MODE}.rectangle must be left out with a polygon (got {list(p.rectangle)})")
        return _of_area(p, polygon_legs(p.polygon, p.heading, p.spacing, here, f"{MODE}.polygon"), ship, start)
    if any(p.rectangle):
        return _of_area(p, rectangle_legs(p.rectangle, p.heading, p.spacing, here), ship, start)
    planned = plan_lawnmower(p, vessel, limits, start)
    return _survey(p, [planned.table], stretch(planned.route, planned.profile, 0.0))


def _survey(p: LawnmowerParameters, tables: list[Timetable], one: Stretch) -> Plan:
    return Plan(joined(tables), PlannedTrack((one,), leg_ends(one.route), NEAR * abs(p.spacing)))


def _of_area(p: LawnmowerParameters, legs: AreaLegs, ship: Ship, start: tuple[float, float, float]) -> Plan:
    if p.run_in <= 0.0:
        raise ParameterError(
            f"{MODE}.run_in must be above 0 m with a rectangle or a polygon (got 0 m): the vessel turns to its first leg there"
        )
    elements, sections = survey_legs(replace(p, spacing=legs.spacing, run_in=0.0), ship.vessel, ship.limits, legs.strips)
    beginning = legs.begin - p.run_in * cmath.exp(1j * legs.course)
    points = [Waypoint(place, THROUGH, p.speed) for place in (beginning, legs.begin)]
    if abs(beginning - complex(start[0], start[1])) < DISTINCT * p.run_in:
        del points[0]
    turned = spot_turn(start, points[0].position, ship.vessel, ship.limits)
    motion = rest_of(turned) if turned else Motion(*start, 0.0, 0.0, 0.0)
    here = complex(motion.x, motion.y)
    before, slower = polyline(here, tuple(points), ship)
    route = [one._replace(leg=NO_LEG) for one in before] + elements
    piece = from_rest((route, slower + sections), cmath.phase(points[0].position - here), motion, ship, turned)
    delay, sailing = float(turned.times[-1]) if turned else 0.0, piece.sailing
    assert sailing is not None  # noqa: S101 - from_rest sails
    return _survey(p, [*([turned] if turned else []), piece.table], stretch(sailing.route, sailing.profile, delay))
