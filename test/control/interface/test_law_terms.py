"""The quantities that follow from the terms of any law, step by step and for whole runs."""

import math
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.control.interface.law import Terms, diagnosed, lyapunov_function, lyapunov_rates, weight_norms


@pytest.mark.parametrize("neurons", [1, 4, 27, 125])
def test_norms_and_lyapunov_rates_of_a_run_are_bit_identical_to_those_of_its_steps(neurons: int) -> None:
    random = np.random.default_rng(neurons)
    steps = 50
    intervals: Any = 0.01 * random.integers(1, 4, steps)
    weights = random.normal(size=(steps, 3, neurons)) * 10.0 ** random.uniform(-9.0, 3.0, (steps, 1, neurons))
    yaw, surge = random.normal(size=steps), random.normal(size=steps)
    previous, stepwise = None, []
    for k in range(steps):
        u, v, r = weights[k]
        terms = Terms(yaw_surface=float(yaw[k]), surge_surface=float(surge[k]), surge_weights=u, sway_weights=v, yaw_weights=r)
        terms = diagnosed(terms, previous, float(intervals[k]))
        previous = terms.lyapunov
        norms = terms.surge_weight_norm, terms.sway_weight_norm, terms.yaw_weight_norm
        stepwise.append((*norms, terms.lyapunov, terms.lyapunov_rate))
    lyapunov = lyapunov_function(yaw, surge)
    whole = np.column_stack((weight_norms(weights), lyapunov, lyapunov_rates(lyapunov, intervals)))
    np.testing.assert_array_equal(whole, stepwise)
    np.testing.assert_allclose(whole[:, :3], np.linalg.norm(weights, axis=2))


def test_a_law_without_surfaces_and_networks_has_neither_norms_nor_a_lyapunov_function() -> None:
    terms = diagnosed(Terms(heading_error=0.1), None, 0.01)
    assert math.isnan(terms.lyapunov)
    assert math.isnan(terms.yaw_weight_norm)
    assert terms.lyapunov_rate == 0.0
    np.testing.assert_array_equal(lyapunov_rates(np.full(3, math.nan), np.full(3, 0.01)), [0.0, math.nan, math.nan])
