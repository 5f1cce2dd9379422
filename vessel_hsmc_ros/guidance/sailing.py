"""What a hull can sail: turns within its limits, motions on the spot, and whole routes.

A ship that sails a route: the plan of geometry, speed and motion, checked against its limits.

The turns that a ship can make: radius and transitions for a speed, and the speed for a radius, from its hull and its limits.

A steady turn takes a drift angle, a yaw rate, a surge force and a yaw moment; the transitions before and after it take yaw
acceleration, and until the drift has followed more yaw rate and moment than the turn itself. The radius is the smallest at which
the steady turn stays within the limits, the transition the shortest, by steps, at which the whole turn does.

Motions of the hull itself near a point: a turn on the spot from rest to rest, and a halt from any motion.

Surge speed and yaw rate are given, the sway velocity and the position follow by integration of m22·dv + m23·dr = -m11·u·r - Y.
"""

import cmath
import math
from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import Motion, wrap
from vessel_hsmc_ros.core.metrics import NO_LEG
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.guidance.curve_motion import Demand, Pace, demand
from vessel_hsmc_ros.guidance.curves import Arc
from vessel_hsmc_ros.guidance.route import (
    CONSTANT,
    FREE,
    RISE,
    Element,
    Phase,
    Route,
    Section,
    SpeedProfile,
    TravelLimits,
    Turning,
    phases,
    straight,
    turn,
)
from vessel_hsmc_ros.guidance.route_motion import RouteMotion, motion_along, timetable
from vessel_hsmc_ros.guidance.timetable import Timetable, blended, joined, world_rows
from vessel_hsmc_ros.plant.dynamics import Velocities, Vessel, inverse_dynamics, unforced_sway

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
    """The fastest turn with a radius. `radius`: m. `speed`: largest speed over ground, m/s."""
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

    `name`: of the parameter, for the error message. `speed`: speed over ground, m/s.
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
    """What a motion takes beyond the limits. `motion`: the motion over ground. `share`: of surge force and yaw moment."""
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


STEPS, SUBSTEPS = 16, 4  # instants of each part of a change of speed, and steps of the integration of the sway between two
DECAY, DECAY_STEPS = 12.0, 128
"""Time after the turn or halt in which the sway decays, in terms of its time constant, and its instants."""

HALT_SHARE = 0.75  # share of the limits of the acceleration that a halt takes; the rest is for the transition to it
BLENDED = 0.4
"""Share of the braking of a halt in which the acceleration of the motion before it decays. On its way it reaches -0.37 of what it
was; that is over before the braking has reached HALT_SHARE, so that the sum stays within the limits."""

PASSES = 5  # passes that find the heading towards a point while the ship moves aside
NEGLIGIBLE = 1e-6
"""Angle that is not worth a turn, rad, and speed at which there is no drift, relative to what the sway takes to decay."""


class _Given(NamedTuple):
    """Surge speed and yaw rate with their rates, and the heading, at instants; arrays."""

    times: Array
    u: Array
    du: Array
    psi: Array
    r: Array
    dr: Array


def spot_turn(pose: tuple[float, float, float], target: complex, vessel: Vessel, limits: TravelLimits) -> Timetable | None:
    """Turn the bow towards a point.

    `pose`: x, y, psi at the beginning; at rest. `target`: the point, m. Returns the motion, from the time 0 on; None where the
    bow points there. Raises ParameterError if the yaw moment is too small for any turn.
    """
    x, y, psi = pose
    here, table = complex(x, y), None
    for _ in range(PASSES if vessel.coupled else 1):
        angle = wrap(cmath.phase(target - here) - psi)
        if abs(angle) < NEGLIGIBLE:
            return None
        table = _turned(pose, angle, vessel, limits)
        here = complex(table.rows[-1, 0], table.rows[-1, 1])
    return table


