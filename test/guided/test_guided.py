"""The guided law: properties for any input, and closed-loop behaviour; `make benchmark-guided` runs the complete table."""

import math
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.metrics import position_error, reversals_per_second
from vessel_hsmc_ros.core.schema import build
from vessel_hsmc_ros.guided.actuator_identification import bank, first_state
from vessel_hsmc_ros.guided.controller import GuidedController, command
from vessel_hsmc_ros.guided.current_estimate import STILL_WATER
from vessel_hsmc_ros.guided.parameters import GuidedParameters, gains
from vessel_hsmc_ros.guided.predictor import learn
from vessel_hsmc_ros.guided.state import Filter, initial
from vessel_hsmc_ros.law.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.law.network import Estimates
from vessel_hsmc_ros.plant.dynamics import VesselParameters, rk4
from vessel_hsmc_ros.runs.offline import load_scenario, simulate
from vessel_hsmc_ros.scenario.suite import judge, load_suite

ROWS = {row.name: row for row in load_suite("guided")}
SHIP = VesselParameters().coefficients()
LIMITS = np.array([2e5, 3e6])
T = 0.02
STILL = np.zeros(3)

anything = st.floats(allow_nan=False, allow_infinity=False)
wide = st.one_of(anything, st.floats(-1e6, 1e6), st.floats(-10.0, 10.0), st.just(0.0))
wide_inputs = st.lists(wide, min_size=15, max_size=15).map(np.array)
moderate = st.tuples(
    *[st.floats(-20.0, 20.0)] * 2, st.floats(-math.pi, math.pi), *[st.floats(-2.0, 2.0)] * 2, st.floats(-0.2, 0.2)
)
courses = st.lists(st.tuples(moderate, moderate), min_size=2, max_size=6)


KNOWN = KnownVessel(**INSTANT)
"""The ship of these tests has no lags, and the law knows it."""


def controller(period=T, **parameters):
    return GuidedController(build(GuidedParameters, parameters, "guided"), KNOWN, period)


def answers(law, course, acceleration=STILL):
    return np.array([law.update(0.0, np.array(state), np.array(reference), acceleration)[0] for state, reference in course])


@given(st.lists(wide_inputs, min_size=1, max_size=4), st.sampled_from([0.001, 0.02, 0.1, 1.0]))
@settings(max_examples=300)
def test_any_finite_input_gives_a_finite_wrench_within_the_limits(inputs, period: float) -> None:
    law = controller(period)
    for numbers in inputs:
        wrench, terms = law.update(0.0, numbers[:6], numbers[6:12], numbers[12:])
        assert np.isfinite(wrench).all()
        assert (np.abs(wrench) <= LIMITS).all()
        assert -math.pi <= terms.commanded_heading <= math.pi
        values = (
            terms.yaw_surface,
            terms.surge_surface,
            terms.surge_estimate,
            terms.sway_estimate,
            terms.yaw_estimate,
        )
        assert np.isfinite(values).all()
        assert np.isfinite(law.memory.W).all()


def test_the_largest_floats_give_a_finite_wrench() -> None:
    law = controller()
    for sign in (1.0, -1.0):
        wrench, _ = law.update(0.0, np.full(6, sign * sys.float_info.max), np.full(6, -sign * sys.float_info.max), STILL)
        assert np.isfinite(wrench).all()


@given(courses, st.floats(-10.0, 10.0))
def test_the_wrench_is_invariant_under_rotations_of_the_earth_fixed_frame(course, angle: float) -> None:
    """A rotation of ship, reference and goal leaves the wrench unchanged, also where a heading wraps at 180°."""

    def turned(s):
        c, n = math.cos(angle), math.sin(angle)
        return (c * s[0] - n * s[1], n * s[0] + c * s[1], math.remainder(s[2] + angle, 2 * math.pi), *s[3:])

    straight = answers(controller(), course)
    other = answers(controller(), [(turned(state), turned(reference)) for state, reference in course])
    np.testing.assert_allclose(straight, other, atol=1e-6 * LIMITS.max())


