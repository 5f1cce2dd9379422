"""The published laws that cancel the ship's dynamics: model, known answers, symmetry, convergence with an exact model."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.control.interface.known_vessel import (
    KnownDamping,
    KnownVessel,
    drag,
    drag_slope,
    free_acceleration,
    jerk,
    known_ship,
    point_ahead,
    rotated,
)
from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.metrics import position_error, rms
from vessel_hsmc_ros.plant.dynamics import rk4
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate

MODEL_BASED = ["ashrafiuon", "backstepping", "hand_position"]
SHIP = known_ship(KnownVessel(), KnownDamping())
CALM = {f"vessel_sim.disturbance.periodic.{name}": 0.0 for name in ("surge_force", "sway_force", "yaw_moment")}
LIMITS = {"vessel_sim.actuators.surge_force_limit": 2e5, "vessel_sim.actuators.yaw_moment_limit": 3e6}
RATES = {f"{node}.rate_hz": 20.0 for node in ("vessel_sim", "reference_ship", "controller")}
STILL = Acceleration(0.0, 0.0, 0.0)

wide = st.floats(-1e3, 1e3)
states = st.tuples(wide, wide, st.floats(-math.pi, math.pi), st.floats(-5, 5), st.floats(-5, 5), st.floats(-1, 1))


def circling() -> Motion:
    """A ship in a steady turn: u and r are chosen, and v is where its sway force vanishes."""
    u, r, v = 2.0, 0.1, 0.0
    for _ in range(60):
        v += free_acceleration(Motion(0.0, 0.0, 0.0, u, v, r), SHIP).dv * SHIP.m22 / drag_slope(v, SHIP.d_v, SHIP.d_v2, SHIP.d_v3)
    return Motion(12.0, -3.0, 0.7, u, v, r)


def run_of(law: str, seconds: float, **changes: object) -> Any:
    wanted = {"controller.law": law, "vessel_sim.duration": seconds, **RATES, **LIMITS, **CALM}
    return simulate(load_scenario("case2_tracking", {**wanted, **{k.replace("__", "."): v for k, v in changes.items()}}))


def test_the_known_model_equals_the_plant() -> None:
    random, plant = np.random.default_rng(1), VesselParameters().coefficients()
    for _ in range(20):
        x = random.normal(size=6) * [10.0, 10.0, 2.0, 2.0, 1.0, 0.3]
        moved = np.asarray(rk4(x, np.zeros(2), np.zeros(3), plant, 1e-6))
        np.testing.assert_allclose((moved - x)[3:] / 1e-6, free_acceleration(Motion(*x), SHIP), rtol=1e-3, atol=1e-7)


def test_the_slope_of_the_damping_is_its_derivative() -> None:
    for velocity in (-2.0, -0.1, 0.3, 4.0):
        slope = (drag(velocity + 1e-6, 3.0, 2.0, 0.5) - drag(velocity - 1e-6, 3.0, 2.0, 0.5)) / 2e-6
        assert drag_slope(velocity, 3.0, 2.0, 0.5) == pytest.approx(slope, rel=1e-6)


def test_velocity_acceleration_and_jerk_of_a_point_are_the_derivatives_of_its_position() -> None:
    at, change, h = Motion(1.0, 2.0, 0.4, 2.0, -0.3, 0.2), Acceleration(0.1, -0.05, 0.03), 1e-4

    def later(t: float) -> Motion:
        u, v, r = at.u + t * change.du, at.v + t * change.dv, at.r + t * change.dr
        middle = at.psi + 0.5 * t * (at.r + 0.5 * t * 0.5 * change.dr)
        step = rotated(t * 0.5 * (at.u + u), t * 0.5 * (at.v + v), middle)
        return Motion(at.x + step.x, at.y + step.y, at.psi + t * 0.5 * (at.r + r), u, v, r)

    before, after = (point_ahead(later(t), change, 5.0) for t in (-h, h))
    now = point_ahead(at, change, 5.0)
    np.testing.assert_allclose(np.subtract(after.position, before.position) / (2 * h), now.velocity, atol=1e-6)
    np.testing.assert_allclose(np.subtract(after.velocity, before.velocity) / (2 * h), now.acceleration, atol=1e-6)
    before, after = (point_ahead(later(t), change, 0.0) for t in (-h, h))
    np.testing.assert_allclose(np.subtract(after.acceleration, before.acceleration) / (2 * h), jerk(at, change), atol=1e-6)


@pytest.mark.parametrize("law", MODEL_BASED)
def test_a_ship_on_the_reference_gets_the_wrench_that_keeps_it_there(law: str) -> None:
    at = circling()
    f = free_acceleration(at, SHIP)
    wrench, _ = make_controller(law, 0.02).step(at, at, STILL)
    np.testing.assert_allclose(wrench, (-SHIP.m11 * f.du, -SHIP.m33 * f.dr), rtol=1e-9)


@pytest.mark.parametrize("law", MODEL_BASED)
def test_the_mirrored_ship_gets_the_mirrored_wrench(law: str) -> None:
    def mirrored(m: Motion) -> Motion:
        return Motion(m.x, -m.y, -m.psi, m.u, -m.v, -m.r)

    ship, desired, change = circling()._replace(x=8.0, y=1.0, psi=0.2), circling(), Acceleration(0.02, 0.01, 0.005)
    one, other = (make_controller(law, 0.02) for _ in range(2))
    for _ in range(5):
        (tau_1, tau_2), _ = one.step(ship, desired, change)
        reflected, _ = other.step(mirrored(ship), mirrored(desired), Acceleration(0.02, -0.01, -0.005))
        assert reflected == pytest.approx((tau_1, -tau_2), rel=1e-9)


@pytest.mark.parametrize("law", MODEL_BASED)
@given(states, states)
@settings(max_examples=60)
def test_the_wrench_is_finite_and_within_the_limits_in_every_state(law: str, ship: Any, reference: Any) -> None:
    made = make_controller(law, 0.02)
    for _ in range(3):
        (tau_1, tau_2), terms = made.step(Motion(*ship), Motion(*reference), Acceleration(1.0, 1.0, 1.0))
        assert abs(tau_1) <= 2e5
        assert abs(tau_2) <= 3e6
        assert terms.surge_saturated == (abs(tau_1) == 2e5)


@pytest.mark.parametrize("law", MODEL_BASED)
def test_with_an_exact_model_the_calm_circle_is_tracked_to_a_millimetre(law: str) -> None:
    run = run_of(law, 240.0)
    assert rms(position_error(run.state, run.reference)[-400:]) < 1e-3


@pytest.mark.parametrize("law", MODEL_BASED)
def test_a_wrong_damping_leaves_an_error_that_the_exact_model_does_not(law: str) -> None:
    halved = {name: 0.5 * value for name, value in vars(KnownDamping()).items()}
    run = run_of(law, 160.0, **{f"controller.{law}.model.{name}": value for name, value in halved.items()})
    assert rms(position_error(run.state, run.reference)[-400:]) > 0.01


def test_the_two_surface_law_as_printed_keeps_an_offset_of_the_position() -> None:
    run = run_of("ashrafiuon", 160.0, controller__ashrafiuon__surfaces="as_printed")
    assert rms(position_error(run.state, run.reference)[-400:]) > 5.0


def test_the_integral_of_the_hand_position_stops_while_an_actuator_is_saturated() -> None:
    made: Any = make_controller("hand_position", 0.02, yaw_moment_limit=1.0)
    made.step(circling()._replace(y=1.0), circling(), STILL)
    assert made.memory.integral == (0.0, 0.0)


def test_new_gains_keep_the_integral() -> None:
    made: Any = make_controller("hand_position", 0.02)
    made.step(circling()._replace(x=12.001), circling(), STILL)
    kept = made.memory
    made.retune(type(made).__orig_bases__[0].__args__[0](position_gain=0.2))
    assert made.memory is kept
    assert kept.integral.x == pytest.approx(0.02 * 0.001)
    assert made.constants.k_p == 0.2
