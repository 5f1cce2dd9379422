"""The heading against the motion: a turned compass is found whatever the current, and a heading that fits never is an alarm."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.control.safety.monitors import LARGEST_BIAS, Alarm, Heading, bias, block_length
from vessel_hsmc_ros.control.safety.parameters import MonitorParameters
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import Motion, wrap

RATE, LENGTH, SPEED = 5.0, 4.0, 1.5
CURRENTS = st.tuples(st.floats(-0.7, 0.7), st.floats(-0.7, 0.7))
COURSES = ("there and back", "turns to both sides", "a square")


def turn_rates(course: str, seconds: float) -> Array:
    """The yaw rate of a vessel that sails a course."""
    t = np.arange(0.0, seconds, 1.0 / RATE)
    if course == "turns to both sides":
        return np.asarray(0.22 * np.sin(2.0 * math.pi * t / 40.0))
    leg, angle = (40.0, math.pi) if course == "there and back" else (30.0, 0.5 * math.pi)
    turning = t % leg > leg - 8.0
    side = np.where(t % (2.0 * leg) < leg, 1.0, -1.0) if course == "there and back" else 1.0
    return np.where(turning, side * angle / 8.0, 0.0)


def way(course: str, current: Sequence[float], seed: int, noise: float = 0.02, seconds: float = 150.0) -> Array:
    """Time, x, y and heading of a vessel in a current, whose drift grows with its turns and whose speed changes, (n, 4)."""
    rng = np.random.default_rng(seed)
    r = turn_rates(course, seconds)
    t, psi = np.arange(len(r)) / RATE, np.cumsum(r) / RATE + rng.uniform(-math.pi, math.pi)
    u = SPEED * (1.0 + 0.2 * np.sin(t / 17.0 + rng.uniform(0.0, 6.0)))
    v = -0.8 * u * r + 0.3 * r + 0.05 * np.cos(psi - 1.0)  # drift in turns, a distant antenna, and leeway
    velocity = (u + 1j * v) * np.exp(1j * psi) + complex(*current)
    place = np.cumsum(velocity) / RATE + noise * (rng.normal(size=len(t)) + 1j * rng.normal(size=len(t)))
    return np.column_stack((t, place.real, place.imag, psi + 0.01 * rng.normal(size=len(t))))


def watched(track: Array, limit: float = math.inf) -> tuple[Heading, float]:
    """The monitor after a track, and when it has demanded the safe action first, s; infinite for never."""
    monitor, first = Heading(MonitorParameters(), LENGTH), math.inf
    for t, x, y, psi in track[track[:, 0] < limit].tolist():
        alarm = monitor.step(round(t * 1e9), Motion(x, y, wrap(psi), 0.0, 0.0, 0.0))
        first = min(first, t if alarm is Alarm.SAFE else math.inf)
    return monitor, first


@settings(max_examples=15, deadline=None)
@given(st.sampled_from(COURSES), CURRENTS, st.integers(0, 10**6), st.floats(-math.radians(80.0), math.radians(80.0)))
def test_a_bias_is_found_whatever_the_current(course: str, current: tuple[float, float], seed: int, angle: float) -> None:
    track = way(course, current, seed)
    track[:, 3] += angle
    monitor, first = watched(track)
    assert monitor.found is not None
    assert monitor.found.angle == pytest.approx(angle, abs=math.radians(4.0))
    assert not monitor.found.lost
    if abs(angle) > LARGEST_BIAS + math.radians(8.0):
        assert first < math.inf
        assert f"to the {'left' if angle > 0.0 else 'right'}, +-" in monitor.detail
    elif abs(angle) < LARGEST_BIAS - math.radians(4.0):
        assert first == math.inf


@settings(max_examples=15, deadline=None)
@given(st.sampled_from(COURSES), CURRENTS, st.integers(0, 10**6), st.sampled_from([0.0, 0.02, 0.2, 0.7]))
def test_a_heading_that_fits_gives_no_alarm(course: str, current: tuple[float, float], seed: int, noise: float) -> None:
    track = way(course, current, seed, noise)
    monitor = Heading(MonitorParameters(), LENGTH)
    alarms = {monitor.step(round(t * 1e9), Motion(x, y, wrap(psi), 0.0, 0.0, 0.0)) for t, x, y, psi in track.tolist()}
    assert alarms == {Alarm.OK}


@pytest.mark.parametrize("seed", [0, 1, 3, 4])
def test_a_hull_whose_sway_decays_slowly_after_its_turns_has_not_lost_its_heading(seed: int) -> None:
    """Zigzags at a speed that hardly changes: dv/dt = -0.9 u r - v/4 s."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 200.0, 1.0 / RATE)
    r = rng.uniform(0.2, 0.25) * np.where(t % (period := rng.uniform(16.0, 24.0)) < 0.5 * period, 1.0, -1.0)
    u, v = SPEED * (1.0 + 0.1 * np.sin(t / 17.0)), np.zeros(len(t))
    for k in range(len(t) - 1):
        v[k + 1] = v[k] + (-0.9 * u[k] * r[k] - v[k] / 4.0) / RATE
    psi = np.cumsum(r) / RATE + rng.uniform(-math.pi, math.pi)
    place = np.cumsum((u + 1j * v) * np.exp(1j * psi)) / RATE + 0.02 * (rng.normal(size=len(t)) + 1j * rng.normal(size=len(t)))
    monitor, first = watched(np.column_stack((t, place.real, place.imag, psi)))
    assert first == math.inf
    assert monitor.found is None or not monitor.found.lost


