"""The certificate of a vessel: its conditions, and its bounds compared with simulated errors of hulls from its box."""

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from durations import rest_long

from vessel_hsmc_ros.control.interface.known_vessel import INSTANT
from vessel_hsmc_ros.control.laws.hierarchical_linear import Lag, Mean, at_rest, dead_time, linearise, poles, steady
from vessel_hsmc_ros.control.laws.hierarchical_parameters import gains
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_for, scenario_text
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate
from vessel_hsmc_ros.studies.certificate import (
    BOX,
    Part,
    at_a_point,
    box,
    case_of,
    hull_at,
    in_box,
    limits_of,
    sway_of,
    under_way,
)

FIXED = {"controller.law": "hierarchical", "controller.hierarchical.actuator_identification": False}

DECLARED = {f"controller.vessel.{name}": value for name, value in INSTANT.items()}
"""Instant actuators that are declared: a slower law drifts too far for the circle of a slow drift."""


@lru_cache
def of_vessel(name: str) -> Scenario:
    text = scenario_for(read_vessel(name).values, name, "made")
    return parse_scenario(text, "made", source="made").changed(FIXED)


@lru_cache
def boat() -> Scenario:
    """A boat of 3 m whose sway is damped twice as much as by the rules of thumb."""
    made = parse_scenario(scenario_text("made", MainData(length=3.0)), "made", source="made")
    return made.changed({**FIXED, "vessel.sway_damping": 2.0 * made.vessel_sim.vessel.sway_damping})


def loaded(scenario: Scenario, mode: str) -> Scenario:
    """The scenario with wind, gusts, a current and noise."""
    L, F = scenario.controller.vessel.length, scenario.controller.vessel.surge_force_limit
    return scenario.changed(
        {
            "reference_ship.mode": mode,
            "vessel_sim.disturbance.earth_fixed.east_force": 0.03 * F,
            "vessel_sim.disturbance.earth_fixed.gust_deviation": 0.006 * F,
            "vessel_sim.disturbance.current.east": 0.08,
            "vessel_sim.sensors.position_noise": 0.0005 * L,
        }
    )


@pytest.mark.parametrize("name", ["cybership2", "cybership_enterprise"])
def test_the_cyberships_have_no_certificate_and_the_condition_is_named(name: str) -> None:
    for part, condition in (
        (under_way(case_of(of_vessel(name))), "course by heading (1 + lam·D)/K"),
        (at_a_point(case_of(of_vessel(name))), "1 + slowest decay/c"),
    ):
        assert part.failed[0].name == condition
        assert math.isinf(part.bound)
        assert str(part.failed[0]).startswith(f"{condition} must exceed 1 (got ")


@pytest.mark.parametrize("name", ["paper_ship", "otter"])
def test_hulls_with_much_sway_damping_have_a_certificate_under_way(name: str) -> None:
    part = under_way(case_of(loaded(of_vessel(name), "circle")))
    assert part.failed == ()
    assert 0.0 < part.bound < 0.03 * of_vessel(name).controller.vessel.length


@pytest.mark.parametrize("mode", rest_long(["straight", "circle", "goal"], 2))
def test_in_calm_water_without_noise_a_certified_hull_ends_on_its_path_and_near_the_target_at_rest(mode: str) -> None:
    case = case_of(boat().changed({"reference_ship.mode": mode}))
    assert 0.0 < at_a_point(case).bound < 0.1 * case.g.l0
    assert case.speed == 0.0 if mode == "goal" else under_way(case).bound == pytest.approx(0.0, abs=1e-9)


def test_at_rest_under_the_force_of_the_paper_the_bound_is_less_than_three_times_the_largest_circle_of_the_corners() -> None:
    scenario = load_scenario(
        "case3_stabilisation", {**FIXED, **DECLARED, "controller.rate_hz": 50.0, "vessel_sim.duration": 600.0}
    )
    errors = []
    for ship in [*box(scenario.vessel_sim.vessel)][:4]:  # those of the lowest inertias, which a force accelerates most
        run = simulate(replace(scenario, vessel_sim=replace(scenario.vessel_sim, vessel=ship)))
        errors.append(np.hypot(*(run.state - run.reference)[run.time > 200.0, :2].T).max())
    assert 1.0 < at_a_point(case_of(scenario)).bound / max(errors) < 3.0


def test_a_hull_with_its_centre_of_percussion_beyond_the_station_lever_has_none_at_rest() -> None:
    assert "station lever/centre of percussion l0/x_p" in [each.name for each in at_a_point(case_of(of_vessel("otter"))).failed]


