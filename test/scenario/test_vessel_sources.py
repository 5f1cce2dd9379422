"""The derived numbers of the library, computed again from the primary ones of the sources."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from vessel_hsmc_ros.core.schema import entries
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters
from vessel_hsmc_ros.scenario.vessels import read_vessel

GRAVITY, SEA_WATER = 9.81, 1025.0

Matrix = NDArray[np.float64]


def mass_matrix(name: str) -> Matrix:
    v = read_vessel(name).hull()
    m32 = v.yaw_sway_inertia or v.sway_yaw_inertia
    return np.array([[v.surge_inertia, 0, 0], [0, v.sway_inertia, v.sway_yaw_inertia], [0, m32, v.yaw_inertia]])


def rigid_body(mass: float, inertia: float, x_g: float) -> Matrix:
    """The mass matrix of a rigid body whose centre of gravity is x_g ahead of the origin, with the inertia at the origin."""
    return np.array([[mass, 0, 0], [0, mass, mass * x_g], [0, mass * x_g, inertia]])


def test_the_papers_ship_is_the_default_of_the_plant() -> None:
    hull, default = read_vessel("paper_ship").hull(), ShipParameters()
    assert all(getattr(hull, name) == getattr(default, name) for name in entries(ShipParameters) if "." not in name)


@pytest.mark.parametrize(("name", "mass", "x_g"), [("cybership2", 23.8, 0.046), ("cybership_enterprise", 14.79, 0.0375)])
def test_the_inertia_of_the_cyberships_is_rigid_body_and_added_mass(name: str, mass: float, x_g: float) -> None:
    np.testing.assert_allclose(mass_matrix(name), rigid_body(mass, 1.76, x_g) + np.diag([2.0, 10.0, 1.0]), rtol=1e-12)


def test_the_thrust_of_cybership2_is_that_at_2000_rpm_and_its_moment_that_of_the_rudders() -> None:
    hull = read_vessel("cybership2").hull()
    n = 2000.0 / 60.0
    assert hull.thrusters.thrust_ahead[0] == pytest.approx(3.65034e-3 * n**2, rel=1e-3)
    assert hull.thrusters.thrust_astern[0] == pytest.approx(5.10256e-3 * n**2, rel=1e-3)
    assert hull.thrusters.slipstream[0] == pytest.approx(0.5**2 * 8.0 / (math.pi * 1000.0 * 0.08**2), rel=1e-3)
    assert hull.thrusters.limits() == pytest.approx((hull.surge_force_limit, hull.yaw_moment_limit), rel=0.01)


def test_the_otter_follows_from_its_main_data() -> None:
    hull, m, x_g = read_vessel("otter").hull(), 55.0, 0.2
    I_g = m * (0.25 * 2.0) ** 2
    added = np.diag([2.7 * SEA_WATER * (m / SEA_WATER) ** (5 / 3) / 2.0**2, 1.5 * m, 1.7 * I_g])
    M = rigid_body(m, I_g + m * x_g**2, x_g) + added
    np.testing.assert_allclose(mass_matrix("otter"), M, rtol=1e-4)
    assert hull.surge_damping == pytest.approx(24.4 * GRAVITY / (6 * 0.5144), rel=1e-4)
    assert (hull.sway_damping, hull.yaw_damping) == pytest.approx((M[1, 1], M[2, 2]), rel=1e-4)
    assert hull.draught == pytest.approx(m / SEA_WATER / (2 * 0.4 * 0.25 * 2.0), rel=0.01)
    ahead, astern = 0.5 * 24.4 * GRAVITY, 0.5 * 13.6 * GRAVITY
    assert (*hull.thrusters.thrust_ahead, *hull.thrusters.thrust_astern) == pytest.approx((ahead, astern), rel=1e-3)
    assert (hull.surge_force_limit, hull.yaw_moment_limit) == pytest.approx((2 * ahead, 2 * astern * 0.395), rel=1e-3)


def test_the_cross_flow_drag_of_the_otter_is_the_fit_to_strips() -> None:
    hull = read_vessel("otter").hull()
    # Drag of a strip by Hoerner's curve at B/2T = 0.93, between its points at 0.83 and 0.99.
    drag = np.interp(0.25 / (2 * 0.13415), [0.833589, 0.988002], [0.87959, 0.828415])
    x = np.linspace(-1.0, 1.0, 21)
    (v_low, v_high), (r_low, r_high) = hull.sway_speed_range, hull.yaw_rate_range
    v, r = np.meshgrid(np.linspace(v_low, v_high, 41), np.linspace(r_low, r_high, 41))
    flow = v[..., None] + x * r[..., None]
    strips = 0.5 * SEA_WATER * 0.13415 * drag * np.abs(flow) * flow * 0.1
    Y, N = strips.sum(-1).ravel(), (x * strips).sum(-1).ravel()
    of_v = np.stack([np.abs(v) * v, np.abs(r) * v], -1).reshape(-1, 2)
    of_r = np.stack([np.abs(r) * r, np.abs(v) * r], -1).reshape(-1, 2)
    given_v = np.array([hull.sway_damping_quadratic, hull.sway_damping_at_yaw])
    given_r = np.array([hull.yaw_damping_quadratic - 10 * hull.yaw_damping, hull.yaw_damping_at_sway])
    np.testing.assert_allclose(np.linalg.lstsq(of_v, Y)[0], given_v, rtol=1e-3)
    np.testing.assert_allclose(np.linalg.lstsq(of_r, N)[0], given_r, rtol=1e-3)
    errors = [np.std(of_v @ given_v - Y) / np.std(Y), np.std(of_r @ given_r - N) / np.std(N)]
    assert errors == pytest.approx([0.06, 0.08], abs=0.005)


def test_the_supply_vessel_follows_from_its_nondimensional_matrices() -> None:
    m, L = 6e6, 76.2
    scale = np.diag([1.0, 1.0, L])
    M = m * scale @ np.array([[1.1274, 0, 0], [0, 1.8902, -0.0744], [0, -0.0744, 0.1278]]) @ scale
    D = m * math.sqrt(GRAVITY / L) * scale @ np.array([[0.0358, 0, 0], [0, 0.1183, -0.0124], [0, -0.0041, 0.0308]]) @ scale
    np.testing.assert_allclose(mass_matrix("supply_vessel"), M, rtol=1e-6)
    v = read_vessel("supply_vessel").hull()
    damping = [v.surge_damping, v.sway_damping, v.sway_damping_from_yaw, v.yaw_damping_from_sway, v.yaw_damping]
    np.testing.assert_allclose(damping, [D[0, 0], D[1, 1], D[1, 2], D[2, 1], D[2, 2]], rtol=1e-6)


def test_gunnerus_is_rigid_body_and_added_mass_and_its_force_the_power_at_its_speed() -> None:
    added = np.array([[26599.24721721, 0, 0], [0, 132619.44, -473277.78], [0, -571162.06, 13320142.0]])
    np.testing.assert_allclose(mass_matrix("gunnerus"), rigid_body(574127.69, 41237080.0, 0.0) + added, rtol=1e-8)
    assert read_vessel("gunnerus").hull().surge_force_limit == pytest.approx(500e3 / (12.6 * 1852 / 3600), rel=1e-3)


@pytest.mark.parametrize("name", ["wam_v_16", "heron", "milliampere", "cybership_enterprise"])
def test_the_limits_are_those_of_the_thrusters_at_rest(name: str) -> None:
    hull = read_vessel(name).hull()
    assert hull.thrusters.limits() == pytest.approx((hull.surge_force_limit, hull.yaw_moment_limit), rel=1e-3)


def test_the_thrust_of_the_wam_v_is_that_of_its_simulators_drag_at_15_knots() -> None:
    u = 7.71667
    assert read_vessel("wam_v_16").hull().thrusters.thrust_ahead[0] == pytest.approx((51.3 + 72.4 * u) * u / 2, rel=1e-4)
