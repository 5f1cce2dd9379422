"""The legs of a plan, and which of them no law can sail in a mean wind and a current.

Each leg is judged in a steady motion on its course, by the rules of campaigns (`studies.campaign.feasibility`). The surge force
must give the velocity through the water that the leg takes against the wind. Force and moment must be within their share of the
limits at the heading at which no sway force is left over.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.metrics import NO_LEG
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack
from vessel_hsmc_ros.plant.simulator import within
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.scenario.ship_rules import scale_of
from vessel_hsmc_ros.studies.campaign.feasibility import MAX_LIMIT_SHARE, MIN_WAY, STEP, demand, exceeded, infeasible_rest

SAMPLES = 1200  # of the steady motion on a leg, in steps of T/20; the heading settles in the first and the last third
SPEEDS = 50  # places of a leg at which its speed is read


class Leg(NamedTuple):
    """The straight part of a leg."""

    number: int  # from 0 on
    way: float  # arc length at which it begins, from the last stop on, m
    # begin, end: its ends, m
    begin: complex
    end: complex
    course: float  # rad
    speed: float  # the largest over ground, m/s


def legs_of(track: PlannedTrack) -> list[Leg]:
    """The legs of a plan in their order; of one in several parts, the whole."""
    found: dict[int, Leg] = {}
    for one in track.stretches:
        end = 0.0
        for element in one.route.elements:
            begin, end = end, end + element.length
            if element.leg == NO_LEG or (element.turn and element.leg in found):
                continue
            last = begin if element.turn else end  # of a leg that its corners take whole, the turn alone is left
            speed = float(one.profile.at(one.profile.time_at(np.linspace(begin, last, SPEEDS)))[1].max())
            a, b = map(complex, one.route.position(np.array([begin, last])))
            leg = found.get(element.leg, Leg(element.leg, begin, a, b, float(one.route.course(begin)), speed))
            found[element.leg] = leg._replace(end=b, speed=max(leg.speed, speed))
    return list(found.values())


def infeasible_legs(scenario: Scenario, legs: Sequence[Leg]) -> list[str]:
    """A line for each leg that cannot be sailed in the mean wind and the current of a scenario, and for holds.

    Raises ParameterError if the limits of the propulsion are missing.
    """
    scale_of(scenario.vessel_sim.vessel)  # checks the limits
    reasons = {f"leg {leg.number + 1}": _why_not(scenario, leg) for leg in legs}
    path = scenario.reference_ship
    if path.mode == "path" and any(path.path.holds):
        sim = scenario.vessel_sim
        reasons["a hold"] = infeasible_rest(*_loads(scenario), within(sim.actuators, sim.vessel), sim.vessel.coefficients())
    return [f"infeasible on {what}: {why}" for what, why in reasons.items() if why]


def _loads(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """Current [m/s] and mean force of the wind [N], east and north."""
    disturbance = scenario.vessel_sim.disturbance
    current, wind = disturbance.current, disturbance.earth_fixed
    return np.array([current.east, current.north]), np.array([wind.east_force, wind.north_force])


def _why_not(scenario: Scenario, leg: Leg) -> str:
    """Why a leg cannot be sailed; empty if it can."""
    sim, (current, wind) = scenario.vessel_sim, _loads(scenario)
    along = np.array([math.cos(leg.course), math.sin(leg.course)])
    limits = within(sim.actuators, sim.vessel)
    push = MAX_LIMIT_SHARE * limits.surge_force_limit + float(wind @ along)
    most = scale_of(replace(sim.vessel, surge_force_limit=push)).U if push > 0.0 else 0.0
    cross = abs(float(current[1] * along[0] - current[0] * along[1]))
    through = float(np.hypot(*(leg.speed * along - current)))
    has = f"the boat has {quantity(most, 'm/s')}{' in this wind' if np.any(wind) else ''}"
    if cross > most:
        return f"{quantity(cross, 'm/s')} of cross current, {has}"
    if through > most:
        return f"{quantity(leg.speed, 'm/s')} over ground takes {quantity(through, 'm/s')} through the water, {has}"
    vessel = sim.vessel.coefficients()
    h = STEP * math.sqrt(vessel.m33 / limits.yaw_moment_limit)
    rows = np.zeros((SAMPLES, 9))
    rows[:, 2], rows[:, 3] = leg.course, leg.speed
    middle = slice(SAMPLES // 3, 2 * SAMPLES // 3)
    needed = demand(rows, current, wind, vessel, h)
    steady = needed._replace(**{name: getattr(needed, name)[middle] for name in needed._fields})
    if not np.all(steady.u > MIN_WAY * leg.speed):
        return "the wind turns the boat off its course"
    return exceeded(steady, limits, h)
