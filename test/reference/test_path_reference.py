"""Path references: near all waypoints, continuously, to a stop at the last."""

import math
from dataclasses import replace

import numpy as np
import pytest
from reference_motion import PERIOD, assert_feasible, motion_of

from vessel_hsmc_ros.core.exceptions import GoalError, ParameterError
from vessel_hsmc_ros.reference.factory import ReferenceShipParameters, make_reference

AT_ORIGIN = ReferenceShipParameters(mode="path", initial_pose=(0.0, 0.0, 0.0))
LOOP = [(60.0, 0.0), (60.0, 50.0), (0.0, 50.0), (-20.0, 20.0)]


def reference_of(points=()):
    p = AT_ORIGIN
    if points:
        p = replace(p, path=replace(p.path, waypoints=tuple(n for point in points for n in point), time=1.0))
    return make_reference(p, PERIOD)


def nearest(states, point):
    return np.hypot(states[:, 0] - point[0], states[:, 1] - point[1]).min()


def test_a_path_passes_near_every_waypoint_and_stops_at_the_last() -> None:
    states, accelerations = motion_of(reference_of(LOOP), 200.0)
    assert_feasible(states, accelerations)
    assert all(nearest(states, point) < 5.0 for point in LOOP)
    assert math.dist(states[-1, :2], LOOP[-1]) < 0.06
    assert states[-1, 2] - math.atan2(-30.0, -20.0) == pytest.approx(2.0 * math.pi, abs=0.02)  # a full turn to the left
    assert states[150:350, 3].mean() == pytest.approx(1.5, abs=0.05)


def test_a_new_path_on_the_way_changes_the_motion_continuously() -> None:
    reference = reference_of(LOOP)
    before, first = motion_of(reference, 60.0)
    reference.set_path([(0.0, 0.0), (0.0, -40.0)])
    after, second = motion_of(reference, 200.0)
    assert_feasible(np.vstack((before, after)), np.vstack((first, second)))
    assert math.dist(after[-1, :2], (0.0, -40.0)) < 0.06


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
    with pytest.raises(GoalError, match="a path of 0 waypoints is not allowed"):
        reference_of().set_path([])
    with pytest.raises(ParameterError, match=r"path\.waypoints with 3 numbers is not allowed: it takes x, y for each waypoint"):
        make_reference(replace(AT_ORIGIN, path=replace(AT_ORIGIN.path, waypoints=(1.0, 2.0, 3.0))), PERIOD)
