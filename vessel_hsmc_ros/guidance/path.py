"""Paths: waypoints joined by legs and corners that the hull can sail, from the present motion to rest at the last waypoint.

A stop divides a path into parts that begin at rest, with a turn on the spot towards the next waypoint. Each part is a route: its
legs, and corners with the smallest radius at the speed of the legs, or slower where the legs are too short for that.
"""

import cmath
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, wrap
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.guidance.bends import wide_corners
from vessel_hsmc_ros.guidance.corners import STOP, join
from vessel_hsmc_ros.guidance.on_the_spot import halt, spot_turn
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack, Stretch, stretch
from vessel_hsmc_ros.guidance.polyline import Part, Planned, Ship, Waypoint, begun, fitted_turning, polyline
from vessel_hsmc_ros.guidance.route import Element, Route, straight
from vessel_hsmc_ros.guidance.sailing import Sailing, sail
from vessel_hsmc_ros.guidance.speed_profile import FREE, Section, changes_of
from vessel_hsmc_ros.guidance.thinning import Scale, ahead, thinned
from vessel_hsmc_ros.guidance.timetable import Timetable, blended, joined
from vessel_hsmc_ros.guidance.turning import TravelLimits, check_straight, largest_acceleration

Array = NDArray[np.float64]

SLOW = 0.5  # share of the required speed below which the mean speed of a path is named
DISTINCT = 2e-3  # waypoints nearer to each other than this are one, relative to the radius of gyration of the hull
TOLERANCE, REACH = 0.4, 4.0
"""How far points that are left out may be from the way, and how far off a leg a ship may be to be on it, relative to the radius
of gyration, a quarter of the length of most hulls."""

TURN_WAY = 2.5
"""Way in which a ship under way turns to a point and its drift decays, in radii of the turn of the largest yaw rate."""

NEAR = 2.0  # distance within which a ship passes a point of a leg, in radii of gyration: half of the length of most hulls
AT_REST = 1e-3  # shares of speed and largest yaw rate below which the ship counts as at rest where a path begins
SPEED_GAIN, SHORTEST = 0.07, 0.01
"""Speed that an acceleration brings while it decays in a time, relative to their product; and the least share of that of a
transition in which it decays."""

JOIN_SPEEDS = (1.0, 0.6, 0.35, 0.2)
"""Speeds of the turn with which a path begins under way, relative to that of the path, in the order of preference."""

FAR = 1e9  # distance of a point that has the same bearing from wherever a vessel turns on the spot, m
SET_OFF, SET_OFF_SHARE = 0.3, 0.1
"""Speed of the beginning after a turn on the spot, in terms of the radius of gyration and the yaw acceleration, and largest share
of the leg that it takes."""


class Plan(NamedTuple):
    """A path as a motion over time and its geometry, both from the time 0 on; and a remark where it is much slower."""

    table: Timetable
    track: PlannedTrack
    slow: str = ""


class PathPiece(NamedTuple):
    """A part of a plan: its motion, and the sailing that it is; None for a halt or a turn on the spot."""

    table: Timetable
    sailing: Sailing | None = None


