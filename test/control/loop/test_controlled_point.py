import math
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.law import Terms
from vessel_hsmc_ros.control.loop.control_period import (
    ORIGIN,
    START,
    ControlledPoint,
    Heading,
    at_origin,
    controlled_point_of,
    position,
    to_controlled_point,
)
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, extrapolate, tracking_error, transform, transform_rate, wrap

POINT = ControlledPoint(1.5, 0.1, 0.2, 1e-5, 0.03)
SHIP, DESIRED = Motion(3.0, -2.0, 2.9, 1.4, 0.3, 0.05), Motion(2.5, -1.0, -3.0, 1.6, -0.2, -0.04)
RATE = Acceleration(0.03, -0.02, 0.01)
ERRORS = "surge_error", "sway_error", "surge_error_rate", "sway_error_rate"


def test_at_the_origin_nothing_is_changed() -> None:
    desired = DESIRED._replace(v=-0.0)
    at = to_controlled_point(SHIP, desired, RATE, Heading(0.3), ORIGIN)
    assert at.motion is SHIP
    assert at.desired is desired
    assert at.acceleration is RATE
    assert at.delta == Heading(0.3)


def test_a_vessel_without_coupling_is_controlled_at_the_origin() -> None:
    assert controlled_point_of(KnownVessel(), 0.01).x_p == 0.0
    assert controlled_point_of(KnownVessel(sway_yaw_inertia=6e5, controlled_point="origin"), 0.01).x_p == 0.0
    assert controlled_point_of(KnownVessel(sway_yaw_inertia=-6e5), 0.01).x_p == 0.0
    assert controlled_point_of(KnownVessel(sway_yaw_inertia=-6e5, controlled_point="percussion"), 0.01).x_p < -3.0
    assert controlled_point_of(KnownVessel(sway_yaw_inertia=6e5), 0.01).x_p == pytest.approx(6e5 / 177.9e3)


def transformed_over(periods: int, desired: Motion, rate: Acceleration) -> list[tuple[Motion, Acceleration]]:
    """The transformed reference while ship and reference move with constant accelerations of the body velocities."""
    ship, delta, found = SHIP, Heading(0.2), []
    for _ in range(periods):
        at = to_controlled_point(ship, desired, rate, delta, POINT)
        found.append((at.desired, at.acceleration))
        delta = at.delta
        ship = extrapolate(ship, Acceleration(0.0, 0.0, 0.0), POINT.T)
        desired = extrapolate(desired, rate, POINT.T)
    return found


def test_the_transformed_velocity_and_acceleration_are_derivatives_of_the_transformed_position() -> None:
    # The bandwidth of the filter is taken as constant, so the speed of the reference is.
    (a, rate), (b, _), (c, _) = transformed_over(3, DESIRED, Acceleration(0.0, 0.0, 0.01))
    c_psi, s_psi = math.cos(b.psi), math.sin(b.psi)
    over_ground = np.subtract(c[:2], a[:2]) / (2.0 * POINT.T)
    assert [c_psi * b.u - s_psi * b.v, s_psi * b.u + c_psi * b.v] == pytest.approx(over_ground, abs=1e-5)
    assert [rate.du, rate.dv, rate.dr] == pytest.approx(np.subtract(c[3:], a[3:]) / (2.0 * POINT.T), abs=1e-4)


@pytest.mark.parametrize("turn", [math.pi, -math.pi, 2.0 * math.pi, 0.5 * math.pi])
def test_a_difference_of_the_headings_counts_alike_on_every_course(turn: float) -> None:
    ship, desired = SHIP._replace(psi=0.05), DESIRED._replace(psi=-0.05)
    expected = to_controlled_point(ship, desired, RATE, Heading(0.02), POINT).delta
    ship, desired = (each._replace(psi=wrap(each.psi + turn)) for each in (ship, desired))
    assert to_controlled_point(ship, desired, RATE, Heading(0.02), POINT).delta == pytest.approx(expected, abs=1e-12)


def test_the_point_of_the_ship_moves_with_the_velocity_of_its_pivot() -> None:
    at = to_controlled_point(SHIP, DESIRED, RATE, START, POINT).motion
    assert at == (SHIP.x + 1.5 * math.cos(2.9), SHIP.y + 1.5 * math.sin(2.9), 2.9, 1.4, 0.3 + 1.5 * 0.05, 0.05)


def test_a_constant_difference_of_the_headings_leaves_no_error_of_the_origin() -> None:
    delta, ship, desired = START, DESIRED._replace(psi=0.4), DESIRED._replace(psi=0.0)
    ship, desired = ship._replace(r=0.0), desired._replace(r=0.0)
    point = POINT._replace(T=0.1)
    for _ in range(2000):
        delta = to_controlled_point(ship, desired, RATE, delta, point).delta
    at = to_controlled_point(ship, desired, RATE, delta, point)
    assert at.motion[:2] == pytest.approx(at.desired[:2], abs=1e-7)
    assert at.acceleration == pytest.approx(
        Acceleration(RATE.du - RATE.dr * 1.5 * math.sin(0.4), RATE.dv + 1.5 * math.cos(0.4) * RATE.dr, RATE.dr)
    )


