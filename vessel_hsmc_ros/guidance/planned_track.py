"""A plan: the geometry of a path or survey, the errors of a ship against it, and a motion that is known ahead as a table.

| symbol | meaning | unit |
|---|---|---|
| p | position of the ship, as a complex number | m |
| P(s), chi(s), kappa(s) | position, course and curvature of the plan at the arc length s | m, rad, 1/m |
| s_p | arc length of the plan at the time | m |

On a leg the line is straight, beyond its ends too: with d = (p - P(s_p))·exp(-i·chi), the cross-track error is Im d, the
along-track error Re d. In a turn, s is the arc length of the nearest point near s_p, the cross-track error is Im d there, and the
along-track error s - s_p. The motion of the reference has no part in it.

The rows of a table are position and heading with their first and second derivatives. Between them stand polynomials of the fifth
degree, so that position, velocity and acceleration are continuous and those of one motion; they are derivatives, not integrated.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.fence import Fence, leaving
from vessel_hsmc_ros.core.kernel import Array, kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.metrics import NO_LEG, TrackErrors
from vessel_hsmc_ros.guidance.programs import KernelReference, passed
from vessel_hsmc_ros.guidance.route import Element, Route, SpeedProfile

ComplexArray = NDArray[np.complex128]

STEPS, LEAST_SLOPE = 12, 0.25
"""Steps of Newton's method to the nearest point of a turn, and the smallest slope 1 - kappa·Im d that it divides by."""

FINE = 0.1
"""Largest distance between two positions with which a leg is compared, relative to that within which it counts as passed."""

FENCE_POINTS = 1000  # of a stretch between two stops that are compared with a fence

FARTHEST = 0.5  # how far from s_p the nearest point is sought, in terms of the smallest radius of curvature


class Stretch(NamedTuple):
    """A route that is sailed without a stop: its geometry, the speed along it, and when it begins and ends, s."""

    route: Route
    profile: SpeedProfile
    begin: float
    end: float

    def sailed(self, time: float) -> float:
        """The way along it until a time, s, or its end, m."""
        return float(self.profile.at(np.array([min(self.end, time) - self.begin]))[0][0]) if time > self.begin else 0.0


class PlannedTrack(NamedTuple):
    """A plan."""

    stretches: tuple[Stretch, ...]  # in their order
    waypoints: tuple[complex, ...]  # m; for a survey the ends of its legs
    near: float  # distance within which a point of a leg counts as passed, m
    waits: bool = False  # whether its clock waits for the vessel


def stretch(route: Route, profile: SpeedProfile, begin: float) -> Stretch:
    """A stretch that begins at a time, s."""
    return Stretch(route, profile, begin, begin + float(profile.times[-1]))


def replaced(track: PlannedTrack, now: float, new: PlannedTrack) -> PlannedTrack:
    """A plan in whose place another one comes at a time, s."""
    kept = tuple(one._replace(end=min(one.end, now)) for one in track.stretches if one.begin < now)
    return PlannedTrack(kept + new.stretches, track.waypoints + new.waypoints, new.near, track.waits)


def leg_ends(route: Route) -> tuple[complex, ...]:
    """Where the legs of a route begin and end, m."""
    points = route.position(route.element_ends)
    return tuple(complex(points[i + k]) for i, element in enumerate(route.elements) if _is_leg(element) for k in (0, 1))


def leg_count(track: PlannedTrack) -> int:
    """The number of legs of a plan."""
    return len({(i, e.leg) for i, one in enumerate(track.stretches) for e in one.route.elements if _is_leg(e)})


def _is_leg(element: Element) -> bool:
    return not element.turn and element.leg != NO_LEG