def plan_path(waypoints: Sequence[Waypoint], motion: Motion, acceleration: Acceleration, ship: Ship, speed: float) -> Plan:
    """The motion along a path, and its geometry.

    `waypoints`: the waypoints in their order; without one the ship comes to rest. `speed`: its usual speed, m/s. Raises
    ParameterError if a leg or a corner cannot be sailed; the message contains which, and what would do.
    """
    waypoints = [point._replace(number=k) for k, point in enumerate(waypoints, 1)]
    speeds = {point.speed for point in waypoints}
    for one in sorted(speeds):
        check_straight(f"{ship.owner}: speed", one, ship.vessel, ship.limits)
    fastest = max(speeds, default=speed)
    slow = _resting(motion, AT_REST, fastest, ship.limits)
    points = _needed(waypoints, motion, slow, fastest, ship)
    # A ship under way returns to a path of no waypoint but where it is.
    parts = _parts(points if points or slow else waypoints[-1:])
    pieces: list[PathPiece] = []
    required = _required_time(complex(motion.x, motion.y), points, ship.limits.acceleration)
    row, resting = world_row(motion, acceleration), slow if parts else _resting(motion, 0.0, fastest, ship.limits)
    if not resting:
        pieces += _under_way(parts, motion, acceleration, fastest, ship)
    elif waypoints and _is_here(waypoints[0], motion, ship):
        pieces += _rest(waypoints[0], motion, ship)
    for given in parts:
        pieces += _from_stop(given, rest_of(pieces[-1].table) if pieces else motion, ship)
    if pieces and resting:
        pieces[0] = _settling(pieces[0], row, ship.limits)
    track = PlannedTrack(_stretches(pieces), tuple(point.position for point in waypoints), NEAR * _gyration(ship))
    still = Timetable(np.zeros(1), np.array([[*motion[:3], *[0.0] * 6]]))
    table = joined([piece.table for piece in pieces]) if pieces else still
    return Plan(table, track, _slow(required, sum(float(piece.table.times[-1]) for piece in pieces if piece.sailing)))


def _from_stop(given: Part, motion: Motion, ship: Ship) -> list[PathPiece]:
    """A part from rest to rest: the turn on the spot towards it, its legs, and what the vessel does at its end."""
    part = _wide(complex(motion.x, motion.y), given, ship)
    turned = spot_turn((motion.x, motion.y, motion.psi), part.points[0].position, ship.vessel, ship.limits)
    before = rest_of(turned) if turned is not None else motion
    legs = _from_rest(part, before, ship, turned)
    found = [PathPiece(turned), legs] if turned is not None else [legs]
    return found + _rest(given.points[-1], rest_of(legs.table), ship)


def _rest(point: Waypoint, motion: Motion, ship: Ship) -> list[PathPiece]:
    """What a vessel at rest does at a waypoint: it turns to the heading there on the spot, and holds."""
    pieces = []
    if point.heading is not None:
        towards = complex(motion.x, motion.y) + FAR * cmath.exp(1j * point.heading)
        turned = spot_turn((motion.x, motion.y, motion.psi), towards, ship.vessel, ship.limits)
        if turned is not None:
            pieces.append(PathPiece(turned))
            motion = rest_of(turned)
    if point.hold:
        settled = min(point.hold, ship.limits.yaw_rate / ship.limits.yaw_acceleration)
        times = np.unique([0.0, settled, point.hold])
        pieces.append(PathPiece(Timetable(times, np.array([[*motion[:3], *[0.0] * 6]] * len(times)))))
    return pieces


def _is_here(point: Waypoint, motion: Motion, ship: Ship) -> bool:
    return abs(point.position - complex(motion.x, motion.y)) <= DISTINCT * _gyration(ship)


def _required_time(start: complex, points: Sequence[Waypoint], acceleration: float) -> float:
    """The time of the legs at their speeds, with speeding up and slowing down at the ends and at each stop, s."""
    ways = np.abs(np.diff([start, *(point.position for point in points)]))
    stops = sum(point.corner == STOP for point in points)
    change = 2.0 * max((point.speed for point in points), default=0.0) / acceleration
    return sum(float(way) / point.speed for way, point in zip(ways, points, strict=True)) + (1.0 + stops) * change


def _slow(required: float, time: float) -> str:
    """A remark on a path that takes a time, s, where another one was required."""
    if required >= SLOW * time:
        return ""
    share = quantity(100.0 * required / time, "%")
    corners = "its corners are too sharp or too close together"
    return f"the path takes {quantity(time, 's')}, at {share} of the speed of its legs on average: {corners}"


def _resting(motion: Motion, share: float, fastest: float, limits: TravelLimits) -> bool:
    """Whether a ship is slower than a share of its speed and of its largest yaw rate."""
    return math.hypot(motion.u, motion.v) <= share * fastest and abs(motion.r) <= share * limits.yaw_rate


