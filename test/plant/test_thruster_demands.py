"""Demands of thrusters in real time: each with an age of its own, missing, silent, forgotten, and again."""

import math

import pytest
from thruster_layouts import layout_of

from vessel_sim_node.drives import ThrusterDemands

SECOND = 10**9


def demands() -> ThrusterDemands:
    """Those of a rudder with its screw, and a bow thruster."""
    return ThrusterDemands(layout_of("rudder_and_bow_thruster"))


def test_each_thrust_is_zero_after_its_own_time_and_angles_hold() -> None:
    made = demands()
    given = {"thrusters/screw/thrust": (80.0, 1), "thrusters/screw/angle": (-0.2, 2), "thrusters/bow/thrust": (-30.0, 3)}
    assert set(made.topics) == set(given)
    for topic, (value, at) in given.items():
        assert not made.hold(topic, value, at * SECOND)
    bow = 0.5 * math.pi
    expected = {1: [80.0, -30.0], 2: [0.0, -30.0], 3: [0.0, -30.0], 4: [0.0, 0.0]}
    for oldest, thrust in expected.items():
        assert made.present(oldest * SECOND) == (thrust, [-0.2, pytest.approx(bow)])
    assert made.stale(2 * SECOND) == ["thrusters/screw/thrust"]
    made.hold("thrusters/screw/thrust", 50.0, 9 * SECOND)
    assert made.present(9 * SECOND)[0] == [50.0, 0.0]
    assert made.stopped() == ([0.0, 0.0], [-0.2, pytest.approx(bow)])


def test_what_is_not_finite_is_named_and_holds_nothing_up() -> None:
    made = demands()
    made.hold("thrusters/bow/thrust", 20.0, SECOND)
    for value in (math.nan, math.inf, -math.inf):
        problem = made.hold("thrusters/bow/thrust", value, 5 * SECOND)
        assert f"thrusters/bow/thrust must be a finite number (got {value})" in problem
    assert made.present(SECOND)[0] == [0.0, 20.0]
    assert made.present(2 * SECOND)[0] == [0.0, 0.0], "it does not prolong the last one"


def test_after_each_step_of_the_clock_no_thrust_holds_until_the_next_demand() -> None:
    made = demands()
    for begin in (100, 20):
        made.hold("thrusters/screw/thrust", 70.0, begin * SECOND)
        made.hold("thrusters/screw/angle", 0.3, begin * SECOND)
        assert made.present((begin - 1) * SECOND)[0] == [70.0, 0.0]
        made.forget()
        assert made.present((begin - 90) * SECOND) == ([0.0, 0.0], [0.3, pytest.approx(0.5 * math.pi)])


def test_in_lockstep_each_missing_demand_is_bridged_by_its_own_last_one() -> None:
    made = demands()
    steps = [(10.0, 0.1, 1.0), (math.nan, 0.2, 2.0), (math.nan, math.nan, math.nan), (math.nan, math.nan, 4.0)]
    taken = []
    for number, values in enumerate(steps):
        assert not made.complete()
        for topic, value in zip(made.topics, values, strict=True):
            made.append(topic, value)
        assert made.complete()
        thrust, angle = made.take(number * SECOND, (number - 2) * SECOND)
        taken.append((*thrust, angle[0]))
    assert taken == [(10.0, 1.0, 0.1), (10.0, 2.0, 0.2), (10.0, 2.0, 0.2), (0.0, 4.0, 0.2)]
