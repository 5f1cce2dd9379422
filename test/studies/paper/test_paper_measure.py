"""The numbers measured in a run, and the reduced dynamics compared with the closed loop."""

import math

import numpy as np
import pytest

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.laws.hierarchical_printed import HierarchicalPrintedParameters
from vessel_hsmc_ros.core.kinematics import as_motion
from vessel_hsmc_ros.core.metrics import Run, rms
from vessel_hsmc_ros.plant.dynamics import unforced_acceleration
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate
from vessel_hsmc_ros.studies.paper.measure import (
    Surfaces,
    growth_rate,
    lateral_error,
    measure,
    on_surfaces,
    reduced_error,
    settling_time,
)
from vessel_hsmc_ros.studies.paper.reproduction import ExactModelLaw

VESSEL = VesselParameters().coefficients()
PRINTED = Surfaces(0.3, 0.3, 0.3, 0.001, 100.0)


@pytest.fixture(scope="module")
def circle() -> Run:
    scenario = load_scenario("case2_tracking", {"vessel_sim.duration": 60.0})
    law = ExactModelLaw(scenario.controller.hierarchical_printed, scenario.controller.vessel, VESSEL)
    return simulate(scenario, law=law, interpreted=True)  # the compilation of this law takes far longer


def test_the_settling_time_is_the_last_crossing_of_the_limit() -> None:
    time = np.arange(6.0)
    assert settling_time(time, np.array([5.0, 0.1, -3.0, 0.5, -0.5, 0.2]), 1.0) == 3.0
    assert settling_time(time, np.zeros(6), 1.0) == 0.0
    assert math.isnan(settling_time(time, np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0]), 1.0))
    assert math.isnan(settling_time(time, np.full(6, np.nan), 1.0))


def test_the_velocities_of_the_reduced_dynamics_make_both_surfaces_zero() -> None:
    rng = np.random.default_rng(3)
    law = ExactModelLaw(HierarchicalPrintedParameters(), KnownVessel(), VESSEL)
    for _ in range(20):
        x, y, psi, v = rng.uniform(-1.0, 1.0, 4) * (50.0, 50.0, 3.0, 1.0)
        reference = rng.uniform(-1.0, 1.0, 6) * (50.0, 50.0, 3.0, 3.0, 1.0, 0.2)
        u, r, z2e = on_surfaces(x, y, psi, v, as_motion(reference), PRINTED)
        _, terms = law.update(0.0, np.array([x, y, psi, u, v, r]), reference, np.zeros(3))
        assert terms.sway_error == pytest.approx(z2e)
        assert terms.yaw_surface == pytest.approx(0.0, abs=1e-12)
        assert terms.surge_surface == pytest.approx(0.0, abs=1e-12)


def test_the_reduced_dynamics_predict_the_lateral_error_of_the_closed_loop(circle: Run) -> None:
    time, predicted = reduced_error(circle, VESSEL, HierarchicalPrintedParameters())
    actual = np.interp(time, circle.control["time"], circle.control["sway_error"])
    assert len(time) == 201
    assert np.max(np.abs(actual)) > 3.0
    np.testing.assert_allclose(predicted, actual, atol=0.01)


def test_the_growth_rate_is_zero_on_a_straight_line_and_positive_in_a_turn() -> None:
    assert growth_rate(0.0, 0.0, VESSEL) == 0.0
    rate, damping, r = growth_rate(0.125, 0.0, VESSEL), VESSEL.d_v / VESSEL.m22, 0.125
    assert rate > 0.0
    assert rate * rate + damping * rate == pytest.approx(VESSEL.m11 / VESSEL.m22 * r * r)
    assert growth_rate(-r, 0.0, VESSEL) == rate


def test_the_growth_rate_has_the_slope_of_the_damping_at_the_sway_velocity() -> None:
    v, step = -0.22, 1e-5
    drag = [value * (VESSEL.d_v + VESSEL.d_v2 * abs(value) + VESSEL.d_v3 * value * value) for value in (v - step, v + step)]
    slope = (drag[1] - drag[0]) / (2.0 * step) / VESSEL.m22
    rate, r = growth_rate(0.125, v, VESSEL), 0.125
    assert rate * rate + slope * rate == pytest.approx(VESSEL.m11 / VESSEL.m22 * r * r)
    assert rate == pytest.approx(0.01142, abs=2e-5)


def test_a_small_lateral_error_in_a_turn_grows_at_the_growth_rate() -> None:
    u, r, step = 0.3, 0.1, 0.1
    v = 0.0
    for _ in range(100):  # the sway velocity at which the turn is steady
        v += unforced_acceleration(u, v, r, VESSEL)[1]
    time = step * np.arange(4001)
    psi = r * time
    # A steady turn: both components of the velocity run round a circle.
    x = (u * np.sin(psi) + v * np.cos(psi)) / r
    y = (v * np.sin(psi) - u * np.cos(psi)) / r
    turn = np.column_stack((x, y, psi, np.full_like(time, u), np.full_like(time, v), np.full_like(time, r)))
    start = np.array([x[0], y[0] + 1e-4, 0.0, v])
    error = lateral_error(np.array(time), turn, np.zeros(4001), start, PRINTED._replace(a=0.0), VESSEL)
    grown = math.log(error[-1] / error[1000]) / (time[-1] - time[2000])
    assert grown == pytest.approx(growth_rate(r, v, VESSEL), rel=0.02)


def test_a_diverging_prediction_ends_in_nan() -> None:
    time = np.arange(2001.0)
    reference = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 5.0], (2001, 1))
    error = lateral_error(time, reference, np.full(2001, 1e6), np.array([0.0, 1.0, 0.0, 0.0]), PRINTED, VESSEL)
    assert np.isfinite(error[0])
    assert np.isnan(error[-1])


def test_the_numbers_of_the_circle_have_their_known_values(circle: Run) -> None:
    numbers = measure(circle, VESSEL, HierarchicalPrintedParameters())
    assert numbers.duration == pytest.approx(60.0)
    assert numbers.position_error_start == pytest.approx(math.hypot(10.0, 14.0))
    assert numbers.surge_force_peak == pytest.approx(3.1e7, rel=0.05)
    assert numbers.surge_peak_in_g == pytest.approx(26.2, rel=0.01)
    assert 10.0 < numbers.heading_settling_time < 15.0
    assert numbers.yaw_switching_gain_needed > 100.0 * 2.0 * 950e2 / 636e5 * 0.5
    late = circle.control["time"] >= 45.0
    assert numbers.weighted_sway_surface_late == pytest.approx(0.001 * rms(circle.control["sway_surface"][late]), rel=1e-3)
    assert numbers.surge_estimate_error < 0.1, "the model is known exactly, the disturbance is not"
    other = measure(circle, VESSEL, None)
    assert other.position_error_final == numbers.position_error_final
    assert math.isnan(other.yaw_surface_late)
