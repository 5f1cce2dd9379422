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

Of a rectangle, the long sides of which are the outer legs:

| symbol | meaning | unit |
|---|---|---|
| l, w | length along the legs, width across them | m |
| n, d | number of legs, distance between two, d <= spacing | -, m |

n = ceil(w/spacing) + 1 and d = w/(n - 1): the outer legs are the long sides. The survey begins at the nearest corner. A ship that
lies elsewhere turns on the spot, goes to the beginning of the run-in of that corner, and turns to it under way.
"""

import cmath
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.core.track_errors import NO_LEG
from vessel_hsmc_ros.guidance.corners import THROUGH
from vessel_hsmc_ros.guidance.goal_parameters import NONE
from vessel_hsmc_ros.guidance.on_the_spot import spot_turn
from vessel_hsmc_ros.guidance.path import DISTINCT, from_rest, rest_of
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack, Stretch, leg_ends, stretch
from vessel_hsmc_ros.guidance.polygon import ROUNDING, PolygonLegs, Strip, polygon_legs
from vessel_hsmc_ros.guidance.polyline import Part, Planned, Ship, Waypoint, polyline
from vessel_hsmc_ros.guidance.route import Element, Pieces, Route, displacement, straight, turn
from vessel_hsmc_ros.guidance.sailing import Sailing, sail
from vessel_hsmc_ros.guidance.shapes import SMALLEST
from vessel_hsmc_ros.guidance.speed_profile import CONSTANT, FREE, Section
from vessel_hsmc_ros.guidance.timetable import Timetable, joined
from vessel_hsmc_ros.guidance.turning import TravelLimits, Turning, check_straight, turning_at, turning_with
from vessel_hsmc_ros.plant.dynamics import Vessel

MODE = "reference_ship.lawnmower"

NEAR = 0.1  # distance within which a ship passes a point of a leg, relative to the distance between two legs


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

    `start`: position x, y [m] and course at the beginning. Raises ParameterError if the spacing is zero, or the ship cannot
    sail a leg or a turn within its limits.
    """
    elements, sections = survey_legs(p, vessel, limits)
    return sail(MODE, Route(elements, start), sections, vessel, limits)


def survey_legs(p: LawnmowerParameters, vessel: Vessel, limits: TravelLimits, strips: Sequence[Strip] = ()) -> Planned:
    """The run-in, legs and turns of a survey.

    `strips`: the legs, if they are not those of the parameters. Raises ParameterError as `plan_lawnmower`.
    """
    _spacing(p)
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


def _spacing(p: LawnmowerParameters) -> float:
    """The spacing of a survey. Raises ParameterError if it is zero."""
    if abs(p.spacing) < SMALLEST:
        raise ParameterError(f"{MODE}.spacing must have a magnitude of at least {SMALLEST:g} m (got {p.spacing:g} m)")
    return p.spacing


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


BISECTIONS = 60


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


class Legs(NamedTuple):
    """The legs of a rectangle."""

    number: int  # number of legs
    length: float  # of a leg, m
    spacing: float  # between two, m, positive to port
    begin: complex  # where the first begins, m
    course: float  # of the first, rad


def legs_of(rectangle: tuple[float, ...], heading: float, spacing: float, here: complex) -> Legs:
    """The legs of a rectangle, begun at the corner that is nearest to a place.

    `rectangle`: x, y of the center, length and width, m. `heading`: direction of the length, rad. `spacing`: largest distance
    between two legs, m. `here`: the place, m. Raises ParameterError if there are not four numbers, or length or width is not
    positive.
    """
    if len(rectangle) != 4 or min(rectangle[2:]) <= 0.0:
        raise ParameterError(
            f"{MODE}.rectangle must be x, y of the center, a positive length and a positive width (got {list(rectangle)})"
        )
    x, y, length, width = rectangle
    gaps = max(1, math.ceil(width / abs(spacing) - ROUNDING))
    along = cmath.exp(1j * heading)
    corners = [
        Legs(
            gaps + 1,
            length,
            -end * side * width / gaps,
            complex(x, y) - along * 0.5 * complex(end * length, -side * width),
            heading if end > 0 else heading + math.pi,
        )
        for end in (1, -1)
        for side in (1, -1)
    ]
    return min(corners, key=lambda legs: abs(legs.begin - here))


class Survey(NamedTuple):
    """A survey as a motion over time, and its geometry."""

    table: Timetable
    track: PlannedTrack


@lru_cache(maxsize=4)
def plan_survey(p: LawnmowerParameters, vessel: Vessel, limits: TravelLimits, start: tuple[float, float, float]) -> Survey:
    """The survey of parameters, of a rectangle or of legs from the start on.

    `start`: position x, y [m] and heading at the beginning; the course of the first leg where there is no rectangle. Raises
    ParameterError as `legs_of` and `plan_lawnmower`, or the run-in is too short for the turn to it.
    """
    here, ship = complex(start[0], start[1]), Ship(vessel, limits, 0.0, MODE)
    if any(p.polygon):
        if any(p.rectangle):
            raise ParameterError(f"{MODE}.rectangle must be left out with a polygon (got {list(p.rectangle)})")
        return _of_area(p, polygon_legs(p.polygon, p.heading, _spacing(p), here, f"{MODE}.polygon"), ship, start)
    if any(p.rectangle):
        legs = legs_of(p.rectangle, p.heading, p.spacing, here)
        strips = (Strip(0.0, legs.length, 0.0),) * legs.number
        return _of_area(p, PolygonLegs(strips, legs.spacing, legs.begin, legs.course), ship, start)
    planned = plan_lawnmower(p, vessel, limits, start)
    return _survey(p, [planned.table], stretch(planned.route, planned.profile, 0.0))


def _survey(p: LawnmowerParameters, tables: list[Timetable], one: Stretch) -> Survey:
    return Survey(joined(tables), PlannedTrack((one,), leg_ends(one.route), NEAR * abs(p.spacing)))


def _of_area(p: LawnmowerParameters, legs: PolygonLegs, ship: Ship, start: tuple[float, float, float]) -> Survey:
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
    before, slower = polyline(here, Part(tuple(points)), ship)
    route = [one._replace(leg=NO_LEG) for one in before] + elements
    piece = from_rest((route, slower + sections), cmath.phase(points[0].position - here), motion, ship, turned)
    delay, sailing = float(turned.times[-1]) if turned else 0.0, piece.sailing
    assert sailing is not None  # noqa: S101 - from_rest sails
    return _survey(p, [*([turned] if turned else []), piece.table], stretch(sailing.route, sailing.profile, delay))
