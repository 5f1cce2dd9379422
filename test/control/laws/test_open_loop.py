import pytest

from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion

REST, STILL = Motion(*[0.0] * 6), Acceleration(0.0, 0.0, 0.0)


def test_inputs_hold_from_their_times_on_and_are_zero_before() -> None:
    law = make_controller("open_loop", 0.1, times=[0.2, 0.5], surge_force=[3.0, -1.0], yaw_moment=[0.0, 2.0])
    wrenches = [law.step(REST, REST, STILL)[0] for _ in range(7)]
    assert wrenches == [(0.0, 0.0)] * 2 + [(3.0, 0.0)] * 3 + [(-1.0, 2.0)] * 2
    law.reset()
    assert law.step(REST, REST, STILL)[0] == (0.0, 0.0)


def test_lists_of_unequal_length_and_times_that_do_not_increase_are_rejected() -> None:
    with pytest.raises(ParameterError, match="lists of equal length, not of 2, 1 and 1"):
        make_controller("open_loop", 0.1, times=[0.0, 1.0])
    with pytest.raises(ParameterError, match="times must increase: 1 s follows 1 s"):
        make_controller("open_loop", 0.1, times=[1.0, 1.0], surge_force=[0.0, 0.0], yaw_moment=[0.0, 0.0])


@pytest.mark.parametrize("period", [0.1, 1.0 / 30.0, 1.0 / 60.0])
def test_a_step_at_a_multiple_of_the_period_takes_effect_at_it_in_spite_of_rounding(period: float) -> None:
    times = [round(k * period, 9) for k in range(200)]
    assert any(k * period != time for k, time in enumerate(times))
    numbers = [float(k) for k in range(200)]
    law = make_controller("open_loop", period, times=times, surge_force=numbers, yaw_moment=[-2.0 * k for k in numbers])
    assert [law.step(REST, REST, STILL)[0] for _ in range(200)] == [(k, -2.0 * k) for k in numbers]
