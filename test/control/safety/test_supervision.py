"""Every row of the state machine that decides what is commanded."""

import math
from itertools import pairwise
from typing import Any

import pytest

from vessel_hsmc_ros.control.safety.parameters import ACTIONS, Operation, Reason, SafetyParameters
from vessel_hsmc_ros.control.safety.supervision import Authority, Supervision

LIMITS = (100.0, 40.0)
SHIP = Authority(LIMITS, (10.0, 20.0))
T = 0.1
STEP = (2.0, 0.8)
"""Largest change in a period: the limits in 5 s."""

GOOD = (60.0, -20.0)
STEP_TO_GOOD = (2.0, -0.8)
OK = Reason.NONE


def controller(active: bool = True, ship: Authority = SHIP, **values: Any) -> Supervision:
    return Supervision(SafetyParameters(**values), ship, active)


def running(ship: Authority = SHIP, **values: Any) -> Supervision:
    """A controller whose law commands GOOD."""
    s = controller(ship=ship, **values)
    s.step(GOOD, OK, T)
    return s


def commands(
    s: Supervision, count: int, wanted: tuple[float, float] | None = None, reason: Reason = Reason.OVERDUE
) -> list[float]:
    """The surge forces of the next periods."""
    return [s.step(wanted, reason, T)[0] for _ in range(count)]


def test_an_active_controller_commands_what_the_law_gives_from_the_first_period_on() -> None:
    s = controller()
    assert s.step((99.0, -39.0), OK, T) == (99.0, -39.0)
    assert s.step((-99.0, 39.0), OK, T) == (-99.0, 39.0), "its own changes have no bound"
    assert (s.operation, s.reason) == (Operation.ACTIVE, OK)


def test_standby_commands_zero_until_it_is_activated() -> None:
    s = controller(active=False)
    assert s.step(GOOD, OK, T) == (0.0, 0.0)
    assert (s.operation, s.reason) == (Operation.STANDBY, Reason.IN_STANDBY)


def test_activation_leads_from_zero_to_the_law_at_the_bounded_rate() -> None:
    s = controller(active=False)
    assert s.activate() is OK
    assert s.step(GOOD, OK, T) == (2.0, -0.8)
    assert (s.operation, s.reason) == (Operation.ACTIVE, Reason.HANDOVER)
    assert commands(s, 29, GOOD, OK)[-1] == pytest.approx(60.0)
    assert s.step(GOOD, OK, T) == GOOD
    assert s.reason is OK


def test_each_activation_after_standby_leads_from_zero() -> None:
    s = controller(active=False)
    for _ in range(2):
        s.activate()
        assert s.step(GOOD, OK, T) == STEP_TO_GOOD
        commands(s, 60, GOOD, OK)
        s.standby()
        assert s.step(GOOD, OK, T) == s.command == (0.0, 0.0)
    s.activate()
    commands(s, 60, GOOD, OK)
    s.stop()
    assert s.step(GOOD, OK, T) == s.command == (0.0, 0.0)
    s.rearm()
    s.activate()
    assert s.step(GOOD, OK, T) == STEP_TO_GOOD


def test_a_change_of_law_or_gains_is_no_violation_of_the_rate_of_the_law_each_time() -> None:
    s = running(surge_force_rate=50.0, yaw_moment_rate=50.0)
    for demand in ((-60.0, 20.0), GOOD):
        s.handover()
        assert s.step(demand, OK, T) != demand, "it is bounded"
        assert (s.operation, s.violations) == (Operation.ACTIVE, {})
        commands(s, 80, demand, OK)
        assert s.command == demand


def test_a_change_during_a_handover_begins_another_one() -> None:
    s, switching = running(), [(-100.0, 0.0), (100.0, 0.0)]

    def largest_change(count: int) -> float:
        forces = [s.command[0], *(s.step(switching[k % 2], OK, T)[0] for k in range(count))]
        return max(abs(b - a) for a, b in pairwise(forces))

    s.handover()
    assert largest_change(90) <= 2.0 + 1e-9, "for twice the time of a ramp, which is 5 s"
    s.handover()
    assert largest_change(90) <= 2.0 + 1e-9


def test_the_fallback_law_is_wanted_during_the_safe_action_alone() -> None:
    s = running(action="fallback")
    assert not s.wants_fallback
    s.step(None, Reason.OVERDUE, T)
    assert s.wants_fallback
    s.standby()
    assert not s.wants_fallback
    s.stop()
    assert not s.wants_fallback