def _settling(piece: PathPiece, row: Array, limits: TravelLimits) -> PathPiece:
    """The first piece of a ship that counts as at rest: what is left of the motion before it decays."""
    decay = min(float(piece.table.times[-1]), limits.yaw_rate / limits.yaw_acceleration)
    return piece._replace(table=blended(piece.table, row, decay))


def _stretches(pieces: Sequence[PathPiece]) -> tuple[Stretch, ...]:
    ends = np.cumsum([float(piece.table.times[-1]) for piece in pieces])
    return tuple(
        stretch(piece.sailing.route, piece.sailing.profile, float(end - piece.table.times[-1]))
        for piece, end in zip(pieces, ends, strict=True)
        if piece.sailing
    )


def _needed(waypoints: Sequence[Waypoint], motion: Motion, slow: bool, fastest: float, ship: Ship) -> list[Waypoint]:
    """The waypoints that a ship, at rest or under way, has to go to."""
    gyration, here = _gyration(ship), complex(motion.x, motion.y)
    course, turn = motion.psi, 0.0
    if not slow:
        course, turn = motion.psi + math.atan2(motion.v, motion.u), TURN_WAY * fastest / ship.limits.yaw_rate
    left = ahead(
        _distinct(here, waypoints, DISTINCT * gyration), here, course, Scale(TOLERANCE * gyration, REACH * gyration, turn)
    )
    return thinned(here, left, TOLERANCE * gyration)


def _gyration(ship: Ship) -> float:
    """The radius of gyration of the hull, m."""
    return math.sqrt(ship.vessel.m33 / ship.vessel.m22)


def _wide(start: complex, part: Part, ship: Ship) -> Part:
    return wide_corners(start, part, ship, TOLERANCE * _gyration(ship))


def _distinct(here: complex, waypoints: Sequence[Waypoint], least: float) -> list[Waypoint]:
    """The waypoints at least a distance apart, m: repetitions would give legs without a direction."""
    found: list[Waypoint] = []
    for point in waypoints:
        last = found[-1].position if found else here
        if abs(point.position - last) > least:
            found.append(point)
        elif found and point.corner == STOP:
            found[-1] = found[-1]._replace(corner=STOP)
            heading = found[-1].heading if point.heading is None else point.heading
            found[-1] = found[-1]._replace(hold=found[-1].hold + point.hold, heading=heading)
    return found


def _parts(points: Sequence[Waypoint]) -> list[Part]:
    """The parts between stops."""
    parts, begin = [], 0
    for i, point in enumerate(points, 1):
        if point.corner == STOP or i == len(points):
            parts.append(Part(tuple(points[begin:i])))
            begin = i
    return parts


def rest_of(table: Timetable) -> Motion:
    """The state at rest at the end of a table."""
    x, y, psi = map(float, table.rows[-1, :3])
    return Motion(x, y, psi, 0.0, 0.0, 0.0)


def _from_rest(part: Part, motion: Motion, ship: Ship, turned: Timetable | None) -> PathPiece:
    start = complex(motion.x, motion.y)
    course = cmath.phase(part.points[0].position - start)
    return from_rest(polyline(start, part, ship), course, motion, ship, turned)


def from_rest(legs: Planned, course: float, motion: Motion, ship: Ship, turned: Timetable | None) -> PathPiece:
    """Legs and corners sailed from rest to rest.

    `course`: of the first leg, rad. `motion`: at rest where it begins. `turned`: the turn on the spot before it, if there is
    one. Raises ParameterError as `sail`.
    """
    elements, sections = legs
    if turned is not None:
        elements, sections = _set_off(elements, sections, float(turned.times[-1]), ship)
    # Not wrapped, so that the heading is continuous.
    course = motion.psi + wrap(course - motion.psi)
    route = Route(elements, (motion.x, motion.y, course))
    sailing = sail(ship.owner, route, sections, ship.vessel, ship.limits)
    # The heading at rest differs from the course of the leg by rounding, or by what is left of a drift angle.
    row = np.array([*motion[:3], *[0.0] * 6])
    return PathPiece(blended(sailing.table, row, float(sailing.table.times[-1]) / len(elements)), sailing)


