"""The turns that a ship can make: radius and transitions for a speed, and the speed for a radius, from its hull and its limits.

A steady turn takes a drift angle, a yaw rate, a surge force and a yaw moment; the transitions before and after it take yaw
acceleration, and until the drift has followed more yaw rate and moment than the turn itself. The radius is the smallest at which
the steady turn stays within the limits, the transition the shortest, by steps, at which the whole turn does.
"""

import math
from contextlib import suppress
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.guidance.curve_motion import Demand, Pace, demand
from vessel_hsmc_ros.guidance.curves import Arc
from vessel_hsmc_ros.guidance.route import Element, Route, straight, turn
from vessel_hsmc_ros.guidance.route_motion import RouteMotion, motion_along
from vessel_hsmc_ros.guidance.speed_profile import Phase, SpeedProfile
from vessel_hsmc_ros.plant.dynamics import Vessel

LARGEST_SHARE = 0.7
"""Largest share of surge force and yaw moment that a turn takes in calm water: the rest is for wind and for catching up."""

LARGEST_DRIFT = math.radians(20.0)  # largest drift angle of a steady turn, rad
STEADY_SHARE = 0.85
"""Share of the limits that the steady part of a turn takes, so that there are transitions that stay within them."""

WIDER, LONGER, SLOWER = 1.1, 1.2, 0.97  # steps in which a turn becomes wider, its transitions longer, and its speed less
TOO_WIDE = 1.3  # a radius so many times that of a turn one step of the speed slower is not worth the speed
MAX_LENGTH_RATIO = 200.0
"""Largest radius, in terms of the smallest one that the yaw rate allows, and largest transition, in terms of the radius."""

SLOWEST = 0.02  # smallest share of the speed at which a turn is sought
RESOLVED = 0.997  # share of the limits up to which peaks between two instants of a motion are below them as well
BISECTIONS = 30

TRIED, TRIED_SHARE = 1e-4, 0.997
"""Relative residual of the drift angle of a turn that is tried, and the share of yaw rate and acceleration that it may take: in a
path the drift angle is exact, other instants are compared, and a peak is by up to 0.1 % larger."""

RUN_UP = 4.0  # length of the legs before and after the turn that is tried, in transitions


class TravelLimits(NamedTuple):
    """Limits of a motion along a route, m/s², rad/s, rad/s², N, N·m, infinite where unknown, and the current allowed for, m/s."""

    acceleration: float
    yaw_rate: float
    yaw_acceleration: float
    surge_force: float
    yaw_moment: float
    current: float


class Turning(NamedTuple):
    """A turn: speed, m/s, radius, m, length of its transitions, m."""

    speed: float
    radius: float
    transition: float


class Excess(NamedTuple):
    """A limit that a motion exceeds: name, unit, demand, limit, and the arc length at which it is exceeded most, m."""

    name: str
    unit: str
    needed: float
    limit: float
    s: float

    def __str__(self) -> str:
        """The demand and the limit in words."""
        return f"a {self.name} of {quantity(self.needed, self.unit)} (the limit is {quantity(self.limit, self.unit)})"


def steady_demand(curvature: float, speed: float, vessel: Vessel, current: float) -> Demand:
    """What a steady turn or a straight line takes through the water, against the current.

    `curvature`: of the route over ground, 1/m. `speed`: over ground, m/s. `current`: speed of the current that is allowed for,
    m/s.
    """
    through = speed + current
    # The yaw rate is that over ground.
    return demand(Arc(curvature * speed / through), Pace(through, 0.0), vessel, 2.0 * LARGEST_DRIFT)


def sustained(speed: float, vessel: Vessel, limits: TravelLimits, curvature: float = 0.0) -> bool:
    """Whether a ship can turn steadily, or go straight, at a speed over ground, m/s."""
    needed, share = steady_demand(curvature, speed, vessel, limits.current), STEADY_SHARE if curvature else 1.0
    return (
        speed * curvature <= share * limits.yaw_rate
        and needed.drift <= LARGEST_DRIFT
        and needed.surge_force <= LARGEST_SHARE * limits.surge_force
        and needed.yaw_moment <= share * LARGEST_SHARE * limits.yaw_moment
    )


@lru_cache(maxsize=256)
def turning_at(speed: float, vessel: Vessel, limits: TravelLimits) -> Turning:
    """The tightest turn at a speed, or at the largest speed below it at which the ship can turn.

    Near the top speed a turn takes force that is not left, so that its radius is many times that of one a little slower.
    `speed`: speed over ground, m/s. Raises ParameterError if there is none.
    """
    slower = speed
    while slower >= SLOWEST * speed:
        radius, tighter = (_smallest_radius(share * slower, vessel, limits) for share in (1.0, SLOWER))
        with suppress(ParameterError):
            if radius < TOO_WIDE * tighter:
                return Turning(slower, radius, _transition(slower, radius, vessel, limits))
        slower *= SLOWER
    raise ParameterError(f"no turn at {speed:.3g} m/s or less is within the limits of this ship")


