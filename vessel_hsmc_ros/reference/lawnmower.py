"""A survey of a rectangle: parallel legs joined by U-turns, begun at `initial_pose` with its angle as the first leg's course.

The U-turns have the radius that is set, or the smallest with which the ship can turn at the speed of the legs; where the legs are
closer together than that they are teardrops. The ship starts from rest at the beginning of the first leg, or of the run-in before
it, and stops at the end of the last.
"""

from dataclasses import dataclass
from functools import lru_cache

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.core.track_errors import NO_LEG
from vessel_hsmc_ros.plant.dynamics import Vessel
from vessel_hsmc_ros.reference.polyline import Planned
from vessel_hsmc_ros.reference.route import Element, Route, straight
from vessel_hsmc_ros.reference.sailing import Sailing, sail
from vessel_hsmc_ros.reference.shapes import SMALLEST
from vessel_hsmc_ros.reference.speed_profile import CONSTANT, FREE, Section
from vessel_hsmc_ros.reference.turning import TravelLimits, Turning, check_straight, turning_at, turning_with
from vessel_hsmc_ros.reference.u_turns import u_turn

MODE = "reference_ship.lawnmower"


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
    heading: float = parameter(0.0, "Direction of the length of `rectangle`.", unit="rad", low=-6.3, high=6.3)
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

    Args:
        p: The survey.
        vessel: Coefficients of the hull.
        limits: Limits of the motion.
        start: Position x, y [m] and course at the beginning.

    Raises:
        ParameterError: the spacing is zero, or the ship cannot sail a leg or a turn within its limits.
    """
    elements, sections = survey_legs(p, vessel, limits)
    return sail(MODE, Route(elements, start), sections, vessel, limits)


def survey_legs(p: LawnmowerParameters, vessel: Vessel, limits: TravelLimits) -> Planned:
    """The run-in, legs and turns of a survey.

    Args:
        p: The survey.
        vessel: Coefficients of the hull.
        limits: Limits of the motion.

    Raises:
        ParameterError: as `plan_lawnmower`.
    """
    if abs(p.spacing) < SMALLEST:
        raise ParameterError(f"{MODE}.spacing = {p.spacing:g} m is not allowed: its magnitude must be at least {SMALLEST:g} m")
    check_straight(f"{MODE}.speed", p.speed, vessel, limits)
    turning = _turning(p, vessel, limits)
    elements = [Element(straight(p.run_in), NO_LEG, turn=False)] if p.run_in else []
    for leg in range(p.legs):
        elements.append(Element(straight(p.leg_length), leg, turn=False))
        if leg < p.legs - 1:
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
