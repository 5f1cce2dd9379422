"""A curve that a ship cannot travel is rejected in one line with the demand, the limit and a feasible speed."""

import math
import re

import pytest
from durations import rest_long
from hulls import BOAT

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.guidance.curve_motion import LARGEST_DRIFT, Demand, Pace, check_feasible, demand
from vessel_hsmc_ros.guidance.curves import Arc, CircleParameters, FigureEightParameters, SquareParameters, StraightParameters
from vessel_hsmc_ros.plant.dynamics import Vessel

SHAPES = {
    "straight": StraightParameters().shape(),
    "circle": CircleParameters(-20.0).shape(),
    "figure_eight": FigureEightParameters(60.0).shape(),
    "square": SquareParameters(40.0).shape(),
}


def reason(
    mode: str, speed: float, vessel: Vessel = BOAT, force: float = 300.0, moment: float = 250.0, rise_time: float = 0.0
) -> str:
    """The error line, empty if the curve is feasible."""
    try:
        check_feasible(
            f"reference_ship.{mode}", SHAPES[mode], Pace(speed, rise_time), vessel, Demand(LARGEST_DRIFT, force, moment)
        )
    except ParameterError as error:
        return str(error)
    return ""


def test_the_demand_of_a_line_is_the_resistance_of_the_hull() -> None:
    assert demand(Arc(0.0), Pace(3.0, 0.0), BOAT, LARGEST_DRIFT) == Demand(0.0, 50.0 * 3.0 + 30.0 * 9.0, 0.0)


def test_the_line_names_demand_limit_and_largest_feasible_speed() -> None:
    assert reason("straight", 3.0) == (
        "reference_ship.straight: a straight line at 3 m/s needs a surge force of 420 N (vessel.surge_force_limit is 300 N);"
        " the largest feasible speed is 2.43 m/s"
    )
    assert reason("circle", 3.0) == (
        "reference_ship.circle: radius 20 m at 3 m/s needs a surge force of 480 N (vessel.surge_force_limit is 300 N)"
        " and a yaw moment of 362 N·m (vessel.yaw_moment_limit is 250 N·m); the largest feasible speed is 2.27 m/s"
    )


def test_a_moment_against_the_turn_counts_as_one_with_it() -> None:
    """Munk's moment turns this hull further into the turn than its damping takes, so the rudder holds against it."""
    loose, radius = BOAT._replace(d_r=0.0, d_r2=0.0, d_r3=0.0), 20.0
    beta = demand(Arc(1.0 / radius), Pace(2.0, 0.0), loose, LARGEST_DRIFT).drift
    munk = (loose.m22 - loose.m11) * 4.0 * math.cos(beta) * math.sin(beta)
    assert munk > 100.0
    assert demand(Arc(1.0 / radius), Pace(2.0, 0.0), loose, LARGEST_DRIFT).yaw_moment == pytest.approx(munk)
    assert "a yaw moment of" in reason("circle", 2.0, loose, moment=0.9 * munk)
    assert reason("circle", 2.0, loose, moment=1.1 * munk) == ""


@pytest.mark.parametrize("mode", rest_long(SHAPES))
def test_the_speed_that_the_line_names_is_feasible_and_a_little_more_is_not(mode: str) -> None:
    found = re.search(r"the largest feasible speed is ([\d.]+) m/s", reason(mode, 3.0))
    assert found
    speed = float(found[1])
    assert reason(mode, speed) == ""
    assert reason(mode, 1.01 * speed) != ""


def test_without_limits_only_the_drift_angle_bounds_a_curve() -> None:
    assert reason("circle", 3.0, force=math.inf, moment=math.inf) == ""
    weak = BOAT._replace(d_v=20.0, d_v2=0.0)
    assert reason("circle", 3.0, weak, math.inf, math.inf) == (
        "reference_ship.circle: radius 20 m at 3 m/s needs a drift angle of 76° (the largest is 45°);"
        " the largest feasible speed is 0.761 m/s"
    )


def test_the_start_needs_force_for_the_acceleration_too() -> None:
    assert reason("straight", 2.0, rise_time=20.0) == ""
    assert reason("straight", 2.0, rise_time=4.0) == (
        "reference_ship.straight: a straight line at 2 m/s needs a surge force of 584 N (vessel.surge_force_limit is 300 N);"
        " with a rise_time of 4 s the largest feasible speed is 1.06 m/s, with a longer one more"
    )