def _smallest_radius(speed: float, vessel: Vessel, limits: TravelLimits) -> float:
    """The smallest radius, by steps, of a steady turn at a speed, m; infinite if there is none."""
    radius = smallest = speed / (STEADY_SHARE * limits.yaw_rate)
    if not sustained(speed, vessel, limits, 1.0 / (MAX_LENGTH_RATIO * smallest)):
        return math.inf
    while not sustained(speed, vessel, limits, 1.0 / radius):
        radius *= WIDER
    return radius


@lru_cache(maxsize=256)
def turning_with(radius: float, speed: float, vessel: Vessel, limits: TravelLimits) -> Turning:
    """The fastest turn with a radius.

    `radius`: m. `speed`: largest speed over ground, m/s. Raises ParameterError if there is none.
    """
    slower = speed
    while slower >= SLOWEST * speed:
        if sustained(slower, vessel, limits, 1.0 / radius):
            return Turning(slower, radius, _transition(slower, radius, vessel, limits))
        slower *= SLOWER
    raise ParameterError(f"no turn with a radius of {radius:.3g} m is within the limits of this ship")


def largest_acceleration(speed: float, vessel: Vessel, limits: TravelLimits) -> float:
    """The acceleration along legs up to a speed that leaves the surge force below its limit, m/s²."""
    left = limits.surge_force - steady_demand(0.0, speed, vessel, limits.current).surge_force
    return min(limits.acceleration, STEADY_SHARE * left / vessel.m11)


def check_straight(name: str, speed: float, vessel: Vessel, limits: TravelLimits) -> None:
    """Check that a ship can keep a speed on a leg.

    `name`: of the parameter, for the error message. `speed`: speed over ground, m/s. Raises ParameterError if it takes more
    than LARGEST_SHARE of the surge force.
    """
    if sustained(speed, vessel, limits):
        return
    low, high = 0.0, speed
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if sustained(middle, vessel, limits) else (low, middle)
    needed = steady_demand(0.0, speed, vessel, limits.current).surge_force
    against = f" against a current of {limits.current:g} m/s" if limits.current else ""
    remedy = f"at most {low:.3g} m/s would do" if low > SLOWEST * speed else "a smaller motion.current would do"
    raise ParameterError(
        f"{name} = {speed:g} m/s{against} needs a surge force of {quantity(needed, 'N')}: {LARGEST_SHARE:g} of"
        f" vessel.surge_force_limit is {quantity(LARGEST_SHARE * limits.surge_force, 'N')}; {remedy}"
    )


def excesses(motion: RouteMotion, limits: TravelLimits, share: float = 1.0) -> list[Excess]:
    """What a motion takes beyond the limits.

    `motion`: the motion over ground. `share`: of surge force and yaw moment.
    """
    surge, yaw = motion.inputs(limits.current)
    r, dr, s = motion.velocities.r, motion.velocities.dr, motion.travel.s
    # In the middle between two instants, of the polynomial of the fifth degree that the timetable has there.
    between = 1.5 * np.diff(r) / np.diff(motion.times) - 0.25 * (dr[1:] + dr[:-1])
    rows = (
        ("yaw rate", "rad/s", r, RESOLVED * limits.yaw_rate),
        ("yaw acceleration", "rad/s²", np.concatenate((dr, RESOLVED * between)), RESOLVED * limits.yaw_acceleration),
        ("surge force", "N", surge, share * limits.surge_force),
        ("yaw moment", "N·m", yaw, share * limits.yaw_moment),
    )
    found = []
    for name, unit, needed, limit in rows:
        worst = int(np.argmax(np.abs(needed)))
        if abs(needed[worst]) > limit:
            found.append(Excess(name, unit, float(abs(needed[worst])), limit, float(s[worst % len(s)])))
    return found


def _transition(speed: float, radius: float, vessel: Vessel, limits: TravelLimits) -> float:
    """The length of the transitions of a turn, m. Raises ParameterError if none is found that is within the limits."""
    # The largest slope of the curvature in a transition of the length c is 1.5/(R·c).
    transition = max(1.5 * speed * speed / (radius * limits.yaw_acceleration), radius / MAX_LENGTH_RATIO)
    bounds = limits._replace(yaw_rate=TRIED_SHARE * limits.yaw_rate, yaw_acceleration=TRIED_SHARE * limits.yaw_acceleration)
    while transition <= MAX_LENGTH_RATIO * radius:
        tried = _tried(Turning(speed, radius, transition), vessel)
        if tried and not excesses(tried, bounds, LARGEST_SHARE):
            return transition
        transition *= LONGER
    raise ParameterError(f"no turn with a radius of {radius:.3g} m at {speed:.3g} m/s is within the limits of this ship")


def _tried(t: Turning, vessel: Vessel) -> RouteMotion | None:
    """A half turn and another to the other side at once, as in a teardrop; None where the hull would move sideways."""
    leg = straight(RUN_UP * t.transition)
    angle = max(math.pi, 2.0 * t.transition / t.radius)
    bends = (turn(side * angle, t.radius, t.transition) for side in (-1.0, 1.0))
    route = Route([Element(part, 0, turn=True) for part in (leg, *bends, leg)], (0.0, 0.0, 0.0))
    try:
        return motion_along(route, SpeedProfile([Phase(route.length / t.speed, t.speed, t.speed)]), vessel, tolerance=TRIED)
    except ParameterError:
        return None
