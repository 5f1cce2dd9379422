"""(k + c)·T < 2, by the poles of the held double integrator and by the laws on the ship."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.laws.course import CourseLawParameters
from vessel_hsmc_ros.control.laws.hierarchical_printed import check_step
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.plant.dynamics import rk4
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters

SHIP = VesselParameters().coefficients()


@given(st.floats(0.01, 500.0), st.floats(0.01, 500.0), st.floats(0.001, 1.0))
def test_the_limit_is_where_a_pole_leaves_the_unit_circle(k: float, c, T: float) -> None:
    assume(abs((k + c) * T - 2.0) > 1e-3)
    # e and de after a period in which dde = -(k + c)·de - k·c·e was held
    held = np.array([-k * c, -(k + c)])
    step = np.array([[1.0, T], [0.0, 1.0]]) + np.outer([0.5 * T * T, T], held)
    stable = np.max(np.abs(np.linalg.eigvals(step))) < 1.0
    try:
        check_step(
            CourseLawParameters(reaching_gain=k, heading_surface_slope=c), "reaching_gain", "heading_surface_slope", T, "x"
        )
    except ParameterError:
        assert not stable
    else:
        assert stable


def surfaces(law, seconds, period=0.02):
    """|S| of the course law after half of a time and at its end, begun 1 degree beside its course, on a ship at rest."""
    state, found = np.array([0.0, 0.0, np.radians(1.0), 0.0, 0.0, 0.0]), []
    for _ in range(round(seconds / period)):
        wrench, terms = law.update(0.0, state, np.zeros(6), np.zeros(3))
        state = rk4(state, wrench, (0.0, 0.0, 0.0), SHIP, period)
        found.append(abs(terms.yaw_surface))
    return found[len(found) // 2 - 1], found[-1]


@pytest.mark.parametrize(("k", "settles"), [(99.68, True), (99.72, False), (100.0, False)])
def test_the_loop_is_stable_on_one_side_of_the_limit_only(k: float, settles: bool) -> None:
    """At 50 Hz with c = 0.3 1/s the limit is k = 99.7 1/s; 100 1/s, which k·T < 2 would just not allow, is beyond it."""
    law = make_controller("course", 0.01, reaching_gain=k, switching_gain=0.0, adaptation_gain=0.0)  # refused at 0.02 s
    late, later = surfaces(law, 80.0)
    assert (later < late) == settles


def test_the_error_names_the_remedy() -> None:
    slow = CourseLawParameters(reaching_gain=1.0, heading_surface_slope=3.0)
    with pytest.raises(ParameterError, match=r"is 4 and must be below 2, so set a rate above 2 Hz"):
        check_step(slow, "reaching_gain", "heading_surface_slope", 1.0, "course")
    with pytest.raises(ParameterError, match=r"so set a gain below 1 1/s or a rate above 0\.75 Hz"):
        check_step(
            CourseLawParameters(reaching_gain=1.0, heading_surface_slope=0.5),
            "reaching_gain",
            "heading_surface_slope",
            4.0 / 3.0,
            "x",
        )
