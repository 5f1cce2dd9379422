"""The two laws of case 1, alone and on a ship that only turns."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.laws.course import CourseLawParameters
from vessel_hsmc_ros.control.laws.hierarchical_printed import sign
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.plant.dynamics import derivative, unforced_acceleration
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters

SHIP = VesselParameters().coefficients()
CALM = (0.0, 0.0, 0.0)

angles, rates = st.floats(-math.pi, math.pi), st.floats(-1.0, 1.0)
states = st.tuples(st.just(0.0), st.just(0.0), angles, st.floats(-3.0, 3.0), rates, rates).map(np.array)


@given(states, st.tuples(angles, rates, rates))
def test_the_course_surface_obeys_its_reaching_law(state, desired) -> None:
    """dS = -k·S - eta·sgn S where the network is exact."""
    reference = np.array([0.0, 0.0, desired[0], 0.0, 0.0, desired[1]])
    law: Any = make_controller("course", 0.01, **{"network.layout": "listed", "network.listed_centers": state[3:]})
    law.memory.W[:] = unforced_acceleration(state[3], state[4], state[5], SHIP)[2]
    wrench, terms = law.update(0.0, state, reference, np.array([0.0, 0.0, desired[2]]))
    dds = derivative(state, wrench, CALM, SHIP)[5] - desired[2]
    S = terms.heading_surface
    assert terms.yaw_surface == S == pytest.approx(0.3 * terms.heading_error + terms.heading_error_rate)
    assert 0.3 * terms.heading_error_rate + dds == pytest.approx(-100.0 * S - 0.001 * sign(S), abs=1e-9)


def test_the_course_network_learns_by_integration() -> None:
    law: Any = make_controller("course", 0.01, adaptation_gain=2.0)
    state = np.array([0.0, 0.0, 0.2, 0.0, 0.0, 0.0])
    first, second, third = (law.update(0.0, state, np.zeros(6), np.zeros(3))[1] for _ in range(3))
    assert not first.yaw_weights.any()
    H = second.yaw_weights / (0.01 * 2.0 * 0.3 * 0.2)
    assert H.shape == (27,)
    assert ((H > 0.9) & (H <= 1.0)).all()  # the centres are within a fifth of the width
    np.testing.assert_allclose(third.yaw_weights, 2.0 * second.yaw_weights)
    law.retune(CourseLawParameters(reaching_gain=50.0))
    assert law.update(0.0, state, np.zeros(6), np.zeros(3))[1].yaw_weights.any()
    law.reset()
    assert not law.update(0.0, state, np.zeros(6), np.zeros(3))[1].yaw_weights.any()


def test_the_pd_controller_matches_a_calculation_by_hand() -> None:
    law: Any = make_controller("pd", 0.01, heading_gain=1e6, yaw_rate_gain=3e7, yaw_damping=8e6, surge_force=5e4)
    state = np.array([9.0, 9.0, 0.3, 2.0, 0.0, 0.04])
    reference = np.array([0.0, 0.0, 0.1, 0.0, 0.0, 0.01])
    wrench, terms = law.update(0.0, state, reference, np.array([0.0, 0.0, 0.002]))
    assert wrench == pytest.approx([5e4, 636e5 * 0.002 + 8e6 * 0.01 - 1e6 * 0.2 - 3e7 * 0.03])
    assert (terms.heading_error, terms.heading_error_rate) == pytest.approx((0.2, 0.03))


@pytest.mark.parametrize("law", ["course", "pd"])
def test_the_heading_error_is_wrapped_and_other_terms_are_nan(law) -> None:
    state, reference = np.zeros(6), np.zeros(6)
    state[2], reference[2] = math.radians(170.0), math.radians(-170.0)
    wrench, terms = make_controller(law, 0.01).update(0.0, state, reference, np.zeros(3))
    assert math.degrees(terms.heading_error) == pytest.approx(-20.0)
    assert wrench[1] > 0.0
    assert math.isnan(terms.surge_error)
    assert math.isnan(terms.surge_surface)
    assert math.isnan(terms.surge_estimate)


def test_an_unstable_course_gain_is_rejected() -> None:
    with pytest.raises(ParameterError, match=r"controller\.course\.reaching_gain = 100 1/s is unstable .* below 99\.7 1/s"):
        make_controller("course", 0.02)