def test_an_activation_that_is_not_ready_is_refused_with_its_reason() -> None:
    s = controller(active=False)
    assert s.activate(Reason.NO_CONSUMER) is Reason.NO_CONSUMER
    assert s.operation is Operation.STANDBY


@pytest.mark.parametrize(
    ("wanted", "reason", "expected"),
    [
        (None, Reason.OVERDUE, Reason.OVERDUE),
        (None, OK, Reason.LAW_UNDEFINED),
        (GOOD, Reason.SECOND_PUBLISHER, Reason.SECOND_PUBLISHER),
        ((math.nan, 0.0), OK, Reason.COMMAND_NOT_FINITE),
        ((0.0, 40.1), OK, Reason.COMMAND_LIMIT),
    ],
)
def test_a_fault_leads_to_the_safe_action_in_the_same_period(
    wanted: tuple[float, float] | None, reason: Reason, expected: Reason
) -> None:
    s = running()
    assert s.step(wanted, reason, T) == pytest.approx((58.0, -19.2))
    assert (s.operation, s.reason) == (Operation.SAFE, expected)


def test_the_safe_action_goes_on_to_zero_while_the_fault_lasts() -> None:
    s = running()
    assert commands(s, 31)[-1] == 0.0
    assert s.operation is Operation.SAFE


def test_the_law_commands_again_after_enough_good_periods_without_a_bump() -> None:
    s = running(fresh_samples=3)
    commands(s, 5)
    before = s.command
    assert [s.step(GOOD, OK, T)[0] for _ in range(2)] == pytest.approx([before[0] - 2.0, before[0] - 4.0])
    assert s.reason is Reason.NOT_READY
    assert s.step(GOOD, OK, T)[0] == pytest.approx(before[0] - 2.0), "the third turns it round"
    assert (s.operation, s.reason) == (Operation.ACTIVE, Reason.HANDOVER)


def test_a_fault_between_good_periods_starts_their_count_anew() -> None:
    s = running(fresh_samples=3)
    for wanted, reason in [(None, Reason.OVERDUE), (GOOD, OK), (GOOD, OK), (None, Reason.OVERDUE), (GOOD, OK), (GOOD, OK)]:
        s.step(wanted, reason, T)
    assert s.operation == Operation.SAFE
    s.step(GOOD, OK, T)
    assert s.reason == Reason.HANDOVER


def test_stop_is_answered_by_the_next_period_from_any_state() -> None:
    safe, standby, handing_over = running(), controller(active=False), controller(active=False)
    safe.step(None, Reason.OVERDUE, T)
    handing_over.activate()
    handing_over.step(GOOD, OK, T)
    for s in (running(), safe, standby, handing_over):
        s.stop()
        assert s.step(GOOD, OK, T) == (0.0, 0.0)
        assert (s.operation, s.reason) == (Operation.STOPPED, Reason.IN_STOP)


def test_a_stop_holds_until_it_is_rearmed_and_then_waits_in_standby() -> None:
    s = running()
    s.stop()
    assert s.activate() is s.standby() is Reason.IN_STOP
    assert commands(s, 5, GOOD, OK) == [0.0] * 5
    assert s.rearm() is OK
    assert s.operation is Operation.STANDBY
    assert s.step(GOOD, OK, T) == (0.0, 0.0)
    assert s.activate() is OK


@pytest.mark.parametrize("why", [Reason.IN_STOP, Reason.SHUTTING_DOWN])
def test_a_stop_keeps_its_reason_until_it_is_rearmed(why: Reason) -> None:
    made = running()
    for _ in range(2):
        made.stop(why)
        made.standby()
        made.activate()
        made.step(GOOD, OK, T)
        assert (made.operation, made.reason) == (Operation.STOPPED, why)
        made.rearm()
        assert made.reason is Reason.IN_STANDBY
        made.activate()


def test_rearming_what_is_not_stopped_changes_nothing() -> None:
    s = running()
    s.rearm()
    assert (s.operation, s.step(GOOD, OK, T)) == (Operation.ACTIVE, GOOD)


def test_a_person_puts_it_in_standby_at_once() -> None:
    s = running()
    assert s.standby() is OK
    assert s.step(GOOD, OK, T) == (0.0, 0.0)


def test_the_command_keeps_the_bounded_rate_after_a_change_of_law_or_gains() -> None:
    s = running()
    s.handover()
    assert s.step((-100.0, -20.0), OK, T) == (58.0, -20.0)
    assert s.reason is Reason.HANDOVER


