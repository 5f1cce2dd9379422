"""Velocities that contradict the positions, and those that do not however noisy they are."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from vessel_hsmc_ros.control.safety.monitors import Alarm, Compared, Velocities, compared, explained
from vessel_hsmc_ros.control.safety.parameters import MonitorParameters
from vessel_hsmc_ros.core.kinematics import Motion, wrap

LENGTH, SPEED = 4.0, 1.2

REST = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def true_motion(t: float) -> Motion:
    """A circle at constant speed, its centre at (-3, 7)."""
    r = 0.1
    psi = 1.0 + r * t
    return Motion(-3.0 + SPEED / r * math.sin(psi), 7.0 - SPEED / r * math.cos(psi), psi, SPEED, 0.0, r)


def alarms(
    measured: Callable[[Motion, np.random.Generator], Motion], seconds: float = 40.0, rate: float = 20.0, length: float = LENGTH
) -> tuple[list[Alarm], Velocities]:
    monitor, random = Velocities(MonitorParameters(), length), np.random.default_rng(1)
    times = np.arange(0.0, seconds, 1.0 / rate)
    return [monitor.step(round(t * 1e9), measured(true_motion(t), random), 1.0 / rate) for t in times], monitor


def in_parent_frame(m: Motion, _: object) -> Motion:
    c, s = math.cos(m.psi), math.sin(m.psi)
    return m._replace(u=c * m.u - s * m.v, v=s * m.u + c * m.v)


WRONG = {
    "in the frame of the pose": (in_parent_frame, "twist_frame: parent"),
    "not filled in": (lambda m, _: m._replace(u=0.0, v=0.0, r=0.0), "observer.enabled: true"),
    "of the other sign": (lambda m, _: m._replace(u=-m.u), "twist"),
    "yaw rate positive to starboard": (lambda m, _: m._replace(r=-m.r), "positive to port"),
    "yaw rate in degrees": (lambda m, _: m._replace(r=math.degrees(m.r)), "in rad/s"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_wrong_velocities_are_named_and_demand_the_safe_action_within_ten_seconds(kind: str) -> None:
    spoil, hint = WRONG[kind]
    found, monitor = alarms(spoil)
    assert found == sorted(found)
    assert found.index(Alarm.WARN) / 20.0 <= 7.5
    assert found.index(Alarm.SAFE) / 20.0 <= 10.5
    assert hint in monitor.detail


def noisy(position: float, velocity: float) -> Callable[[Motion, np.random.Generator], Motion]:
    return lambda m, random: Motion(
        *(value + s * random.normal() for value, s in zip(m, [position] * 2 + [0.01] + [velocity] * 2 + [0.02], strict=True))
    )


def swaying(m: Motion, random: np.random.Generator) -> Motion:
    """The wave motion is in the positions only, as where a filter smooths the velocities."""
    return m._replace(x=m.x + 0.3 * math.sin(m.psi / 0.1 * 1.1))


HEALTHY = {
    "exact": lambda m, _: m,
    "RTK": noisy(0.02, 0.02),
    "GNSS": noisy(0.7, 0.1),
    "poor GNSS": noisy(3.0, 0.3),
    "waves in the positions only": swaying,
    "a share of a fifth": lambda m, _: m._replace(u=1.2 * m.u),
    "at rest": lambda *_: REST,
    "at rest with noise": lambda _, random: noisy(0.7, 0.1)(REST, random),
}


@pytest.mark.parametrize("rate", [5.0, 20.0, 100.0])
@pytest.mark.parametrize("kind", HEALTHY)
def test_velocities_that_fit_give_no_alarm(kind: str, rate: float) -> None:
    found, monitor = alarms(HEALTHY[kind], seconds=30.0 if rate == 100.0 else 60.0, rate=rate)
    assert (set(found), monitor.detail) == ({Alarm.OK}, "")


def test_jumps_of_the_position_give_no_alarm() -> None:
    jumps = iter(np.arange(800))
    found, _ = alarms(lambda m, _: m._replace(x=m.x + 5.0 * (next(jumps) // 150)))
    assert set(found) == {Alarm.OK}


def test_an_alarm_stays_while_the_ship_lies_still_and_ends_when_it_moves_with_velocities_that_fit() -> None:
    found, monitor = alarms(WRONG["not filled in"][0], seconds=15.0)
    assert found[-1] is Alarm.SAFE
    rest, begin = true_motion(15.0)._replace(u=0.0, v=0.0, r=0.0), 15.0
    assert {monitor.step(round((begin + k / 20.0) * 1e9), rest, 0.05) for k in range(600)} == {Alarm.SAFE}
    after = [monitor.step(round((begin + 30.0 + k / 20.0) * 1e9), true_motion(15.0 + k / 20.0), 0.05) for k in range(400)]
    assert after[-1] is Alarm.OK
    monitor.reset()
    assert monitor.alarm is Alarm.OK


@pytest.mark.parametrize("interval", [0.05, 0.19, 0.34, 0.9])
def test_the_speeds_that_are_shown_do_not_depend_on_how_far_apart_samples_are(interval: float) -> None:
    monitor = Velocities(MonitorParameters(), LENGTH)
    for k in range(round(20.0 / interval)):
        monitor.step(round(interval * k * 1e9), Motion(2.0 * interval * k, 0.0, 0.0, 0.5, 0.0, 0.0), interval)
    assert monitor.detail.startswith("the positions move at (2, 0) m/s, the measured velocities give (0.5, 0) m/s")


def test_an_interruption_begins_the_comparison_anew() -> None:
    monitor = Velocities(MonitorParameters(), LENGTH)
    for k in range(200):
        t = 0.05 * k + 3.0 * (k // 80)
        assert monitor.step(round(t * 1e9), WRONG["not filled in"][0](true_motion(t), None), 0.05) is Alarm.OK


def test_velocities_that_neither_fit_nor_contradict_end_the_time_of_a_warning_that_has_not_come_yet() -> None:
    monitor, parameters = Velocities(MonitorParameters(), LENGTH), MonitorParameters()
    rates = np.tile([[[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]], (7, 1, 1))
    wrong, unclear = rates.copy(), rates.copy()
    wrong[:, 1, 0], unclear[:, 1, 0] = 0.1, 0.58
    monitor.step(0, REST, 0.1)
    for _ in range(5):
        for each, periods in ((wrong, parameters.velocity_warning - 0.15), (unclear, 0.1)):
            monitor._found = compared(each, monitor._slow)
            assert [monitor.step(0, REST, 0.1) for _ in range(round(periods / 0.1))][-1] is Alarm.OK


def test_a_twist_that_lacks_one_velocity_only_is_not_taken_for_one_that_is_not_filled_in() -> None:
    found = Compared(np.array([0.3, 1.0, 0.0]), np.array([0.0, 0.9, 0.0]), True, True, 0)
    assert "not filled in" not in explained(found)
    assert "not filled in" in explained(found._replace(measured=np.array([0.05, -0.05, 0.0])))


def test_after_a_clock_that_was_set_back_the_comparison_begins_anew_at_once() -> None:
    monitor = Velocities(MonitorParameters(), LENGTH)
    for k in range(20):
        monitor.step(round((1000.0 + 0.05 * k) * 1e9), true_motion(0.05 * k), 0.05)
    after = [monitor.step(k * 50_000_000, WRONG["not filled in"][0](true_motion(0.05 * k), None), 0.05) for k in range(220)]
    assert after[-1] is Alarm.SAFE


def test_a_gyro_with_an_error_is_found_on_a_course_to_the_west_where_the_heading_wraps() -> None:
    monitor, random = Velocities(MonitorParameters(), LENGTH), np.random.default_rng(1)
    for k in range(220):
        west = Motion(-SPEED * 0.05 * k, 0.0, wrap(math.pi + 0.02 * random.normal()), SPEED, 0.0, 0.2)
        monitor.step(k * 50_000_000, west, 0.05)
    assert monitor.alarm is Alarm.SAFE
    assert "yaw rate is 0.2 rad/s" in monitor.detail


@pytest.mark.parametrize("decay", [4.0, 8.0, 16.0])
def test_an_alarm_stays_while_the_ship_comes_to_rest(decay: float) -> None:
    """The changing error of a ship that slows down looks like noise; an alarm that ends gives the law full thrust again."""
    monitor, x, speed = Velocities(MonitorParameters(), LENGTH), 0.0, 2.3
    found = []
    for k in range(1600):
        if found and found[-1] is Alarm.SAFE:
            speed *= 1.0 - 0.05 / decay
        x += 0.05 * speed
        found.append(monitor.step(50_000_000 * k, REST._replace(x=x), 0.05))
    assert found == sorted(found)
    assert found[-1] is Alarm.SAFE
    assert speed < 0.05
