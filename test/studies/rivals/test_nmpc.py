"""Predictive control: its model against the plant, disturbance estimate, and tracking performance."""

import math
import sys
from typing import Any

import numpy as np
import pytest
from durations import rest_long

from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.core.exceptions import ControlError, ParameterError
from vessel_hsmc_ros.core.metrics import position_error, rms
from vessel_hsmc_ros.plant.dynamics import rk4
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate
from vessel_hsmc_ros.studies.rivals.nmpc import NmpcParameters, compile_horizon

pytest.importorskip("casadi", reason="the predictive law is an extra")

PERIOD = 0.1
SHIP = VesselParameters().coefficients()
REFERENCE = np.array([10.0, -5.0, 3.0, 2.0, -0.1, 0.1])
NONE = np.zeros(3)


@pytest.fixture
def law() -> Any:
    return make_controller("nmpc", PERIOD)


def run_of(seconds, **changes):
    rates = {f"{node}.rate_hz": 10.0 for node in ("vessel_sim", "reference_ship", "controller")}
    limits = {"vessel_sim.actuators.surge_force_limit": 2e5, "vessel_sim.actuators.yaw_moment_limit": 3e6}
    changes = {name.replace("__", "."): value for name, value in changes.items()}
    wanted = {"controller.law": "nmpc", "vessel_sim.duration": seconds, **rates, **limits, **changes}
    return simulate(load_scenario("case2_tracking", wanted))


def test_the_model_of_the_predictive_law_equals_the_plant(law) -> None:
    random = np.random.default_rng(1)
    for _ in range(20):
        x = random.normal(size=6) * [10.0, 10.0, 2.0, 2.0, 1.0, 0.3]
        u, b, e = random.uniform(-1.0, 1.0, 2), random.normal(size=3) * [2e4, 2e4, 5e5], random.normal(size=2) * 2e4
        c, s = math.cos(x[2]), math.sin(x[2])
        (stepped,) = law.horizon.step(x, u, b, (0.0, 0.0), 0.2)
        disturbance = b / [SHIP.m11, SHIP.m22, SHIP.m33]
        np.testing.assert_allclose(stepped[:, 0], rk4(x, u * [2e5, 3e6], disturbance, SHIP, 0.2), rtol=1e-12, atol=1e-12)
        # an earth-fixed force, over a step too short to turn in, is the same force turned into the hull's frame
        turned = np.add(b, [c * e[0] + s * e[1], -s * e[0] + c * e[1], 0.0])
        (fixed,), (body,) = law.horizon.step(x, u, b, e, 1e-6), law.horizon.step(x, u, turned, (0.0, 0.0), 1e-6)
        np.testing.assert_allclose(fixed, body, atol=1e-11)


def test_the_sensitivities_are_the_derivatives_of_the_predicted_motion(law) -> None:
    random = np.random.default_rng(2)
    x, b, e = REFERENCE - 1.0, random.normal(size=3) * 1e4, random.normal(size=2) * 1e4
    U = random.uniform(-0.5, 0.5, (2, 24))
    X, G = law.horizon.sensitivity(x, U, b, e)
    for place in (0, 1, 14, 47):
        change = np.zeros(48)
        change[place] = 1e-6
        (moved,) = law.horizon.motion(x, U + change.reshape(-1, 2).T, b, e)
        np.testing.assert_allclose((moved - X).T.ravel() / 1e-6, G[:, place], rtol=1e-3, atol=1e-5)


def test_a_horizon_is_compiled_once(law) -> None:
    again: Any = make_controller("nmpc", 0.02)
    assert again.horizon is law.horizon
    assert compile_horizon.cache_info().currsize <= 4


@pytest.mark.parametrize(("changes", "at_most"), rest_long([({}, 0.01), ({"reference_ship__yaw_moment": 0.0}, 0.01)]))
def test_the_reference_is_tracked_under_the_papers_disturbance(changes, at_most: float) -> None:
    run = run_of(60.0, **changes)
    assert rms(position_error(run.state, run.reference)[-200:]) < at_most
    assert np.all(np.max(np.abs(run.wrench), axis=0) <= [2e5, 3e6])


@pytest.mark.long
@pytest.mark.parametrize("kind", ["hull", "earth"])
def test_body_fixed_and_earth_fixed_disturbances_are_distinguished(law, kind: str) -> None:
    ship = np.array([0.0, 0.0, 0.0, 1.5, 0.0, 0.1])
    force = np.array([3e3, -4e3])
    for _ in range(600):
        reference = np.concatenate((ship[:3], (1.5, -0.1, 0.1)))  # a circle, or the two kinds look the same
        wrench, _ = law.update(0.0, ship, reference, NONE)
        c, s = (math.cos(ship[2]), math.sin(ship[2])) if kind == "earth" else (1.0, 0.0)
        disturbance = [(c * force[0] + s * force[1]) / SHIP.m11, (-s * force[0] + c * force[1]) / SHIP.m22, 0.0]
        ship = rk4(ship, np.add(wrench, [0.0, 4e5]), disturbance, SHIP, PERIOD)
    right, wrong = (law.plan.e, law.plan.b[:2]) if kind == "earth" else (law.plan.b[:2], law.plan.e)
    assert np.hypot(*(right - force)) < 0.35 * np.hypot(*force)
    assert np.hypot(*wrong) < 0.35 * np.hypot(*force)
    assert law.plan.b[2] == pytest.approx(4e5, rel=0.05)


def test_after_a_reset_the_same_inputs_give_bit_identical_wrenches(law) -> None:
    state = np.add(REFERENCE, [1.0, 2.0, 0.3, -0.5, 0.1, 0.0])
    first = [law.update(0.0, state, REFERENCE, NONE)[0] for _ in range(3)]
    law.reset()
    again = [law.update(0.0, state, REFERENCE, NONE)[0] for _ in range(3)]
    np.testing.assert_array_equal(first, again)


def test_the_heading_error_is_wrapped(law) -> None:
    state = REFERENCE.copy()
    state[2], reference = math.radians(-170.0), REFERENCE.copy()
    reference[2] = math.radians(170.0)
    assert law.update(0.0, state, reference, NONE)[1].heading_error == pytest.approx(math.radians(20.0))
    law.retune(NmpcParameters(heading_weight=10.0))
    law.reset()
    assert law.update(0.0, state, reference, NONE)[0][1] < 0.0


def test_a_predicted_motion_that_is_not_finite_is_rejected(law) -> None:
    with pytest.raises(ControlError, match="predicted motion is not finite"):
        law.update(0.0, np.array([0.0, 0.0, 0.0, 1e3, 1e3, 1e3]), REFERENCE, NONE)


def test_without_casadi_the_extra_is_named(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "casadi", None)
    compile_horizon.cache_clear()
    with pytest.raises(ParameterError, match=r"controller.law = nmpc needs CasADi, .* `nmpc`"):
        make_controller("nmpc", PERIOD)