@pytest.mark.parametrize(("mode", "within"), rest_long([("circle", 5.0), ("straight", 5.0), ("goal", 5.0)]))
def test_simulated_errors_of_hulls_of_the_box_stay_within_the_bound_which_is_not_far(mode: str, within: float) -> None:
    scenario = loaded(boat(), mode)
    case = case_of(scenario)
    part: Part = at_a_point(case) if mode == "goal" else under_way(case)
    random, ratios = np.random.default_rng(3), []
    for _ in range(4):
        ship = in_box(scenario.vessel_sim.vessel, *random.uniform(1.0 - BOX, 1.0 + BOX, 4).tolist())
        hull = {f"vessel_sim.vessel.{name}": value for name, value in vars(ship).items() if isinstance(value, float)}
        run = simulate(scenario.changed({**hull, "vessel_sim.duration": 600.0, "vessel_sim.seed": int(random.integers(1000))}))
        late = run.time > 450.0
        ratios.append(part.bound / np.hypot(*(run.state - run.reference)[late, :2].T).max())
    assert min(ratios) >= 1.0
    assert max(ratios) <= within


def test_the_linearised_law_has_the_poles_of_the_closed_form_where_its_surfaces_are_fast() -> None:
    """The polynomial of docs/theory.md is that of S1 = S2 = 0."""
    case = case_of(of_vessel("paper_ship").changed({**DECLARED, "reference_ship.mode": "straight"}))
    hull, U, g = (
        hull_at(case.ship.coefficients(), 0.0),
        case.speed,
        case.g._replace(k1=200.0, k2=200.0, lam=1e4, rho=0.25e8, T=1e-5),
    )
    D, K = sway_of(hull, U, 1e-3)
    lam = math.hypot(g.l0, g.T_a * U) / U
    found = poles(linearise(g, hull, steady(hull, U, 0.0, Mean()), (Lag(0.0, 0.0), Lag(0.0, 0.0)), 20.0))
    for root in np.roots([lam, lam * D + 1.0 - K, D + g.c * (1.0 - K), g.c * D]):
        assert np.min(np.abs(found - root)) < 0.03 * abs(root)


def test_at_rest_the_bow_turns_into_the_wind_or_current_and_nowhere_else() -> None:
    hull, F = hull_at(boat().vessel_sim.vessel.coefficients(), 0.0), 0.1 * boat().controller.vessel.surge_force_limit
    for mean in (Mean((F, 0.0)), Mean(current=(0.2, 0.0)), Mean((F, 0.0), 0.0, (0.2, 0.0))):
        (at,) = at_rest(hull, mean)
        assert abs(at.motion.psi) == pytest.approx(math.pi, abs=1e-6)
        assert at.wrench[0] > 0.0
    (across,) = at_rest(hull, Mean((0.0, F)))
    assert across.motion.psi == pytest.approx(-0.5 * math.pi, abs=1e-6)


def test_a_dead_time_beyond_the_tolerated_one_makes_the_law_oscillate() -> None:
    """The simulated vessel on a straight line, with dead times below and above the bound, which is that of a nominal hull."""
    scenario = of_vessel("paper_ship").changed({"reference_ship.mode": "straight"})
    case = case_of(scenario)
    hull = hull_at(case.ship.coefficients(), 0.0)
    found = linearise(case.g, hull, steady(hull, case.speed, 0.0, Mean()), case.lags, 20.0)
    assert poles(found).real.max() < 0.0
    tolerated = dead_time(case.g, found, 1)
    errors = []
    for share in (0.85, 1.25):
        changes: dict[str, Any] = {"vessel_sim.actuators.yaw_dead_time": share * tolerated, "vessel_sim.duration": 300.0}
        run = simulate(scenario.changed({**changes, "vessel_sim.initial_pose": [0.0, 0.5, 0.0]}))
        errors.append(np.abs(run.state[run.time > 200.0, 5]).max())
    assert errors[0] < 0.01 < errors[1]


def test_the_corners_of_the_box_have_a_fifth_more_or_less_sway_damping_and_coriolis_ratio() -> None:
    ship = of_vessel("paper_ship").vessel_sim.vessel
    D, K = sway_of(hull_at(ship.coefficients(), 0.0), 1.0, 1e-3)
    found = np.array([sway_of(hull_at(each.coefficients(), 0.0), 1.0, 1e-3) for each in box(ship)])
    assert len(found) == 16
    np.testing.assert_allclose(sorted(set(np.round(found[:, 0] / D, 6))), (0.8, 1.2))
    np.testing.assert_allclose(sorted(set(np.round(found[:, 1] / K, 6))), (0.8, 1.2))


def test_the_limits_are_those_of_the_forces() -> None:
    scenario = load_scenario("case2_tracking", {"controller.law": "hierarchical"})
    case = case_of(scenario)
    limits, hull = limits_of(case), hull_at(scenario.vessel_sim.vessel.coefficients(), 0.0)
    fastest = math.hypot(case.speed, limits.current)
    assert hull(Motion(0.0, 0.0, 0.0, fastest, 0.0, 0.0), (case.g.tau_1max, 0.0, 0.0), (0.0, 0.0))[0] == pytest.approx(
        0.0, abs=1e-6
    )
    assert limits.circle == pytest.approx(0.102, abs=0.001)
    assert gains(case.parameters, case.known, 1.0 / limits.rate).lam / limits.rate == pytest.approx(2.0, abs=1e-3)
    tightest = steady(hull, case.speed, case.speed / limits.turn, Mean())
    assert abs(tightest.wrench[1]) < case.g.tau_2max
