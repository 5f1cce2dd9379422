import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.core import kinematics as kin

angles = st.floats(-50.0, 50.0)
numbers = st.floats(-100.0, 100.0)
motions = st.builds(kin.Motion, numbers, numbers, angles, *[st.floats(-5.0, 5.0)] * 3)
accelerations = st.builds(kin.Acceleration, *[st.floats(-5.0, 5.0)] * 3)


def test_a_heading_difference_across_180_degrees_is_wrapped() -> None:
    assert math.degrees(kin.wrap(math.radians(-170.0) - math.radians(170.0))) == pytest.approx(20.0)
    assert math.degrees(kin.wrap(math.radians(170.0) - math.radians(-170.0))) == pytest.approx(-20.0)


@given(angles)
def test_wrap_keeps_the_direction_and_its_range(angle: float) -> None:
    wrapped = kin.wrap(angle)
    assert -math.pi < wrapped <= math.pi or wrapped == pytest.approx(-math.pi)
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


@given(st.floats(-math.pi, math.pi, exclude_min=True))
def test_wrap_returns_an_angle_in_range_unchanged(angle: float) -> None:
    assert kin.wrap(angle) == angle


@given(angles)
def test_heading_to_quaternion_and_back_is_the_identity(psi: float) -> None:
    z, w = kin.quaternion_from_heading(psi)
    assert kin.wrap(kin.heading_from_quaternion(0.0, 0.0, z, w) - psi) == pytest.approx(0.0, abs=1e-12)


@given(angles, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(0.1, 10.0))
def test_heading_of_a_rolling_pitching_ship_and_of_any_scale(yaw, pitch, roll, scale) -> None:
    cy, sy, cp, sp, cr, sr = (f(0.5 * a) for a in (yaw, pitch, roll) for f in (math.cos, math.sin))
    x, y = sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy
    z, w = cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy
    heading = kin.heading_from_quaternion(scale * x, scale * y, scale * z, scale * w)
    assert kin.wrap(heading - yaw) == pytest.approx(0.0, abs=1e-9)


def test_the_transformation_matches_a_calculation_by_hand() -> None:
    state = kin.Motion(3.0, 4.0, math.pi / 2, 0.0, 0.0, 0.0)
    assert kin.transform(state) == pytest.approx((4.0, -3.0, math.pi / 2))


def advance(state, acceleration, dt):
    """The state after dt of a ship whose body acceleration is constant, by many small steps."""
    n = 200
    h = dt / n
    x, y, psi, u, v, r = state
    for k in range(n):
        mid = (k + 0.5) * h
        um, vm = u + acceleration[0] * mid, v + acceleration[1] * mid
        heading = psi + r * mid + 0.5 * acceleration[2] * mid * mid
        x += h * (um * math.cos(heading) - vm * math.sin(heading))
        y += h * (um * math.sin(heading) + vm * math.cos(heading))
    psi += r * dt + 0.5 * acceleration[2] * dt * dt
    du, dv, dr = acceleration
    return kin.Motion(x, y, psi, u + du * dt, v + dv * dt, r + dr * dt)


@given(motions, accelerations)
def test_rates_are_the_derivatives_of_the_transformation(state, acceleration) -> None:
    dt = 1e-4
    before, after = advance(state, acceleration, -dt), advance(state, acceleration, dt)
    z, zb, za = kin.transform(state), kin.transform(before), kin.transform(after)
    rate = kin.transform_rate(z, state)
    np.testing.assert_allclose(rate, (np.array(za) - np.array(zb)) / (2 * dt), atol=1e-3)
    rb, ra = kin.transform_rate(zb, before), kin.transform_rate(za, after)
    second = kin.transform_acceleration(z, state, acceleration)
    np.testing.assert_allclose(second, (np.array(ra) - np.array(rb)) / (2 * dt), atol=2e-2, rtol=1e-4)


@given(motions, accelerations, st.floats(-0.02, 0.02))
def test_extrapolation_is_close_to_the_motion(state, acceleration, interval) -> None:
    np.testing.assert_allclose(kin.extrapolate(state, acceleration, interval), advance(state, acceleration, interval), atol=1e-4)


@given(motions, accelerations)
def test_extrapolation_by_zero_returns_the_same_state(state, acceleration) -> None:
    assert kin.extrapolate(state, acceleration, 0.0) is state


@given(motions)
def test_the_published_state_differs_by_full_turns_only(state) -> None:
    published = kin.as_published(state)
    np.testing.assert_array_equal(np.delete(published, 2), np.delete(state, 2))
    assert kin.wrap(published[2] - state[2]) == pytest.approx(0.0, abs=1e-12)


def test_velocities_along_the_axes_of_the_earth_are_resolved_along_and_across_the_hull() -> None:
    psi, u, v = 0.4, 1.7, -0.6
    found = kin.in_body_frame(kin.Motion(3.0, -4.0, psi, u, v, 0.2))
    turned = complex(u, v) * complex(math.cos(psi), -math.sin(psi))
    assert found == pytest.approx((3.0, -4.0, psi, turned.real, turned.imag, 0.2))