def halt(motion: Motion, row: Array, vessel: Vessel, limits: TravelLimits) -> Timetable:
    """Come to rest. `row`: the row of a table there, whose acceleration decays. Returns the motion, from the time 0 on."""
    x, y, psi, u, v, r = motion
    # A yaw rate that is just gathering would be halted in no time, and with no time for its acceleration to decay.
    gathering = RISE * min(1.0, abs(row[8]) / limits.yaw_acceleration) * limits.yaw_rate
    slowing = max(abs(u) / limits.acceleration, max(abs(r), gathering) / limits.yaw_acceleration)
    duration, sway_time = slowing / (HALT_SHARE * (1.0 - RISE)), vessel.m22 / vessel.d_v
    profile = SpeedProfile([Phase(max(duration, 1e-3 * sway_time), 1.0, 0.0)])
    times = _instants(profile, vessel, drifts=vessel.coupled or math.hypot(u, v) > NEGLIGIBLE * limits.acceleration * sway_time)
    integral, share, rate = profile.at(times)
    given = _Given(times, u * share, u * rate, psi + r * integral, r * share, r * rate)
    halted = _integrated(complex(x, y), v, given, vessel)[0]
    return blended(halted, row, BLENDED * float(profile.times[-1]))


def _turned(pose: tuple[float, float, float], angle: float, vessel: Vessel, limits: TravelLimits) -> Timetable:
    x, y, psi = pose
    share, side = 1.0, math.copysign(1.0, angle)
    while share > SLOWEST:
        profile = SpeedProfile(phases([Section(abs(angle), share * limits.yaw_rate, FREE)], share * limits.yaw_acceleration))
        times = _instants(profile, vessel, vessel.coupled)
        turned, r, dr = (side * column for column in profile.at(times))
        still = np.zeros_like(times)
        table, v, dv = _integrated(complex(x, y), 0.0, _Given(times, still, still, psi + turned, r, dr), vessel)
        if (
            np.max(np.abs(inverse_dynamics(Velocities(still, v, r, still, dv, dr), vessel)[1]))
            <= LARGEST_SHARE * limits.yaw_moment
        ):
            return table
        share *= SLOWER
    raise ParameterError(
        f"reference_ship: a turn on the spot needs more than {LARGEST_SHARE:g} of vessel.yaw_moment_limit ="
        f" {limits.yaw_moment:g} N·m, even at {SLOWEST:g} of motion.yaw_acceleration; a smaller one would do"
    )


def _instants(profile: SpeedProfile, vessel: Vessel, drifts: bool) -> Array:
    corners = profile.corners
    parts = [np.linspace(begin, end, STEPS, endpoint=False) for begin, end in pairwise(corners)]
    decay = DECAY * vessel.m22 / vessel.d_v if drifts else 0.0
    if drifts:
        parts.append(corners[-1] + np.linspace(0.0, decay, DECAY_STEPS, endpoint=False))
    return np.append(np.concatenate(parts), corners[-1] + decay)


def _integrated(start: complex, v0: float, given: _Given, vessel: Vessel) -> tuple[Timetable, Array, Array]:
    """The table, the sway velocity and its rate."""
    times, u, du, psi, r, dr = given
    n = len(times)
    v, p = np.full(n, v0), np.full(n, start)
    if vessel.coupled or v0 or np.any(u):
        for i in range(n - 1):
            v[i + 1], p[i + 1] = _advanced(v[i], p[i], given, i, vessel)
    # At rest at the end, but for what is left of a decay.
    v[-1] = 0.0
    dv = np.array([unforced_sway(*row, vessel) for row in zip(u, v, r, dr, strict=True)])
    return Timetable(times, world_rows((p.real, p.imag, psi, u, v, r), (du, dv, dr))), v, dv


def _advanced(v: float, p: complex, given: _Given, i: int, vessel: Vessel) -> tuple[float, complex]:
    """Sway velocity and position at the next instant, by Heun's method between which the others are linear."""
    h = (given.times[i + 1] - given.times[i]) / SUBSTEPS
    ends = [(column[i], column[i + 1] - column[i]) for column in (given.u, given.psi, given.r, given.dr)]
    for k in range(SUBSTEPS):
        (u, psi, r, dr), after = ([a + j / SUBSTEPS * b for a, b in ends] for j in (k, k + 1))
        first = unforced_sway(u, v, r, dr, vessel)
        second = unforced_sway(after[0], v + h * first, after[2], after[3], vessel)
        w = v + 0.5 * h * (first + second)
        p += 0.5 * h * (complex(u, v) * cmath.exp(1j * psi) + complex(after[0], w) * cmath.exp(1j * after[1]))
        v = w
    return float(v), complex(p)


TURN_SHARE, LEAST_SHARE = 0.5, 0.2
"""Largest share of the accelerations with which the speed changes in a turn, and the share below which it is constant."""


