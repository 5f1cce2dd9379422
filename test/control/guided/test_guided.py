"""The guided law in closed loop: tracking, rest in a current, limits, delays, centre of percussion, and its second start."""

import math

import numpy as np
import pytest
from compiling import only_compiled
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.safety.monitors import Alarm, Saturation
from vessel_hsmc_ros.control.safety.parameters import MonitorParameters
from vessel_hsmc_ros.core.metrics import position_error, rms
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate

LENGTH = 32.0
LIMITS = {"vessel_sim.actuators.surge_force_limit": 2e5, "vessel_sim.actuators.yaw_moment_limit": 3e6}
AT_REST = {"reference_ship.surge_force": 0.0, "reference_ship.yaw_moment": 0.0}
INSTANT = {f"{axis}_{what}": 0.0 for axis in ("surge", "yaw") for what in ("lag", "dead_time")}
RATES = {"surge_force_rate": math.inf, "yaw_moment_rate": math.inf}


def error_of(scenario, over=0.25, **changes):
    run = simulate(load_scenario(scenario, {**LIMITS, "controller.law": "guided", **changes}))
    first = int((1.0 - over) * len(run.time))
    return rms(position_error(run.state[first:], run.reference[first:])) / LENGTH


@only_compiled
@pytest.mark.parametrize(("scenario", "limit"), [("case2_straight", 0.001), ("case2_tracking", 0.003), ("figure_eight", 0.003)])
def test_the_ship_tracks_though_nothing_but_inertia_and_limits_is_declared(scenario, limit):
    assert error_of(scenario) < limit


@pytest.mark.parametrize(
    "direction", [0.5 * math.pi, *(pytest.param(side * math.pi, marks=only_compiled) for side in (0.0, 1.0, -0.5))]
)
def test_the_ship_rests_in_a_current_from_every_side_though_it_does_not_know_it(direction):
    flow = {
        "vessel_sim.disturbance.current.east": 0.4 * math.cos(direction),
        "vessel_sim.disturbance.current.north": 0.4 * math.sin(direction),
    }
    calm = {f"vessel_sim.disturbance.periodic.{each}": 0.0 for each in ("surge_force", "sway_force", "yaw_moment")}
    assert error_of("case2_tracking", **AT_REST, **flow, **calm, **{"vessel_sim.duration": 600.0}) < 0.02


@only_compiled
def test_slow_actuators_that_are_declared_do_not_make_it_oscillate():
    slow = {"surge_lag": 1.0, "yaw_lag": 1.0, "surge_force_rate": 4e4, "yaw_moment_rate": 6e5}
    plant = {f"vessel_sim.actuators.{name}": value for name, value in slow.items()}
    known = {f"controller.vessel.{name}": value for name, value in {**slow, "surge_dead_time": 0.0, "yaw_dead_time": 0.0}.items()}
    assert error_of("case2_straight", **plant, **known) < 0.005


@only_compiled
def test_a_ship_with_slow_actuators_reaches_a_turning_reference_from_six_lengths_away():
    slow = {"vessel_sim.actuators.surge_force_rate": 2e4, "vessel_sim.actuators.yaw_moment_rate": 3e5}
    known = {"surge_force_rate": 2e4, "yaw_moment_rate": 3e5, **INSTANT}
    declared = {f"controller.vessel.{name}": value for name, value in known.items()}
    far = {"vessel_sim.initial_pose": [0.0, 200.0, math.pi], "vessel_sim.duration": 600.0}
    assert error_of("case2_tracking", **slow, **declared, **far) < 0.005


@only_compiled
def test_a_ship_whose_slow_actuators_are_not_declared_does_not_stay_on_a_circle_within_that_of_her_reference():
    slow = {"vessel_sim.actuators.surge_force_rate": 2e4, "vessel_sim.actuators.yaw_moment_rate": 3e5}
    turn = {"reference_ship.surge_force": 9e4, "reference_ship.yaw_moment": 6e5, "reference_ship.initial_pose": [15.0, 15.0, 0.0]}
    far = {"vessel_sim.initial_pose": [-185.0, 15.0, math.pi], "vessel_sim.duration": 600.0}
    assert error_of("case2_tracking", **slow, **turn, **far) < 0.002


@only_compiled
@pytest.mark.parametrize(("to_full", "dead_time"), [(16.0, 1.5), (20.0, 0.0), (20.0, 1.5)])
def test_turns_of_a_ship_whose_slow_actuators_are_not_declared_do_not_overshoot_for_ever(to_full, dead_time):
    slow = {
        "surge_force_rate": 2e5 / to_full,
        "yaw_moment_rate": 3e6 / to_full,
        "surge_dead_time": dead_time,
        "yaw_dead_time": dead_time,
    }
    plant = {f"vessel_sim.actuators.{name}": value for name, value in slow.items()}
    away = {"vessel_sim.initial_pose": [-60.0, 60.0, -2.0], "vessel_sim.duration": 600.0}
    assert error_of("case2_straight", **plant, **away) < 0.01