def clock(track: PlannedTrack, time: Array, reference: Array) -> Array:
    """The times of a plan at those of a run, (n,) s: others where its clock waits, found by the way of the reference.

    `time`: times since the reference began, (n,) s. `reference`: x, y of the reference, (n, 2) m.
    """
    if not track.waits:
        return time
    steps = np.abs(np.diff(reference[:, 0] + 1j * reference[:, 1], prepend=reference[0, 0] + 1j * reference[0, 1]))
    way, before = np.cumsum(np.nan_to_num(steps)), 0.0
    found = np.zeros(len(time))
    for one in track.stretches:
        length = one.sailed(one.end)
        at = way >= before
        found[at] = one.begin + one.profile.time_at(np.clip(way[at] - before, 0.0, length))
        before += length
    return found


def track_errors(track: PlannedTrack, time: Array, position: Array) -> TrackErrors:
    """Cross-track and along-track errors of a ship.

    `time`: times since the reference began, (n,) s. `position`: x, y of the ship, (n, 2) m.
    """
    n = len(time)
    found = TrackErrors(np.full(n, NO_LEG, np.int64), np.zeros(n, np.bool_), np.full(n, np.nan), np.full(n, np.nan))
    for one in track.stretches:
        at = np.flatnonzero((time >= one.begin) & (time < one.end))
        if len(at):
            p = position[at, 0] + 1j * position[at, 1]
            errors = _errors(one.route, one.profile.at(time[at] - one.begin)[0], p)
            for column, values in zip(found, errors, strict=True):
                column[at] = values
    return found


def passed_legs(track: PlannedTrack, time: float, position: Array) -> dict[int, tuple[float, float]]:
    """How much of each leg was passed near enough, by its number: that length, and the length planned until a time, m.

    `time`: since the reference began, s. `position`: x, y of the ship, (n, 2) m.
    """
    p = position[:, 0] + 1j * position[:, 1]
    longest = float(np.abs(np.diff(p)).max(initial=0.0))
    p = p[:: max(1, int(FINE * track.near / longest))] if longest else p[:1]
    found: dict[int, tuple[float, float]] = {}
    for one in track.stretches:
        sailed = one.sailed(time)
        for element, (begin, end) in zip(one.route.elements, pairwise(one.route.element_ends), strict=True):
            length = float(min(end, sailed) - begin)
            if _is_leg(element) and length > 0.0:
                near, whole = found.get(element.leg, (0.0, 0.0))
                d = _offset(one.route, np.array(begin), p)
                found[element.leg] = near + _covered(d, length, track.near), whole + length
    return found


def _covered(d: ComplexArray, length: float, near: float) -> float:
    """The length of a leg that is near a track, along and across which the track is d, m."""
    across = np.maximum(np.abs(d.imag[:-1]), np.abs(d.imag[1:]))
    at = across <= near
    reach = np.sqrt(near * near - across[at] * across[at])
    low = np.clip(np.minimum(d.real[:-1], d.real[1:])[at] - reach, 0.0, length)
    high = np.clip(np.maximum(d.real[:-1], d.real[1:])[at] + reach, 0.0, length)
    if not len(low):
        return 0.0
    order = np.argsort(low)
    low, reached = low[order], np.maximum.accumulate(high[order])
    return float(reached[-1] - low[0] - np.sum(np.maximum(low[1:] - reached[:-1], 0.0)))


def outline(track: PlannedTrack, points: int) -> list[ComplexArray]:
    """Positions along each stretch, as far as it was sailed, m.

    Args:
        track: The plan.
        points: Number of positions of a stretch.
    """
    return [one.route.position(np.linspace(0.0, one.sailed(one.end), points)) for one in track.stretches]


def _errors(route: Route, planned: Array, p: ComplexArray) -> TrackErrors:
    index = route.index_at(planned)
    turn = np.array([element.turn for element in route.elements])[index]
    leg = np.array([element.leg for element in route.elements], np.int64)[index]
    cross, along = np.empty(len(p)), np.empty(len(p))
    d = _offset(route, planned[~turn], p[~turn])
    cross[~turn], along[~turn] = d.imag, d.real
    nearest = _nearest(route, planned[turn], p[turn])
    cross[turn], along[turn] = _offset(route, nearest, p[turn]).imag, nearest - planned[turn]
    return TrackErrors(leg, turn, cross, along)


