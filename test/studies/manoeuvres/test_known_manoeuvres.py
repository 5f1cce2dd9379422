"""Manoeuvres of ships whose metrics are known: linear damping and equal inertias make the equations solvable by hand."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq, fsolve

from vessel_hsmc_ros.plant.dynamics import derivative
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies.manoeuvres.page import UNITS
from vessel_hsmc_ros.studies.manoeuvres.run import (
    METRICS,
    PLANS,
    Manoeuvre,
    Ship,
    in_still_water,
    perform,
    scenario_of,
    ship_of,
    track_of,
)

FORCE, MOMENT, LENGTH = 600.0, 300.0, 5.0
HULL = {
    **{"length": LENGTH, "beam": 1.5, "surge_force_limit": FORCE, "yaw_moment_limit": MOMENT},
    **{"surge_inertia": 500.0, "sway_inertia": 500.0, "yaw_inertia": 900.0},
    **{"surge_damping": 200.0, "sway_damping": 400.0, "yaw_damping": 450.0},
    **{f"{axis}_damping_{power}": 0.0 for axis in ("surge", "sway", "yaw") for power in ("quadratic", "cubic")},
}


def a_ship(**hull: float) -> Ship:
    """A ship with linear damping and no Munk moment, so that its yaw is that of Nomoto's first-order model."""
    values = {**HULL, **hull}
    return ship_of(in_still_water("boat", {f"vessel.{name}": value for name, value in values.items()}))


@pytest.fixture(scope="module")
def ship() -> Ship:
    return a_ship()


def metrics(ship: Ship, name: str, **options: Any) -> dict[str, float]:
    done = perform(ship, name, **options)
    assert done.complete, name
    return done.metrics


def test_the_test_speed_is_that_of_85_percent_of_the_largest_output(ship: Ship) -> None:
    assert ship.top_speed == pytest.approx(FORCE / 200.0)
    # With linear resistance the output is proportional to the square of the speed.
    assert ship.speed == pytest.approx(math.sqrt(0.85) * ship.top_speed)
    assert ship.approach_force == pytest.approx(200.0 * ship.speed)


def test_the_test_speed_stays_inside_the_range_of_the_hull_data() -> None:
    values = {f"vessel.{name}": value for name, value in HULL.items()} | {"vessel.surge_speed_range": (-1.0, 1.0)}
    ship = ship_of(in_still_water("boat", values))
    assert ship.top_speed == 1.0
    assert metrics(ship, "speed_run")["top_speed"] == pytest.approx(1.0, rel=1e-2)


def test_the_steady_turn_is_the_root_of_the_equations_of_motion(ship: Ship) -> None:
    found = metrics(ship, "turning_circle")
    r, force = MOMENT / 450.0, ship.approach_force
    # Without a Munk moment: v = -m·u·r/d_v, and F = d_u·u - m·v·r.
    u = force / (200.0 + (500.0 * r) ** 2 / 400.0)
    v = 500.0 * u * r / 400.0
    assert found["steady_yaw_rate"] == pytest.approx(math.degrees(r), rel=1e-3)
    assert found["steady_speed"] == pytest.approx(math.hypot(u, v), rel=1e-2)
    assert found["steady_diameter"] == pytest.approx(2.0 * math.hypot(u, v) / r, rel=1e-2)
    assert found["drift_angle"] == pytest.approx(math.degrees(math.atan2(v, u)), rel=1e-2)


def test_the_steady_turn_of_the_papers_ship_is_a_root_found_by_another_solver() -> None:
    scenario = in_still_water("paper", {})
    ship = ship_of(scenario)
    hull = ship.scenario.vessel_sim.vessel.coefficients()

    def surplus(velocity: np.ndarray) -> np.ndarray:
        state = np.array([0.0, 0.0, 0.0, *velocity])
        return derivative(state, (ship.approach_force, -ship.largest_moment), np.zeros(3), hull)[3:]

    u, v, r = fsolve(surplus, [2.5, 0.6, -0.35], xtol=1e-12)
    found = metrics(ship, "turning_circle")
    assert found["steady_diameter"] == pytest.approx(2.0 * math.hypot(u, v) / abs(r), rel=1e-3)
    assert found["drift_angle"] == pytest.approx(math.degrees(math.atan2(v, u)), rel=1e-2)


@pytest.mark.parametrize("angle_deg", [10.0, 20.0])
def test_the_zigzag_of_a_ship_without_munk_moment_is_that_of_nomotos_model(ship: Ship, angle_deg: float) -> None:
    T, rate = 900.0 / 450.0, angle_deg / 35.0 * MOMENT / 450.0
    angle = math.radians(angle_deg)
    time = brentq(lambda t: rate * (t - T * (1.0 - math.exp(-t / T))) - angle, 1e-6, 1e3)
    r = rate * (1.0 - math.exp(-time / T))
    # From the reversal on, r = (r_1 + K·delta)·exp(-t/T) - K·delta, which is zero at the overshoot.
    check = T * math.log(1.0 + r / rate)
    found = metrics(ship, f"zigzag_{angle_deg:.0f}")
    assert found["initial_turning_time"] == pytest.approx(time, abs=5e-3)
    # Later than by hand by up to a step of 0.02 s, in which the ship turns on.
    assert found["first_overshoot"] == pytest.approx(math.degrees(T * r - rate * check), rel=1e-2)
    assert found["first_yaw_check_time"] == pytest.approx(check, abs=0.03)


