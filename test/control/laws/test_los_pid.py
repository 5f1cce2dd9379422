"""Line-of-sight guidance with PID: properties in every state, and closed-loop performance as a baseline."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.laws.los_pid import LosPidParameters, adapted, derived_stretch, scaled
from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.core.metrics import position_error, rms
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_for, scenario_text
from vessel_hsmc_ros.scenario.scenario import parse_scenario
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate

NONE = np.zeros(3)
AHEAD = np.array([0.0, 0.0, 0.0, 2.0, 0.0, 0.0])

wide = st.floats(-1e3, 1e3)
states = st.tuples(wide, wide, st.floats(-math.pi, math.pi), st.floats(-5, 5), st.floats(-5, 5), st.floats(-1, 1)).map(np.array)


def law(**gains):
    return make_controller("los_pid", 0.1, **gains)


def run_of(seconds, **changes):
    rates = {f"{node}.rate_hz": 10.0 for node in ("vessel_sim", "reference_ship", "controller")}
    limits = {"vessel_sim.actuators.surge_force_limit": 2e5, "vessel_sim.actuators.yaw_moment_limit": 3e6}
    changes = {name.replace("__", "."): value for name, value in changes.items()}
    wanted = {"controller.law": "los_pid", "vessel_sim.duration": seconds, **rates, **limits, **changes}
    return simulate(load_scenario("case2_tracking", wanted))


@given(states, states)
@settings(max_examples=200)
def test_the_wrench_is_finite_and_within_the_limits_in_every_state(state, reference) -> None:
    made = law()
    for _ in range(3):
        wrench, terms = made.update(0.0, state, reference, np.array([9.0, 9.0, 9.0]))
        assert abs(wrench[0]) <= 2e5
        assert abs(wrench[1]) <= 3e6
        assert -math.pi < terms.commanded_heading <= math.pi


@pytest.mark.parametrize(
    ("changes", "at_most"),
    [({}, 0.05), ({"reference_ship__yaw_moment": 0.0}, 0.05), ({"vessel_sim__initial_pose": (55.0, 15.0, 3.0)}, 0.1)],
)
def test_the_reference_is_tracked_under_the_papers_disturbance(changes, at_most: float) -> None:
    run = run_of(200.0, **changes)
    assert rms(position_error(run.state, run.reference)[-500:]) < at_most


def test_a_reference_at_rest_is_reached_with_bow_or_stern() -> None:
    for heading in (0.0, math.pi):
        resting = {"reference_ship__surge_force": 0.0, "reference_ship__yaw_moment": 0.0}
        run = run_of(120.0, vessel_sim__initial_pose=(-30.0, 20.0, heading), **resting)
        assert position_error(run.state, run.reference)[-100:].max() < 2.0


@pytest.mark.parametrize("side", [-5.0, 5.0])
@pytest.mark.parametrize("speed", [-2.0, 2.0])
def test_it_steers_to_the_line_in_the_direction_of_travel(side: float, speed: float) -> None:
    state, reference = np.array([0.0, side, 0.0, speed, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, speed, 0.0, 0.0])
    made = law()
    for _ in range(30):
        _, terms = made.update(0.0, state, reference, NONE)
    assert np.sign(terms.commanded_heading) == -np.sign(side * speed)


@pytest.mark.parametrize("psi", [0.3, 3.0])
@pytest.mark.parametrize("off", [0.2, -0.2, math.pi - 0.2, math.pi + 0.2])
def test_a_ship_keeps_station_with_bow_or_stern_towards_a_point_whichever_is_nearer(psi: float, off: float) -> None:
    state = np.array([5.0, -3.0, psi, 0.0, 0.0, 0.0])
    reference = np.array([5.0 + 30.0 * math.cos(psi + off), -3.0 + 30.0 * math.sin(psi + off), psi, 0.0, 0.0, 0.0])
    made = law()
    for _ in range(600):
        _, terms = made.update(0.0, state, reference, NONE)
    turn, way = (off, 1.0) if off < 1.0 else (off - math.pi, -1.0)
    assert wrap(terms.commanded_heading - psi) == pytest.approx(turn, abs=1e-3)
    assert terms.commanded_surge_velocity * way > 0.0


def test_the_heading_error_is_wrapped() -> None:
    state, reference = AHEAD.copy(), AHEAD.copy()
    state[2], reference[2] = math.radians(-170.0), math.radians(170.0)
    wrench, _ = law().update(0.0, state, reference, NONE)
    assert wrench[1] < 0.0


def test_integrals_stop_while_their_actuator_is_at_its_limit() -> None:
    made = law(surge_force_limit=1.0, yaw_moment_limit=1.0, stretch=1.0)
    for _ in range(600):
        _, terms = made.update(0.0, np.array([-50.0, 5.0, 0.0, 0.0, 0.0, 0.0]), AHEAD, NONE)
        assert terms.surge_saturated
        assert terms.yaw_saturated
    assert made.memory.surge_integral == made.memory.yaw_integral == 0.0


def test_new_gains_keep_the_integrals() -> None:
    made = law()
    made.update(0.0, np.array([0.5, 0.1, 0.01, 1.9, 0.0, 0.0]), AHEAD, NONE)
    fresh, kept = law().memory, made.memory
    assert kept.surge_integral != 0.0
    made.retune(LosPidParameters(yaw_bandwidth=0.2))
    assert made.memory == kept
    made.reset()
    assert made.memory == fresh


def test_declared_actuators_stretch_the_times_of_the_gains_and_undeclared_ones_do_not() -> None:
    p = LosPidParameters()
    assert adapted(p, KnownVessel()) == p
    assert adapted(p, KnownVessel(surge_lag=0.0, yaw_lag=0.0)) == p
    assert derived_stretch(p, KnownVessel(yaw_lag=0.7, yaw_dead_time=0.3)) == pytest.approx(1.0 + 2.0 * 1.3 * 0.8 / 3.0)
    assert derived_stretch(p, KnownVessel(surge_force_rate=2e4)) == pytest.approx((4.0 * 0.8 * 10.0) ** (1.0 / 3.0))
    double = adapted(replace(p, stretch=2.0), KnownVessel(yaw_lag=5.0))
    assert (double.yaw_bandwidth, double.yaw_integral_gain, double.lookahead_time) == pytest.approx((0.4, 0.005, 8.0))


def test_the_gains_of_a_similar_ship_are_the_same_in_its_units_of_length_and_time() -> None:
    """A model of a quarter of the length by Froude's law: times a half, masses 1/64, forces 1/64, moments 1/256."""
    paper, p = KnownVessel(), LosPidParameters()
    model = KnownVessel(
        length=paper.length / 4.0,
        surge_inertia=paper.surge_inertia / 64.0,
        yaw_inertia=paper.yaw_inertia / 1024.0,
        surge_force_limit=paper.surge_force_limit / 64.0,
        yaw_moment_limit=paper.yaw_moment_limit / 256.0,
    )
    found = adapted(p, model)
    assert found.lookahead_distance == pytest.approx(p.lookahead_distance / 4.0)
    assert found.yaw_bandwidth == pytest.approx(2.0 * p.yaw_bandwidth)
    assert found.yaw_integral_gain == pytest.approx(8.0 * p.yaw_integral_gain)
    assert found.catch_up_speed == pytest.approx(p.catch_up_speed / 2.0)
    assert found.station_keeping_speed == pytest.approx(p.station_keeping_speed / 2.0)
    assert scaled(found, 4.0, 2.0).adaptation_gain == pytest.approx(p.adaptation_gain)
    late = replace(model, surge_lag=0.5, yaw_lag=0.5)
    assert scaled(adapted(p, late), 4.0, 2.0).along_gain == pytest.approx(
        adapted(p, KnownVessel(surge_lag=1.0, yaw_lag=1.0)).along_gain
    )
    assert adapted(replace(p, stretch=1.0), model).yaw_bandwidth == p.yaw_bandwidth