def test_the_output_is_continuous_where_the_heading_wraps() -> None:
    def wrench(psi):
        law = controller(slew_time=0.0)
        return law.update(0.0, np.array([0.0, 0.0, psi, 1.0, 0.1, 0.0]), np.array([-2.0, 0.5, psi, 1.0, 0.1, 0.0]), STILL)[0]

    np.testing.assert_allclose(wrench(math.pi - 1e-9), wrench(-math.pi + 1e-9), rtol=1e-6, atol=1.0)


@given(courses)
def test_the_law_is_symmetric_to_port_and_starboard(course) -> None:
    mirror = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
    one_neuron = {"network.layout": "listed", "network.listed_centers": [0.5, 0.0, 0.0]}
    straight = answers(controller(**one_neuron), course)
    other = answers(controller(**one_neuron), [(np.array(a) * mirror, np.array(b) * mirror) for a, b in course])
    np.testing.assert_allclose(straight * [1.0, -1.0], other, atol=1e-6 * LIMITS.max())


@given(st.floats(-0.02, 0.02), st.floats(-0.02, 0.02), st.floats(-math.pi, math.pi))
def test_near_zero_speed_a_small_change_makes_a_small_difference(u: float, v: float, psi: float) -> None:
    """Continuity near zero speed at the position of the reference, where w, u and v all vanish."""

    def wrench(nudge):
        law = controller(slew_time=0.0)
        return law.update(0.0, np.array([0.0, nudge, psi, u, v, 0.0]), np.zeros(6), STILL)[0]

    assert (np.abs(wrench(1e-7) - wrench(0.0)) < 1e-3 * LIMITS).all()


def test_new_gains_keep_the_internal_state_and_reset_clears_it() -> None:
    law, course = controller(), [((3.0, 1.0, 0.2, 1.0, 0.1, 0.05), (0.0, 0.0, 0.0, 0.5, 0.0, 0.0))] * 20
    first = answers(law, course)
    weights, memory = law.memory.W.copy(), law.memory
    law.retune(GuidedParameters(position_gain=0.1))
    np.testing.assert_array_equal(law.memory.W, weights)
    assert law.memory is memory
    assert weights.any()
    law.retune(GuidedParameters())
    law.reset()
    assert not law.memory.W.any()
    np.testing.assert_array_equal(answers(law, course), first)


def moored(law, seconds):
    """Step the law on a ship that does not move, far from its reference: both actuators saturate without effect."""
    far = np.array([3000.0, 3000.0, 0.0, 0.0, 0.0, 0.0])
    return [law.update(0.0, np.zeros(6), far, STILL) for _ in range(round(seconds / T))]


def distances(law, seconds=60.0):
    """Distance to a resting point 5 m ahead of a ship that starts at rest, on the true plant."""
    state, there, far = np.zeros(6), np.array([5.0, 0.0, 0.0, 0.0, 0.0, 0.0]), []
    for _ in range(round(seconds / T)):
        wrench, _ = law.update(0.0, state, there, STILL)
        state = rk4(state, wrench, STILL, SHIP, T)
        far.append(math.hypot(state[0] - 5.0, state[1]))
    return np.array(far)


def test_saturated_actuators_suspend_the_adaptation() -> None:
    law = controller()
    _, before = moored(law, 6.0)[-1]
    held = moored(law, 54.0)
    assert all(terms.surge_saturated and terms.yaw_saturated for _, terms in held)
    np.testing.assert_allclose(np.abs([wrench for wrench, _ in held]), np.tile(LIMITS, (len(held), 1)))
    _, after = held[-1]
    assert after.surge_estimate == pytest.approx(before.surge_estimate, rel=1e-6)
    assert after.yaw_estimate == pytest.approx(before.yaw_estimate, rel=1e-6)
    recovered, fresh = distances(law), distances(controller())
    arrivals = [T * np.flatnonzero(way > 0.1)[-1] for way in (recovered, fresh)]
    assert recovered.max() < 1.01 * fresh.max()
    assert arrivals[0] < arrivals[1] + 2.0


@pytest.fixture(scope="module")
def circle():
    row = ROWS["circle"]
    return row, simulate(load_scenario(row.scenario, row.changes))


