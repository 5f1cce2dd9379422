import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.core.exceptions import SimulationError
from vessel_hsmc_ros.plant.devices import SensorParameters
from vessel_hsmc_ros.plant.disturbance import (
    EarthFixedParameters,
    PeriodicParameters,
    WaveParameters,
    body_wrench,
    next_gust,
    periodic_wrench,
    total,
)
from vessel_hsmc_ros.plant.dynamics import acceleration, derivative, rk4, unforced_acceleration
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.plant.simulator import DisturbanceParameters, PlantParameters, Simulator
from vessel_sim_node import plant as public

SHIP = VesselParameters().coefficients()
CALM = (0.0, 0.0, 0.0)
REST = np.zeros(6)

motions = st.tuples(*[st.floats(-100.0, 100.0)] * 2, st.floats(-7.0, 7.0), *[st.floats(-3.0, 3.0)] * 3).map(np.array)


def test_the_derivative_matches_a_calculation_by_hand() -> None:
    state = np.array([0.0, 0.0, math.pi / 2, 2.0, 1.0, 0.5])
    rates = public.derivative(state, (1e5, 1e6), (0.1, 0.2, 0.3), SHIP)
    damping_u = 215e2 * 2.0 + 43e2 * 4.0 + 21.5e2 * 8.0
    damping_v = 147e3 * 1.0 + 29.4e3 * 1.0 + 14.7e3 * 1.0
    damping_r = 802e4 * 0.5 + 160.4e4 * 0.25 + 80.2e4 * 0.125
    expected = [
        -1.0,
        2.0,
        0.5,
        (177.9e3 * 0.5 - damping_u + 1e5) / 120e3 + 0.1,
        (-120e3 * 1.0 - damping_v) / 177.9e3 + 0.2,
        ((120e3 - 177.9e3) * 2.0 - damping_r + 1e6) / 636e5 + 0.3,
    ]
    np.testing.assert_allclose(rates, expected, rtol=1e-12)


def test_as_printed_the_higher_yaw_damping_is_divided_by_the_surge_inertia() -> None:
    printed = VesselParameters(as_printed=True).coefficients()
    u, v, r = 2.0, 1.0, -0.5
    f_u, f_v, f_r = unforced_acceleration(u, v, r, printed)
    assert (f_u, f_v) == unforced_acceleration(u, v, r, SHIP)[:2]
    higher = 160.4e4 * abs(r) * r + 80.2e4 * r**3
    assert f_r == pytest.approx(((120e3 - 177.9e3) * u * v - 802e4 * r) / 636e5 - higher / 120e3)


def test_the_munk_moment_turns_a_drifting_ship() -> None:
    drifting = np.array([0.0, 0.0, 0.0, 2.0, 0.5, 0.0])
    assert derivative(drifting, (0.0, 0.0), CALM, SHIP)[5] == pytest.approx((120e3 - 177.9e3) * 1.0 / 636e5)


@given(motions, st.floats(-1e6, 1e6), st.floats(-1e7, 1e7))
def test_the_plant_is_symmetric_to_port_and_starboard(state, force, moment) -> None:
    mirror = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
    left = derivative(state, (force, moment), (0.1, 0.2, 0.3), SHIP)
    right = derivative(mirror * state, (force, -moment), (0.1, -0.2, -0.3), SHIP)
    np.testing.assert_allclose(right, mirror * left, rtol=1e-12, atol=1e-12)


@given(motions)
def test_without_inputs_the_kinetic_energy_decreases(state) -> None:
    inertia = np.array([SHIP.m11, SHIP.m22, SHIP.m33])
    power = np.sum(inertia * state[3:] * derivative(state, (0.0, 0.0), CALM, SHIP)[3:])
    assert power <= 1e-6


def test_steady_surge_speed_solves_the_drag_polynomial() -> None:
    state = REST
    for _ in range(20_000):
        state = rk4(state, (1e5, 0.0), CALM, SHIP, 0.01)
    roots = np.roots([SHIP.d_u3, SHIP.d_u2, SHIP.d_u, -1e5])
    assert state[3] == pytest.approx(float(roots[np.isreal(roots)].real[0]), rel=1e-9)


def test_runge_kutta_converges_at_order_four() -> None:
    start = np.array([0.0, 0.0, 0.3, 2.0, -0.4, 0.3])  # no velocity changes its sign: |v|v is smooth there only once

    def error(steps):
        state = start
        for _ in range(steps):
            state = rk4(state, (1e5, 2e6), (0.01, 0.02, 0.003), SHIP, 2.0 / steps)
        return np.linalg.norm(state - exact)

    exact = start
    for _ in range(4000):
        exact = rk4(exact, (1e5, 2e6), (0.01, 0.02, 0.003), SHIP, 2.0 / 4000)
    orders = [math.log2(error(n) / error(2 * n)) for n in (10, 20, 40)]
    assert all(3.8 < order < 4.2 for order in orders), orders


def test_the_papers_disturbance() -> None:
    w = periodic_wrench(50.0 * math.pi, PeriodicParameters().constants())
    assert w == pytest.approx((2 * 11e2, 2 * 26e2, 2 * 950e2))
    assert acceleration(w, SHIP) == pytest.approx((22e2 / 120e3, 52e2 / 177.9e3, 1900e2 / 636e5))