def _set_off(elements: list[Element], sections: list[Section], duration: float, ship: Ship) -> Planned:
    """The first leg with a slow beginning, in which a ship that has not kept its heading at rest turns to the leg.

    `duration`: how long the beginning takes, s.
    """
    radius = math.sqrt(ship.vessel.m33 / ship.vessel.m22)
    length, speed = elements[0].length, SET_OFF * radius * math.sqrt(ship.limits.yaw_acceleration)
    way = min(speed * duration, SET_OFF_SHARE * length)
    if elements[0].turn or speed >= sections[0].speed:
        return elements, sections
    slow, rest = (elements[0]._replace(pieces=straight(part)) for part in (way, length - way))
    return [slow, rest, *elements[1:]], [Section(way, speed, FREE), sections[0]._replace(length=length - way), *sections[1:]]


def _under_way(parts: list[Part], motion: Motion, acceleration: Acceleration, fastest: float, ship: Ship) -> list[PathPiece]:
    """The first part from a motion; a halt where there is none, or where it is too short to slow down for its corners."""
    ahead = motion.u > abs(motion.v)
    for share in JOIN_SPEEDS if parts and ahead else ():
        try:
            piece = _joining(parts[0], motion, acceleration, share * fastest, ship)
        except ParameterError:
            continue
        return [piece, *_rest(parts.pop(0).points[-1], rest_of(piece.table), ship)]
    return [PathPiece(halt(motion, world_row(motion, acceleration), ship.vessel, ship.limits))]


def _joining(part: Part, motion: Motion, acceleration: Acceleration, speed: float, ship: Ship) -> PathPiece:
    """From a motion: its curvature decays, the speed becomes one to turn with, and the ship turns to the first waypoint."""
    row = world_row(motion, acceleration)
    velocity, change = complex(row[3], row[4]), complex(row[6], row[7])
    W, start = abs(velocity), complex(motion.x, motion.y)
    beta = wrap(cmath.phase(velocity) - motion.psi)
    course = motion.psi + beta
    turning = fitted_turning(speed, ship)
    fastest = max(W, *(point.speed for point in part.points))
    run = changes_of(largest_acceleration(fastest, ship.vessel, ship.limits), fastest).way(W, turning.speed)
    kappa = (velocity.conjugate() * change).imag / W**3
    target = (part.points[0].position - start) * cmath.exp(-1j * course)
    # In the time of a transition, also where the ship is slow.
    decay = turning.transition * min(1.0, W / turning.speed)
    before, bend = join(target, kappa, decay, turning.radius, turning.transition, run)
    elements, sections = begun(before, bend, W, turning)
    begin = Route(elements, (motion.x, motion.y, course))
    start = complex(begin.position(begin.length))
    more, rest = polyline(start, _wide(start, part, ship), ship, under_way=True)
    route = Route([*elements, *more], (motion.x, motion.y, course))
    sailing = sail(ship.owner, route, [*sections, *rest], ship.vessel, ship.limits, (W, beta))
    decays, gain = turning.transition / turning.speed, SPEED_GAIN * (velocity.conjugate() * change).real / W
    if gain * decays > fastest - W:
        decays = max(SHORTEST * decays, (fastest - W) / gain)
    return PathPiece(blended(sailing.table, row, decays), sailing)


def world_row(motion: Motion, acceleration: Acceleration) -> Array:
    """The row of a table: pose, its first and its second derivative, of a state and the derivatives of its velocities."""
    x, y, psi, u, v, r = motion
    du, dv, dr = acceleration
    along = cmath.exp(1j * psi)
    velocity, change = complex(u, v) * along, complex(du - r * v, dv + r * u) * along
    return np.array([x, y, psi, velocity.real, velocity.imag, r, change.real, change.imag, dr])
