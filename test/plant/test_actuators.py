import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.plant.devices import ActuatorParameters, actuate

PERIOD = 0.01


def response(commands, **parameters):
    """Applied wrenches for (surge force, yaw moment) commands, (n, 2)."""
    surge, yaw = ActuatorParameters(**parameters).constants(PERIOD)
    applied = [(0.0, 0.0)]
    for command in commands:
        applied.append((actuate(applied[-1][0], command[0], surge), actuate(applied[-1][1], command[1], yaw)))
    return np.array(applied[1:])


def test_without_limits_the_applied_wrench_is_bit_identical_to_the_command() -> None:
    commands = [(1e9, -1e12), (0.1, 0.3), (-7.0, 1e-300)]
    np.testing.assert_array_equal(response(commands), commands)


def test_limits_apply_in_both_directions() -> None:
    applied = response([(5e5, -5e6), (-1e5, 1e6)], surge_force_limit=2e5, yaw_moment_limit=3e6)
    np.testing.assert_array_equal(applied, [(2e5, -3e6), (-1e5, 1e6)])


def test_the_step_response_of_the_lag() -> None:
    applied = response([(1e5, -1e6)] * 500, surge_lag=0.5, yaw_lag=2.0)
    time = PERIOD * np.arange(1, 501)
    np.testing.assert_allclose(applied[:, 0], 1e5 * (1.0 - np.exp(-time / 0.5)), rtol=1e-12)
    np.testing.assert_allclose(applied[:, 1], -1e6 * (1.0 - np.exp(-time / 2.0)), rtol=1e-12)


def test_a_short_lag_has_almost_no_effect() -> None:
    np.testing.assert_allclose(response([(1e5, 1e6)], surge_lag=1e-3, yaw_lag=1e-3), [(1e5, 1e6)], rtol=1e-4)


def test_the_rate_limit_makes_a_ramp() -> None:
    applied = response([(1e5, -1e6)] * 300, surge_force_rate=5e4, yaw_moment_rate=4e5)
    time = PERIOD * np.arange(1, 301)
    np.testing.assert_allclose(applied[:, 0], np.minimum(5e4 * time, 1e5), rtol=1e-9)
    np.testing.assert_allclose(applied[:, 1], np.maximum(-4e5 * time, -1e6), rtol=1e-9)


def test_a_saturated_actuator_reverses_without_delay() -> None:
    """The limit acts on the command, so no lag builds up behind it."""
    applied = response([(1e9, 0.0)] * 1000 + [(-1e9, 0.0)], surge_force_limit=2e5, surge_lag=1.0)
    assert applied[999, 0] == pytest.approx(2e5, rel=1e-4)
    assert applied[1000, 0] == pytest.approx(applied[999, 0] - 4e5 * -math.expm1(-PERIOD), rel=1e-3)


commands = st.lists(st.tuples(st.floats(-1e9, 1e9), st.floats(-1e12, 1e12)), min_size=1, max_size=30)


@given(commands, st.floats(0.0, 3.0), st.floats(1.0, 1e7))
def test_limit_and_rate_are_never_exceeded(wanted, lag, rate: float) -> None:
    applied = response(wanted, surge_force_limit=2e5, surge_lag=lag, surge_force_rate=rate)
    force = np.concatenate(([0.0], applied[:, 0]))
    assert np.max(np.abs(force)) <= 2e5
    assert np.max(np.abs(np.diff(force))) <= rate * PERIOD * (1.0 + 1e-9) + 1e-9
