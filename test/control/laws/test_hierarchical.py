"""The repaired hierarchical law: its surfaces obey their reaching laws, it scales with the vessel, tracks and keeps station."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.control.interface.network import Estimates
from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.laws.hierarchical import control, guidance, learned_current, turn_in_current
from vessel_hsmc_ros.control.laws.hierarchical_parameters import HierarchicalParameters, gains, stretch
from vessel_hsmc_ros.core.exceptions import InstabilityError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, extrapolate
from vessel_hsmc_ros.core.metrics import rms
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text
from vessel_hsmc_ros.scenario.scenario import parse_scenario
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate

PERIOD = 0.02
SHIP = replace(KnownVessel(), **INSTANT)
G = gains(HierarchicalParameters(), SHIP, PERIOD)


def moved(m: Motion, rates: Acceleration, h: float) -> Motion:
    return extrapolate(m, rates, h)


def surfaces_at(ship: Motion, desired: Motion, rates: Acceleration, c: Any, f: Estimates) -> Any:
    turn = turn_in_current(desired, rates, c, G)
    return control(ship, guidance(ship, desired, rates, G), turn, c, desired.u, f, G)


numbers = st.floats(-1.0, 1.0)


@given(st.lists(numbers, min_size=18, max_size=18))
def test_with_right_networks_both_surfaces_decay_at_their_reaching_laws(drawn: list[float]) -> None:
    """The finite difference of S1 and S2 along the motion is -k·S - eta·sat(S/phi), for any state, reference and current."""
    d = np.array(drawn)
    ship = Motion(*(d[:6] * [20.0, 20.0, 3.0, 2.5, 0.5, 0.2]))
    desired = Motion(*(d[6:12] * [20.0, 20.0, 3.0, 2.5, 0.5, 0.2]))
    if abs(desired.u) < 0.05 or math.hypot(ship.x - desired.x, ship.y - desired.y) < 0.1:
        return
    rates, c, f = Acceleration(*(d[12:15] * [0.1, 0.02, 0.02])), (0.3, -0.2, 0.0), Estimates(*(d[15:18] * [0.2, 0.2, 0.02]))
    s = surfaces_at(ship, desired, rates, c, f)
    accelerations = Acceleration(f.fu + s.tau_1 / G.m11, f.fv, f.fr + s.tau_2 / G.m33)
    # The reference's acceleration is taken as constant in its own axes; that of r_d·s has no further derivative either.
    h = 1e-5
    later = surfaces_at(moved(ship, accelerations, h), moved(desired, rates, h), rates, c, f)
    before = surfaces_at(moved(ship, accelerations, -h), moved(desired, rates, -h), rates, c, f)
    for name, k, eta, phi in (("S1", G.k1, G.eta1, G.phi1), ("S2", G.k2, G.eta2, G.phi2)):
        value, rate = getattr(s, name), (getattr(later, name) - getattr(before, name)) / (2.0 * h)
        expected = -k * value - eta * min(max(value / phi, -1.0), 1.0)
        assert rate == pytest.approx(expected, rel=1e-4, abs=1e-4 * (1.0 + abs(expected)))


@given(st.floats(-0.5, 0.5), st.floats(0.5, 20.0))
def test_the_reaching_of_a_slow_moment_can_be_stopped_in_time(r: float, full: float) -> None:
    """The surface decays as without a limit of the rate, but at most so that the moment returns to zero with the surface."""
    ship = replace(SHIP, yaw_moment_rate=SHIP.yaw_moment_limit / full)
    g = gains(HierarchicalParameters(), ship, PERIOD)
    assert g.j == pytest.approx(ship.yaw_moment_rate / ship.yaw_inertia)
    at, still = Motion(0.0, 0.0, 0.0, 0.0, 0.0, r), Acceleration(0.0, 0.0, 0.0)
    n = guidance(at, Motion(*[0.0] * 6), still, g)
    s = control(at, n, (0.0, 0.0), (0.0, 0.0, 0.0), 0.0, Estimates(0.0, 0.0, 0.0), g)
    free = g.k1 * s.S1 + g.eta1 * min(max(s.S1 / g.phi1, -1.0), 1.0)
    braked = math.copysign(min(abs(free), math.sqrt(2.0 * g.j * s.ahead * abs(s.S1))), s.S1)
    assert s.ahead * s.tau_2 / g.m33 == pytest.approx(-braked, abs=1e-12)


def test_the_rate_of_a_moment_that_is_not_declared_is_assumed_to_be_slow() -> None:
    T = math.sqrt(SHIP.yaw_inertia / SHIP.yaw_moment_limit)
    assert gains(HierarchicalParameters(), KnownVessel(), PERIOD).j == pytest.approx(0.4 / T**3)
    partly = KnownVessel(yaw_moment_rate=SHIP.yaw_moment_limit / (4.0 * T))
    assert gains(HierarchicalParameters(), partly, PERIOD).j == pytest.approx(0.25 / T**3)
    assert stretch(partly, PERIOD) == pytest.approx(0.8 + 2.0 * 0.4 * 4.0 + PERIOD / T, abs=0.1)


@given(st.floats(1.0, 300.0), st.floats(0.5, 20.0), st.integers(0, 2**31))
def test_one_set_of_numbers_serves_a_vessel_of_any_size(length: float, time: float, seed: int) -> None:
    """In units of length and time of turns every vessel has the same wrench, given the same outputs of the networks."""
    size, pace = length / SHIP.length, time / math.sqrt(SHIP.yaw_inertia / SHIP.yaw_moment_limit)
    other = replace(
        SHIP,
        length=length,
        surge_inertia=SHIP.surge_inertia * 2.0,
        yaw_inertia=SHIP.yaw_inertia * 3.0,
        surge_force_limit=SHIP.surge_force_limit * 2.0 * size / pace**2,
        yaw_moment_limit=SHIP.yaw_moment_limit * 3.0 / pace**2,
    )
    there = gains(HierarchicalParameters(), other, PERIOD * pace)
    random = np.random.default_rng(seed)
    ship, desired = random.normal(size=6), random.normal(size=6)
    rates, scale = random.normal(size=3) * 0.1, np.array([size, size, 1.0, size / pace, size / pace, 1.0 / pace])
    f = random.normal(size=3) * 0.1
    wrenches = []
    for g, way, per in ((G, np.ones(6), 1.0), (there, scale, 1.0 / pace)):
        a, b = Motion(*(ship * way)), Motion(*(desired * way))
        change = Acceleration(*(rates * way[3:] * per))
        turn = turn_in_current(b, change, (0.0, 0.0, 0.0), g)
        s = control(a, guidance(a, b, change, g), turn, (0.0, 0.0, 0.0), b.u, Estimates(*(f * way[3:] * per)), g)
        wrenches.append((s.tau_1 / g.tau_1max, s.tau_2 / g.tau_2max))
    np.testing.assert_allclose(wrenches[1], wrenches[0], rtol=1e-9)


def test_slow_actuators_stretch_its_time_and_undeclared_ones_count_as_slow() -> None:
    instant = stretch(SHIP, PERIOD)
    slow = stretch(replace(SHIP, yaw_lag=1.0, yaw_dead_time=0.5, yaw_moment_rate=1e6), PERIOD)
    assert instant < stretch(KnownVessel(), PERIOD)
    assert instant < slow
    assert gains(HierarchicalParameters(), replace(SHIP, surge_lag=3.0), PERIOD).k1 < G.k1


def test_a_period_too_long_for_the_gains_is_refused_with_the_rate_that_it_takes() -> None:
    with pytest.raises(InstabilityError, match=r"controller.rate_hz must be above .* Hz .*\(got 0.1 Hz\)"):
        make_controller("hierarchical", 10.0)
    for rate_hz in (5.0, 10.0, 100.0):
        make_controller("hierarchical", 1.0 / rate_hz)


def test_the_current_is_learned_on_a_circle_and_told_from_a_lasting_sway_velocity_of_the_hull() -> None:
    c, current, lasting = (0.0, 0.0, 0.0), (0.4, -0.2), 0.05
    desired = Motion(0.0, 0.0, 0.0, 2.0, 0.1, 0.1)
    for k in range(40000):
        psi = 0.1 * PERIOD * k
        v = 0.1 + current[1] * math.cos(psi) - current[0] * math.sin(psi) + lasting
        c = learned_current(Motion(0.0, 0.0, psi, 2.0, v, 0.1), desired, c, G)
    np.testing.assert_allclose(c, (*current, lasting), atol=1e-3)


def test_a_hull_in_a_current_turns_as_its_velocity_through_the_water_does() -> None:
    """r_c integrated over a lap is a full turn, and its rate is the derivative."""
    c, R, U = (0.6, 0.3, 0.0), 18.0, 2.0
    still = Acceleration(0.0, 0.0, 0.0)
    n, total = 4000, 0.0
    headings = np.linspace(0.0, 2.0 * math.pi, n, endpoint=False)
    found = [turn_in_current(Motion(0.0, 0.0, psi, U, 0.0, U / R), still, c, replace_least(0.0)) for psi in headings]
    total = sum(r for r, _ in found) * (2.0 * math.pi / n) * R / U
    assert total == pytest.approx(2.0 * math.pi, rel=1e-6)
    slopes = np.gradient([r for r, _ in found], 2.0 * math.pi / n * R / U)
    np.testing.assert_allclose(slopes[1:-1], [rate for _, rate in found][1:-1], atol=1e-5)


def replace_least(speed: float) -> Any:
    return G._replace(U_c=speed)


LIMITS = {"vessel_sim.actuators.surge_force_limit": 2e5, "vessel_sim.actuators.yaw_moment_limit": 3e6}
ACTUATORS = {
    **{f"controller.vessel.{axis}_{what}": 0.0 for axis in ("surge", "yaw") for what in ("lag", "dead_time")},
    "controller.vessel.surge_force_rate": math.inf,
    "controller.vessel.yaw_moment_rate": math.inf,
}


@pytest.mark.parametrize(
    ("scenario", "changes", "at_most"),
    [
        ("case2_tracking", {}, 0.005),
        ("case2_straight", {}, 0.002),
        ("case2_slalom", {}, 0.01),
        ("case3_stabilisation", {}, 0.25),
        ("case2_tracking", {"vessel_sim.disturbance.current.north": 0.3}, 0.05),
        ("case2_tracking", {"vessel_sim.actuators.surge_lag": 1.5, "vessel_sim.actuators.yaw_lag": 1.5}, 0.02),
        ("case2_tracking", {"controller.rate_hz": 10.0}, 0.01),
        ("case2_tracking", {"reference_ship.surge_force": -6e4, "reference_ship.yaw_moment": 4e5}, 0.02),
    ],
)
def test_it_keeps_the_promise_of_the_paper_within_the_limits_of_the_actuators(
    scenario: str, changes: dict[str, Any], at_most: float
) -> None:
    """Rms position error of the last quarter: tracking and station keeping under the paper's disturbance, without chatter."""
    slow = any("lag" in name for name in changes)
    run = simulate(
        load_scenario(scenario, {"controller.law": "hierarchical", **LIMITS, **({} if slow else ACTUATORS), **changes})
    )
    late = run.time >= 0.75 * run.time[-1]
    error = run.state[late, :2] - run.reference[late, :2]
    assert rms(np.hypot(*error.T)) < at_most
    moments = run.wrench[late, 1]
    assert np.sum(np.abs(np.diff(moments))) / 3e6 < 0.05 * (run.time[-1] - run.time[late][0])
    assert np.max(np.abs(run.wrench)) <= 3e6