def _offset(route: Route, s: Array, p: ComplexArray) -> ComplexArray:
    """From a point of the route to the ship, along and across the course there, m."""
    result: ComplexArray = (p - route.position(s)) * np.exp(-1j * route.course(s))
    return result


def _nearest(route: Route, planned: Array, p: ComplexArray) -> Array:
    sharpest = max(element.sharpest for element in route.elements)
    reach = FARTHEST / sharpest if sharpest else route.length
    s = planned
    for _ in range(STEPS):
        d = _offset(route, s, p)
        s = s + d.real / np.maximum(1.0 - route.curvature(s)[0] * d.imag, LEAST_SLOPE)
        s = np.clip(s, np.maximum(planned - reach, 0.0), np.minimum(planned + reach, route.length))
    return s


def stretches_of(parts: Sequence[Stretch], delay: float) -> tuple[Stretch, ...]:
    """Stretches that begin later by a delay, s."""
    return tuple(one._replace(begin=one.begin + delay, end=one.end + delay) for one in parts)


def track_leaving(fence: Fence, track: PlannedTrack) -> str:
    """As `leaving`, of a planned way with its turns; a turn counts to the leg before it."""
    for one in track.stretches:
        s = np.linspace(0.0, one.route.length, FENCE_POINTS)
        legs = np.maximum.accumulate(np.array([element.leg for element in one.route.elements])[one.route.index_at(s[1:])]) + 1
        if found := leaving(fence, one.route.position(s), legs.tolist()):
            return found
    return ""


class Timetable(NamedTuple):
    """A motion over time."""

    times: Array  # increasing times, shape (n,), s
    rows: Array  # x, y, psi, their first and their second derivatives, shape (n, 9)


def joined(tables: Sequence[Timetable]) -> Timetable:
    """Tables one after the other, each of which begins at the time 0 where and as the last one ends."""
    times, rows, begin = [tables[0].times[:1]], [tables[0].rows[:1]], float(tables[0].times[0])
    for table in tables:
        times.append(begin + table.times[1:])
        rows.append(table.rows[1:])
        begin += float(table.times[-1])
    return Timetable(np.concatenate(times), np.concatenate(rows))


def blended(table: Timetable, row: Array, duration: float) -> Timetable:
    """A table that begins with a given row: the difference decays along a polynomial of the fifth degree.

    `row`: its first row as it must be, shape (9,). `duration`: time in which the difference decays, s.
    """
    offset, rows = row - table.rows[0], table.rows.copy()
    elapsed = table.times - table.times[0]
    for i in np.flatnonzero(elapsed < duration):
        for j in range(3):
            begin = float(offset[j]), float(offset[3 + j]), float(offset[6 + j])
            rows[i, j::3] += quintic(begin, (0.0, 0.0, 0.0), duration, float(elapsed[i]) / duration)
    return Timetable(table.times, rows)


def world_rows(motion: Motion | tuple[Any, ...], acceleration: Acceleration | tuple[Any, ...]) -> Array:
    """The rows of a table of states and the derivatives of their velocities: shape (9,) of numbers, (n, 9) of arrays."""
    x, y, psi, u, v, r = motion
    du, dv, dr = acceleration
    along = np.exp(1j * psi)
    velocity, change = (u + 1j * v) * along, (du - r * v + 1j * (dv + r * u)) * along
    return np.stack((x, y, psi, velocity.real, velocity.imag, r, change.real, change.imag, dr), axis=-1)


def at_rest(motion: Motion, *times: float) -> Timetable:
    """A table of a ship that stays where it is."""
    return Timetable(np.array(times), np.array([[*motion[:3], *[0.0] * 6]] * len(times)))


class TimetableConstants(NamedTuple):
    """The table, and the length of a step, s."""

    table: Timetable
    period: float


