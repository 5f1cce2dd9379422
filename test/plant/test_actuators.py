import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_sim_node.actuators import ActuatorParameters, Actuators

PERIOD = 0.01


def arrived(commands, **parameters):
    """What arrives of (surge force, yaw moment) commands, (n, 2)."""
    actuators = Actuators(ActuatorParameters(**parameters), PERIOD)
    return np.array([actuators.step(command) for command in commands])


def test_without_limits_the_command_arrives_to_the_last_bit():
    commands = [(1e9, -1e12), (0.1, 0.3), (-7.0, 1e-300)]
    np.testing.assert_array_equal(arrived(commands), commands)


def test_limits_cut_both_ways_and_pass_what_is_within():
    said = arrived([(5e5, -5e6), (-1e5, 1e6)], surge_force_limit=2e5, yaw_moment_limit=3e6)
    np.testing.assert_array_equal(said, [(2e5, -3e6), (-1e5, 1e6)])


def test_the_step_response_of_the_lag():
    said = arrived([(1e5, -1e6)] * 500, surge_lag=0.5, yaw_lag=2.0)
    time = PERIOD * np.arange(1, 501)
    np.testing.assert_allclose(said[:, 0], 1e5 * (1.0 - np.exp(-time / 0.5)), rtol=1e-12)
    np.testing.assert_allclose(said[:, 1], -1e6 * (1.0 - np.exp(-time / 2.0)), rtol=1e-12)


def test_a_short_lag_is_nearly_none():
    np.testing.assert_allclose(arrived([(1e5, 1e6)], surge_lag=1e-3, yaw_lag=1e-3), [(1e5, 1e6)], rtol=1e-4)


def test_the_rate_limit_makes_a_ramp():
    said = arrived([(1e5, -1e6)] * 300, surge_force_rate=5e4, yaw_moment_rate=4e5)
    time = PERIOD * np.arange(1, 301)
    np.testing.assert_allclose(said[:, 0], np.minimum(5e4 * time, 1e5), rtol=1e-9)
    np.testing.assert_allclose(said[:, 1], np.maximum(-4e5 * time, -1e6), rtol=1e-9)


def test_a_limited_actuator_turns_back_at_once():
    """The limit acts on the command, so no lag builds up behind it."""
    said = arrived([(1e9, 0.0)] * 1000 + [(-1e9, 0.0)], surge_force_limit=2e5, surge_lag=1.0)
    assert said[999, 0] == pytest.approx(2e5, rel=1e-4)
    assert said[1000, 0] == pytest.approx(said[999, 0] - 4e5 * -math.expm1(-PERIOD), rel=1e-3)


commands = st.lists(st.tuples(st.floats(-1e9, 1e9), st.floats(-1e12, 1e12)), min_size=1, max_size=30)


@given(commands, st.floats(0.0, 3.0), st.floats(1.0, 1e7))
def test_limit_and_rate_are_never_exceeded(wanted, lag, rate):
    said = arrived(wanted, surge_force_limit=2e5, surge_lag=lag, surge_force_rate=rate)
    force = np.concatenate(([0.0], said[:, 0]))
    assert np.max(np.abs(force)) <= 2e5
    assert np.max(np.abs(np.diff(force))) <= rate * PERIOD * (1.0 + 1e-9) + 1e-9
