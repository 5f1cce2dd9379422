"""The track of the guided law: when it is sailed astern, and that it does not depend on how the world is turned."""

import cmath
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.control.guided.guidance import ASTERN, INTEGRAL, Integrals, Track, drift_in_turn, integrated, track
from vessel_hsmc_ros.control.guided.parameters import GuidedParameters, gains
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, wrap

GAINS = gains(GuidedParameters(), KnownVessel(), 0.1)
STEADY = Acceleration(0.0, 0.0, 0.0)
FAST, SLOW = 0.3, 0.1 * ASTERN
NONE = Integrals(0.0, 0.0, 0.0, 0.0)


def track_of(ship: Motion, goal: Motion, current: complex, turned: float = 0.0, mirrored: bool = False) -> Track:
    """The track in a world that is turned by an angle, and mirrored at x before."""
    side = -1.0 if mirrored else 1.0

    def placed(motion: Motion) -> Motion:
        place = complex(motion.x, side * motion.y) * cmath.exp(1j * turned)
        return Motion(place.real, place.imag, wrap(side * motion.psi + turned), motion.u, side * motion.v, side * motion.r)

    water = complex(current.real, side * current.imag) * cmath.exp(1j * turned)
    rate = Acceleration(0.02, side * 0.01, side * 0.03)
    return track(
        placed(ship), placed(goal), rate, water.real, water.imag, Integrals(0.01, side * 0.02, 0.0, 0.0), 0.5, 1.0, GAINS
    )


@pytest.mark.parametrize("over_ground", [-FAST, -SLOW, 0.0, SLOW, FAST])
@pytest.mark.parametrize("through_water", [-FAST, -SLOW, 0.0, SLOW, FAST])
@pytest.mark.parametrize("psi", [0.4, -2.8])
def test_only_a_reference_that_moves_astern_over_ground_and_through_the_water_is_followed_astern(
    over_ground: float, through_water: float, psi: float
) -> None:
    goal = Motion(5.0, -3.0, psi, over_ground, 0.0, 0.0)
    current = (over_ground - through_water) * cmath.exp(1j * psi)
    found = track(goal, goal, STEADY, current.real, current.imag, NONE, 0.5, 1.0, GAINS)
    assert found.way == (-1.0 if over_ground == through_water == -FAST else 1.0)
    if abs(through_water) == FAST:
        assert pytest.approx(FAST) == found.W
        assert wrap(found.chi - psi) == pytest.approx(
            0.0 if through_water > 0.0 else math.copysign(math.pi, wrap(found.chi - psi))
        )


def test_a_reference_that_is_far_away_is_pursued_ahead_however_it_moves() -> None:
    goal = Motion(5.0, -3.0, 0.4, -FAST, 0.0, 0.0)
    near, far = (track(goal._replace(x=5.0 - away), goal, STEADY, 0.0, 0.0, NONE, 0.5, 1.0, GAINS) for away in (0.1, 50.0))
    assert (near.way, far.way) == (-1.0, 1.0)
    assert abs(far.chi) < 1.0


@pytest.mark.parametrize("turned", [0.0, 1.0, -2.5, math.pi])
@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("u", [-0.3, 0.0, 0.4])
@pytest.mark.parametrize("away", [0.05, 0.4, 3.0])
def test_the_track_turns_and_is_mirrored_with_the_world(turned: float, mirrored: bool, u: float, away: float) -> None:
    goal = Motion(2.0, 1.0, 2.9, u, 0.03, 0.05)
    ship = Motion(2.0 + away, 1.0 - 0.7 * away, -3.0, 0.2, -0.02, 0.04)
    first, found = track_of(ship, goal, 0.05 - 0.11j), track_of(ship, goal, 0.05 - 0.11j, turned, mirrored)
    side = -1.0 if mirrored else 1.0
    assert wrap(found.chi - side * first.chi - turned) == pytest.approx(0.0, abs=1e-9)
    same, opposite = ("W", "growth", "way", "w_t", "dw_t"), ("dchi", "e_c")
    assert [getattr(found, name) for name in same] == pytest.approx([getattr(first, name) for name in same])
    assert [getattr(found, name) for name in opposite] == pytest.approx([side * getattr(first, name) for name in opposite])
    over_earth = complex(first.xi.x, side * first.xi.y) * cmath.exp(1j * turned)
    assert found.xi == pytest.approx((first.xi.along, side * first.xi.across, over_earth.real, over_earth.imag))


@pytest.mark.parametrize("u", [-0.3, 0.4])
@pytest.mark.parametrize("psi", [2.9, -2.9])
def test_the_distance_to_port_counts_across_the_course_through_the_water_and_none_along_it(u: float, psi: float) -> None:
    goal, current = Motion(5.0, -3.0, psi, u, 0.0, 0.0), (0.1, 0.15)
    chi = track(goal, goal, STEADY, *current, NONE, 0.5, 1.0, GAINS).chi
    for angle, share in ((0.0, 0.0), (0.5 * math.pi, 1.0), (math.pi, 0.0), (-0.5 * math.pi, -1.0)):
        ship = goal._replace(x=5.0 + 0.02 * math.cos(chi + angle), y=-3.0 + 0.02 * math.sin(chi + angle), psi=1.0)
        assert track(ship, goal, STEADY, *current, NONE, 0.5, 1.0, GAINS).e_c == pytest.approx(0.02 * share, abs=1e-9)