class TimetableMemory(NamedTuple):
    """Number of steps, whole ones but where the clock waits for the vessel: the motion is a function of time."""

    steps: float


@kernel
def quintic(a: tuple[float, float, float], b: tuple[float, float, float], h: float, z: float) -> tuple[float, float, float]:
    """The polynomial of the fifth degree between two points: value, first and second derivative.

    `a`, `b`: value, first and second derivative at its two ends. `h`: time between these, s. `z`: where, from 0 to 1.
    """
    v, w, k = a[1] * h, b[1] * h, 0.5 * a[2] * h * h
    # Rests at z = 1 of the Taylor polynomial at z = 0: of value, slope and half the second derivative.
    e0, e1, e2 = b[0] - a[0] - v - k, w - v - 2.0 * k, 0.5 * b[2] * h * h - k
    c3, c4, c5 = 10.0 * e0 - 4.0 * e1 + e2, -15.0 * e0 + 7.0 * e1 - 2.0 * e2, 6.0 * e0 - 3.0 * e1 + e2
    value = a[0] + z * (v + z * (k + z * (c3 + z * (c4 + z * c5))))
    slope = v + z * (2.0 * k + z * (3.0 * c3 + z * (4.0 * c4 + z * 5.0 * c5)))
    bend = 2.0 * k + z * (6.0 * c3 + z * (12.0 * c4 + z * 20.0 * c5))
    return value, slope / h, bend / (h * h)


@kernel
def column(rows: Array, i: int, j: int) -> tuple[float, float, float]:
    """Value, first and second derivative of x, y or psi in a row."""
    return float(rows[i, j]), float(rows[i, 3 + j]), float(rows[i, 6 + j])


@kernel
def motion_at(time: float, table: Timetable) -> tuple[Motion, Acceleration]:
    """State, and the derivatives of its velocities; before the first and after the last time the ship is at rest."""
    i, last = passed(table.times, time) - 1, len(table.times) - 1
    if i < 0 or i >= last:
        i = 0 if i < 0 else last
        pose = Motion(float(table.rows[i, 0]), float(table.rows[i, 1]), float(table.rows[i, 2]), 0.0, 0.0, 0.0)
        return pose, Acceleration(0.0, 0.0, 0.0)
    begin = float(table.times[i])
    h = float(table.times[i + 1]) - begin
    z = (time - begin) / h
    x, dx, ddx = quintic(column(table.rows, i, 0), column(table.rows, i + 1, 0), h, z)
    y, dy, ddy = quintic(column(table.rows, i, 1), column(table.rows, i + 1, 1), h, z)
    psi, r, dr = quintic(column(table.rows, i, 2), column(table.rows, i + 1, 2), h, z)
    c, s = math.cos(psi), math.sin(psi)
    u, v = c * dx + s * dy, -s * dx + c * dy
    return Motion(x, y, psi, u, v, r), Acceleration(c * ddx + s * ddy + r * v, -s * ddx + c * ddy - r * u, dr)


@kernel
def move(m: TimetableMemory, c: TimetableConstants) -> TimetableMemory:  # noqa: ARG001 - the form of all references
    """The reference one period later."""
    return TimetableMemory(m.steps + 1)


@kernel
def read(m: TimetableMemory, c: TimetableConstants) -> tuple[Motion, Acceleration]:
    """State, and the derivatives of its velocities."""
    return motion_at(m.steps * c.period, c.table)


class TimetableReference(KernelReference):
    """A motion that is known ahead, in discrete time."""

    move, read = staticmethod(move), staticmethod(read)

    def __init__(self, table: Timetable, track: PlannedTrack, period: float) -> None:
        self.constants, self.track = TimetableConstants(table, period), track
        self.reset()

    def reset(self) -> None:
        """Return to the start."""
        self.memory = TimetableMemory(0)

    @property
    def time_left(self) -> float:
        """Time until the end of the table, s."""
        return max(0.0, float(self.constants.table.times[-1] - self.memory.steps * self.constants.period))
