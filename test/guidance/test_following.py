"""References that wait for their vessel: the pace of the clock, the lag along the trail, and the motion that follows."""

import math
from typing import Any

import numpy as np
import pytest
from durations import rest_long
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import build
from vessel_hsmc_ros.guidance.factory import (
    CURVES,
    PLANNED,
    REFERENCES,
    ReferenceShipParameters,
    make_held_reference,
    make_reference,
)
from vessel_hsmc_ros.guidance.following import (
    TRAIL_POINTS,
    PaceMemory,
    Trail,
    Waiting,
    demanded_pace,
    next_pace,
    rate_of,
    waiting_of,
)
from vessel_hsmc_ros.guidance.goal import MotionLimits
from vessel_hsmc_ros.guidance.waypoints import PathParameters

PERIOD = 0.05
WAITING = Waiting(2.0, 6.0, 3.0)
shares = st.floats(0.0, 1.0)


def reference(mode: str, period: float = PERIOD, **values: Any) -> Any:
    given = {"mode": mode, "follow": "vessel", "initial_pose": (0.0, 0.0, 0.0), **values}
    given["path.waypoints"] = (100.0, 0.0, 100.0, 100.0)
    return make_reference(build(ReferenceShipParameters, given, "reference_ship"), period)


@given(lag=st.floats(-1e3, 1e3), more=st.floats(0.0, 10.0))
def test_the_demanded_pace_falls_from_one_to_zero_between_the_two_lags(lag: float, more: float) -> None:
    pace = demanded_pace(lag, WAITING)
    assert demanded_pace(lag + more, WAITING) <= pace + 1e-12
    assert pace == (1.0 if lag <= 2.0 else 0.0 if lag >= 6.0 else pytest.approx(pace))
    assert 0.0 <= pace <= 1.0
    assert demanded_pace(4.0, WAITING) == pytest.approx(0.5)


@given(a=shares, s=shares, demands=st.lists(shares, min_size=1, max_size=20), T=st.floats(0.05, 50.0), h=st.floats(1e-3, 1.0))
def test_the_pace_stays_between_zero_and_one_and_the_clock_never_goes_back(
    a: float, s: float, demands: list[float], T: float, h: float
) -> None:
    memory = PaceMemory(a, s)
    for demand in demands:
        memory, advanced = next_pace(memory, demand, T, h)
        assert 0.0 <= memory.a <= 1.0
        assert 0.0 <= memory.s <= 1.0
        assert 0.0 <= advanced <= h


@given(a=shares, s=shares, demand=shares, T=st.floats(0.5, 50.0))
def test_the_clock_is_the_integral_of_the_pace_and_its_rate_the_derivative(a: float, s: float, demand: float, T: float) -> None:
    h, before = 1e-4, PaceMemory(a, s)
    whole = next_pace(before, demand, T, 0.4)
    part = next_pace(before, demand, T, 0.2)
    rest = next_pace(part.memory, demand, T, 0.2)
    assert whole.advanced == pytest.approx(part.advanced + rest.advanced, abs=1e-12)
    assert whole.memory == pytest.approx(rest.memory, abs=1e-12)
    after = next_pace(before, demand, T, h)
    assert after.advanced == pytest.approx(0.5 * h * (s + after.memory.s), abs=1e-9)
    assert (after.memory.s - s) / h == pytest.approx(0.5 * (rate_of(before, T) + rate_of(after.memory, T)), abs=1e-6)


def test_a_stop_from_full_pace_takes_the_limit_of_acceleration_and_no_more() -> None:
    motion, speed = MotionLimits(), 1.5
    waiting = waiting_of(1.0, 0.01, speed, motion)
    assert waiting.stands - waiting.slows == pytest.approx(0.5 * speed**2 / motion.acceleration)
    memory, rates = PaceMemory(1.0, 1.0), []
    for _ in range(5000):
        memory, _ = next_pace(memory, 0.0, waiting.time_constant, 0.01)
        rates.append(-rate_of(memory, waiting.time_constant))
    assert max(rates) * speed == pytest.approx(motion.acceleration, rel=1e-3)


@given(back=st.floats(0.0, 19.0), aside=st.floats(-1.0, 1.0))
def test_the_lag_is_the_way_along_the_trail_round_a_bend_too(back: float, aside: float) -> None:
    """A leg of 10 m and a half turn of radius 5 m, within half a step of the trail."""
    trail = Trail(30.0)
    for s in np.arange(0.0, 10.0 + 5.0 * math.pi, 0.01):
        trail.lead(*place(s, 0.0))
    vessel, _ = place(10.0 + 5.0 * math.pi - back, aside)
    assert trail.lag(vessel) == pytest.approx(back, abs=0.5 * 30.0 / TRAIL_POINTS)


def place(s: float, aside: float) -> tuple[complex, float]:
    if s <= 10.0:
        return complex(s, aside), 0.0
    turn = (s - 10.0) / 5.0
    return complex(10.0, 5.0) - 1j * (5.0 - aside) * complex(math.cos(turn), math.sin(turn)), turn


