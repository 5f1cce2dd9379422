"""The guided law with any input, at the edges of its limits, and on the circle of the suite."""

import math
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.control.guided.controller import GuidedController
from vessel_hsmc_ros.control.guided.parameters import GuidedParameters
from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.core.metrics import position_error, reversals_per_second
from vessel_hsmc_ros.core.schema import build
from vessel_hsmc_ros.plant.dynamics import rk4
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate
from vessel_hsmc_ros.studies.suite import judge, load_suite

ROWS = {row.name: row for row in load_suite("guided")}
SHIP = VesselParameters().coefficients()
LIMITS = np.array([2e5, 3e6])
T = 0.02
STILL = np.zeros(3)
OFFSET = np.array([0.0137, 0.0071, 0.0113, 0.0, 0.0, 0.0])  # from the round numbers that are drawn often

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
@settings(max_examples=120)
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
        assert np.isfinite(law.memory.x).all()


def test_the_largest_floats_give_a_finite_wrench() -> None:
    law = controller()
    for sign in (1.0, -1.0):
        wrench, _ = law.update(0.0, np.full(6, sign * sys.float_info.max), np.full(6, -sign * sys.float_info.max), STILL)
        assert np.isfinite(wrench).all()


@given(courses, st.floats(-10.0, 10.0))
@settings(max_examples=40)
def test_the_wrench_is_invariant_under_rotations_of_the_earth_fixed_frame(course, angle: float) -> None:
    """A rotation of ship, reference and goal leaves the wrench unchanged, also where a heading wraps at 180°.

    Not where rounding decides: with the reference exactly abeam, or a heading that turns by exactly 180° in one step.
    """

    def turned(s):
        c, n = math.cos(angle), math.sin(angle)
        return (c * s[0] - n * s[1], n * s[0] + c * s[1], math.remainder(s[2] + angle, 2 * math.pi), *s[3:])

    course = [(state + k * OFFSET, reference + 0.7 * k * OFFSET) for k, (state, reference) in enumerate(course, 1)]
    straight = answers(controller(), course)
    other = answers(controller(), [(turned(state), turned(reference)) for state, reference in course])
    np.testing.assert_allclose(straight, other, atol=1e-6 * LIMITS.max())


def test_the_output_is_continuous_where_the_heading_wraps() -> None:
    def wrench(psi):
        law = controller()
        return law.update(0.0, np.array([0.0, 0.0, psi, 1.0, 0.1, 0.0]), np.array([-2.0, 0.5, psi, 1.0, 0.1, 0.0]), STILL)[0]

    np.testing.assert_allclose(wrench(math.pi - 1e-9), wrench(-math.pi + 1e-9), rtol=1e-6, atol=1.0)


@given(st.floats(-0.02, 0.02), st.floats(-0.02, 0.02), st.floats(-math.pi, math.pi))
def test_near_zero_speed_a_small_change_makes_a_small_difference(u: float, v: float, psi: float) -> None:
    """Continuity near zero speed at the position of the reference; at that very point the approach has no direction."""

    def wrench(nudge):
        law = controller()
        return law.update(0.0, np.array([0.0, nudge, psi, u, v, 0.0]), np.zeros(6), STILL)[0]

    assert (np.abs(wrench(2e-7) - wrench(1e-7)) < 1e-3 * LIMITS).all()


def test_new_gains_keep_the_internal_state_and_reset_clears_it() -> None:
    law, course = controller(), [((3.0, 1.0, 0.2, 1.0, 0.1, 0.05), (0.0, 0.0, 0.0, 0.5, 0.0, 0.0))] * 20
    first = answers(law, course)
    memory = law.memory
    states = memory.x.copy()
    law.retune(GuidedParameters(position_gain=2.0))
    assert law.memory is memory
    np.testing.assert_array_equal(law.memory.x, states)
    law.retune(GuidedParameters())
    law.reset()
    np.testing.assert_array_equal(answers(law, course), first)


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


@pytest.mark.long
def test_the_ship_returns_after_a_force_beyond_its_thrust() -> None:
    """A force of 300 kN against the bow saturates the thrust for a minute; there must be no wind-up afterwards."""
    period = 0.1
    law, state, there = controller(period), np.zeros(6), np.zeros(6)
    for k in range(round(200.0 / period)):
        disturbance = (-3e5 / SHIP.m11, 0.0, 0.0) if k * period < 60.0 else (0.0, 0.0, 0.0)
        wrench, _ = law.update(0.0, state, there, STILL)
        state = rk4(state, wrench, disturbance, SHIP, period)
    assert math.hypot(state[0], state[1]) < 0.3
