"""Path references: along their legs, through, over or with a stop at the waypoints, continuously, to rest at the last."""

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from durations import rest_long
from hulls import COUPLING
from hypothesis import given, settings
from hypothesis import strategies as st
from reference_motion import PERIOD, assert_feasible, motion_of

from vessel_hsmc_ros.core.exceptions import GoalError, ParameterError
from vessel_hsmc_ros.core.schema import build
from vessel_hsmc_ros.guidance.factory import ReferenceShipParameters, make_reference, travel_limits
from vessel_hsmc_ros.guidance.route import TravelLimits
from vessel_hsmc_ros.guidance.route_motion import DriftOverTime, RouteMotion, Travel
from vessel_hsmc_ros.guidance.sailing import excesses, sustained
from vessel_hsmc_ros.guidance.timetable import motion_at
from vessel_hsmc_ros.plant.dynamics import Velocities
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text
from vessel_hsmc_ros.scenario.scenario import parse_scenario

AT_ORIGIN = ReferenceShipParameters(mode="path", initial_pose=(0.0, 0.0, 0.0))
LOOP = [(60.0, 0.0), (60.0, 50.0), (0.0, 50.0), (-20.0, 20.0)]


COUPLED = {f"vessel.{name}": value for name, value in COUPLING.items()}


def reference_of(points=(), **path):
    p = AT_ORIGIN
    if points:
        waypoints = tuple(n for point in points for n in point)
        p = replace(p, path=replace(p.path, waypoints=waypoints, time=1.0, **path))
    return make_reference(p, PERIOD)


def nearest(states, point):
    return np.hypot(states[:, 0] - point[0], states[:, 1] - point[1]).min()


def test_a_path_passes_through_every_corner_at_its_speed_and_stops_at_the_last_waypoint() -> None:
    states, accelerations = motion_of(reference_of(LOOP), 200.0)
    assert_feasible(states, accelerations)
    assert all(nearest(states, point) < 12.0 for point in LOOP)
    assert math.dist(states[-1, :2], LOOP[-1]) < 1e-6
    assert states[-1, 2] - math.atan2(-30.0, -20.0) == pytest.approx(2.0 * math.pi, abs=0.02)  # a full turn to the left
    assert np.hypot(*states[200:900, 3:5].T).min() == pytest.approx(1.5, abs=1e-3)


def test_over_a_waypoint_the_ship_turns_behind_it_and_is_on_the_next_leg_again() -> None:
    states, accelerations = motion_of(reference_of([(100.0, 0.0), (100.0, 200.0)], corners=("over",)), 250.0)
    assert_feasible(states, accelerations)
    assert nearest(states, (100.0, 0.0)) < 0.1
    assert states[:, 0].max() > 110.0
    on_leg = (states[:, 1] > 90.0) & (states[:, 1] < 200.0)
    np.testing.assert_allclose(states[on_leg, 0], 100.0, atol=1e-6)


def test_a_sharp_corner_is_sailed_over_its_waypoint_without_a_stop() -> None:
    states, accelerations = motion_of(reference_of([(100.0, 0.0), (0.0, 0.0)]), 300.0)
    assert_feasible(states, accelerations)
    assert nearest(states, (100.0, 0.0)) < 0.1
    under_way = slice(150, int(np.argmax(np.hypot(states[:, 0], states[:, 1])[300:] < 20.0)) + 300)
    assert np.hypot(*states[under_way, 3:5].T).min() > 1.4