@pytest.mark.parametrize("desired", [DESIRED, DESIRED._replace(u=0.08, v=0.02)], ids=["under way", "from station keeping"])
def test_errors_of_the_point_are_transformed_back_to_the_origin(desired: Motion) -> None:
    def errors(motion: Motion, followed: Motion) -> list[Any]:
        z, z_d = transform(motion), transform(followed)
        e, dz, dz_d = tracking_error(z, z_d), transform_rate(z, motion), transform_rate(z_d, followed)
        return [e.z1, e.z2, dz.z1 - dz_d.z1, dz.z2 - dz_d.z2]

    at = to_controlled_point(SHIP, desired, RATE, Heading(-0.7), POINT)
    back = at_origin(Terms()._replace(**dict(zip(ERRORS, errors(at.motion, at.desired), strict=True))), at.back)
    assert [getattr(back, name) for name in ERRORS] == pytest.approx(errors(SHIP, desired), abs=1e-14)
    assert math.isnan(at_origin(Terms(), at.back).sway_error)


SLOW = [(0.08, 0.03), (0.08, -0.03), (-0.08, 0.03), (-0.08, -0.03)]
"""Surge speed and acceleration: to station keeping and from it, ahead and astern."""


@pytest.mark.parametrize(("u", "du"), SLOW)
def test_near_station_keeping_the_transformed_velocity_is_the_derivative_of_the_transformed_position(u: float, du: float) -> None:
    slow, rate = DESIRED._replace(u=u, v=0.02), Acceleration(du, -0.02, 0.01)
    (a, _), (b, _), (c, _) = transformed_over(3, slow, rate)
    c_psi, s_psi = math.cos(b.psi), math.sin(b.psi)
    over_ground = np.subtract(c[:2], a[:2]) / (2.0 * POINT.T)
    assert [c_psi * b.u - s_psi * b.v, s_psi * b.u + c_psi * b.v] == pytest.approx(over_ground, abs=1e-5)


def test_in_station_keeping_the_origin_is_controlled() -> None:
    at = to_controlled_point(SHIP, DESIRED._replace(u=0.0, v=0.0), Acceleration(0.0, 0.0, 0.0), Heading(0.7), POINT)
    assert at.motion == SHIP
    assert at.desired == DESIRED._replace(u=0.0, v=0.0)
    assert at.acceleration == (0.0, 0.0, 0.0)


def test_the_filter_is_stable_at_any_speed_and_keeps_its_angle_in_a_turn() -> None:
    delta = START
    for speed in (0.0, 1.0, 1e12, 1e300):
        delta = to_controlled_point(SHIP, DESIRED._replace(u=speed), RATE, delta, POINT._replace(T=1.0)).delta
        assert -math.pi < delta.delta <= math.pi
    assert delta.delta == pytest.approx(2.9 + 3.0 - 2.0 * math.pi, abs=0.11)


@pytest.mark.parametrize(
    ("vessel", "lengths"), [({}, 0.4857), ({"surge_inertia": 140e3}, 0.7420), ({"surge_inertia": 177.9e3}, 1.0)]
)
def test_the_filter_is_slower_where_the_heading_is_less_stable(vessel: dict[str, Any], lengths: float) -> None:
    point = controlled_point_of(KnownVessel(sway_yaw_inertia=6e5, **vessel), 0.01)
    assert 1.0 / point.per_distance == pytest.approx(32.0 * lengths, rel=1e-3)


def test_a_difference_of_the_headings_that_grows_steadily_is_followed_without_lag() -> None:
    at, ship, desired = START, Motion(0.0, 0.0, 0.0, 1.6, 0.0, 0.001), Motion(0.0, 0.0, 0.0, 1.6, 0.0, 0.0)
    point = POINT._replace(T=0.1)
    for k in range(3000):
        at = to_controlled_point(ship._replace(psi=1e-4 * k), desired, Acceleration(0.0, 0.0, 0.0), at, point).delta
    assert at.delta == pytest.approx(1e-4 * 3000, abs=1e-6)


@pytest.mark.parametrize(("u", "du"), SLOW)
def test_near_station_keeping_the_velocity_of_the_ships_point_is_the_derivative_of_its_position(u: float, du: float) -> None:
    slow, rate, ship, found = DESIRED._replace(u=u, v=0.02), Acceleration(du, -0.02, 0.01), SHIP, []
    for _ in range(3):
        found.append(to_controlled_point(ship, slow, rate, Heading(0.2), POINT).motion)
        ship, slow = extrapolate(ship, Acceleration(0.0, 0.0, 0.0), POINT.T), extrapolate(slow, rate, POINT.T)
    a, b, c = found
    c_psi, s_psi = math.cos(b.psi), math.sin(b.psi)
    over_ground = np.subtract(c[:2], a[:2]) / (2.0 * POINT.T)
    assert [c_psi * b.u - s_psi * b.v, s_psi * b.u + c_psi * b.v] == pytest.approx(over_ground, abs=1e-5)
    assert abs(b.u - SHIP.u) > 0.05, "the point moves along the hull"


def test_the_slow_rate_of_the_filter_is_bounded_in_a_long_turn_away_from_the_reference() -> None:
    at, ship = START, Motion(0.0, 0.0, 0.0, 1.6, 0.0, 0.0)
    point = POINT._replace(T=0.1)
    for k in range(600):
        at = to_controlled_point(ship._replace(psi=0.08 * k), ship, Acceleration(0.0, 0.0, 0.0), at, point).delta
    assert abs(at.rate) <= 0.1 * 1.6 * point.per_distance * (1.0 + 1e-12)


@pytest.mark.parametrize("u", [0.01, 0.1, 0.19, 0.3])
def test_the_controlled_point_comes_in_astern_as_it_does_ahead(u: float) -> None:
    ahead, astern = DESIRED._replace(u=u, v=0.02), DESIRED._replace(u=-u, v=-0.02)
    backwards = Acceleration(-RATE.du, -RATE.dv, RATE.dr)
    assert position(astern, backwards, POINT) == pytest.approx(position(ahead, RATE, POINT))
    assert 0.0 < position(ahead, RATE, POINT)[0] <= POINT.x_p