class Sailing(NamedTuple):
    """A route, the speed along it, the motion of the hull on it, and its timetable from the time 0 on."""

    route: Route
    profile: SpeedProfile
    motion: RouteMotion
    table: Timetable


AT_REST = (0.0, 0.0)
REACHED = 1e-9
RESTING = 1e-3  # share of the largest yaw rate below which a ship that has come to the end is at rest
ATTEMPTS, SLOWER_TURN, GENTLER = 24, 0.95, 0.7
"""Attempts to keep all limits, and what reduces the speed of a turn and the acceleration from one to the next."""


def sail(
    owner: str,
    route: Route,
    sections: Sequence[Section],
    vessel: Vessel,
    limits: TravelLimits,
    start: tuple[float, float] = AT_REST,
) -> Sailing:
    """Sail a route to rest.

    `owner`: name of the mode, for the error message. `start`: speed [m/s] and drift angle at the beginning.
    """
    top = max(section.speed for section in sections)
    acceleration = largest_acceleration(top, vessel, limits)
    slower = _freed(route, sections, limits, acceleration)
    for _ in range(ATTEMPTS):
        sailing = _sailing(owner, route, phases(slower, acceleration, start[0]), vessel, start)
        found = excesses(sailing.motion, limits)
        if not found:
            return sailing._replace(table=_rested(sailing.table, vessel, limits))
        # A drift that has not decayed takes yaw acceleration where the speed changes, and where turns follow each other.
        worst = int(route.index_at(found[0].s))
        near = [i for i in range(max(0, worst - 1), min(worst + 2, len(slower))) if slower[i].share and _changes(sailing, i)]
        if near:
            for i in near:
                share = 0.5 * slower[i].share
                slower[i] = slower[i]._replace(share=share if share > LEAST_SHARE else CONSTANT)
        elif route.elements[worst].turn:
            slower[worst] = slower[worst]._replace(speed=SLOWER_TURN * slower[worst].speed)
        else:
            acceleration *= GENTLER
    where = place(route, found[0].s)
    raise ParameterError(f"{owner}: {where} needs {' and '.join(map(str, found))}; a lower speed or longer legs would do")


def _freed(route: Route, sections: Sequence[Section], limits: TravelLimits, acceleration: float) -> list[Section]:
    """The sections, of which turns change their speed with a share of the yaw acceleration or of the acceleration."""
    freed, largest = [], limits.yaw_acceleration
    for element, section in zip(route.elements, sections, strict=True):
        share = TURN_SHARE * largest / max(element.sharpest * acceleration, largest) if element.turn else section.share
        freed.append(section._replace(share=share))
    return freed


def _changes(sailing: Sailing, i: int) -> bool:
    """Whether the speed changes in an element that is a turn."""
    ends, travel = sailing.route.element_ends, sailing.motion.travel
    inside = (travel.s >= ends[i]) & (travel.s <= ends[i + 1])
    return sailing.route.elements[i].turn and bool(np.any(travel.W_rate[inside]))


def _sailing(owner: str, route: Route, parts: Sequence[Phase], vessel: Vessel, start: tuple[float, float]) -> Sailing:
    speed, beta = start
    if parts[0].begin < (1.0 - REACHED) * speed:
        raise ParameterError(f"{owner}: at {speed:.3g} m/s there is no room to slow down for the first corners")
    profile = SpeedProfile(parts)
    motion = motion_along(route, profile, vessel, beta)
    return Sailing(route, profile, motion, timetable(motion, route, 0.0))


def _rested(table: Timetable, vessel: Vessel, limits: TravelLimits) -> Timetable:
    """A table, and the end of the turning that is left where the drift has not decayed on a short last leg."""
    x, y, psi, _, _, r = map(float, table.rows[-1, :6])
    if abs(r) <= RESTING * limits.yaw_rate:
        return table
    return joined([table, halt(Motion(x, y, psi, 0.0, 0.0, r), table.rows[-1], vessel, limits)])


def place(route: Route, s: float) -> str:
    """The leg or turn of an arc length, m, in words."""
    element = route.elements[int(route.index_at(s))]
    if element.leg == NO_LEG:
        return "the run-in"
    return f"turn {element.leg + 1}" if element.turn else f"leg {element.leg + 1}"