def test_a_handover_to_a_law_that_switches_between_its_limits_ends() -> None:
    s = controller(active=False)
    s.activate()
    sides = [s.step((100.0 * (-1) ** k, 0.0), OK, T)[0] for k in range(102)]
    assert all(abs(b - a) <= 2.0 for a, b in pairwise(sides[:100]))
    assert s.reason is OK
    assert abs(sides[-1]) == 100.0


def test_a_change_of_the_law_that_is_faster_than_declared_is_a_violation_and_counted() -> None:
    s = running(surge_force_rate=50.0)
    assert s.step((66.0, -20.0), OK, T)[0] == 58.0
    assert (s.reason, s.violations) == (Reason.COMMAND_RATE, {Reason.COMMAND_RATE: 1})


def test_a_law_without_limits_of_its_own_is_not_bounded_but_its_safe_action_starts_within_them() -> None:
    s = running(Authority(LIMITS, (10.0, 20.0), bounded=False))
    assert s.step((1e6, 0.0), OK, T) == (1e6, 0.0)
    assert s.step(None, Reason.OVERDUE, T)[0] == 98.0
    assert running(Authority(LIMITS, (10.0, 20.0), bounded=False), surge_force_limit=70.0).step((71.0, 0.0), OK, T)[0] == 58.0


def test_the_safe_action_zero_is_at_once() -> None:
    assert commands(running(action="zero"), 2) == [0.0, 0.0]


def test_the_safe_action_hold_is_followed_by_the_ramp() -> None:
    assert commands(running(action="hold", hold_time=0.2), 4) == pytest.approx([60.0, 60.0, 58.0, 56.0])


def test_the_safe_action_brake_opposes_the_measured_motion_and_ramps_without_one() -> None:
    s = controller(action="brake")
    s.step((0.0, 0.0), OK, T)
    braked = [s.step(None, Reason.OVERDUE, T, (0.5, -1.0)) for _ in range(10)]
    assert braked[-1] == (-1.0, 4.0), "mass times velocity over the time constant of 5 s"
    assert s.step(None, Reason.OVERDUE, T) == pytest.approx((0.0, 3.2))
    assert s.step(None, Reason.OVERDUE, T, (math.nan, -1.0)) == pytest.approx((0.0, 2.4))
    assert s.step(None, Reason.OVERDUE, T, (0.5, math.nan)) == pytest.approx((0.0, 1.6))


def test_a_brake_never_reverses_the_motion() -> None:
    for period in (0.01, 1.0, 20.0):
        s, u = controller(action="brake", ramp_time=0.1), 3.0
        for _ in range(200):
            s.step(None, Reason.OVERDUE, period, (u, 0.0))
            u += s.command[0] / SHIP.inertia[0] * period
            assert u >= 0.0


def test_the_safe_action_fallback_takes_the_wrench_of_another_law_and_ramps_without_one() -> None:
    s = running(action="fallback")
    assert not s.wants_fallback
    s.step(None, Reason.LAW_UNDEFINED, T, fallback=(200.0, 0.0))
    assert s.wants_fallback
    assert s.command == pytest.approx((62.0, -19.2))
    assert s.step(None, Reason.LAW_UNDEFINED, T, fallback=(math.nan, 0.0))[0] == pytest.approx(60.0)
    assert s.step(None, Reason.LAW_UNDEFINED, T)[0] == pytest.approx(58.0)


@pytest.mark.parametrize("other", [(1e7, -1e9), (-101.0, 41.0)])
def test_the_wrench_of_another_law_is_cut_to_the_limits_of_the_ship(other: tuple[float, float]) -> None:
    s = running(action="fallback")
    for _ in range(100):
        force, moment = s.step(None, Reason.OVERDUE, T, fallback=other)
        assert abs(force) <= LIMITS[0]
        assert abs(moment) <= LIMITS[1]
    assert s.command == (math.copysign(LIMITS[0], other[0]), math.copysign(LIMITS[1], other[1]))


def test_a_brake_stays_within_the_limits() -> None:
    s = controller(action="brake", ramp_time=0.1)
    assert s.step(None, Reason.OVERDUE, T, (1e3, -1e3)) == (-100.0, 40.0)


def test_commands_of_a_law_without_limits_are_cut_to_those_of_the_ship_where_actuators_take_them() -> None:
    s = running(Authority(LIMITS, (10.0, 20.0), bounded=False, clips=True))
    assert s.step((1e7, -1e9), OK, T) == (100.0, -40.0)
    assert s.operation is Operation.ACTIVE
    assert s.step((math.nan, 0.0), OK, T) == (98.0, -39.2)
    assert (s.operation, s.reason) == (Operation.SAFE, Reason.COMMAND_NOT_FINITE)


