"""A rectangle as a survey: its legs, the corner at which it begins, and the way there from the present place.

| symbol | meaning | unit |
|---|---|---|
| l, w | length along the legs, width across them | m |
| n, d | number of legs, distance between two, d <= spacing | -, m |

n = ceil(w/spacing) + 1 and d = w/(n - 1): the outer legs are the long sides. The survey begins at the nearest corner. A ship that
lies elsewhere turns on the spot, goes to the beginning of the run-in of that corner, and turns to it under way.
"""

import cmath
import math
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.core.track_errors import NO_LEG
from vessel_hsmc_ros.plant.dynamics import Vessel
from vessel_hsmc_ros.reference.corners import THROUGH
from vessel_hsmc_ros.reference.lawnmower import MODE, LawnmowerParameters, plan_lawnmower, survey_legs
from vessel_hsmc_ros.reference.on_the_spot import spot_turn
from vessel_hsmc_ros.reference.path import DISTINCT, from_rest, rest_of
from vessel_hsmc_ros.reference.planned_track import PlannedTrack, Stretch, leg_ends, stretch
from vessel_hsmc_ros.reference.polyline import Part, Ship, Waypoint, polyline
from vessel_hsmc_ros.reference.timetable import Timetable, joined
from vessel_hsmc_ros.reference.turning import TravelLimits

ROUNDING = 1e-9
"""A width that exceeds a whole number of spacings by less, relative to a spacing, does not take another leg."""


class Legs(NamedTuple):
    """The legs of a rectangle.

    Attributes:
        number: Number of legs.
        length: Of a leg, m.
        spacing: Between two, m, positive to port.
        begin: Where the first begins, m.
        course: Of the first, rad.
    """

    number: int
    length: float
    spacing: float
    begin: complex
    course: float


def legs_of(rectangle: tuple[float, ...], heading: float, spacing: float, here: complex) -> Legs:
    """The legs of a rectangle, begun at the corner that is nearest to a place.

    Args:
        rectangle: x, y of the center, length and width, m.
        heading: Direction of the length, rad.
        spacing: Largest distance between two legs, m.
        here: The place, m.

    Raises:
        ParameterError: there are not four numbers, or length or width is not positive.
    """
    if len(rectangle) != 4 or min(rectangle[2:]) <= 0.0:
        raise ParameterError(
            f"{MODE}.rectangle = {list(rectangle)} is not allowed: it takes x, y of the center, a positive"
            " length and a positive width"
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

    Args:
        p: The survey.
        vessel: Coefficients of the hull.
        limits: Limits of the motion.
        start: Position x, y [m] and heading at the beginning; the course of the first leg where there is no rectangle.

    Raises:
        ParameterError: as `legs_of` and `plan_lawnmower`, or the run-in is too short for the turn to it.
    """
    if any(p.rectangle):
        return _of_rectangle(p, Ship(vessel, limits, 0.0, MODE), start)
    planned = plan_lawnmower(p, vessel, limits, start)
    return _survey([planned.table], stretch(planned.route, planned.profile, 0.0))


def _survey(tables: list[Timetable], one: Stretch) -> Survey:
    return Survey(joined(tables), PlannedTrack((one,), leg_ends(one.route)))


def _of_rectangle(p: LawnmowerParameters, ship: Ship, start: tuple[float, float, float]) -> Survey:
    legs = legs_of(p.rectangle, p.heading, p.spacing, complex(start[0], start[1]))
    if p.run_in <= 0.0:
        raise ParameterError(
            f"{MODE}.run_in = 0 m is not allowed with a rectangle: it takes a way on which the ship turns to its leg"
        )
    elements, sections = survey_legs(
        replace(p, legs=legs.number, leg_length=legs.length, spacing=legs.spacing, run_in=0.0), ship.vessel, ship.limits
    )
    beginning = legs.begin - p.run_in * cmath.exp(1j * legs.course)
    points = [Waypoint(place, THROUGH, p.speed) for place in (beginning, legs.begin)]
    if abs(beginning - complex(start[0], start[1])) < DISTINCT * p.run_in:
        del points[0]
    turned = spot_turn(start, points[0].position, ship.vessel, ship.limits)
    motion = rest_of(turned) if turned else Motion(*start, 0.0, 0.0, 0.0)
    here = complex(motion.x, motion.y)
    before, slower = polyline(here, Part(tuple(points), 0), ship)
    route = [one._replace(leg=NO_LEG) for one in before] + elements
    piece = from_rest((route, slower + sections), cmath.phase(points[0].position - here), motion, ship, turned)
    delay, sailing = float(turned.times[-1]) if turned else 0.0, piece.sailing
    assert sailing is not None  # noqa: S101 - from_rest sails
    return _survey([*([turned] if turned else []), piece.table], stretch(sailing.route, sailing.profile, delay))
