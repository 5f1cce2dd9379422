import math

import numpy as np
import pytest

from vessel_hsmc_ros.core.metrics import evaluate, heading_error, position_error, reversals_per_second


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
