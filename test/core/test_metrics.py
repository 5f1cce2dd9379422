import math

import numpy as np
import pytest

from vessel_hsmc_ros.core.metrics import (
    body_error,
    evaluate,
    heading_error,
    position_error,
    reversals_per_second,
    settling_bound,
    settling_time,
    share_at_limit,
    travel,
)


def test_metrics_match_a_calculation_by_hand() -> None:
    time = np.arange(5.0)
    state = np.zeros((5, 6))
    state[:, 0] = [5.0, 3.0, 0.0, 0.0, 4.0]
    state[:, 2] = math.radians(10.0)
    wrench = np.array([[1.0, -2.0], [-3.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    m = evaluate(time, state, np.zeros((5, 6)), wrench)
    assert m.position_error_rms == pytest.approx(math.sqrt((25 + 9 + 16) / 5))
    assert m.position_error_rms_last_quarter == pytest.approx(math.sqrt(16 / 2))
    assert m.position_error_final == 4.0
    assert m.heading_error_rms_deg == pytest.approx(10.0)
    assert m.heading_error_final_deg == pytest.approx(10.0)
    assert (m.surge_force_peak, m.yaw_moment_peak) == (3.0, 2.0)
    assert m.surge_force_rms == pytest.approx(math.sqrt(10 / 5))
    assert m.yaw_moment_rms == pytest.approx(math.sqrt(4 / 5))


def test_position_error_and_wrapped_heading_error() -> None:
    state, reference = np.zeros((1, 6)), np.zeros((1, 6))
    state[0, :3] = 3.0, 4.0, math.radians(-170.0)
    reference[0, 2] = math.radians(170.0)
    assert position_error(state, reference) == pytest.approx([5.0])
    assert np.degrees(heading_error(state, reference)) == pytest.approx([20.0])


def test_reversals_are_counted_where_the_rate_changes_its_sign() -> None:
    time = np.arange(0.0, 100.0, 0.5)
    held = np.repeat(np.tile([0.0, 1.0], 50), 2)  # up and down every second, held for two samples
    assert reversals_per_second(time, held) == pytest.approx(98.0 / 99.5)
    assert reversals_per_second(time, held, after=50.0) == pytest.approx(48.0 / 49.5)
    assert reversals_per_second(time, time) == 0.0
    assert reversals_per_second(time[:1], time[:1]) == 0.0


def test_the_position_error_is_resolved_in_the_body_frame_of_the_ship() -> None:
    state, reference = np.zeros((2, 6)), np.zeros((2, 6))
    reference[:, :2] = 1e3, -2e3
    state[:, :3] = [
        [1e3, -1998.0, math.radians(90.0)],
        [1e3, -1998.0, 0.0],
    ]  # 2 m north of the reference, heading north, then east
    reference[:, 2] = math.radians(45.0)
    assert body_error(state, reference) == pytest.approx(np.array([[2.0, 0.0], [0.0, 2.0]]), abs=1e-12)


def test_the_body_error_is_as_long_as_the_position_error_wherever_the_origin_is() -> None:
    rng = np.random.default_rng(1)
    state, reference = rng.normal(size=(2, 50, 6))
    shift = np.array([1e4, -3e4, 0.0, 0.0, 0.0, 0.0])
    error = body_error(state, reference)
    assert np.hypot(*error.T) == pytest.approx(position_error(state, reference))
    assert body_error(state + shift, reference + shift) == pytest.approx(error, abs=1e-9)


def test_an_error_settles_after_it_last_exceeds_its_bound() -> None:
    time = np.arange(10.0, 16.0)
    error = np.array([5.0, 0.5, -2.0, 0.5, -0.5, 0.1])
    assert settling_time(time, error, 1.0) == 3.0
    assert settling_time(time, error, 5.0) == 0.0
    assert settling_time(time[:3], error[:3], 1.0) is None
    assert settling_time(time[:2], np.array([0.1, math.nan]), 1.0) is None


def test_the_settled_error_is_relative_to_the_initial_error_within_shares_of_the_hull() -> None:
    assert settling_bound(4.0, 4.0) == 0.2
    assert settling_bound(0.0, 4.0) == 0.04
    assert settling_bound(100.0, 4.0) == 0.4
    assert settling_bound(100.0, 0.0) == 5.0


def test_the_share_of_time_at_a_limit() -> None:
    wrench = np.array([0.0, 10.0, -10.0 * (1.0 - 1e-9), 9.0])
    assert share_at_limit(wrench, 10.0) == 0.5
    assert share_at_limit(wrench, math.inf) is None


def test_actuator_travel_counts_the_changes_relative_to_the_limit_per_minute() -> None:
    time, wrench = np.arange(5.0) * 30.0, np.array([0.0, 10.0, -5.0, -5.0, 0.0])
    assert travel(time, wrench, 10.0) == pytest.approx((10.0 + 15.0 + 5.0) / 10.0 / 2.0)
    assert travel(time[:1], wrench[:1], 10.0) == 0.0
    assert travel(time, wrench, math.inf) is None


def test_saturation_is_evaluated_on_the_command_where_the_applied_wrench_lags() -> None:
    zeros = np.zeros((4, 6))
    applied, commanded = np.full((4, 2), 9.9), np.array([[10.0, 0.0], [10.0, 0.0], [0.0, 0.0], [0.0, -5.0]])
    m = evaluate(np.arange(4.0), zeros, zeros, applied, commanded=commanded, limits=(10.0, 5.0))
    assert (m.surge_force_at_limit, m.yaw_moment_at_limit) == (0.5, 0.25)
