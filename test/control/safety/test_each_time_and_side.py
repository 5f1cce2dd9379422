"""The safety layer at its exact times, on each axis and side, and at the second time."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from vessel_hsmc_ros.boats.handover import Handover, Sticks
from vessel_hsmc_ros.control.safety.monitors import Alarm, Monitor, NotMoving, Saturation, Velocities
from vessel_hsmc_ros.control.safety.parameters import FreshnessParameters, MonitorParameters, Operation, Reason, SafetyParameters
from vessel_hsmc_ros.control.safety.samples import Freshness, Sample
from vessel_hsmc_ros.control.safety.supervision import Authority, Supervision
from vessel_hsmc_ros.core.kinematics import Motion

BOUNDS = replace(
    MonitorParameters(),
    moving_speed=0.3,
    moving_yaw_rate=0.02,
    driven_share=0.5,
    not_moving_warning=1.0,
    not_moving_safe=2.0,
    saturation_warning=1.5,
    saturation_safe=2.5,
)
LIMITS = 200.0, 70.0
SHIP = Authority(LIMITS, (50.0, 20.0))


def test_a_monitor_warns_and_demands_the_safe_action_in_the_period_in_which_its_time_is_full_each_time() -> None:
    monitor = Monitor(Reason.NOT_MOVING, 0.5, 1.0)
    for _ in range(2):
        found = [monitor.watch(True, 0.25) for _ in range(5)]
        assert found == [Alarm.OK, Alarm.WARN, Alarm.WARN, Alarm.SAFE, Alarm.SAFE]
        assert [monitor.watch(False, 0.25) for _ in range(3)] == [Alarm.SAFE, Alarm.OK, Alarm.OK]
    for _ in range(3):
        monitor.watch(True, 0.25)
    monitor.reset()
    assert [monitor.watch(True, 0.25) for _ in range(4)] == [Alarm.OK, Alarm.WARN, Alarm.WARN, Alarm.SAFE]


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_each_axis_has_its_own_bounds_of_command_and_motion_on_either_side(axis: int, side: float) -> None:
    def alarm(share: float, motion: float) -> Alarm:
        monitor, command, moves = NotMoving(BOUNDS, LIMITS), [0.0, 0.0], [0.0, 0.0]
        command[axis], moves[axis] = side * share * LIMITS[axis], motion * (BOUNDS.moving_speed, BOUNDS.moving_yaw_rate)[axis]
        return [monitor.step((command[0], command[1]), (moves[0], moves[1]), 0.5) for _ in range(6)][-1]

    assert alarm(0.5, 0.9) is alarm(0.5, -0.9) is Alarm.SAFE
    assert alarm(0.5, 1.0) is alarm(0.5, -1.0) is Alarm.OK
    assert alarm(0.49, 0.0) is Alarm.OK
    saturation = Saturation(BOUNDS, LIMITS)
    at = (side * LIMITS[0], 0.0) if axis == 0 else (0.0, side * LIMITS[1])
    assert [saturation.step(at, 0.5) for _ in range(7)] == [Alarm.OK] * 3 + [Alarm.WARN] * 2 + [Alarm.SAFE] * 2
    below = at[0] * 0.999, at[1] * 0.999
    assert [saturation.step(below, 0.5) for _ in range(4)][-1] is Alarm.OK


def test_velocities_are_integrated_between_samples_that_are_far_apart_in_a_turn() -> None:
    """A circle within the gap of a second: what is integrated by one end only is off by half of what it turns in a step."""
    monitor, u, r, dt = Velocities(MonitorParameters(), 4.0), 2.0, 0.5, 0.9
    for k in range(40):
        psi = 2.0 + r * k * dt
        motion = Motion(u / r * math.sin(psi), -u / r * math.cos(psi), math.remainder(psi, 2.0 * math.pi), u, 0.0, r)
        assert monitor.step(round(k * dt * 1e9), motion, dt) is Alarm.OK
    exact = Velocities(MonitorParameters(), 4.0)
    for k in range(3):
        exact.step(k * 10**8, Motion(0.0, 0.0, 0.0, 1.0 + k, 0.0, 0.1 * k), 0.1)
    assert exact._integral == pytest.approx([0.1 * (1.5 + 2.5), 0.0, 0.1 * (0.05 + 0.15)])


def supervised(**values: Any) -> Supervision:
    return Supervision(replace(SafetyParameters(), fresh_samples=3, ramp_time=1.0, **values), SHIP)


def test_good_periods_count_anew_after_each_safe_action() -> None:
    made = supervised()
    for _ in range(3):
        made.step((1.0, 1.0), Reason.NONE, 0.1)
        made.step(None, Reason.OVERDUE, 0.1)
        seen = []
        for _ in range(3):
            made.step((1.0, 1.0), Reason.NONE, 0.1)
            seen.append(made.operation)
        assert seen == [Operation.SAFE, Operation.SAFE, Operation.ACTIVE]


def test_the_time_of_a_hold_begins_with_each_safe_action() -> None:
    made = supervised(action="hold", hold_time=0.3)
    for _ in range(2):
        for _ in range(30):
            made.step((40.0, -9.0), Reason.NONE, 0.1)
        held = [made.step(None, Reason.OVERDUE, 0.1) for _ in range(4)]
        assert held[:3] == [(40.0, -9.0)] * 3
        assert held[3] == pytest.approx((20.0, -2.0))


def test_each_violation_of_the_guard_counts() -> None:
    made = supervised()
    cases = {Reason.COMMAND_LIMIT: (0.0, -71.0), Reason.COMMAND_NOT_FINITE: (1.0, math.nan)}
    for count in (1, 2, 3):
        for reason, demand in cases.items():
            made.step(demand, Reason.NONE, 0.1)
            assert made.violations[reason] == count


@pytest.mark.parametrize(("own", "allowed"), [(-1.0, (200.0, 70.0)), (0.0, (0.0, 0.0)), (30.0, (30.0, 30.0))])
def test_a_limit_of_the_guard_is_that_of_the_ship_only_where_none_is_set(own: float, allowed: tuple[float, float]) -> None:
    for axis in (0, 1):
        for side in (1.0, -1.0):
            for factor, kept in ((1.0, True), (1.001, False)):
                made = supervised(surge_force_limit=own, yaw_moment_limit=own)
                demand = [0.0, 0.0]
                demand[axis] = side * (allowed[axis] * factor + (0.0 if kept else 1e-3))
                made.step((demand[0], demand[1]), Reason.NONE, 0.1)
                assert (made.operation is Operation.ACTIVE) is kept


def test_a_sample_that_is_taken_ends_the_reason_of_what_was_refused_before() -> None:
    """What is overdue then is silent, and not of a wrong frame."""
    fresh = Freshness(0.5, FreshnessParameters(), "odom")
    second = 10**9
    for start in (second, 9 * second):
        assert fresh.accept(Sample(start, "map", "", (1.0,)), start, start) is Reason.WRONG_FRAME
        assert fresh.accept(Sample(start + 1, "odom", "", (1.0,)), start + 1, start + 1) is Reason.NONE
        assert fresh.overdue(start + second // 2, start + second // 2) is Reason.NONE
        late = start + second // 2 + 10
        assert fresh.overdue(late, late) is Reason.OVERDUE
        # Within the time-out of the refusal, by the stamps alone.
        assert fresh.overdue(late, start + second // 2 - 10) is Reason.OVERDUE


def ready() -> Handover:
    made = Handover(4, 1.0, {4: "guided", 0: "manual"})
    made.heartbeat(0.0, True, 4, 4)
    made.controller(False, 0.0)
    return made


@pytest.mark.parametrize(
    "later",
    [lambda made: made.heartbeat(0.2, False, 4, 4), lambda made: made.heartbeat(0.2, True, 4, 6), lambda made: made.check(9.0)],
)
def test_the_first_reason_of_a_take_over_is_kept_until_standby(later: Callable[[Handover], None]) -> None:
    made = ready()
    made.heartbeat(0.1, True, 0, 4)
    assert made.taken == "mode manual, commands need guided"
    later(made)
    made.take_over("a stick")
    assert made.taken == "mode manual, commands need guided"
    made.controller(True, 9.0)
    assert made.taken == ""


@pytest.mark.parametrize("state", [5, 6])
def test_each_failsafe_ends_the_commands(state: int) -> None:
    made = ready()
    made.heartbeat(0.1, True, 4, state)
    assert made.taken == "the autopilot reports a failsafe"
    assert not made.passes(0.1)


@pytest.mark.parametrize("width", [1400, 1600, 1351, 1649])
def test_a_stick_shows_any_of_what_was_sent_within_its_memory(width: int) -> None:
    sticks = Sticks([2], 50.0)
    for k in range(40):
        sticks.sent(0.1 * k, {2: 1400 if k % 2 else 1600})
    assert sticks.moved(4.0, [1500, width, 1500]) == ""
    for far in (1349, 1651):
        assert sticks.moved(4.0, [1500, far, 1500]) == f"channel 2 of the radio is at {far} µs"
