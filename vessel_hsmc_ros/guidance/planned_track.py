"""A plan: the geometry of a path or survey, the errors of a ship against it, and the reference that follows it.

| symbol | meaning | unit |
|---|---|---|
| p | position of the ship, as a complex number | m |
| P(s), chi(s), kappa(s) | position, course and curvature of the plan at the arc length s | m, rad, 1/m |
| s_p | arc length of the plan at the time | m |

On a leg the line is straight, beyond its ends too: with d = (p - P(s_p))·exp(-i·chi), the cross-track error is Im d, the
along-track error Re d. In a turn, s is the arc length of the nearest point near s_p, the cross-track error is Im d there, and the
along-track error s - s_p. The motion of the reference has no part in it.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.fence import Fence, leaving
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.metrics import NO_LEG, TrackErrors
from vessel_hsmc_ros.guidance.route import Element, Route, SpeedProfile
from vessel_hsmc_ros.guidance.timetable import (
    KernelReference,
    Timetable,
    TimetableConstants,
    TimetableMemory,
    move_table,
    read_table,
)

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


class TimetableReference(KernelReference):
    """A motion that is known ahead, in discrete time."""

    move, read = staticmethod(move_table), staticmethod(read_table)

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
