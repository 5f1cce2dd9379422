"""Legs and corners of a path: what each leg leaves to the corners at its ends."""

import math

import numpy as np
import pytest

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.guidance.corners import polyline
from vessel_hsmc_ros.guidance.factory import travel_limits
from vessel_hsmc_ros.guidance.path import plan_path
from vessel_hsmc_ros.guidance.waypoints import Ship, Waypoint
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text
from vessel_hsmc_ros.scenario.scenario import parse_scenario

LENGTH = 4.0
BOAT = parse_scenario(scenario_text("boat", MainData(length=LENGTH)), "boat", source="boat").reference_ship


def corner_speeds(points: list[complex], corner: str = "through") -> list[float]:
    """The speeds of the corners of a path from rest to rest by its points, the first of which is its start."""
    p = BOAT
    ship = Ship(p.vessel.coefficients(), travel_limits(p), 0.0, "path")
    part = tuple(Waypoint(point, corner, p.motion.speed) for point in points[1:])
    elements, sections = polyline(points[0], part, ship)
    return [section.speed for element, section in zip(elements, sections, strict=True) if element.turn]


def drawn(seed: int) -> list[complex]:
    """A route with corners of unlike angles, none so sharp that it is begun over its waypoint, and legs with little room."""
    rng = np.random.default_rng(seed)
    points, course = [0j], 0.0
    for turn in rng.choice([0.15, 0.4, 0.9, 1.6, 2.0], 4) * rng.choice([-1.0, 1.0], 4):
        points.append(points[-1] + rng.uniform(3.0, 9.0) * LENGTH * complex(math.cos(course), math.sin(course)))
        course += turn
    # The legs from and to rest are long: what they leave free for the change of speed is another matter.
    return [-20.0 * LENGTH, *points, points[-1] + 20.0 * LENGTH * complex(math.cos(course), math.sin(course))]


@pytest.mark.long
def test_a_large_corner_before_a_small_one_is_as_fast_as_the_small_one_before_it() -> None:
    unlike = 0
    for seed in range(60):
        points = drawn(seed)
        try:
            there = corner_speeds(points)
        except ParameterError:
            with pytest.raises(ParameterError):
                corner_speeds(points[::-1])
            continue
        assert corner_speeds(points[::-1]) == pytest.approx(there[::-1]), f"the way back, seed {seed}"
        unlike += len(set(there)) > 1
    assert unlike > 20


@pytest.mark.parametrize("angle", [1.2, 1.6, 2.0])
@pytest.mark.parametrize("legs", [2.0, 4.0, 6.0])
def test_corners_leave_a_quarter_of_a_leg_from_rest_free_and_none_of_one_under_way(angle: float, legs: float) -> None:
    p, first = BOAT, legs * LENGTH
    ship = Ship(p.vessel.coefficients(), travel_limits(p), 0.0, "path")
    ends = first, first + 20.0 * LENGTH * complex(math.cos(angle), math.sin(angle))
    part = tuple(Waypoint(complex(end), "through", p.motion.speed) for end in ends)
    rest, way = (polyline(0j, part, ship, under_way) for under_way in (False, True))
    free = [sum(element.length for element in elements[:1] if not element.turn) for elements, _ in (rest, way)]
    assert free[0] >= 0.25 * first * (1.0 - 1e-9)
    assert free[1] <= free[0]
    assert legs > 2.0 or free[1] < 0.25 * first, "there the corner may take all of the leg"


@pytest.mark.long
def test_a_corner_soon_after_rest_is_not_sailed_at_the_little_speed_that_is_reached_before_it() -> None:
    p, rest = BOAT, Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    ship = Ship(p.vessel.coefficients(), travel_limits(p), 0.0, "path")
    for first in np.arange(0.5, 3.1, 0.1) * LENGTH:
        ends = complex(first), first + 3.0 * LENGTH * complex(math.cos(1.6), math.sin(1.6))
        points = [Waypoint(end, "through", p.motion.speed) for end in ends]
        assert plan_path(points, rest, Acceleration(0.0, 0.0, 0.0), ship, p.motion.speed).slow == "", first
