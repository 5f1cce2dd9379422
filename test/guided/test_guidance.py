"""Guidance and the predictor against their defining equations."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.guided.current_estimate import STILL_WATER
from vessel_hsmc_ros.guided.guidance import (
    LARGEST_LEAD,
    BodyCommand,
    approach_rate,
    course_damping,
    course_rate,
    direction_of_travel,
    heading_error,
    integrate_error,
    resolve,
    velocity_command,
)
from vessel_hsmc_ros.guided.parameters import GuidedParameters, by_hand_or_derived, gains
from vessel_hsmc_ros.guided.predictor import correct, predict
from vessel_hsmc_ros.guided.station_keeping import undisturbed_share
from vessel_hsmc_ros.law.known_vessel import INSTANT, KnownVessel

KNOWN = KnownVessel(**INSTANT)
G = gains(GuidedParameters(), KNOWN, 0.02)
LIGHT = G._replace(rho=1e-6)
"""Practically without the station-keeping lever arm: the equations of a moving ship."""

places = st.floats(-50.0, 50.0)
angles = st.floats(-math.pi, math.pi)
speeds = st.floats(-3.0, 3.0)
motions = st.builds(Motion, places, places, angles, speeds, speeds, st.floats(-0.3, 0.3))
accelerations = st.builds(Acceleration, *[st.floats(-0.2, 0.2)] * 3)
STEADY = Acceleration(0.0, 0.0, 0.0)


def advanced(motion: Motion, acceleration: Acceleration, dt: float) -> Motion:
    return predict(motion, *acceleration, dt)


@given(motions, accelerations, motions, accelerations)
def test_the_velocity_command_has_the_derivative_it_states(
    motion: Motion, dnu: Acceleration, desired: Motion, dnu_d: Acceleration
) -> None:
    dt = 1e-4
    now = velocity_command(motion, desired, dnu_d, (0.01, -0.02), G)
    ahead, behind = (
        velocity_command(advanced(motion, dnu, h), advanced(desired, dnu_d, h), dnu_d, (0.01, -0.02), G) for h in (dt, -dt)
    )
    assert now.dwx == pytest.approx((ahead.wx - behind.wx) / (2 * dt), abs=1e-5)
    assert now.dwy == pytest.approx((ahead.wy - behind.wy) / (2 * dt), abs=1e-5)


@given(motions, motions)
def test_the_approach_speed_is_limited_far_from_the_reference(motion, desired) -> None:
    wanted = velocity_command(motion, desired, STEADY, (0.0, 0.0), G)
    assert wanted.feedback_squared <= G.v_max**2 * (1 + 1e-9)


@given(st.floats(0.5, 3.0), angles, st.floats(-0.3, 0.3), st.sampled_from([1.0, -1.0]))
def test_a_ship_turned_by_the_heading_error_has_the_commanded_sway_velocity(speed: float, direction: float, v: float, s) -> None:
    wanted = velocity_command(Motion(0, 0, 0, 0, 0, 0), Motion(0, 0, direction, speed, 0, 0), STEADY, (0.0, 0.0), LIGHT)
    psi = 0.3
    for _ in range(60):
        psi += heading_error(resolve(wanted, STILL_WATER, psi), v, s, LIGHT.rho, LIGHT)
    w = resolve(wanted, STILL_WATER, psi)
    assert w.w_n == pytest.approx(v, abs=1e-6)
    assert s * w.w_t > 0.0


@given(st.floats(0.5, 3.0), angles, speeds, speeds, st.floats(-0.4, 0.4), st.floats(-0.2, 0.2), st.sampled_from([1.0, -1.0]))
def test_the_course_rate_is_the_derivative_of_the_commanded_heading(
    speed: float, direction: float, dwx, dwy, v: float, dv, s
) -> None:
    wx, wy = speed * math.cos(direction), speed * math.sin(direction)

    def commanded(t):
        x, y = wx + t * dwx, wy + t * dwy
        return math.atan2(y, x) - s * math.asin((v + t * dv) / math.hypot(x, y))

    h = 1e-6
    slope = math.remainder(commanded(h) - commanded(-h), 2 * math.pi) / (2 * h)
    psi = commanded(0.0) if s > 0.0 else commanded(0.0) + math.pi
    c, sn = math.cos(psi), math.sin(psi)
    w = BodyCommand(wx * c + wy * sn, -wx * sn + wy * c, dwx * c + dwy * sn, -dwx * sn + dwy * c)
    assert course_rate(w, v, dv, 0.1, s, LIGHT.rho, LIGHT) == pytest.approx(slope, abs=1e-3)


def test_abeam_in_a_current_faster_than_the_command_the_rate_of_the_sway_does_not_decide_the_turn() -> None:
    """The ship is carried to port at 1.5 m/s, the command is 0.8 m/s to starboard: 1/q, some 20 rad/s per m/s², before."""
    w = BodyCommand(0.1, -0.8, 0.0, 0.0)
    still, changing = (course_rate(w, 1.5, dv, 0.0, 1.0, G.rho, G) for dv in (0.0, 1.0))
    assert abs(changing - still) < 0.05


def test_at_rest_the_course_rate_is_the_yaw_rate_of_the_reference() -> None:
    assert course_rate(BodyCommand(0.0, 0.0, 0.1, 0.1), 0.0, 0.1, 0.05, 1.0, G.rho, G) == pytest.approx(0.05)


@given(st.floats(-math.pi, math.pi))
def test_a_turn_can_be_stopped_with_the_planned_acceleration(epsilon: float) -> None:
    """Along r = c(epsilon), depsilon = -r, the yaw acceleration is c'(epsilon)·r."""
    h = 1e-5
    rate = approach_rate(epsilon, G)
    slope = (approach_rate(epsilon + h, G) - approach_rate(epsilon - h, G)) / (2 * h)
    assert abs(slope * rate) <= G.a_max * (1 + 1e-6)
    assert abs(rate) <= G.r_max
    assert math.copysign(1.0, rate) == math.copysign(1.0, epsilon)
    assert approach_rate(1e-4, G) == pytest.approx(G.c * 1e-4, rel=0.01)


