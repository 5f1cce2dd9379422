"""Integrals stop while their own actuator is saturated and go on while the other one is; filters are stable at every period."""

import math
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion

STILL = Acceleration(0.0, 0.0, 0.0)
DESIRED = Motion(10.0, -4.0, 0.3, 2.0, 0.1, 0.02)
SHIP = Motion(9.98, -3.98, 0.31, 1.99, 0.11, 0.019)
SMALL = 1e-3
LARGE: dict[str, Any] = {"surge_force_limit": 1e12, "yaw_moment_limit": 1e15}
LIMITS: tuple[str, ...] = tuple(LARGE)

OWN: dict[str, tuple[dict[str, Any], tuple[str, str]]] = {
    "los_pid": ({"stretch": 1.0}, ("surge_integral", "yaw_integral")),
    "alos": ({"law": "los_pid", "stretch": 1.0, "guidance": "alos"}, ("surge_integral", "yaw_integral")),
    "ashrafiuon": ({"surfaces": "as_printed"}, ("surge_integral", "sway_integral")),
}


def after_steps(name: str, limits: dict[str, Any], ship: Motion = SHIP, **own: Any) -> tuple[Any, Any]:
    """Terms and memory of the third step."""
    settings = {**LARGE, **limits, **own}
    made: Any = make_controller(settings.pop("law", name), 0.02, **settings)
    for _ in range(3):
        _, terms = made.step(ship, DESIRED, STILL)
    return terms, made.memory


@pytest.mark.parametrize("saturated", [(), (0,), (1,), (0, 1)], ids=str)
@pytest.mark.parametrize("name", OWN)
def test_an_integral_stops_only_while_its_own_actuator_is_saturated(name: str, saturated: tuple[int, ...]) -> None:
    own, fields = OWN[name]
    terms, memory = after_steps(name, {LIMITS[axis]: SMALL for axis in saturated}, **own)
    assert (terms.surge_saturated, terms.yaw_saturated) == (0 in saturated, 1 in saturated)
    assert [getattr(memory, field) == 0.0 for field in fields] == [0 in saturated, 1 in saturated]


@pytest.mark.parametrize("saturated", [(), (0,), (1,), (0, 1)], ids=str)
@pytest.mark.parametrize("far", [False, True])
def test_the_integral_over_the_earth_stops_while_either_actuator_or_the_error_is_saturated(
    saturated: tuple[int, ...], far: bool
) -> None:
    ship = SHIP._replace(x=-200.0) if far else SHIP
    terms, memory = after_steps("hand_position", {LIMITS[axis]: SMALL for axis in saturated}, ship)
    assert (terms.surge_saturated, terms.yaw_saturated) == (0 in saturated, 1 in saturated)
    assert any(memory.integral) is (not saturated and not far)


@pytest.mark.parametrize("period", [0.02, 0.5, 2.0, 5.0])
def test_filters_that_are_faster_than_the_period_reach_their_input_and_do_not_pass_it(period: float) -> None:
    made: Any = make_controller("backstepping", period, filter_time=0.4, excitation=0.0)
    made.step(SHIP, DESIRED, STILL)
    nearer = SHIP._replace(x=DESIRED.x + 1.0, psi=0.4)
    before, commanded = (made.memory.a_u, made.memory.a_r), []
    for _ in range(30):
        terms = made.step(nearer, DESIRED, STILL)[1]
        commanded.append((terms.commanded_surge_velocity, terms.commanded_yaw_rate))
        for filtered, start, end in zip((made.memory.a_u, made.memory.a_r), before, commanded[0], strict=True):
            assert min(start, end) - 1e-12 <= filtered <= max(start, end) + 1e-12
    assert np.ptp(commanded, axis=0) == pytest.approx((0.0, 0.0), abs=1e-12)
    share = 1.0 if period >= 0.4 else 1.0 - (1.0 - period / 0.4) ** 30
    for filtered, start, end in zip((made.memory.a_u, made.memory.a_r), before, commanded[0], strict=True):
        assert filtered == pytest.approx(start + share * (end - start))
    assert math.dist(before, commanded[0]) > 1e-3
