"""The weight of the cross error in the heading and its rate, which is its derivative also where the weight is bounded."""

from typing import Any

import pytest

from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.studies.rivals.backstepping import LARGEST_WEIGHT, cross_weight


@pytest.mark.parametrize("phase", [0.3, 2.0, -1.4])
@pytest.mark.parametrize("r", [0.0, 0.4, -0.4])
@pytest.mark.parametrize("u", [0.0, 1.0, -1.0, 4.0])
def test_the_rate_of_the_weight_is_its_derivative_and_zero_at_its_bound(u: float, r: float, phase: float) -> None:
    made: Any = make_controller("backstepping", 0.02, excitation=1.5)
    g, rate, h = made.constants, Acceleration(0.2, 0.1, 0.05), 1e-6

    def weight(t: float) -> tuple[float, float]:
        return cross_weight(Motion(0.0, 0.0, 0.0, u + rate.du * t, 0.0, r + rate.dr * t), rate, phase + g.l3 * t, g)

    before, (now, slope), after = weight(-h), weight(0.0), weight(h)
    assert slope == pytest.approx((after[0] - before[0]) / (2.0 * h), abs=1e-6)
    assert abs(now) <= LARGEST_WEIGHT
    assert (slope == 0.0) is (abs(now) == LARGEST_WEIGHT)
