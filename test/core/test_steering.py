"""The yaw moment that there is with some thrust and speed, and what a law's demand becomes by it."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.hull import LARGEST_BOOST, available, moment_limit, steered, steering

FORCE, MOMENT = 300.0, 250.0
LOSS, SPEED = st.floats(0.0, 1.0), st.one_of(st.just(math.inf), st.floats(0.1, 10.0))
DEMAND = st.tuples(st.floats(-FORCE, FORCE), st.floats(-MOMENT, MOMENT))


@given(DEMAND, st.floats(-5.0, 5.0), SPEED)
def test_without_a_loss_nothing_changes(demand: tuple[float, float], u: float, speed: float) -> None:
    made = steering(0.0, speed, FORCE, MOMENT)
    assert steered(demand, u, made) is demand
    assert available(*demand, u, made) == demand[1]


@given(LOSS, SPEED, DEMAND, st.floats(-5.0, 5.0))
def test_a_demand_becomes_one_that_there_is_with_no_less_thrust_and_no_more_than_the_boost(
    loss: float, speed: float, demand: tuple[float, float], u: float
) -> None:
    made = steering(loss, speed, FORCE, MOMENT)
    force, moment = steered(demand, u, made)
    assert abs(moment) <= abs(demand[1])
    assert available(force, moment, u, made) == moment
    assert abs(demand[0]) <= abs(force) <= max(abs(demand[0]), LARGEST_BOOST * FORCE) * (1.0 + 1e-12)
    assert force * demand[0] >= 0.0
    if abs(force) > abs(demand[0]):
        assert abs(moment) == pytest.approx(min(abs(demand[1]), moment_limit(force, u, made)))


@given(LOSS, SPEED, st.floats(0.0, FORCE), st.floats(0.0, FORCE), st.floats(0.0, 5.0), st.floats(0.0, 5.0))
def test_the_limit_grows_with_thrust_and_speed_up_to_the_full_moment(
    loss: float, speed: float, X_1: float, X_2: float, u_1: float, u_2: float
) -> None:
    made = steering(loss, speed, FORCE, MOMENT)
    slow, fast = (moment_limit(min_or_max(X_1, X_2), min_or_max(u_1, u_2), made) for min_or_max in (min, max))
    assert 0.0 <= slow <= fast * (1.0 + 1e-12)
    assert fast <= MOMENT
    assert moment_limit(FORCE, 0.0, made) == pytest.approx(MOMENT)
    assert moment_limit(0.0, 0.0, made) == pytest.approx((1.0 - loss) * MOMENT, abs=1e-9)
    assert moment_limit(-X_1, -u_1, made) == moment_limit(X_1, u_1, made)


def test_an_outboard_without_thrust_has_no_moment_and_a_rudder_has_it_from_its_speed_on() -> None:
    outboard, rudder = steering(1.0, math.inf, FORCE, MOMENT), steering(1.0, 2.0, FORCE, MOMENT)
    assert moment_limit(0.0, 3.0, outboard) == 0.0
    assert moment_limit(0.0, 1.0, rudder) == pytest.approx(0.25 * MOMENT)
    assert moment_limit(0.0, 2.5, rudder) == MOMENT
    assert steered((0.0, MOMENT), 0.0, outboard) == pytest.approx((LARGEST_BOOST * FORCE, LARGEST_BOOST * MOMENT))
    assert steered((-150.0, MOMENT), 0.0, outboard) == pytest.approx((-150.0, 0.5 * MOMENT))


@pytest.mark.parametrize(("force", "moment"), [(math.inf, MOMENT), (FORCE, math.inf)])
def test_a_loss_without_limits_is_refused(force: float, moment: float) -> None:
    with pytest.raises(ParameterError, match="steering_loss must be 0 without finite"):
        steering(0.5, math.inf, force, moment)
    assert steering(0.0, math.inf, force, moment).loss == 0.0