@pytest.mark.parametrize("psi", [2.9, -2.9])
def test_the_integral_grows_along_and_across_the_reference_whatever_the_heading_of_the_ship(psi: float) -> None:
    goal = Motion(5.0, -3.0, psi, 0.4, 0.0, 0.0)
    for angle, along, across in ((0.0, 1, 0), (0.5 * math.pi, 0, 1), (math.pi, -1, 0), (-0.5 * math.pi, 0, -1)):
        ship = goal._replace(x=5.0 + 0.02 * math.cos(psi + angle), y=-3.0 + 0.02 * math.sin(psi + angle), psi=0.3)
        xi = track(ship, goal, STEADY, 0.0, 0.0, Integrals(0.01, 0.02, 0.0, 0.0), 0.5, 1.0, GAINS).xi
        assert [math.copysign(1.0, xi[i] - start) * (abs(xi[i] - start) > 1e-12) for i, start in ((0, 0.01), (1, 0.02))] == [
            along, across,
        ]  # fmt: skip


@pytest.mark.parametrize("psi", [0.3, -2.0])
def test_only_in_a_turn_the_error_is_integrated_over_the_earth_whatever_the_heading_of_the_reference(psi: float) -> None:
    start = Integrals(0.0, 0.0, 0.01, -0.02)
    straight = integrated(start, 0.02, -0.01, psi, 0.1, 0.05, 0.0, GAINS)
    turning = integrated(start, 0.02, -0.01, psi, 0.1, 0.05, 1.0, GAINS)
    assert (straight.x, straight.y) == pytest.approx(((1.0 - GAINS.w_0 * GAINS.h) * 0.01, -(1.0 - GAINS.w_0 * GAINS.h) * 0.02))
    grown = turning.x - straight.x, turning.y - straight.y
    assert grown[0] > 0.0
    assert grown == pytest.approx((grown[0], -0.5 * grown[0]))
    assert straight[:2] == turning[:2] != start[:2]


def test_a_ship_far_from_her_reference_integrates_no_error_but_unloads_integrals_of_the_other_sign() -> None:
    far = integrated(Integrals(0.01, -0.02, 0.0, 0.0), 5.0, -3.0, 0.4, 0.1, 0.05, 1.0, GAINS)
    assert far[:2] == (0.01, -0.02)
    assert far[2:] == pytest.approx((0.0, 0.0), abs=1e-7)
    along, across, *_ = integrated(Integrals(-0.01, 0.02, 0.0, 0.0), 5.0, -3.0, 0.4, 0.1, 0.05, 1.0, GAINS)
    assert -0.01 < along < 0.0 < across < 0.02


def test_no_integral_exceeds_its_bound() -> None:
    xi = NONE
    for _ in range(20000):
        xi = integrated(xi, 0.01, -0.01, 0.0, 1.0, 1.0, 1.0, GAINS)
    assert (xi.along, xi.across) == (INTEGRAL[0], -INTEGRAL[0])
    assert 0.9 * INTEGRAL[0] < xi.x == -xi.y <= INTEGRAL[0]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_at_rest_the_ship_follows_a_turn_on_the_spot_by_the_short_way_and_else_keeps_her_heading(side: float) -> None:
    ship = Motion(5.0, -3.0, side * 3.0, 0.0, 0.0, 0.0)
    goal = ship._replace(psi=wrap(side * 3.4))
    resting, turning = (track(ship, goal._replace(r=r), STEADY, 0.0, 0.0, NONE, 0.5, 1.0, GAINS).chi for r in (0.0, 100.0))
    assert wrap(resting - side * 3.0) == pytest.approx(0.0, abs=1e-6)
    assert wrap(turning - side * 3.4) == pytest.approx(0.0, abs=1e-3)
    half = track(ship, goal._replace(r=0.05), STEADY, 0.0, 0.0, NONE, 0.5, 1.0, GAINS).chi
    assert wrap(half - side * 3.2) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("way", [1.0, -1.0], ids=["ahead", "astern"])
@pytest.mark.parametrize("turn", [0.0, 0.1])
@pytest.mark.parametrize("force", [0.02, -0.02])
def test_the_drift_angle_ends_where_the_forces_across_the_hull_are_in_balance(way: float, turn: float, force: float) -> None:
    """A force to port moves the ship to port through the water, whether it goes ahead or astern."""
    a, kappa, W, beta = 0.6, 0.5, 0.3, 0.0
    sailed = Track(W, 0.0, 0.0, turn, way, 0.0, way * W, 0.0, 0.0, NONE)
    for _ in range(2000):
        beta, rate = drift_in_turn(beta, sailed, a, kappa, force, 0.1)
    u, v = way * W * math.cos(beta), way * W * math.sin(beta)
    assert -kappa * u * turn - a * v + force == pytest.approx(0.0, abs=1e-9)
    assert rate == pytest.approx(0.0, abs=1e-9)
    assert turn or v * force > 0.0


@given(st.floats(0.01, 0.3), st.floats(-math.pi, math.pi), st.floats(0.05, 5.0))
def test_the_approach_to_a_point_at_rest_is_slower_than_the_drift_decays(away: float, side: float, settling: float) -> None:
    """Of a ship that rests off the point, near and heading for it or not: beyond that rate the ship would circle it."""
    ship = Motion(-away * math.cos(side), -away * math.sin(side), 0.0, 0.0, 0.0, 0.0)
    goal = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    found = track(ship, goal, STEADY, 0.0, 0.0, NONE, 0.5, settling, GAINS)
    assert math.hypot(found.w_t, found.w_n) <= min(GAINS.k_p, 0.35 * settling) * away * (1.0 + 1e-9)
    assert abs(found.w_t) <= min(GAINS.k_p, 0.35 * settling) * away * abs(math.cos(side)) ** 3 + 1e-12
