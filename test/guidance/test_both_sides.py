"""What holds to port holds to starboard, and what holds ahead holds astern."""

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from durations import rest_long

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.guidance.corners import polyline
from vessel_hsmc_ros.guidance.factory import travel_limits
from vessel_hsmc_ros.guidance.path import join, plan_path
from vessel_hsmc_ros.guidance.route import Element, Phase, Route, SpeedProfile, displacement, straight, turn
from vessel_hsmc_ros.guidance.route_motion import drift_along, motion_along
from vessel_hsmc_ros.guidance.sailing import TRIED, _rested, excesses, halt
from vessel_hsmc_ros.guidance.timetable import Timetable, motion_at, world_rows
from vessel_hsmc_ros.guidance.waypoints import PATH, THROUGH, Ship, Waypoint
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text
from vessel_hsmc_ros.scenario.scenario import parse_scenario

STILL = Acceleration(0.0, 0.0, 0.0)


@cache
def ship() -> Ship:
    """A boat of 4 m."""
    p = parse_scenario(scenario_text("boat", MainData()), "boat").reference_ship
    return Ship(p.vessel.coefficients(), travel_limits(p), 0.0, PATH)


@pytest.mark.parametrize("share", [0.9, 0.002])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_new_plan_begins_with_the_yaw_rate_of_either_side_and_ends_it_within_the_limits(share: float, side: float) -> None:
    r = side * share * ship().limits.yaw_rate
    table = plan_path([], Motion(2.0, 3.0, 0.5, 0.0, 0.0, r), STILL, ship(), 1.0).table
    assert table.rows[0, 5] == r
    rates = [motion_at(time, table) for time in np.linspace(0.0, float(table.times[-1]), 200)]
    assert max(abs(acceleration.dr) for _, acceleration in rates) <= ship().limits.yaw_acceleration
    assert abs(table.rows[-1, 5]) < 1e-3 * ship().limits.yaw_rate
    assert side * (table.rows[-1, 2] - 0.5) > 0.0


@pytest.mark.parametrize(("u", "r"), [(1.0, 0.0), (1.0, 0.02), (0.3, 0.1)])
def test_a_halt_takes_as_long_astern_as_ahead_and_to_either_side(u: float, r: float) -> None:
    times = []
    for ahead in (1.0, -1.0):
        for side in (1.0, -1.0):
            motion = Motion(0.0, 0.0, 0.0, ahead * u, 0.0, side * r)
            table = halt(motion, world_rows(motion, STILL), ship().vessel, ship().limits)
            times.append(table.times)
            found = [motion_at(time, table)[1] for time in np.linspace(0.0, 0.999 * float(table.times[-1]), 300)]
            assert max(abs(each.du) for each in found) <= ship().limits.acceleration
            assert max(abs(each.dr) for each in found) <= ship().limits.yaw_acceleration
    for other in times[1:]:
        np.testing.assert_array_equal(other, times[0])


@pytest.mark.parametrize(("u", "v", "waits"), [(0.5, 0.0, False), (-0.5, 0.0, True), (0.0, 0.3, True), (0.0, -0.3, True)])
def test_a_path_begins_under_way_ahead_and_after_a_halt_where_the_ship_goes_astern_or_aside(
    u: float, v: float, waits: bool
) -> None:
    plan = plan_path([Waypoint(60.0 + 0.0j, THROUGH, 0.8)], Motion(0.0, 0.0, 0.0, u, v, 0.0), STILL, ship(), 0.8)
    assert (plan.track.stretches[0].begin > 0.0) is waits
    assert plan.table.rows[-1, :2] == pytest.approx((60.0, 0.0), abs=1e-6)


@pytest.mark.parametrize("start", [0.1, -0.1])
def test_a_drift_angle_at_the_beginning_of_a_straight_path_decays_from_what_it_is(start: float) -> None:
    route, times = Route([Element(straight(40.0), 0, turn=False)], (0.0, 0.0, 0.0)), np.linspace(0.0, 50.0, 101)
    beta = drift_along(route, SpeedProfile([Phase(50.0, 0.8, 0.8)]), times, ship().vessel, start, TRIED).beta
    assert beta[0] == pytest.approx(start, abs=1e-6)
    assert np.all(np.diff(np.abs(beta[:20])) < 0.0)
    assert abs(beta[-1]) < 1e-3


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_is_left_of_a_turn_to_either_side_at_the_end_of_a_path_is_ended(side: float) -> None:
    r = side * 0.2 * ship().limits.yaw_rate
    rows = np.zeros((2, 9))
    rows[:, 2], rows[:, 5] = (0.0, r), r
    rested = _rested(Timetable(np.array([0.0, 1.0]), rows), ship().vessel, ship().limits)
    assert len(rested.times) > 2
    assert rested.rows[1, 5] == pytest.approx(r)
    assert abs(rested.rows[-1, 5]) < 1e-3 * abs(r)
    assert side * (rested.rows[-1, 2] - r) > 0.0