def test_in_station_keeping_a_point_ahead_of_midships_has_the_commanded_velocity() -> None:
    w, v = BodyCommand(0.0, 1e-4, 0.0, 0.0), 5e-4
    rate = approach_rate(heading_error(w, v, 1.0, G.rho, G), G)
    assert v + G.rho * rate == pytest.approx(w.w_n, abs=1e-5)


def test_the_direction_of_travel_has_hysteresis_and_follows_the_reference() -> None:
    near, far = 5.0, 2.0 * G.R_b
    edge = G.c * G.rho
    assert direction_of_travel(1.0, -0.9 * edge, near, 0.0, 1.0, G.rho, G) == 1.0
    assert direction_of_travel(1.0, -1.1 * edge, near, 0.0, 1.0, G.rho, G) == -1.0
    assert direction_of_travel(-1.0, 0.9 * edge, near, 0.0, 1.0, G.rho, G) == -1.0
    assert direction_of_travel(-1.0, 1.1 * edge, near, 0.0, 1.0, G.rho, G) == 1.0
    assert direction_of_travel(1.0, -1.1 * edge, far, 0.0, 1.0, G.rho, G) == 1.0
    assert direction_of_travel(-1.0, -1.0, near, 2.0, 1.0, G.rho, G) == 1.0
    assert direction_of_travel(1.0, 1.0, near, -2.0, 1.0, G.rho, G) == -1.0


def test_the_error_integral_is_limited_and_held_far_from_the_reference() -> None:
    here, near, far = Motion(0, 0, 0, 0, 0, 0), Motion(1, 0, 0, 0, 0, 0), Motion(100, 0, 0, 0, 0, 0)
    assert integrate_error((0.0, 0.0), far, here, 4.0, G) == (0.0, 0.0)
    assert integrate_error((0.0, 0.0), near, here, 0.0, G) == (0.0, 0.0)
    xi = (0.0, 0.0)
    for _ in range(100_000):
        xi = integrate_error(xi, near, here, 4.0, G)
    assert xi == pytest.approx((G.xi_max, 0.0))


@given(motions, accelerations)
def test_prediction_is_exact_for_a_held_acceleration_in_velocity(motion: Motion, dnu: Acceleration) -> None:
    T, n = 0.1, 200
    coarse, fine = predict(motion, *dnu, T), motion
    for _ in range(n):
        fine = predict(fine, *dnu, T / n)
    np.testing.assert_allclose(coarse[3:], fine[3:], atol=1e-12)
    assert math.hypot(coarse.x - fine.x, coarse.y - fine.y) < 2e-4
    assert abs(math.remainder(coarse.psi - fine.psi, 2 * math.pi)) < 1e-9


@pytest.mark.parametrize("period", [0.001, 0.02, 0.1, 1.0])
def test_the_predictor_converges_to_state_and_acceleration_at_any_period(period: float) -> None:
    """Velocity channel with f as the network's output: both poles at exp(-w·T), so nothing is left after 20/w."""
    g = gains(GuidedParameters(), KNOWN, period)
    truth, f, u_hat = 0.3, 0.0, 0.0
    for _ in range(max(20, round(20.0 / (by_hand_or_derived(GuidedParameters(), KNOWN).surge_learning_rate * period)))):
        innovation = truth - u_hat
        f += (1.0 - g.z_u) ** 2 / period * innovation
        u_hat += (1.0 - g.z_u**2) * innovation + period * f
        truth += period * 0.2
    assert f == pytest.approx(0.2, abs=1e-5)
    assert u_hat == pytest.approx(truth, abs=1e-5)