SLOW_BOAT: dict[str, Any] = {
    "controller.law": "hierarchical",
    "controller.hierarchical.actuator_identification": False,
    "reference_ship.mode": "straight",
    "vessel_sim.duration": 120.0,
    **{f"{node}.rate_hz": 25.0 for node in ("controller", "vessel_sim", "reference_ship")},
    **{f"{node}.{axis}_lag": 0.39 for node in ("controller.vessel", "vessel_sim.actuators") for axis in ("surge", "yaw")},
    **{f"controller.vessel.{axis}_dead_time": 0.0 for axis in ("surge", "yaw")},
    **{f"controller.vessel.{name}_rate": math.inf for name in ("surge_force", "yaw_moment")},
    "vessel_sim.vessel.surge_inertia": 71.6,
    "vessel_sim.vessel.sway_inertia": 87.3,
    "vessel_sim.vessel.yaw_inertia": 46.4,
    "vessel_sim.vessel.surge_damping": 2.4,
    "vessel_sim.vessel.surge_damping_quadratic": 5.2,
    "vessel_sim.vessel.sway_damping": 85.0,
    "vessel_sim.vessel.sway_damping_quadratic": 48.0,
    "vessel_sim.vessel.yaw_damping": 18.0,
    "vessel_sim.vessel.yaw_damping_quadratic": 16.5,
}
"""A boat of 2.2 m with slow actuators, a fifth more yaw inertia than declared and a sway velocity that decays slowly."""


