"""The class of ships with sway-yaw coupling and cross damping: against matrices, and by what physics demands of all of them."""

import math
from typing import Any

import numpy as np
import pytest
from hulls import CYBERSHIP_2, MILLIAMPERE, hull
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from vessel_hsmc_ros.plant.dynamics import Vessel, acceleration, damping_force, derivative, rk4, unforced_acceleration
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters

Array = NDArray[np.float64]

CALM = (0.0, 0.0, 0.0)
SYMMETRIC = hull(**{**MILLIAMPERE, "m32": 62.386})
SPEEDY = {"d_x_vv": 30.0, "d_x_vr": 20.0, "d_y_uv": 200.0, "d_y_ur": -70.0, "d_n_uv": 60.0, "d_n_ur": 300.0}
HULLS = {
    "CyberShip II": hull(**CYBERSHIP_2),
    "milliAmpere": hull(**MILLIAMPERE),
    "milliAmpere with speed-proportional terms": hull(**{**MILLIAMPERE, **SPEEDY}),
}

hulls = pytest.mark.parametrize("vessel", HULLS.values(), ids=HULLS)
velocities = st.tuples(st.floats(-2.0, 2.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
MIRROR = np.array([1.0, -1.0, -1.0])


def mass(s: Vessel) -> Array:
    return np.array([[s.m11, 0.0, 0.0], [0.0, s.m22, s.m23], [0.0, s.m32, s.m33]])


def coriolis(s: Vessel, nu: Any) -> Array:
    u, v, r = nu
    c13, c23 = -(s.m22 * v + 0.5 * (s.m23 + s.m32) * r), s.m11 * u
    return np.array([[0.0, 0.0, c13], [0.0, 0.0, c23], [-c13, -c23, 0.0]])


def damping(s: Vessel, nu: Any) -> Array:
    """D(nu) as a matrix, term by term."""
    u, v, r = nu
    surge = [s.d_u + s.d_u2 * abs(u) + s.d_u3 * u**2, s.d_x_vv * v + s.d_x_vr * r, 0.0]
    sway_by_sway = s.d_v + s.d_v2 * abs(v) + s.d_v3 * v**2 + s.d_y_rv * abs(r) + s.d_y_uv * abs(u)
    sway_by_yaw = s.d_y_r + s.d_y_vr * abs(v) + s.d_y_rr * abs(r) + s.d_y_ur * u
    yaw_by_sway = s.d_n_v + s.d_n_vv * abs(v) + s.d_n_rv * abs(r) + s.d_n_uv * abs(u)
    yaw_by_yaw = s.d_r + s.d_r2 * abs(r) + s.d_r3 * r**2 + s.d_n_vr * abs(v) + s.d_n_ur * abs(u)
    return np.array([surge, [0.0, sway_by_sway, sway_by_yaw], [0.0, yaw_by_sway, yaw_by_yaw]])


@hulls
@settings(max_examples=40)
@given(nu=velocities, wrench=st.tuples(*[st.floats(-500.0, 500.0)] * 3))
def test_the_accelerations_are_those_of_the_matrices(vessel: Vessel, nu: Any, wrench: Any) -> None:
    forces = np.array(wrench) - coriolis(vessel, nu) @ nu - damping(vessel, nu) @ nu
    expected = np.linalg.solve(mass(vessel), forces)
    terms = np.abs(wrench) + np.abs(coriolis(vessel, nu)) @ np.abs(nu) + np.abs(damping(vessel, nu)) @ np.abs(nu)
    size = np.abs(np.linalg.inv(mass(vessel))) @ terms
    rates = derivative(np.array([0.0, 0.0, 0.3, *nu]), wrench, CALM, vessel)[3:]
    assert np.all(np.abs(rates - expected) <= 1e-12 * size + 1e-300)


def test_a_wrench_of_two_components_has_no_sway_force() -> None:
    state, ship = np.array([1.0, 2.0, 0.4, 1.0, 0.2, -0.1]), HULLS["milliAmpere"]
    np.testing.assert_array_equal(derivative(state, (50.0, 7.0), CALM, ship), derivative(state, (50.0, 0.0, 7.0), CALM, ship))


def test_a_sway_force_accelerates_also_the_ship_of_the_paper() -> None:
    paper = VesselParameters().coefficients()
    rates = derivative(np.zeros(6), (0.0, 177.9e3, 0.0), CALM, paper)
    np.testing.assert_array_equal(rates, [0.0, 0.0, 0.0, 0.0, 1.0, 0.0])


@hulls
def test_a_yaw_moment_moves_no_sway_at_the_point_m23_over_m22_ahead(vessel: Vessel) -> None:
    _, sway, yaw = acceleration((0.0, 0.0, 1.0), vessel)
    assert sway + vessel.m23 / vessel.m22 * yaw == pytest.approx(0.0, abs=1e-15)
    assert sway != 0.0


@hulls
@settings(max_examples=40)
@given(nu=velocities)
def test_coriolis_forces_do_no_work(vessel: Vessel, nu: Any) -> None:
    zero: Any = 0.0
    undamped = vessel._replace(**{name: zero for name in Vessel._fields if name.startswith("d_")})
    force = mass(vessel) @ np.array(unforced_acceleration(nu[0], nu[1], nu[2], undamped))
    size = np.abs(nu).sum() * np.abs(force).sum()
    assert abs(np.dot(nu, force)) <= 1e-12 * size + 1e-300


@hulls
@settings(max_examples=40)
@given(nu=velocities, wrench=st.tuples(*[st.floats(-500.0, 500.0)] * 3))
def test_mirror_images_move_as_mirror_images(vessel: Vessel, nu: Any, wrench: Any) -> None:
    motion, mirrored = np.array([1.0, 2.0, 0.3, *nu]), np.array([1.0, -2.0, -0.3, *(MIRROR * nu)])
    rates = derivative(motion, wrench, (0.1, 0.2, 0.3), vessel)
    image = derivative(mirrored, MIRROR * wrench, (0.1, -0.2, -0.3), vessel)
    np.testing.assert_array_equal(image, rates * np.tile(MIRROR, 2))


@given(nu=velocities)
def test_damping_takes_energy_from_milliampere(nu: Any) -> None:
    vessel, force = HULLS["milliAmpere"], damping_force(nu[0], nu[1], nu[2], HULLS["milliAmpere"])
    np.testing.assert_allclose(force, damping(vessel, nu) @ nu, rtol=1e-12, atol=1e-9)
    assert np.dot(nu, force) >= 0.0


@given(nu=velocities)
def test_the_kinetic_energy_falls_at_the_power_of_damping(nu: Any) -> None:
    rate = derivative(np.array([0.0, 0.0, 0.3, *nu]), CALM, CALM, SYMMETRIC)[3:]
    power = np.dot(nu, damping_force(nu[0], nu[1], nu[2], SYMMETRIC))
    gained = np.asarray(nu) @ mass(SYMMETRIC) @ rate
    assert gained == pytest.approx(-power, rel=1e-9, abs=1e-9)
    assert gained <= 0.0


@hulls
@settings(max_examples=40)
@given(
    motion=st.tuples(*[st.floats(-9.0, 9.0)] * 3, *[st.floats(-1.0, 1.0)] * 3),
    current=st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
)
def test_a_current_carries_the_ship_along_and_changes_nothing_else(vessel: Vessel, motion: Any, current: Any) -> None:
    """Galilean invariance: seen from the water, the ship moves as in still water."""
    wrench, step, steps = (20.0, 3.0, -5.0), 0.02, 25
    water, ground = np.array(motion), np.array(motion)
    ground[3:5] += into_body(current, motion[2])
    for _ in range(steps):
        water = rk4(water, wrench, CALM, vessel, step)
        ground = rk4(ground, wrench, CALM, vessel, step, current)
    seen = ground.copy()
    seen[:2] -= step * steps * np.array(current)
    seen[3:5] -= into_body(current, ground[2])
    # The integration error differs: over ground the velocities rotate with the hull, by up to 1 rad in a second.
    np.testing.assert_allclose(seen, water, rtol=0.0, atol=2e-7)


@hulls
@settings(max_examples=40)
@given(motion=st.tuples(*[st.floats(-9.0, 9.0)] * 3, *[st.floats(-1.0, 1.0)] * 3), current=st.tuples(*[st.floats(-1.0, 1.0)] * 2))
def test_the_rates_in_a_current_are_those_in_still_water(vessel: Vessel, motion: Any, current: Any) -> None:
    water, ground = np.array(motion), np.array(motion)
    u_c, v_c = into_body(current, motion[2])
    ground[3:5] += u_c, v_c
    wrench = (20.0, 3.0, -5.0)
    still, moving = derivative(water, wrench, CALM, vessel), derivative(ground, wrench, CALM, vessel, current)
    carried = np.array([*current, 0.0, water[5] * v_c, -water[5] * u_c, 0.0])
    np.testing.assert_allclose(moving, still + carried, rtol=0.0, atol=1e-12 * (1.0 + np.abs(still).max()))


def into_body(current: Any, psi: float) -> Array:
    c, s = math.cos(psi), math.sin(psi)
    return np.array([current[0] * c + current[1] * s, current[1] * c - current[0] * s])


@hulls
def test_the_integration_is_of_order_4(vessel: Vessel) -> None:
    start = np.array([0.0, 0.0, 0.1, 0.8, 0.3, 0.25])  # no velocity changes its sign, at which |v|v is not smooth

    def end(steps: int) -> Array:
        state = start
        for _ in range(steps):
            state = rk4(state, (2.0, 0.3, 0.5), CALM, vessel, 0.4 / steps)
        return state

    exact = end(320)
    errors = [np.abs(end(steps) - exact).max() for steps in (10, 20)]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.35)