def test_at_a_stop_the_ship_rests_and_turns_to_the_next_waypoint_on_the_spot() -> None:
    states, accelerations = motion_of(reference_of([(60.0, 0.0), (60.0, 60.0)], corners=("stop",)), 200.0)
    assert_feasible(states, accelerations)
    at_stop = np.hypot(states[:, 0] - 60.0, states[:, 1]) < 1e-6
    assert np.ptp(states[at_stop, 2]) == pytest.approx(0.5 * math.pi, abs=1e-3)
    # A ship that has not turned at rest has time to: slowly for as long as the turn took, then at full speed.
    speed, left = np.hypot(*states[:, 3:5].T), int(np.flatnonzero(at_stop)[-1])
    turning = round(np.count_nonzero(at_stop & (np.abs(states[:, 5]) > 1e-3)))
    assert speed[left : left + turning // 2].max() < 0.6 * 1.5
    assert speed[left:].max() > 1.2
    # Never off the two legs.
    assert np.minimum(np.abs(states[:, 1]), np.abs(states[:, 0] - 60.0)).max() < 1e-6


def test_a_stop_at_the_repetition_of_a_waypoint_is_a_stop_at_the_waypoint() -> None:
    repeated, _ = motion_of(reference_of([(60.0, 0.0), (60.0, 0.0), (60.0, 60.0)], corners=("through", "stop", "through")), 100.0)
    once, _ = motion_of(reference_of([(60.0, 0.0), (60.0, 60.0)], corners=("stop", "through")), 100.0)
    assert np.count_nonzero(np.hypot(once[:, 0] - 60.0, once[:, 1]) < 1e-6) > 10, "it rests there"
    np.testing.assert_array_equal(repeated, once)


def test_each_leg_has_its_speed_and_a_set_radius_slows_the_corner() -> None:
    slow, _ = motion_of(reference_of([(80.0, 0.0), (80.0, 80.0)], speeds=(1.5, 0.5)), 300.0)
    assert np.hypot(*slow[:, 3:5].T)[slow[:, 1] > 20.0].max() == pytest.approx(0.5, abs=1e-3)
    assert np.hypot(*slow[:, 3:5].T)[slow[:, 0] < 60.0].max() == pytest.approx(1.5, abs=1e-3)
    tight, accelerations = motion_of(reference_of([(80.0, 0.0), (80.0, 80.0)], corner_radius=5.0), 300.0)
    assert_feasible(tight, accelerations)
    assert nearest(tight, (80.0, 0.0)) < 4.0


@settings(max_examples=7, deadline=None)
@given(
    st.lists(st.tuples(st.floats(-8.0, 8.0), st.floats(-8.0, 8.0)), min_size=1, max_size=5),
    st.floats(math.log(0.5), math.log(300.0)),
    st.booleans(),
)
def test_a_path_of_any_boat_is_within_its_limits_or_refused_with_the_corner(points, logarithm, stops) -> None:
    length = math.exp(logarithm)
    ship = parse_scenario(scenario_text("boat", MainData(length=length)), "boat", source="boat")
    waypoints = [length * 5.0 * number for point in points for number in point]
    corners = ["stop" if stops and k % 2 else "through" for k in range(len(points))]
    changes = {"mode": "path", "path.waypoints": waypoints, "path.corners": corners, "path.time": 0.0}
    try:
        p = ship.changed({f"reference_ship.{name}": value for name, value in changes.items()}).reference_ship
        reference: Any = make_reference(p, PERIOD)
    except ParameterError as error:
        refused = str(error)
    else:
        refused = ""
    if refused:
        assert re.match(r"reference_ship\.path: corner \d of \d+° needs .* longer legs or a stop there would do", refused)
        return
    table = reference.constants.table
    times = np.linspace(0.0, table.times[-1], 700)
    motions = [motion_at(float(t), table) for t in times]
    states, accelerations = np.array([m for m, _ in motions]), np.array([a for _, a in motions])
    assert math.dist(states[-1, :2], waypoints[-2:]) < 2e-3 * length
    assert np.hypot(*states[:, 3:5].T).max() <= 1.001 * p.motion.speed
    assert np.abs(states[:, 5]).max() <= 1.001 * p.motion.yaw_rate
    assert np.abs(accelerations[:, 2]).max() <= 1.01 * p.motion.yaw_acceleration
    velocity = states[:, 3] * np.cos(states[:, 2]) - states[:, 4] * np.sin(states[:, 2])
    h = 1e-4 * length / p.motion.speed
    later = np.array([motion_at(float(t) + h, table)[0][:3] for t in times])
    np.testing.assert_allclose((later[:, 0] - states[:, 0]) / h, velocity, atol=1e-3 * p.motion.speed)


@pytest.mark.parametrize(
    ("elapsed", "changes"),
    rest_long([(1.4, {}), (10.0, COUPLED), (55.0, {}), (75.0, COUPLED), (130.0, {})]),
    ids=["begun", "coupled-on-a-leg", "plain-halfway", "coupled-later", "near-the-end"],
)
def test_a_new_path_at_any_time_continues_position_velocity_and_acceleration(elapsed, changes) -> None:
    values = {"path.waypoints": [n for point in LOOP for n in point], "path.time": 1.0, "initial_pose": [0.0, 0.0, 0.0]}
    reference: Any = make_reference(
        build(ReferenceShipParameters, {"mode": "path", **values, **changes}, "reference_ship"), PERIOD
    )
    motion_of(reference, elapsed)
    before = [*reference.state, *reference.acceleration()]
    reference.set_path([(-50.0, -60.0), (-50.0, -150.0)])
    np.testing.assert_allclose([*reference.state, *reference.acceleration()], before, atol=1e-7)
    states, accelerations = motion_of(reference, 400.0)
    assert math.dist(states[-1, :2], (-50.0, -150.0)) < 0.01
    assert np.abs(np.diff(accelerations, axis=0)).max() < 0.1


@pytest.mark.parametrize("velocity", [(1.0, 0.2, 0.05), (-1.0, 0.1, 0.0)])
def test_a_ship_that_is_under_way_without_a_path_comes_to_rest(velocity: tuple[float, ...]) -> None:
    p = replace(AT_ORIGIN, initial_velocity=velocity)
    states, accelerations = motion_of(make_reference(p, PERIOD), 60.0)
    assert_feasible(states[1:], accelerations[1:])
    np.testing.assert_allclose(states[-1, 3:], 0.0, atol=1e-9)


def test_a_new_path_on_the_way_changes_the_motion_continuously() -> None:
    reference = reference_of(LOOP)
    before, first = motion_of(reference, 60.0)
    reference.set_path([(0.0, 0.0), (0.0, -40.0)])
    after, second = motion_of(reference, 200.0)
    assert_feasible(np.vstack((before, after)), np.vstack((first, second)))
    assert math.dist(after[-1, :2], (0.0, -40.0)) < 0.01


def test_a_reset_returns_to_the_planned_path_and_its_legs() -> None:
    reference = reference_of(LOOP)
    planned = reference.track
    for _ in range(2):
        motion_of(reference, 20.0)
        reference.set_path([(0.0, 0.0), (0.0, -40.0)])
        assert reference.track.waypoints != planned.waypoints
        reference.reset()
        assert reference.track is planned


def test_waypoints_astern_short_legs_and_repeated_waypoints_are_passed() -> None:
    reference = reference_of()
    reference.set_path([(-30.0, 0.0), (-30.0, 0.0), (-30.0, 3.0), (-33.0, 3.0), (-60.0, 3.0)])
    states, accelerations = motion_of(reference, 200.0)
    assert_feasible(states, accelerations)
    assert math.dist(states[-1, :2], (-60.0, 3.0)) < 0.06


def test_a_single_waypoint_is_a_goal() -> None:
    reference = reference_of()
    reference.set_path([(20.0, 10.0)])
    states, _ = motion_of(reference, 120.0)
    assert math.dist(states[-1, :2], (20.0, 10.0)) < 0.06
    reference.reset()
    reference.set_path([(0.0, 0.0)])
    states, _ = motion_of(reference, 5.0)
    np.testing.assert_array_equal(states[-1], states[0])


def test_an_empty_path_and_an_odd_number_of_coordinates_are_rejected() -> None:
    with pytest.raises(GoalError, match="a path must have at least one waypoint"):
        reference_of().set_path([])
    with pytest.raises(ParameterError, match=r"path\.waypoints must be x, y for each waypoint \(got 3 numbers\)"):
        make_reference(replace(AT_ORIGIN, path=replace(AT_ORIGIN.path, waypoints=(1.0, 2.0, 3.0))), PERIOD)
    for name, values in (("speeds", (1.0, 2.0)), ("corners", ("over", "over")), ("corners", ("around",))):
        with pytest.raises(ParameterError, match=rf"reference_ship\.path\.{name} "):
            reference_of(LOOP, **{name: values})


def test_waypoints_that_are_given_are_set_at_the_start_unless_they_have_a_time() -> None:
    def moved(**path: Any) -> bool:
        states, _ = motion_of(make_reference(replace(AT_ORIGIN, path=replace(AT_ORIGIN.path, **path)), PERIOD), 3.0)
        return bool(np.any(states[-1] != states[0]))

    assert moved(waypoints=(60.0, 0.0))
    assert not moved(waypoints=(60.0, 0.0), time=-1.0)
    assert not moved(waypoints=(60.0, 0.0), time=4.0)
    assert not moved()
    with pytest.raises(ParameterError, match=r"path\.waypoints must be given with reference_ship\.path\.time \(got"):
        moved(time=2.0)


def test_no_corner_is_slower_than_the_current_that_is_allowed_for() -> None:
    points = [(100.0, 0.0), (100.0, 20.0), (200.0, 20.0)]
    slow, _ = motion_of(reference_of(points), 200.0)
    assert np.hypot(*slow[:, 3:5].T)[300:1000].min() < 0.9
    in_current = replace(AT_ORIGIN, motion=replace(AT_ORIGIN.motion, current=0.9))
    path = replace(AT_ORIGIN.path, waypoints=tuple(n for point in points for n in point), time=1.0)
    with pytest.raises(ParameterError, match=r"path: corner 1 of 90° needs [\d.]+ m of a leg even at 0\.9\d* m/s"):
        make_reference(replace(in_current, path=path), PERIOD)


@pytest.mark.long
def test_a_wide_turn_right_after_a_tight_one_gathers_speed() -> None:
    points = [(100.0, 0.0), (100.0, 14.0), (130.0, 90.0)]
    # With speeds of their own, the legs are not joined by one corner.
    states, accelerations = motion_of(reference_of(points, speeds=(1.5, 1.49, 1.5)), 200.0)
    assert_feasible(states, accelerations)
    speed, turning = np.hypot(*states[:, 3:5].T), np.abs(states[:, 5]) > 1e-3
    tight, wide = turning & (states[:, 2] < 1.4), turning & (states[:, 1] > 16.0)
    assert speed[wide].max() > 1.8 * speed[tight].min()


def test_a_corner_without_room_is_refused_with_what_would_do() -> None:
    waypoints = tuple(n for point in LOOP for n in point)
    in_current = replace(AT_ORIGIN, motion=replace(AT_ORIGIN.motion, current=1.4))
    reference: Any = make_reference(replace(in_current, path=replace(AT_ORIGIN.path, waypoints=waypoints, time=1.0)), PERIOD)
    before = motion_of(reference, 20.0)[0][-1]
    with pytest.raises(GoalError, match=r"path: corner 2 of 90° needs [\d.]+ m of a leg even at .* longer legs or a stop there"):
        reference.set_path([(100.0, 0.0), (200.0, 0.0), (200.0, 20.0), (300.0, 20.0)])
    assert math.dist(motion_of(reference, 1.0)[0][-1, :2], before[:2]) < 2.0


def boat_of(length: float, **path: Any) -> ReferenceShipParameters:
    """The reference that `init` writes for a boat of which the length is known, with a path around a corner."""
    ship = parse_scenario(scenario_text("boat", MainData(length=length)), "boat", source="boat")
    around = [20.0 * length, 0.0, 20.0 * length, 20.0 * length]
    return replace(
        ship.reference_ship, mode="path", path=replace(ship.reference_ship.path, waypoints=tuple(around), time=0.0, **path)
    )


@pytest.mark.parametrize("length", rest_long([0.5, 300.0]))
def test_a_corner_whose_radius_has_no_room_is_refused_with_a_radius_that_has(length: float) -> None:
    with pytest.raises(
        ParameterError, match=r"path: corner 1 of 90° needs .* a corner_radius of ([\d.]+) m, longer legs"
    ) as caught:
        make_reference(boat_of(length, corner_radius=40.0 * length), PERIOD)
    named = float(re.search(r"corner_radius of ([\d.]+) m", str(caught.value))[1])  # type: ignore[index]
    assert 5.0 * length < named < 15.0 * length
    make_reference(boat_of(length, corner_radius=named), PERIOD)


@pytest.mark.parametrize(
    ("motion", "path", "reason"),
    rest_long(
        [
            (
                {},
                {"corner_radius": 0.05},
                r"path\.corner_radius: no turn with a radius of 0\.05 m .*; [\d.]+ m at [\d.]+ m/s would do$",
            ),
            ({"yaw_acceleration": 1e-6}, {}, r"path: no turn at [\d.]+ m/s or less .*; a stop at each waypoint or .* would do$"),
            ({"current": 9.0}, {}, r"path: speed = .* against a current of 9 m/s needs .*; a smaller motion\.current would do$"),
            ({"speed": 9.0}, {}, r"path: speed = 9 m/s needs a surge force of .*; at most [\d.]+ m/s would do$"),
        ]
    ),
)
def test_a_path_beyond_the_limits_is_refused_with_what_would_do(motion: Any, path: Any, reason: str) -> None:
    p = boat_of(4.0, **path)
    with pytest.raises(ParameterError, match=reason):
        make_reference(replace(p, motion=replace(p.motion, **motion)), PERIOD)


@pytest.mark.parametrize("mode", rest_long(["path", "lawnmower"]))
def test_where_no_turn_is_possible_at_the_speed_of_the_legs_the_turns_are_slower(mode: str) -> None:
    p = boat_of(4.0)
    low, high = p.motion.speed, 10.0 * p.motion.speed
    for _ in range(20):  # the largest speed at which a leg leaves the force that it must
        middle = 0.5 * (low + high)
        low, high = (middle, high) if sustained(middle, p.vessel.coefficients(), travel_limits(p)) else (low, middle)
    p = replace(p, mode=mode, motion=replace(p.motion, speed=low), lawnmower=replace(p.lawnmower, speed=low))
    reference: Any = make_reference(p, PERIOD)
    route, profile = reference.track.stretches[0].route, reference.track.stretches[0].profile
    bent = route.curvature(np.linspace(0.0, route.length, 500))[0] != 0.0
    speed = profile.at(profile.time_at(np.linspace(0.0, route.length, 500)))[1]
    assert speed.max() == pytest.approx(low)
    assert 0.5 * low < speed[bent].max() < 0.99 * low


@pytest.mark.parametrize("length", rest_long([0.5, 300.0]))
def test_after_a_short_last_leg_the_turning_ends_within_the_yaw_acceleration(length: float) -> None:
    p = boat_of(length)
    short = 1.4 * length * np.exp(1j * math.radians(60.0))
    around = (20.0 * length, 0.0, 20.0 * length + float(short.real), float(short.imag))
    table = make_reference(replace(p, path=replace(p.path, waypoints=around)), PERIOD).constants.table  # type: ignore[attr-defined]
    step = 1e-3 * p.motion.yaw_rate / p.motion.yaw_acceleration
    rates = np.array([motion_at(float(table.times[-1]) + k * step, table)[0].r for k in range(-1500, 100)])
    assert rates[-1] == 0.0
    assert np.abs(np.diff(rates)).max() <= 1.01 * p.motion.yaw_acceleration * step


def test_an_excess_of_yaw_acceleration_between_two_instants_of_a_motion_is_found() -> None:
    times = np.array([0.25, 0.75, 1.25, 1.75, 2.25], np.float64) * math.pi
    still, r, dr = np.zeros(5), np.sin(times), np.cos(times)  # up to 1, at the instants 0.71
    motion = RouteMotion(
        times,
        Travel(times, still, still, still, still),
        DriftOverTime(still, still, still),
        Velocities(still, still, r, still, still, dr),
        AT_ORIGIN.vessel.coefficients(),
    )
    unlimited = TravelLimits(math.inf, math.inf, math.inf, math.inf, math.inf, 0.0)
    assert excesses(motion, unlimited._replace(yaw_acceleration=1.1)) == []
    (found,) = excesses(motion, unlimited._replace(yaw_acceleration=0.9))
    assert found.name == "yaw acceleration"
    assert found.needed == pytest.approx(1.0, rel=0.02)