@pytest.mark.parametrize(("x", "y", "heading"), [(-0.75, 1.3, 1.0), (1.5, 0.0, 3.0), (-0.75, -1.3, 5.0)])
def test_it_brakes_its_turns_so_that_slow_actuators_end_in_no_limit_cycle(x: float, y: float, heading: float) -> None:
    """Without the brake the moment alternates between its limits, and the boat oscillates by 0.6 m."""
    boat = parse_scenario(scenario_text("boat", MainData(length=2.2)), "boat", source="boat")
    slow = boat.changed({**SLOW_BOAT, "vessel_sim.initial_pose": [x, y, heading]})
    largest = []
    for braking in (slow.controller.hierarchical.turn_deceleration, 1e3):
        run = simulate(slow.changed({"controller.hierarchical.turn_deceleration": braking}))
        largest.append(np.max(np.hypot(*(run.state - run.reference)[run.time >= 90.0, :2].T)))
    assert largest[0] < 0.02
    assert largest[1] > 0.5


@pytest.mark.parametrize(("x", "y", "heading"), [(-160.0, 15.0, 3.1), (15.0, 175.0, 0.0), (40.0, -60.0, -1.6), (15.0, -5.0, 1.6)])
def test_from_afar_it_settles_whatever_its_heading(x: float, y: float, heading: float) -> None:
    changes = {"controller.law": "hierarchical", **LIMITS, **ACTUATORS, "vessel_sim.initial_pose": [x, y, heading]}
    run = simulate(load_scenario("case2_tracking", changes))
    assert np.hypot(*(run.state[-1, :2] - run.reference[-1, :2])) < 0.02


