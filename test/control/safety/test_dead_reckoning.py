"""A lost position is bridged by heading and velocities for the declared time, and never longer."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.control.safety.samples import DeadReckoning
from vessel_hsmc_ros.core.kinematics import Motion

STEP = 20_000_000
SPEED, TURN = 1.5, 0.1


def at(k: int) -> Motion:
    """The motion on a circle after k steps."""
    psi = TURN * k * STEP * 1e-9
    radius = SPEED / TURN
    return Motion(radius * math.sin(psi), radius * (1.0 - math.cos(psi)), math.remainder(psi, 2.0 * math.pi), SPEED, 0.0, TURN)


def lost(motion: Motion, velocities: bool = True) -> Motion:
    known = motion._replace(x=math.nan, y=math.nan)
    return known if velocities else known._replace(u=math.nan, v=math.nan, r=math.nan)


@given(st.integers(1, 400), st.floats(0.5, 30.0))
def test_the_place_moves_on_for_the_declared_time_and_no_longer(steps: int, limit: float) -> None:
    reckoning = DeadReckoning(limit)
    assert reckoning.fill(0, at(0)) == at(0)
    for k in range(1, steps + 1):
        given_motion = lost(at(k))
        filled = reckoning.fill(k * STEP, given_motion)
        if k * STEP <= round(limit * 1e9):
            assert math.dist(filled[:2], at(k)[:2]) < 1e-3
            assert filled[2:] == given_motion[2:]
            assert reckoning.elapsed == pytest.approx(k * STEP * 1e-9)
        else:
            assert filled is given_motion
    back = at(steps + 1)
    assert (reckoning.fill((steps + 1) * STEP, back), reckoning.elapsed) == (back, 0.0)


@pytest.mark.parametrize("limit", [0.0, 10.0])
def test_without_a_limit_a_heading_or_an_earlier_place_nothing_is_filled_in(limit: float) -> None:
    reckoning = DeadReckoning(limit)
    first = lost(at(1))
    assert reckoning.fill(STEP, first) is first
    reckoning.fill(2 * STEP, at(2))
    blind = lost(at(3))._replace(psi=math.nan)
    assert reckoning.fill(3 * STEP, blind) is blind
    again = lost(at(4))
    assert (reckoning.fill(4 * STEP, again) is again) is (limit == 0.0)
    assert reckoning.fill(4 * STEP, again) is again, "a repeated measurement moves nothing"
    reckoning.reset()
    assert reckoning.fill(5 * STEP, again) is again


def test_velocities_are_those_of_the_estimate_or_else_of_before() -> None:
    reckoning, second = DeadReckoning(10.0), 50
    reckoning.fill(0, Motion(0.0, 0.0, 0.0, 1.0, 0.0, 0.0))
    for k in range(1, second + 1):
        filled = reckoning.fill(k * STEP, lost(Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), velocities=False))
    assert filled[:2] == pytest.approx((1.0, 0.0))
    for k in range(second + 1, 2 * second + 1):
        filled = reckoning.fill(k * STEP, lost(Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)), Motion(9.0, 9.0, 9.0, 2.0, 0.0, 0.0))
    assert filled[:2] == pytest.approx((3.0, 0.0), abs=0.02)