@given(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5), st.floats(-7.0, 7.0))
def test_an_earth_fixed_force_keeps_its_direction(east, north, psi: float) -> None:
    along, across, moment = body_wrench((east, north), psi)
    c, s = math.cos(psi), math.sin(psi)
    assert (along * c - across * s, along * s + across * c, moment) == pytest.approx((east, north, 0.0), abs=1e-9)


def test_disturbances_add_up() -> None:
    wind = EarthFixedParameters(east_force=2e4)
    simulator = Simulator(PlantParameters(disturbance=DisturbanceParameters(earth_fixed=wind)), 0.01)
    expected = total((1100.0, 2600.0, 95000.0), body_wrench((2e4, 0.0), math.pi / 4))
    assert simulator.disturbance(0.0) == pytest.approx(expected)


def test_gusts_have_their_standard_deviation_and_correlation_time() -> None:
    blowing = EarthFixedParameters(east_force=1e4, gust_deviation=2e3, gust_time_constant=5.0)
    wind, random = blowing.constants(0.5), np.random.default_rng(1)
    gusts = [tuple(2e3 * random.standard_normal(2))]
    for normal in random.standard_normal((40_000, 2)).tolist():
        gusts.append(next_gust(gusts[-1], normal, wind))
    gust = np.array(gusts)
    np.testing.assert_allclose(gust.std(axis=0), 2e3, rtol=0.05)  # 4000 independent gusts: 5 standard errors
    np.testing.assert_allclose(gust.mean(axis=0), 0.0, atol=5 * 2e3 / math.sqrt(4000 / 2))
    for lag in (1, 5, 10):
        memory = np.mean(gust[lag:] * gust[:-lag], axis=0) / np.var(gust, axis=0)
        np.testing.assert_allclose(memory, math.exp(-0.1 * lag), atol=0.05)


def test_a_force_ahead_of_midships_turns_the_ship() -> None:
    assert body_wrench((0.0, 1e3), 0.0, lever=3.0) == (0.0, 1e3, 3e3)


def test_the_gusts_towards_east_and_north_have_noise_of_their_own() -> None:
    wind = EarthFixedParameters(gust_deviation=2e3, gust_time_constant=5.0).constants(0.5)
    for i, noise in enumerate(np.eye(2)):
        assert next_gust((0.0, 0.0), noise, wind) == tuple(wind.innovation * noise)
        assert next_gust(tuple(noise), np.zeros(2), wind) == tuple(wind.memory * noise), i


def test_a_reset_repeats_disturbances_and_noise() -> None:
    disturbances = DisturbanceParameters(
        earth_fixed=EarthFixedParameters(gust_deviation=1e4), waves=WaveParameters(significant_height=1.0)
    )
    simulator = Simulator(PlantParameters(disturbance=disturbances, sensors=SensorParameters(position_noise=0.1)), 0.01)

    def simulated():
        rows = []
        for k in range(50):
            wrench = simulator.disturbance(0.01 * k)
            rows.append([*wrench, *simulator.measured(k * 10_000_000)])
            simulator.advance(simulator.applied((1e5, 1e6)), wrench)
        return np.array(rows)

    first = simulated()
    simulator.reset()
    np.testing.assert_array_equal(simulated(), first)


def test_random_sources_are_independent_of_each_other() -> None:
    gusts = DisturbanceParameters(earth_fixed=EarthFixedParameters(gust_deviation=1e4))
    wrenches = []
    for sensors in (SensorParameters(), SensorParameters(position_noise=0.1)):
        simulator = Simulator(PlantParameters(disturbance=gusts, sensors=sensors), 0.01)
        simulator.measured(0)
        simulator.advance((0.0, 0.0, 0.0), simulator.disturbance(0.0))
        simulator.measured(10_000_000)
        wrenches.append(simulator.disturbance(0.01))
    assert wrenches[0] == wrenches[1]


@pytest.mark.parametrize("command", [(math.nan, 0.0), (0.0, math.inf)])
def test_a_command_that_is_not_finite_is_rejected(command) -> None:
    simulator = Simulator(PlantParameters(), 0.01)
    with pytest.raises(SimulationError, match=r"must be finite numbers .*(nan|inf)"):
        simulator.applied(command)
    np.testing.assert_array_equal(simulator.state, [5.0, 1.0, math.pi / 4, 0.0, 0.0, 0.0])


def test_a_motion_that_is_not_finite_is_reported() -> None:
    simulator = Simulator(PlantParameters(), 0.01)
    with pytest.raises(SimulationError, match="no longer finite"):
        simulator.advance((1e300, 0.0, 1e300), CALM)


def test_substeps_refine_the_same_motion() -> None:
    coarse, fine = (Simulator(PlantParameters(substeps=n), 0.1) for n in (1, 20))
    for simulator in (coarse, fine):
        for _ in range(50):
            simulator.advance((1e5, 0.0, 1e6), CALM)
    np.testing.assert_allclose(coarse.state, fine.state, rtol=1e-6)
    coarse.reset()
    np.testing.assert_array_equal(coarse.state, [5.0, 1.0, math.pi / 4, 0.0, 0.0, 0.0])