def test_the_crash_stop_of_a_ship_with_linear_resistance_is_logarithmic(ship: Ship) -> None:
    found = metrics(ship, "crash_stop")
    # m·du/dt = -F - d·u.
    time = 500.0 / 200.0 * math.log(1.0 + 200.0 * ship.speed / FORCE)
    reach = (500.0 * ship.speed - FORCE * time) / 200.0
    assert found["stopping_time"] == pytest.approx(time, rel=1e-3)
    assert found["track_reach"] == pytest.approx(reach, rel=1e-3)
    assert found["head_reach"] == pytest.approx(reach, rel=1e-3)
    assert found["side_reach"] == pytest.approx(0.0, abs=1e-9)


def test_the_spiral_of_a_ship_without_munk_moment_is_a_line_without_loop(ship: Ship) -> None:
    found = metrics(ship, "spiral")
    assert found["largest_yaw_rate"] == pytest.approx(math.degrees(MOMENT / 450.0), rel=1e-2)
    assert found["loop_width"] < 0.5
    assert found["residual_yaw_rate"] < 0.5


def test_a_ship_that_is_unstable_on_a_straight_course_has_a_loop_and_is_not_checked() -> None:
    unstable = a_ship(sway_inertia=1500.0, yaw_damping=300.0)
    assert perform(unstable, "spiral").metrics["loop_width"] > 10.0
    assert math.isinf(metrics(unstable, "zigzag_10")["first_overshoot"])


def test_speed_runs_and_bollard_pull_find_the_limits(ship: Ship) -> None:
    assert metrics(ship, "speed_run") == pytest.approx({"top_speed": 3.0, "half_force_speed": 1.5}, rel=1e-2)
    assert metrics(ship, "bollard_pull") == {"bollard_pull": FORCE, "force_rise_time": 0.0}


def test_the_bollard_pull_rises_with_the_lag_of_the_propulsion() -> None:
    values = {f"vessel.{name}": value for name, value in HULL.items()} | {"vessel_sim.actuators.surge_lag": 0.5}
    found = metrics(ship_of(in_still_water("boat", values)), "bollard_pull")
    assert found["bollard_pull"] == pytest.approx(FORCE, rel=1e-3)
    assert found["force_rise_time"] == pytest.approx(0.5 * math.log(20.0), abs=0.02)


@pytest.mark.parametrize("name", PLANS)
def test_manoeuvres_to_port_and_to_starboard_are_mirror_images(name: str) -> None:
    # With sway-yaw coupling and cross terms, which a mirror must change as well.
    coupled = a_ship(sway_inertia=650.0, sway_yaw_inertia=80.0, sway_damping_from_yaw=30.0, yaw_damping_from_sway=20.0)
    port, starboard = (metrics(coupled, name, side=side) for side in ("port", "starboard"))
    assert port == pytest.approx(starboard, rel=1e-12, abs=1e-9)


@pytest.mark.parametrize("name", ["turning_circle", "zigzag_10", "zigzag_20", "crash_stop"])
def test_the_metrics_do_not_depend_on_the_rate(ship: Ship, name: str) -> None:
    found = [_at_rate(ship, name, rate_hz) for rate_hz in (50.0, 100.0)]
    for metric, value in found[0].metrics.items():
        # The zig-zag reverses at a step: within one of 0.02 s at 0.67 rad/s.
        assert value == pytest.approx(found[1].metrics[metric], rel=0.01, abs=0.03), metric


def _at_rate(ship: Ship, name: str, rate_hz: float) -> Manoeuvre:
    rates = {f"{node}.rate_hz": rate_hz for node in ("vessel_sim", "reference_ship", "controller")}
    scenario = scenario_of(ship, name, 2.0).changed(rates)
    track, settings = track_of(simulate(scenario), scenario), scenario.controller.manoeuvre
    return Manoeuvre(name, scenario, track, METRICS[settings.kind](track, settings), True)


@pytest.mark.parametrize("name", PLANS)
def test_a_ship_scaled_by_froude_has_the_same_metrics_in_its_own_units(ship: Ship, name: str) -> None:
    scale = 9.0
    time = math.sqrt(scale)
    mass, moment = scale**3, scale**5
    powers = {
        **{"length": scale, "beam": scale, "surge_force_limit": mass * scale / time**2},
        **{"yaw_moment_limit": moment / time**2, "yaw_inertia": moment, "yaw_damping": moment / time},
        **dict.fromkeys(("surge_inertia", "sway_inertia"), mass),
        **dict.fromkeys(("surge_damping", "sway_damping"), mass / time),
    }
    large = metrics(a_ship(**{key: HULL[key] * factor for key, factor in powers.items()}), name)
    for metric, value in metrics(ship, name).items():
        unit = _unit(metric, scale, time, mass)
        assert large[metric] == pytest.approx(value * unit, rel=0.02, abs=0.02 * unit), metric


def _unit(metric: str, scale: float, time: float, mass: float) -> float:
    units = {"m": scale, "s": time, "m/s": scale / time, "°": 1.0, "°/s": 1.0 / time, "%": 1.0, "N": mass * scale / time**2}
    return units[UNITS[metric]]
