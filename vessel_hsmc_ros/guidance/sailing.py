"""A ship that sails a route: the plan of geometry, speed and motion, checked against its limits."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.core.track_errors import NO_LEG
from vessel_hsmc_ros.guidance.on_the_spot import halt
from vessel_hsmc_ros.guidance.route import Route
from vessel_hsmc_ros.guidance.route_motion import RouteMotion, motion_along, timetable
from vessel_hsmc_ros.guidance.speed_profile import CONSTANT, Phase, Section, SpeedProfile, phases
from vessel_hsmc_ros.guidance.timetable import Timetable, joined
from vessel_hsmc_ros.guidance.turning import TravelLimits, excesses, largest_acceleration
from vessel_hsmc_ros.plant.dynamics import Vessel

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
ATTEMPTS, SLOWER, GENTLER = 24, 0.95, 0.7
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

    `owner`: name of the mode, for the error message. `start`: speed [m/s] and drift angle at the beginning. Raises
    ParameterError if a limit is exceeded, or the ship cannot slow down in time; the message contains where, demand and limit.
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
            slower[worst] = slower[worst]._replace(speed=SLOWER * slower[worst].speed)
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