@given(back=st.floats(0.0, 50.0), aside=st.floats(-50.0, 50.0))
def test_a_vessel_behind_the_beginning_is_behind_by_that_too(back: float, aside: float) -> None:
    trail = Trail(10.0)
    trail.lead(0j, 0.0)
    assert trail.lag(complex(-back, aside)) == pytest.approx(back)
    assert trail.lag(complex(back, aside)) == pytest.approx(0.0)


@pytest.mark.parametrize("mode", rest_long(REFERENCES, 7))
def test_only_planned_tracks_follow_the_vessel(mode: str) -> None:
    if mode in (*PLANNED, *CURVES):
        assert reference(mode).pace == 0.0
    else:
        with pytest.raises(ParameterError, match=f"must be time in mode {mode} .got vessel."):
            reference(mode)


@pytest.mark.parametrize("mode", rest_long([PLANNED[0], CURVES[0], *PLANNED[1:], *CURVES[1:]], 2))
def test_a_reference_stands_without_odometry_runs_with_it_and_stops_when_it_is_lost(mode: str) -> None:
    made = reference(mode)
    start = made.state
    for _ in range(200):
        made.advance()
    np.testing.assert_array_equal(made.state, start)
    for k in range(1600):
        made.observe(tuple(made.state[:2]) if k < 800 else None)
        made.advance()
        assert k != 799 or made.pace > 0.99
    stopped = made.state
    assert math.dist(stopped[:2], start[:2]) > 1.0
    np.testing.assert_allclose(stopped[3:], 0.0, atol=1e-3)
    np.testing.assert_allclose(made.acceleration(), 0.0, atol=1e-3)
    for lost in ((math.nan, 0.0), (0.0, math.inf)):
        made.observe(lost)
        made.advance()
    made.reset()
    np.testing.assert_array_equal(made.state, start)


@pytest.mark.parametrize("mode", rest_long(["lawnmower", "path", "figure_eight"]))
def test_the_published_motion_is_one_motion_while_the_clock_slows_and_goes_on(mode: str) -> None:
    """Velocities are the derivatives of the pose, accelerations those of the velocities."""
    made = reference(mode)
    rows = []
    for k in range(2400):
        # The vessel is held for a while, far behind.
        made.observe(tuple(made.state[:2]) if k < 800 or k > 1600 else (-1e3, 0.0))
        made.advance()
        rows.append((*made.state, *made.acceleration()))
    x, y, psi, u, v, r, du, dv, dr = np.array(rows).T
    along = np.exp(1j * psi)
    velocity, change = (u + 1j * v) * along, (du + 1j * dv + 1j * r * (u + 1j * v)) * along
    for value, rate in ((x + 1j * y, velocity), (velocity, change), (psi, r), (r, dr)):
        np.testing.assert_allclose(np.diff(value) / PERIOD, 0.5 * (rate[1:] + rate[:-1]), atol=2e-3)


@pytest.mark.parametrize(("speed", "lag"), [(0.2, 0.5), (0.7, 0.2)])
def test_a_slow_vessel_is_never_left_further_behind_than_where_the_clock_stands(speed: float, lag: float) -> None:
    period, x = 0.5, 0.0
    made = reference("straight", period, follow_lag=lag)
    for _ in range(600):
        made.observe((x, 0.0))
        made.advance()
        x = min(x + speed * 1.5 * period, made.state[0])
        assert made.state[0] - x < 1.05 * made._waiting.stands
    assert made.pace == pytest.approx(speed, abs=0.05)


@pytest.mark.parametrize("mode", rest_long(["path", "lawnmower", "circle", "spiral"]))
def test_a_reference_that_is_not_held_is_the_same_to_the_bit_and_one_that_is_comes_to_rest_and_goes_on(mode: str) -> None:
    parameters = ReferenceShipParameters(
        mode=mode, initial_pose=(0.0, 0.0, 0.0), path=PathParameters(waypoints=(80.0, 0.0, 80.0, 60.0))
    )
    plain, held = make_reference(parameters, PERIOD), make_held_reference(parameters, PERIOD)
    for _ in range(800):
        assert plain.state.tobytes() == held.state.tobytes()
        assert plain.acceleration().tobytes() == held.acceleration().tobytes()
        plain.advance()
        held.advance()
    reference: Any = held
    reference.held = True
    states = [held.state]
    for step in range(3000):
        reference.held = step < 1500
        held.advance()
        states.append(held.state)
        if step == 1500:
            assert np.hypot(*states[-1][3:5]) < 1e-3
            stood = states[-1]
    moved = np.diff(np.array(states), axis=0)
    limits = parameters.motion
    assert np.abs(moved[:, 3]).max() <= 1.05 * max(limits.acceleration, 0.3) * PERIOD
    assert math.dist(states[-1][:2], stood[:2]) > 5.0