def test_each_limit_is_exceeded_alike_by_a_turn_to_either_side() -> None:
    tight = ship().limits._replace(yaw_rate=0.01, yaw_acceleration=1e-3, surge_force=1.0, yaw_moment=0.1)
    found = []
    for side in (1.0, -1.0):
        parts = (straight(4.0), turn(side * 0.7, 15.0, 6.0), straight(4.0))
        route = Route([Element(part, k, turn=k == 1) for k, part in enumerate(parts)], (1.0, 2.0, 0.3))
        profile = SpeedProfile([Phase(route.length / 0.8, 0.8, 0.8)])
        found.append(excesses(motion_along(route, profile, ship().vessel, tolerance=TRIED), tight))
    port, starboard = found
    assert [each.name for each in port] == ["yaw rate", "yaw acceleration", "surge force", "yaw moment"]
    assert [each.name for each in starboard] == [each.name for each in port]
    np.testing.assert_allclose([each.needed for each in starboard], [each.needed for each in port], rtol=1e-3)


@pytest.mark.parametrize("side", rest_long([1.0, -1.0]))
@pytest.mark.parametrize("bearing", rest_long([0.0, 0.3, 1.2, 2.2, 2.8]))
@pytest.mark.parametrize("curvature", rest_long([0.0, 0.03, -0.05]))
def test_a_path_that_begins_under_way_turns_to_the_nearer_side(side: float, bearing: float, curvature: float) -> None:
    target = 80.0 * complex(math.cos(bearing), side * math.sin(bearing))
    first, bend = join(target, side * curvature, 3.0, 10.0, 4.0, 2.0)
    pieces = (*first, *bend)
    turned = sum(0.5 * piece.length * (piece.begin + piece.end) for piece in pieces)
    left = (target - displacement(pieces)) * complex(math.cos(turned), -math.sin(turned))
    assert abs(left.imag) < 1e-6
    assert left.real > 0.0
    if bearing > 0.1:
        assert 0.0 < side * turned < math.pi + 0.3


@pytest.mark.parametrize("first", [0, 1, 4])
def test_a_corner_without_room_is_counted_from_the_beginning_of_the_path(first: int) -> None:
    strong = ship()._replace(limits=ship().limits._replace(current=0.7))  # no corner is slower than the current
    places = (50.0 + 0.0j, 50.0 + 0.5j, 0.5j, 40.0 + 0.0j)
    points = tuple(Waypoint(place, THROUGH, 0.8, number=first + k) for k, place in enumerate(places, 1))
    with pytest.raises(ParameterError, match=rf"^{PATH}: corner {first + 1} of 90° needs "):
        polyline(0j, points, strong)
    elements, _ = polyline(0j, points[:1], ship())
    assert [element.leg for element in elements] == [first]


PLACES = (0j, 12.0 + 0j, 24.0 + 9.0j, 24.0 + 21.0j, 40.0 + 21.0j)


def corner_speeds(places: Any, under_way: bool = False) -> list[float]:
    points = tuple(Waypoint(place, THROUGH, 0.8, number=k) for k, place in enumerate(places[1:], 1))
    elements, sections = polyline(places[0], points, ship(), under_way)
    return [section.speed for element, section in zip(elements, sections, strict=True) if element.turn]


@pytest.mark.parametrize("scale", rest_long([0.5, 0.8, 1.0, 1.5]))
def test_a_path_and_its_way_back_have_the_same_corner_speeds(scale: float) -> None:
    places = [scale * place for place in PLACES]
    there, back = corner_speeds(places), corner_speeds(places[::-1])
    assert there == pytest.approx(back[::-1])
    assert len(set(there)) > 1


def test_from_rest_a_quarter_of_the_first_leg_is_free_and_under_way_none_is() -> None:
    places = [0j, 3.0 + 0j, 3.0 + 30.0j, 60.0 + 30.0j]
    resting, moving = corner_speeds(places), corner_speeds(places, under_way=True)
    assert resting[0] < 0.85 * moving[0]
    assert resting[1:] == moving[1:]