@only_compiled
@pytest.mark.parametrize("circling", [True, False])
def test_a_ship_whose_pivot_is_ahead_of_her_origin_circles_and_rests(circling):
    coupled = {"sway_yaw_inertia": 1.2e6, "sway_damping_from_yaw": 4.8e5, "yaw_damping_from_sway": 4.8e5}
    hull = {f"vessel_sim.vessel.{name}": value for name, value in coupled.items()}
    declared = {f"controller.vessel.{name}": value for name, value in {"sway_yaw_inertia": 1.2e6, **INSTANT, **RATES}.items()}
    turn = {"reference_ship.surge_force": 9e4, "reference_ship.yaw_moment": 6e5} if circling else AT_REST
    limit = 0.0005 if circling else 0.005
    assert error_of("case2_tracking", **hull, **declared, **turn, **{"vessel_sim.duration": 600.0}) < limit


def test_a_goal_close_astern_is_reached_astern():
    goal = {"goal.times": [5.0], "goal.poses": [-80.0, 5.0, 0.0], "goal.astern_distance": 200.0}
    calm = {f"vessel_sim.disturbance.periodic.{each}": 0.0 for each in ("surge_force", "sway_force", "yaw_moment")}
    changes = {**{f"reference_ship.{name}": value for name, value in goal.items()}, **calm, "vessel_sim.duration": 150.0}
    run = simulate(load_scenario("goal", {"controller.law": "guided", **changes}))
    assert run.reference[:, 3].min() < -0.5
    assert np.abs(run.state[:, 2]).max() < 0.3
    assert position_error(run.state, run.reference).max() < 0.05 * LENGTH


wide = st.floats(-1e9, 1e9)
states = st.tuples(wide, wide, st.floats(-20.0, 20.0), wide, wide, wide).map(np.array)


@settings(max_examples=40)
@given(st.lists(st.tuples(states, states), min_size=1, max_size=5))
def test_commands_are_finite_and_within_the_limits_whatever_is_measured(series):
    law = make_controller("guided", 0.1)
    for state, reference in series:
        (force, moment), _ = law.update(0.0, state, reference, np.zeros(3))
        assert abs(force) <= 2e5 * (1.0 + 1e-12)
        assert abs(moment) <= 3e6 * (1.0 + 1e-12)


def test_a_mirrored_world_has_mirrored_commands():
    state, reference, rate = (
        np.array([1.0, 2.0, 0.3, 2.0, 0.1, 0.02]),
        np.array([3.0, 1.0, 0.5, 2.2, 0.05, 0.03]),
        np.array([0.01, 0.002, 0.003]),
    )
    sides = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
    ours, theirs = make_controller("guided", 0.1), make_controller("guided", 0.1)
    for _ in range(20):
        wrench, _ = ours.update(0.0, state, reference, rate)
        mirrored, _ = theirs.update(0.0, sides * state, sides * reference, np.array([1.0, -1.0, -1.0]) * rate)
        assert mirrored == pytest.approx(wrench * [1.0, -1.0])


def test_a_scaled_ship_has_scaled_commands():
    """By Froude: lengths 4 times, times 2 times, masses 64 times."""
    small = {
        "length": 8.0,
        "surge_inertia": 2e3,
        "sway_inertia": 3e3,
        "yaw_inertia": 1e4,
        "surge_force_limit": 4e3,
        "yaw_moment_limit": 6e3,
    }
    large = {name: value * 4.0**power for (name, value), power in zip(small.items(), (1, 3, 3, 5, 3, 4), strict=True)}
    laws = (
        make_controller("guided", 0.1, **small, **INSTANT, **RATES),
        make_controller("guided", 0.2, **large, **INSTANT, **RATES),
    )
    state, reference = np.array([1.0, 2.0, 0.3, 1.0, 0.1, 0.02]), np.array([1.5, 1.0, 0.5, 1.1, 0.05, 0.03])
    units = np.array([4.0, 4.0, 1.0, 2.0, 2.0, 0.5])
    for _ in range(20):
        few, _ = laws[0].update(0.0, state, reference, np.zeros(3))
        many, _ = laws[1].update(0.0, units * state, units * reference, np.zeros(3))
        assert many == pytest.approx(few * [4.0**3, 4.0**4])


@pytest.mark.parametrize("force", [979.2, 3928.9, 4060.1])
def test_a_saturated_command_is_found_by_the_monitor_whatever_the_limit(force):
    limits = {"surge_force_limit": force, "yaw_moment_limit": 1.7 * force}
    hull = {"length": 8.0, "surge_inertia": 2e3, "sway_inertia": 3e3, "yaw_inertia": 1e4}
    law, monitor = (
        make_controller("guided", 0.1, **hull, **limits, **INSTANT, **RATES),
        Saturation(MonitorParameters(saturation_warning=5.0), tuple(limits.values())),
    )
    state, reference = np.zeros(6), np.array([100.0, 0.0, 0.0, 20.0, 0.0, 0.0])
    for _ in range(80):
        wrench, _ = law.update(0.0, state, reference, np.zeros(3))
        alarm = monitor.step((float(wrench[0]), float(wrench[1])), 0.1)
    assert wrench[0] == pytest.approx(force)
    assert alarm is Alarm.WARN


def test_after_a_reset_it_begins_as_at_first():
    law, rng = make_controller("guided", 0.1), np.random.default_rng(2)
    inputs = rng.normal(size=(30, 2, 6)) * [3.0, 3.0, 0.2, 0.5, 0.1, 0.05]

    def wrenches():
        return np.array([law.update(0.0, state, reference, np.zeros(3))[0] for state, reference in inputs])

    first, later = wrenches(), wrenches()
    law.reset()
    assert np.array_equal(wrenches(), first)
    assert not np.array_equal(later, first)