@pytest.mark.parametrize(("lag", "full"), [(1.0, math.inf), (0.3, 5.0), (0.0, 10.0)])
def test_a_tight_turn_with_declared_slow_actuators_is_tracked(lag: float, full: float) -> None:
    slow = {
        "surge_lag": lag,
        "yaw_lag": lag,
        "surge_force_rate": 2e5 / full or math.inf,
        "yaw_moment_rate": 3e6 / full or math.inf,
    }
    changes = {
        f"{owner}__{name}": value for owner in ("vessel_sim__actuators", "controller__vessel") for name, value in slow.items()
    }
    run = run_of(240.0, reference_ship__surge_force=1e5, reference_ship__yaw_moment=-1e6, **changes)
    assert rms(position_error(run.state, run.reference)[-600:]) < 0.5


@given(st.floats(0.01, 10.0), st.floats(0.1, 1e3))
def test_the_integral_gain_leaves_room_for_a_slow_sway(rate: float, length: float) -> None:
    """On a line the guidance is stable where its gain is below lookahead time/T_v, T_v = 1/rate."""
    vessel, p = KnownVessel(length=length, yaw_inertia=50.0 * length**5, sway_damping_rate=rate), LosPidParameters()
    found = adapted(p, vessel)
    assert 0.0 < found.integral_gain <= min(p.integral_gain, 0.75 * found.lookahead_time * rate)
    assert adapted(replace(p, stretch=1.0), vessel).integral_gain == p.integral_gain
    unknown = adapted(p, replace(vessel, sway_damping_rate=-1.0))
    assert unknown.integral_gain == pytest.approx(0.5 * p.integral_gain)


def own(name: str) -> str:
    """The scenario of a boat of 4 m in wind, or of a vessel of the library, as `init` writes it."""
    if name == "boat":
        return scenario_text(name, MainData(length=4.0, mass=500.0, surge_force_limit=300.0, yaw_moment_limit=250.0, wind=5.0))
    return scenario_for(read_vessel(name).values, name)


@pytest.mark.parametrize("name", ["boat", "otter", "heron", "viknes_830"])
def test_the_default_gains_follow_the_circle_of_a_boat_within_twice_what_tuned_gains_leave(name: str) -> None:
    run = simulate(parse_scenario(own(name), name, {"controller.law": "los_pid"}))
    assert rms(position_error(run.state, run.reference)[-len(run.time) // 4 :]) < 2.0 * 0.0145
