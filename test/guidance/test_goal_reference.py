"""Goal references: a feasible, continuous motion to any pose, and along a stream of poses."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from durations import rest_long
from hypothesis import given, settings
from hypothesis import strategies as st
from reference_motion import LIMITS, PERIOD, assert_feasible, motion_of

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.guidance.factory import ReferenceShipParameters, make_reference
from vessel_hsmc_ros.guidance.goal import STREAM_GAP
from vessel_hsmc_ros.guidance.waypoints import GoalParameters
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text
from vessel_hsmc_ros.scenario.scenario import parse_scenario
from vessel_hsmc_ros.scenario.ship_rules import scale_of

AT_ORIGIN = ReferenceShipParameters(mode="goal", initial_pose=(0.0, 0.0, 0.0))


def reference_of(goals=(), pose=(0.0, 0.0, 0.0), period=PERIOD):
    p = replace(AT_ORIGIN, initial_pose=pose)
    if goals:
        poses = tuple(number for _, *goal in goals for number in goal)
        p = replace(p, goal=replace(p.goal, poses=poses, times=tuple(goal[0] for goal in goals)))
    return make_reference(p, period)


places = st.floats(-60.0, 60.0)


@given(places, places, st.floats(-math.pi, math.pi))
@settings(max_examples=6)
def test_every_goal_is_reached_by_a_feasible_motion(x, y, psi: float) -> None:
    reference = reference_of([(0.5, x, y, psi)])
    states, accelerations = motion_of(reference, 330.0)
    assert_feasible(states, accelerations)
    assert math.dist(states[-1, :2], (x, y)) < 0.06
    assert abs(wrap(states[-1, 2] - psi)) < 0.02
    assert np.abs(states[-1, 3:]).max() < 0.01


@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_a_turn_across_180_degrees_is_continuous(turn: float) -> None:
    start = turn * math.radians(170.0)
    reference = reference_of([(0.5, 0.0, 0.0, -start)], pose=(0.0, 0.0, start))
    states, accelerations = motion_of(reference, 60.0)
    assert_feasible(states, accelerations)
    assert states[-1, 2] == pytest.approx(turn * math.radians(190.0), abs=0.01)  # 20 degrees, not 340
    assert np.abs(np.diff(states[:, 2])).max() < 1.05 * LIMITS.yaw_rate * PERIOD


def test_a_new_goal_on_the_way_changes_the_motion_continuously() -> None:
    goals = [(0.0, 50.0, 0.0, 0.0), (20.0, 0.0, 30.0, 3.0), (40.0, -20.0, -20.0, -3.0)]
    states, accelerations = motion_of(reference_of(goals), 200.0)
    assert_feasible(states, accelerations)
    assert math.dist(states[-1, :2], (-20.0, -20.0)) < 0.06


def test_a_near_goal_astern_is_approached_astern_and_a_far_one_ahead() -> None:
    near, _ = motion_of(reference_of([(0.0, -5.0, 0.0, 0.0)]), 60.0)
    far, _ = motion_of(reference_of([(0.0, -50.0, 0.0, 0.0)]), 60.0)
    assert np.abs(near[:, 2]).max() < 0.1
    assert near[:, 3].min() < -0.3
    assert far[:, 3].min() > -0.05
    assert far[-1, 3] > 1.0


@pytest.mark.parametrize("length", [0.5, 300.0])
def test_the_distance_up_to_which_a_boat_goes_astern_is_in_its_lengths_unless_it_is_set(length: float) -> None:
    def turned(distance: float, **changes: float) -> float:
        p, T = boat(length, **{"goal.poses": [-distance * length, 0.0, 0.0], "goal.times": [0.0]}, **changes)
        states, _ = motion_of(make_reference(p, 0.1 * T), 60.0 * T, 0.1 * T)
        assert math.dist(states[-1, :2], (-distance * length, 0.0)) < 1e-3 * length
        return float(np.abs(states[:, 2]).max())

    assert turned(0.28) < 0.1
    assert turned(0.35) > 3.0
    assert turned(0.28, **{"goal.astern_distance": 0.0}) > 3.0
    assert turned(0.35, **{"goal.astern_distance": 0.4 * length}) < 0.1


def test_without_a_goal_the_reference_stays_and_reset_returns_to_the_start() -> None:
    reference = reference_of(pose=(3.0, 4.0, 1.0))
    states, _ = motion_of(reference, 10.0)
    np.testing.assert_array_equal(states, np.tile([3.0, 4.0, 1.0, 0.0, 0.0, 0.0], (100, 1)))
    reference.set_goal(20.0, 4.0, 1.0)
    motion_of(reference, 10.0)
    reference.reset()
    again, _ = motion_of(reference, 10.0)
    np.testing.assert_array_equal(states, again)


def test_a_goal_at_the_same_place_with_another_heading_turns_the_ship_there() -> None:
    reference = reference_of()
    for heading in (1.0, 1.0, -0.5):
        reference.set_goal(0.0, 0.0, heading)
        states, _ = motion_of(reference, 120.0)
        np.testing.assert_allclose(states[-1, :3], [0.0, 0.0, heading], atol=0.02)


def test_a_goal_is_set_in_the_step_that_is_nearest_to_its_time() -> None:
    scheduled, set_then = reference_of([(0.3, 9.0, 5.0, 1.0), (0.7, 3.0, 2.0, 0.0)], period=0.1), reference_of(period=0.1)
    for step in range(10):  # 0.3/0.1 is 2.9999999999999996, and 0.7/0.1 is 6.999999999999999
        if step == 3:
            set_then.set_goal(9.0, 5.0, 1.0)
        if step == 7:
            set_then.set_goal(3.0, 2.0, 0.0)
        assert scheduled.target()[:3] == set_then.target()[:3]
        scheduled.advance()
        set_then.advance()


def test_goals_with_negative_times_are_never_set() -> None:
    states, _ = motion_of(reference_of([(-1.0, 9.0, 9.0, 1.0), (-1.0, 5.0, 5.0, 0.0)]), 5.0)
    assert not states.any()


def boat(length: float, **changes: object) -> tuple[ReferenceShipParameters, float]:
    """The reference that `init` writes for a boat of which the length is known, and the time of its turns, s."""
    ship = parse_scenario(scenario_text("boat", MainData(length=length)), "boat", source="boat")
    p = ship.changed({f"reference_ship.{name}": value for name, value in {"mode": "goal", **changes}.items()}).reference_ship
    return p, scale_of(ship.vessel_sim.vessel).T


@pytest.mark.parametrize("length", rest_long([0.5, 2.5, 12.0, 70.0, 300.0]))
@pytest.mark.parametrize("goal", [(6.0, 3.0, 2.0), (1.0, 0.5, -1.0), (-0.2, 0.0, 0.0), (-5.0, -1.0, 0.5)])
def test_boats_of_any_size_come_to_rest_at_a_goal_without_oscillation(length: float, goal: tuple[float, ...]) -> None:
    x, y, psi = goal[0] * length, goal[1] * length, goal[2]
    p, T = boat(length, **{"goal.poses": [x, y, psi], "goal.times": [0.0]})
    states, accelerations = motion_of(make_reference(p, 0.1 * T), 75.0 * T, 0.1 * T)
    assert math.dist(states[-1, :2], (x, y)) < 1e-3 * length
    assert abs(wrap(states[-1, 2] - psi)) < 1e-3
    assert np.abs(states[-1, 3:5]).max() < 1e-6 * p.motion.speed
    # Within the limits, and without a reversal of speed or turn.
    assert np.abs(states[:, 3]).max() <= 1.001 * p.motion.speed
    assert np.abs(states[:, 5]).max() <= 1.001 * p.motion.yaw_rate
    assert np.abs(accelerations[:, 0]).max() <= 1.001 * p.motion.acceleration
    assert np.abs(accelerations[:, 2]).max() <= 1.001 * p.motion.yaw_acceleration
    for velocity, limit in ((states[:, 3], p.motion.speed), (states[:, 5], p.motion.yaw_rate)):
        assert len({*np.sign(velocity[np.abs(velocity) > 0.02 * limit])}) <= 1


@pytest.mark.parametrize("length", rest_long([0.5, 300.0]))
def test_boats_of_any_size_follow_a_stream_of_poses(length: float) -> None:
    p, T = boat(length)
    reference, radius, period = make_reference(p, 0.02 * T), 10.0 * length, 0.02 * T
    rate = 0.7 * p.motion.speed / radius

    def feed(k: int, reference: Any) -> None:
        if k % 2 == 0:
            angle = rate * k * period
            reference.set_goal(radius * math.sin(angle), radius * (1.0 - math.cos(angle)), wrap(angle))

    states, _ = motion_of(reference, 100.0 * T, period, feed)
    angle = rate * period * np.arange(len(states))
    off = np.hypot(states[:, 0] - radius * np.sin(angle), states[:, 1] - radius * (1.0 - np.cos(angle)))
    assert off[len(off) // 2 :].max() < 0.05 * length


def circle(k, reference, w=0.05, radius=25.0, every=2):
    """A pose on a circle, five times a second."""
    if k % every == 0:
        angle = w * k * PERIOD
        reference.set_goal(radius * math.sin(angle), radius * (1.0 - math.cos(angle)), wrap(angle))


def test_a_stream_of_poses_is_followed_and_its_last_pose_is_a_goal() -> None:
    reference = reference_of()
    states, accelerations = motion_of(reference, 200.0, feed=circle)
    assert_feasible(states, accelerations)
    angle = 0.05 * PERIOD * np.arange(len(states))
    lag = np.hypot(states[:, 0] - 25.0 * np.sin(angle), states[:, 1] - 25.0 * (1.0 - np.cos(angle)))
    assert lag[500:].max() < 0.6
    after, accelerations = motion_of(reference, 200.0)
    assert_feasible(after, accelerations)
    last = 0.05 * PERIOD * 1998
    assert math.dist(after[-1, :2], (25.0 * math.sin(last), 25.0 * (1.0 - math.cos(last)))) < 0.06


def test_each_stream_that_stops_goes_on_for_its_gap_and_then_leads_back_to_its_last_pose_without_a_turn() -> None:
    reference = reference_of()

    def feed(k: int, reference: Any) -> None:
        if k % 5 == 0:
            reference.set_goal(begin + 0.05 * k, 0.0, 0.0)

    for begin in (0.0, 100.0):
        states, _ = motion_of(reference, 100.0, feed=feed)
        assert states[-1, 3] == pytest.approx(0.5, abs=0.05)
        last = reference.target()
        motion_of(reference, STREAM_GAP - 0.8)
        going = reference.target()
        assert (going.speed, going.x - last.x) == pytest.approx((0.5, 0.5 * (STREAM_GAP - 0.8)))
        motion_of(reference, 0.4)
        ended = reference.target()
        back, accelerations = motion_of(reference, 60.0)
        assert_feasible(back, accelerations)
        assert (ended.x, ended.speed) == (pytest.approx(begin + 0.05 * 995), 0.0)
        assert back[:, 3].min() < -0.02, "astern"
        assert np.abs(back[:, 2]).max() < 0.1
        np.testing.assert_allclose(back[-1], [ended.x, 0.0, 0.0, 0.0, 0.0, 0.0], atol=0.06)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_heading_of_a_stream_goes_on_at_its_rate_across_180_degrees(side: float) -> None:
    reference = reference_of()
    for k in range(4):
        reference.set_goal(0.3 * k, 0.0, wrap(side * (3.0 + 0.05 * k)))
        motion_of(reference, 0.5 if k < 3 else 1.2)
    target = reference.target()
    assert (target.r, target.psi) == pytest.approx((0.1 * side, wrap(side * (3.15 + 0.12))))


def test_a_repeated_goal_is_one_goal() -> None:
    once, often = reference_of(), reference_of()
    first, _ = motion_of(once, 100.0, feed=lambda k, r: r.set_goal(30.0, 10.0, 1.0) if k == 0 else None)
    second, _ = motion_of(often, 100.0, feed=lambda _, r: r.set_goal(30.0, 10.0, 1.0))
    np.testing.assert_array_equal(first, second)


def test_two_distant_goals_are_not_a_stream() -> None:
    reference = reference_of([(0.0, 30.0, 0.0, 0.0), (1.0, -60.0, 20.0, 0.0)])
    motion_of(reference, 1.2)
    assert reference.target().speed == 0.0


@pytest.mark.parametrize(
    ("goals", "word"),
    [
        ({"poses": (1.0, 2.0)}, r"goal.poses must have x, y, heading for each of the 1 goal.times \(got 2 numbers\)"),
        ({"poses": (0.0,) * 6}, r"goal.poses must have x, y, heading for each of the 1 goal.times \(got 6 numbers\)"),
        ({"poses": (0.0,) * 6, "times": (2.0, 2.0)}, r"goal.times must increase \(got \[2.0, 2.0\]\)"),
        ({"times": (5.0,)}, r"goal.poses must be given with reference_ship.goal.times \(got .* = \[5.0\] alone\)"),
    ],
)
def test_inconsistent_goals_are_rejected_with_their_name(goals, word: str) -> None:
    with pytest.raises(ParameterError, match=word):
        make_reference(replace(AT_ORIGIN, goal=replace(AT_ORIGIN.goal, **goals)), PERIOD)


@given(x=st.floats(-50.0, 50.0), y=st.floats(-50.0, 50.0), psi=st.floats(-3.0, 3.0), late=st.floats(0.0, 5.0))
def test_a_goal_that_is_given_is_set_at_the_start_unless_it_has_a_time(x: float, y: float, psi: float, late: float) -> None:
    """Also the origin is a goal; a list below zero never sets one, and neither does a list without a pose."""
    far = replace(AT_ORIGIN, initial_pose=(70.0, 0.0, 0.0))

    def target(after: float, **goals: Any) -> Any:
        reference: Any = make_reference(replace(far, goal=GoalParameters(**goals)), PERIOD)
        for _ in range(round(after / PERIOD)):
            reference.advance()
        return reference.target()[:2]

    assert target(0.0, poses=(x, y, psi)) == (x, y)
    assert target(0.0, poses=(0.0, 0.0, 0.0)) == (0.0, 0.0)
    assert target(late + 2.0 * PERIOD, poses=(x, y, psi), times=(late,)) == (x, y)
    assert target(1.0, poses=(x, y, psi), times=(-1.0,)) == target(1.0) == (70.0, 0.0)


@pytest.mark.parametrize("stamps", [(None, None), (None, 7.0), (7.0, None), (7.0, 7.5)])
def test_the_second_goal_of_a_stream_gives_its_velocity_with_and_without_stamps(
    stamps: tuple[float | None, float | None],
) -> None:
    """Half a second lies between both, by their stamps and by their arrival."""
    reference = reference_of()
    motion_of(reference, 1.0)
    for k, stamp in enumerate(stamps):
        reference.set_goal(10.0 + 0.25 * k, 0.0, 0.0, stamp)
        if k == 0:
            motion_of(reference, 0.5)
    assert reference.target().speed == pytest.approx(0.5)


@pytest.mark.parametrize("stamped", [False, True])
def test_a_goal_that_is_published_at_rest_and_then_moves_has_its_velocity_at_once(stamped: bool) -> None:
    """Its time is that of its latest message, not of the first at that place."""
    reference = reference_of()
    for k in range(12):
        moved = 0.25 * max(k - 10, 0)
        reference.set_goal(10.0 + moved, 0.0, 0.0, 7.0 + 0.5 * k if stamped else None)
        assert reference.target().speed == pytest.approx(0.0 if k <= 10 else 0.5)
        motion_of(reference, 0.5)


def test_the_velocity_of_a_slow_stream_does_not_overshoot() -> None:
    """Goals 1.4 s apart that come at unlike speeds: each velocity lies between the last one and the new difference."""
    reference = reference_of()
    reference.set_goal(10.0, 0.0, 0.0, 7.0)
    reference.set_goal(11.4, 0.0, 0.0, 8.4)
    assert reference.target().speed == pytest.approx(1.0)
    reference.set_goal(12.1, 0.0, 0.0, 9.8)
    assert reference.target().speed == pytest.approx(0.5)


@given(places, places, st.floats(1.0, 60.0))
@settings(max_examples=4, deadline=None)
def test_a_reference_that_is_halted_comes_to_rest_ahead_by_a_feasible_motion_and_stays(x: float, y: float, time: float) -> None:
    reference = reference_of([(0.5, x, y, 0.0)])
    motion_of(reference, time)
    before = reference.state
    reference.halt()
    states, accelerations = motion_of(reference, 150.0)
    assert_feasible(states, accelerations)
    assert np.abs(states[-1, 3:]).max() < 0.01
    assert reference.arrived
    braking = before[3] ** 2 / LIMITS.acceleration  # with half the acceleration
    assert math.dist(states[-1, :2], before[:2]) < braking + 5.0 * abs(before[3]) + 0.5


def test_goals_set_as_actions_are_no_stream_however_quickly_they_follow_each_other() -> None:
    reference = reference_of()
    for k in range(5):
        reference.go_to(20.0 + k, 0.0, 0.0)
        motion_of(reference, 0.5)
        assert reference.target().speed == 0.0
    assert not reference.arrived
    assert reference.time_left > 24.0 / LIMITS.speed - 1.0
    motion_of(reference, 200.0)
    assert reference.arrived
    assert reference.time_left < 0.5