NOISE = {
    f"vessel_sim.sensors.{what}_noise": value
    for what, value in (("position", 0.1), ("heading", 0.0017), ("velocity", 0.01), ("yaw_rate", 0.0017))
}


@pytest.mark.parametrize("scenario", ["case2_tracking", "case2_straight", "case2_slalom"])
def test_noise_of_the_sensors_does_not_roughen_the_moment(scenario: str) -> None:
    """With 0.1 m of noise the moment changes by less than two limits a second."""
    run = simulate(load_scenario(scenario, {"controller.law": "hierarchical", **LIMITS, **ACTUATORS, **NOISE}))
    moments = run.wrench[run.time >= 0.75 * run.time[-1], 1]
    assert np.sum(np.abs(np.diff(moments))) / 3e6 < 2.0 * 0.25 * run.time[-1]


@pytest.mark.parametrize(
    "slow", [{"lag": 2.0}, {"dead_time": 1.0}, {"lag": 1.0, "dead_time": 0.5}], ids=["lag", "dead time", "both"]
)
def test_declared_lag_and_dead_time_are_predicted(slow: dict[str, float]) -> None:
    """The slalom is kept much more closely than with the same actuators undeclared."""
    actuators = {f"{axis}_{what}": value for axis in ("surge", "yaw") for what, value in slow.items()}
    plant = {f"vessel_sim.actuators.{name}": value for name, value in actuators.items()}
    declared = {**ACTUATORS, **{f"controller.vessel.{name}": value for name, value in actuators.items()}}
    errors = []
    for known in ({}, declared):
        changes = {"controller.law": "hierarchical", "controller.hierarchical.actuator_identification": False}
        run = simulate(load_scenario("case2_slalom", {**changes, **LIMITS, **plant, **known}))
        late = run.time >= 0.75 * run.time[-1]
        errors.append(rms(np.hypot(*(run.state[late, :2] - run.reference[late, :2]).T)))
    assert errors[1] < 0.6 * errors[0]