@pytest.mark.parametrize("course", COURSES)
@pytest.mark.parametrize("seed", range(3))
def test_a_heading_that_stands_still_leads_to_the_safe_action(course: str, seed: int) -> None:
    track = way(course, (0.2, -0.1), seed, seconds=400.0)
    frozen = track[:, 0] > 130.0
    track[frozen, 3] = track[frozen, 3][0]
    monitor, first = watched(track)
    assert 130.0 < first < 260.0
    assert monitor.found is not None


def test_an_alarm_stays_while_the_vessel_is_at_rest_until_a_heading_fits_or_a_reset() -> None:
    track = way("a square", (0.2, 0.1), 1)
    track[:, 3] += math.radians(40.0)
    monitor, first = watched(track)
    assert first < math.inf
    _, x, y, psi = track[-1].tolist()
    for k in range(2000):
        assert monitor.step(round(151e9 + k * 1e8), Motion(x, y, wrap(psi), 0.0, 0.0, 0.0)) is Alarm.SAFE
    monitor.reset()
    assert (monitor.alarm, monitor.detail, monitor.found) == (Alarm.OK, "", None)


def test_a_heading_that_is_corrected_under_way_ends_the_alarm() -> None:
    track = way("a square", (0.2, 0.1), 1, seconds=700.0)
    track[track[:, 0] < 200.0, 3] += math.radians(40.0)
    assert watched(track, 199.0)[0].alarm is Alarm.SAFE
    assert watched(track)[0].alarm is Alarm.OK


@pytest.mark.parametrize("case", ["one straight course", "at rest in waves", "too short"])
def test_what_shows_no_heading_has_no_verdict(case: str) -> None:
    rng = np.random.default_rng(1)
    t = np.arange(0.0, 15.0 if case == "too short" else 300.0, 1.0 / RATE)
    if case == "at rest in waves":
        track = np.column_stack((t, 0.4 * np.sin(0.9 * t), 0.4 * np.cos(0.7 * t), 0.3 * np.sin(0.1 * t)))
    else:
        track = np.column_stack((t, SPEED * t, 0.2 * t, 0.02 * rng.normal(size=len(t))))
    monitor, first = watched(track)
    assert (monitor.found, first) == (None, math.inf)


def test_a_position_that_jumps_now_and_then_is_no_motion() -> None:
    track = way("a square", (0.1, 0.3), 2)
    for at in (40.0, 90.0, 120.0):
        track[track[:, 0] > at, 1:3] += 25.0
    monitor, first = watched(track)
    assert first == math.inf
    assert monitor.found is not None
    assert abs(monitor.found.angle) < math.radians(4.0)


def test_a_clock_that_is_set_back_begins_anew_and_long_vessels_have_longer_blocks() -> None:
    monitor, _ = watched(way("a square", (0.0, 0.0), 3))
    assert monitor.found is not None
    monitor.step(0, Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert monitor.found is None
    assert block_length(1.0) == 1.0
    assert block_length(70.0) > 5.0
    assert bias(np.zeros((3, 4)) + np.arange(3)[:, None], 4.0) is None