def test_a_law_that_stays_beyond_the_limits_of_the_ship_does_not_change_what_the_actuators_are_given() -> None:
    s = running(Authority(LIMITS, (10.0, 20.0), bounded=False, clips=True), surge_force_rate=50.0, yaw_moment_rate=50.0)
    for force in (64.0, 69.0, 74.0, 79.0, 84.0, 89.0, 94.0, 99.0, 500.0, 1e7, 1e7, 120.0, 97.0):
        assert s.step((force, GOOD[1]), OK, T) == (min(force, LIMITS[0]), GOOD[1])
    assert (s.operation, s.violations) == (Operation.ACTIVE, {})
    s.step((91.0, GOOD[1]), OK, T)
    assert s.reason is Reason.COMMAND_RATE


STANDBY, ACTIVE, SAFE, STOPPED = Operation
ORDERS: dict[str, tuple[tuple[Operation, Reason], ...]] = {
    "activate": ((ACTIVE, OK), (ACTIVE, OK), (SAFE, OK), (STOPPED, Reason.IN_STOP)),
    "activate without what it needs": (
        *((each, Reason.NO_CONSUMER) for each in (STANDBY, ACTIVE, SAFE)),
        (STOPPED, Reason.IN_STOP),
    ),
    "standby": ((STANDBY, OK), (STANDBY, OK), (STANDBY, OK), (STOPPED, Reason.IN_STOP)),
    "stop": ((STOPPED, OK),) * 4,
    "rearm": ((STANDBY, OK), (ACTIVE, OK), (SAFE, OK), (STANDBY, OK)),
}
"""The state and the answer after each order, from STANDBY, ACTIVE, SAFE and STOPPED."""


def brought_to(state: Operation) -> Supervision:
    """A controller in a state, half way in a handover or in a safe action with a good period."""
    s = controller(active=state in (ACTIVE, SAFE), fresh_samples=3, ramp_time=2.0)
    commands(s, 5, GOOD, OK)
    s.handover()
    if state is STOPPED:
        s.stop()
    commands(s, 5, (-50.0, 10.0), OK)
    if state is SAFE:
        commands(s, 4)
        commands(s, 1, GOOD, OK)
    assert s.operation is state
    return s


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("state", Operation)
def test_each_order_in_each_state_leads_where_it_must_and_else_changes_nothing(state: Operation, order: str) -> None:
    ordered, twin = brought_to(state), brought_to(state)
    name, _, needs = order.partition(" ")
    answer = getattr(ordered, name)(*([Reason.NO_CONSUMER] if needs else []))
    assert (ordered.operation, answer) == ORDERS[order][state]
    if ordered.operation is state and order != "stop":
        for _ in range(30):
            assert ordered.step(GOOD, OK, T) == twin.step(GOOD, OK, T)
            assert (ordered.operation, ordered.reason) == (twin.operation, twin.reason)
    else:
        after = ordered.step(GOOD, OK, T)
        assert after == ((0.0, 0.0) if ordered.operation in (STANDBY, STOPPED) else (5.0, -2.0))


@pytest.mark.parametrize("action", ACTIONS)
def test_a_second_fault_is_answered_like_the_first(action: str) -> None:
    s = running(action=action, hold_time=0.3, fresh_samples=2)
    answers = []
    for _ in range(3):
        answers.append([s.step(None, Reason.OVERDUE, T, (0.5, -1.0), (20.0, 5.0)) for _ in range(8)])
        for _ in range(200):
            s.step(GOOD, OK, T)
        assert (s.operation, s.command) == (Operation.ACTIVE, GOOD)
    assert answers[1:] == [answers[0]] * 2


def test_after_a_fault_the_rate_of_the_law_does_not_count_from_the_safe_action() -> None:
    """Else a law whose command stands still would be refused for its distance from the ramp, for ever."""
    s = running(surge_force_rate=50.0, fresh_samples=2)
    assert commands(s, 31)[-1] == 0.0
    commands(s, 2, GOOD, OK)
    assert s.operation is Operation.ACTIVE
    assert commands(s, 60, GOOD, OK)[-1] == GOOD[0]
    assert s.violations == {}
    assert s.step((GOOD[0] - 6.0, GOOD[1]), OK, T) != (GOOD[0] - 6.0, GOOD[1]), "its own changes are bounded"
    assert s.reason is Reason.COMMAND_RATE