def test_the_circle_is_tracked_to_a_centimetre_within_the_limits(circle) -> None:
    row, run = circle
    verdict = judge(row, run)
    assert verdict.hit, verdict
    assert (np.abs(run.wrench) <= LIMITS).all()
    assert position_error(run.state, run.reference)[run.time >= 100.0].max() < 0.2


def test_the_wrench_does_not_chatter(circle) -> None:
    _, run = circle
    for column in (0, 1):
        assert reversals_per_second(run.time, run.wrench[:, column], 100.0) < 0.2


def test_the_ship_returns_after_a_force_beyond_its_thrust() -> None:
    """A force of 300 kN against the bow saturates the thrust for a minute; there must be no wind-up afterwards."""
    law, state, there = controller(), np.zeros(6), np.zeros(6)
    for k in range(round(300.0 / T)):
        disturbance = (-3e5 / SHIP.m11, 0.0, 0.0) if k * T < 60.0 else (0.0, 0.0, 0.0)
        wrench, _ = law.update(0.0, state, there, STILL)
        state = rk4(state, wrench, disturbance, SHIP, T)
    assert math.hypot(state[0], state[1]) < 0.3


G = gains(GuidedParameters(), KNOWN, T)
BANK = first_state(bank(KNOWN, T), 0.0)
AT_REST = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("channel", ["u", "v", "r"])
def test_an_outlier_changes_the_weights_no_more_than_the_largest_innovation(channel: str) -> None:
    H = np.array([0.5, 1.0, 0.2])
    limit = G.e_r_max if channel == "r" else G.e_max

    def adapted(innovation):
        m = initial(3, 0, G.sway, BANK)
        m.H[:] = H
        learn(AT_REST._replace(**{channel: innovation}), m.predicted, float(H @ H), m, G)
        return m.W

    outlier, largest, half = adapted(1e3), adapted(limit), adapted(0.5 * limit)
    np.testing.assert_array_equal(outlier, largest)
    np.testing.assert_allclose(half, 0.5 * largest)
    assert largest["uvr".index(channel)].all()


def test_the_weights_across_the_activations_decay_and_the_outputs_stay() -> None:
    """What noise has left across H disappears at the rate `leak`; along H nothing changes."""
    m, rng = initial(5, 0, G.sway, BANK), np.random.default_rng(1)
    m.H[:], m.W[:] = rng.uniform(0.2, 1.0, 5), rng.normal(size=(3, 5))
    before, outputs = m.W.copy(), m.W @ m.H
    along = np.outer(outputs, m.H) / (m.H @ m.H)
    found = learn(AT_REST, m.predicted, float(m.H @ m.H), m, G)
    np.testing.assert_allclose(found, outputs)
    np.testing.assert_allclose(m.W @ m.H, outputs, rtol=1e-6)
    np.testing.assert_allclose(m.W - along, (1.0 - G.leak * G.T) * (before - along), atol=1e-8)


@pytest.mark.parametrize("rate", [10.0, -10.0])
def test_the_command_filter_stays_where_the_moment_can_follow_it(rate: float) -> None:
    """|S1| = |r - r_c| <= S1_max, for any state of the filter: anti-windup at the moment limit."""
    m = initial(1, 0, G.sway, BANK)._replace(filter=Filter(rate, 0.0, 1.0, (0.0, 0.0)))
    commanded, _ = command(AT_REST, AT_REST, Acceleration(0.0, 0.0, 0.0), Estimates(0.0, 0.0, 0.0), STILL_WATER, 0.0, m, G)
    assert abs(AT_REST.r - commanded.r_c) == pytest.approx(G.S1_max)


@pytest.mark.parametrize("slew_time", [0.5, 2.0])
def test_the_wrench_changes_at_most_by_its_limit_within_the_slew_time(slew_time: float) -> None:
    law = controller(slew_time=slew_time)
    wrenches = np.array([wrench for wrench, _ in moored(law, slew_time + 1.0)])
    changes = np.abs(np.diff(np.vstack((np.zeros(2), wrenches)), axis=0)) / LIMITS
    np.testing.assert_allclose(changes.max(axis=0), T / slew_time)
