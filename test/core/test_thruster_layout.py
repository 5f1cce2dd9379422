"""The layout of the thrusters as data."""

import math
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.thruster_layout import ThrusterLayout

TWIN: dict[str, Any] = {
    "names": ["left", "right"],
    "x": [-2.0],
    "y": [0.4, -0.4],
    "thrust_ahead": [120.0],
    "thrust_astern": [67.0],
}
RUDDER: dict[str, Any] = {
    **{"names": ["screw"], "kinds": ["rudder"], "x": [-4.0], "thrust_ahead": [1e3], "angle_limit": [0.5], "lift": [50.0]},
    **{"lift_quadratic": [20.0], "slipstream": [0.002]},
}
BAD: list[tuple[dict[str, Any], str]] = [
    ({"x": [0.0, 1.0, 2.0]}, r"x must have 2 elements, as many as names.*\(got \[0.0, 1.0, 2.0\]"),
    ({"kinds": ["fixed", "fixed", "azimuth"]}, "vessel.thrusters.kinds must have 2 elements"),
    ({"kinds": ["sail"]}, r"kinds must be of fixed, azimuth, rudder \(got 'sail'"),
    ({"names": ["left", "left"]}, "left twice"),
    ({"names": ["left", "7"]}, "names must be a letter"),
    ({"names": ["left", "the right"]}, "name of a topic"),
    ({"thrust_ahead": [-1.0]}, r"thrust_ahead must be .* from 0"),
    ({"thrust_ahead": [0.0]}, r"thrust_ahead must be above 0 N \(got 0 N\)"),
    ({"thrust_rate": [-1.0]}, "thrust_rate must be .* from 0 to inf N/s"),
    ({"y": [0.0]}, "left, right cannot give a surge force and a yaw moment independently"),
    ({"angle": [0.5 * math.pi], "x": [1.0, 2.0]}, "cannot give a surge force"),
    ({"kinds": ["azimuth"], "angle_limit": [2.0]}, r"angle_limit .* at most pi/2, or pi .*\(got 2 rad\)"),
    ({"kinds": ["rudder"]}, "lift of a rudder must be above 0"),
]


def layout(values: dict[str, Any]) -> ThrusterLayout:
    return schema.build(ThrusterLayout, values, "vessel.thrusters")


@pytest.mark.parametrize(("change", "reason"), BAD)
def test_a_layout_that_cannot_be_is_refused_in_one_line(change: dict[str, Any], reason: str) -> None:
    with pytest.raises(ParameterError, match=reason) as caught:
        layout({**TWIN, **change})
    assert "\n" not in str(caught.value)


def test_without_names_there_are_no_thrusters() -> None:
    assert not ThrusterLayout()
    assert ThrusterLayout().thrusters() == []
    assert ThrusterLayout().limits() == (0.0, 0.0)


def test_one_element_of_a_list_holds_for_every_thruster() -> None:
    left, right = layout(TWIN).thrusters()
    assert (left.x, right.x) == (-2.0, -2.0)
    assert (left.y, right.y) == (0.4, -0.4)
    assert left.lag == right.lag == 0.0


def test_twin_propellers_give_twice_their_thrust_and_no_sway_force() -> None:
    assert layout(TWIN).limits() == pytest.approx((240.0, 0.8 * 120.0))
    assert layout(TWIN).sway_force_per_yaw_moment() == 0.0


def test_a_rudder_gives_the_sway_the_inverse_of_its_lever() -> None:
    rudder = layout(RUDDER)
    assert rudder.sway_force_per_yaw_moment() == pytest.approx(-0.25)
    force, moment = rudder.limits()
    assert force == 1e3
    assert moment == pytest.approx(4.0 * (50.0 - 20.0 * 0.5) * 0.5 * 2.0)
    assert layout({**RUDDER, "slipstream": [0.0]}).sway_force_per_yaw_moment() == pytest.approx(-0.25)


def test_azimuths_ahead_and_astern_turn_the_ship_without_a_sway_force() -> None:
    pair = layout({"names": ["bow", "stern"], "kinds": ["azimuth"], "x": [1.8, -1.8], "thrust_ahead": [500.0]})
    assert pair.sway_force_per_yaw_moment() == 0.0
    assert pair.limits() == pytest.approx((1000.0, 1800.0))


def test_the_largest_lift_is_where_it_stops_growing() -> None:
    """As of CyberShip II, whose rudders turn further than their best angle."""
    values = {**RUDDER, "lift": [6.43306], "lift_quadratic": [5.83594], "angle_limit": [0.61], "slipstream": [0.0]}
    (rudder,) = layout(values).thrusters()
    angles = np.linspace(0.0, 0.61, 2001)
    lifts = (6.43306 - 5.83594 * angles) * angles
    assert rudder.largest_lift(1.0) == pytest.approx(lifts.max(), rel=1e-6)
    assert rudder.largest_angle == pytest.approx(angles[lifts.argmax()], abs=1e-3)


def test_the_shaft_speed_has_the_sign_and_the_curve_of_the_thrust() -> None:
    (one, _) = layout({**TWIN, "thrust_coefficient_ahead": [0.01108], "thrust_coefficient_astern": [0.006445]}).thrusters()
    assert one.shaft_speed(0.01108 * 100.0**2) == pytest.approx(100.0)
    assert one.shaft_speed(-0.006445 * 50.0**2) == pytest.approx(-50.0)
    assert math.isnan(layout(TWIN).thrusters()[0].shaft_speed(1.0))