def test_the_heading_correction_is_wrapped() -> None:
    below, above = Motion(0, 0, math.pi - 0.01, 0, 0, 0), Motion(0, 0, -math.pi + 0.01, 0, 0, 0)
    half = correct(below, above, 0.5, 0.5, 0.5, 0.5, 0.5)
    assert abs(half.psi) == pytest.approx(math.pi)


def test_correction_has_both_velocity_poles_and_one_pole_of_the_pose() -> None:
    """x = x- + (1 - z)·e in the pose, nu = nu- + (1 - z²)·e in the velocities, each channel with its own pole."""
    predicted, measured = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), Motion(1.0, -2.0, 0.1, 3.0, -4.0, 0.5)
    corrected = correct(predicted, measured, z_p=0.9, z_h=0.8, z_u=0.7, z_v=0.6, z_r=0.5)
    assert corrected == pytest.approx((0.1, -0.2, 0.02, 0.51 * 3.0, 0.64 * -4.0, 0.75 * 0.5))


@pytest.mark.parametrize("channel", ["W", "v", "f_u", "f_v"])
def test_every_motion_and_disturbance_reduces_the_weight_of_the_heading(channel: str) -> None:
    """1/(1 + (W² + v²)/v_0² + (f_u² + f_v²)/a_0²): each term alone at its threshold halves it."""
    at_threshold = {"W": (G.v_0**2, 0.0, 0.0, 0.0), "v": (0.0, G.v_0, 0.0, 0.0)}
    at_threshold |= {"f_u": (0.0, 0.0, G.a_0, 0.0), "f_v": (0.0, 0.0, 0.0, G.a_0)}
    assert undisturbed_share(0.0, 0.0, 0.0, 0.0, G) == 1.0
    assert undisturbed_share(*at_threshold[channel], G) == pytest.approx(0.5)


@pytest.mark.parametrize("mismatch", [0.01, 0.1, 0.3, 1.0, 10.0])
def test_the_station_keeping_lever_arm_grows_with_the_sway_mismatch_up_to_a_limit(mismatch: float) -> None:
    """At w_t = 0, epsilon = atan2(m, q_m): q_m/c is the lever arm, sqrt(rho² + (T_m·min(|m|, m_max))²)."""
    epsilon = heading_error(BodyCommand(0.0, mismatch, 0.0, 0.0), 0.0, 1.0, G.rho, G)
    lever = mismatch / (G.c * math.tan(epsilon))
    assert lever == pytest.approx(math.hypot(G.rho, G.T_m * min(mismatch, G.m_max)))


def test_the_damping_of_the_course_is_the_rate_of_the_heading_error_below_its_bandwidth() -> None:
    g = gains(GuidedParameters(), KnownVessel(sway_damping_rate=0.05), 0.02)
    slow, rate = 0.0, 0.002
    for k in range(1500):
        damping, slow = course_damping(rate * g.T * k, slow, 1e6, g)
    assert damping == pytest.approx(g.b * rate, rel=0.02)
    assert course_damping(1.0, 0.0, 1e6, g)[0] == pytest.approx(g.b * g.w_b * LARGEST_LEAD)
    assert course_damping(1.0, 0.0, 0.0, g)[0] == 0.0


@pytest.mark.parametrize(("ratio", "b"), [(-1.0, 1.5), (0.9, 1.5), (1.25, 1.5), (1.5, 1.0), (2.0, 0.5)])
def test_a_course_that_turns_the_other_way_first_is_damped_less(ratio: float, b: float) -> None:
    g = gains(GuidedParameters(), KnownVessel(sway_damping_rate=0.05, coriolis_ratio=ratio), 0.02)
    assert g.b == pytest.approx(b)
    assert gains(GuidedParameters(), KnownVessel(), 0.02).b == 0.0


def test_the_damping_of_the_course_has_no_kick_where_the_heading_error_wraps() -> None:
    g = gains(GuidedParameters(), KnownVessel(sway_damping_rate=0.05), 0.02)
    damped = []
    for start in (0.0, math.pi - 0.05):
        slow, series = start, []
        for k in range(500):
            damping, slow = course_damping(math.remainder(start + 0.0002 * k, 2.0 * math.pi), slow, 1e6, g)
            series.append(damping)
        damped.append(series)
    assert damped[1] == pytest.approx(damped[0], abs=1e-9)


@given(st.floats(-math.pi, math.pi))
def test_the_error_integral_is_limited_in_every_direction(bearing: float) -> None:
    xi = (0.0, 0.0)
    ship = Motion(0.5 * math.cos(bearing), 0.5 * math.sin(bearing), 0.0, 2.0, 0.0, 0.0)
    for _ in range(200):
        xi = integrate_error(xi, ship, Motion(0.0, 0.0, 0.0, 2.0, 0.0, 0.0), 1e9, G._replace(k_i=1.0))
    assert math.hypot(*xi) == pytest.approx(G.xi_max)
    assert math.atan2(xi[1], xi[0]) == pytest.approx(bearing, abs=1e-9)
