"""The fence under way: when the guard intervenes, what it commands, and when it lets the law command again."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.control.safety.fence_guard import RELEASE_TIME, Braking, FenceGuard
from vessel_hsmc_ros.control.safety.monitors import Alarm
from vessel_hsmc_ros.control.safety.parameters import FenceGuardParameters, Operation, Reason, SafetyParameters
from vessel_hsmc_ros.control.safety.supervision import Authority, Supervision
from vessel_hsmc_ros.core.fence import fence_of
from vessel_hsmc_ros.core.kinematics import Motion

SQUARE = (-50.0, -50.0, 50.0, -50.0, 50.0, 50.0, -50.0, 50.0, -50.0, -50.0)
SHIP = Authority((100.0, 50.0), (200.0, 100.0))
BRAKING = Braking(0.5, 0.0, 0.0, math.inf, 10.0, 1.0, 0.1)
T = 0.1
HOME = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
AHEAD = Motion(70.0, 0.0, 0.0, 0.0, 0.0, 0.0)
LAWS = (1.0, 2.0)  # the law's wrench


def guard(**values: object) -> FenceGuard:
    parameters = FenceGuardParameters(inside=SQUARE, **values)  # type: ignore[arg-type]
    fence = fence_of(parameters, "fence")
    assert fence is not None
    return FenceGuard(parameters, fence, BRAKING, SHIP, 4.0)


def at(x: float, u: float = 0.0, y: float = 0.0, v: float = 0.0) -> Motion:
    return Motion(x, y, 0.0, u, v, 0.0)


def step(g: FenceGuard, motion: Motion, reference: Motion = AHEAD, periods: int = 1) -> Reason:
    for _ in range(periods):
        reason = g.step(motion, 0.0, 0.0, None, reference, T)
    return reason


def test_it_intervenes_where_the_vessel_could_no_longer_stop_inside() -> None:
    # 2 m/s: 0.2 m in a period and 4 m of braking, 5 % of that for the heading, and half of the length as margin
    reach = 4.2 * 1.05 + 2.0
    assert step(guard(), at(50.0 - reach - 0.01, 2.0)) is Reason.NONE
    assert step(guard(), at(50.0 - reach + 0.01, 2.0)) is Reason.FENCE
    assert step(guard(margin=5.0), at(50.0 - reach - 2.9, 2.0)) is Reason.FENCE


def test_it_says_how_far_the_vessel_goes_and_how_far_the_fence_is() -> None:
    g = guard()
    step(g, at(44.0, 2.0))
    assert g.detail == "the vessel stops in 4.4 m, the fence is 6.0 m away, with a margin of 2.0 m"
    step(g := guard(), at(53.5))
    assert g.detail == "the vessel at (53.5, 0) m is 3.5 m outside"
    step(g := guard(current=1.0), at(0.0))
    assert g.detail == "", "it has room"


def test_it_brakes_with_all_of_its_force_until_the_vessel_goes_back() -> None:
    g = guard()
    step(g, at(46.0, 2.0))
    assert g.command(LAWS, at(46.0, 2.0), T) == pytest.approx((-100.0, 0.0))
    step(g, at(47.0, 0.1))
    assert g.command(LAWS, at(47.0, 0.1), T) == pytest.approx((-100.0, 0.0)), "also where it would stop inside by now"
    step(g, at(47.0, -0.01))
    assert g.command(LAWS, at(47.0, -0.01), T) == LAWS, "then the law holds it"


def test_a_vessel_that_goes_astern_brakes_ahead() -> None:
    g = guard()
    step(g, at(-46.0, -2.0))
    assert g.command(LAWS, at(-46.0, -2.0), T) == pytest.approx((100.0, 0.0))


def test_without_a_wrench_of_the_law_and_with_the_action_brake_it_stays_at_the_brake() -> None:
    for g, demand in ((guard(), None), (guard(action="brake"), LAWS)):
        step(g, at(46.0, 2.0))
        step(g, at(47.0, -0.02))
        command = g.command(demand, at(47.0, -0.02), T)
        assert command is not None
        assert command != LAWS
        assert 0.0 < command[0] < 100.0


def test_without_an_alarm_it_commands_nothing() -> None:
    g = guard()
    assert step(g, at(0.0, 1.0)) is Reason.NONE
    assert g.command(LAWS, at(0.0, 1.0), T) is None
    assert g.reference is None


@pytest.mark.parametrize(("action", "last"), [("hold", 44.0), ("return", 0.0)])
def test_it_holds_where_the_vessel_came_from_or_leads_back_along_its_way(action: str, last: float) -> None:
    g = guard(action=action)
    for x in range(0, 46):
        step(g, at(float(x), 0.5))
    step(g, at(46.0, 2.0))
    places = []
    for x in range(46, -1, -1):
        step(g, at(float(x), -0.1))
        assert g.reference is not None
        places.append(g.reference.x)
    assert places[-1] == pytest.approx(last)
    assert places == sorted(places, reverse=True)


def test_it_lets_the_law_command_once_vessel_and_reference_are_inside_for_some_time() -> None:
    g = guard()
    step(g, at(46.0, 2.0))
    assert step(g, at(40.0), periods=1000) is Reason.FENCE, "while the reference is outside"
    for _ in range(10):  # one that comes and goes
        step(g, at(40.0), HOME, round(RELEASE_TIME / T) - 1)
        assert step(g, at(40.0), AHEAD) is Reason.FENCE
    assert step(g, at(40.0), HOME, round(RELEASE_TIME / T) + 1) is Reason.NONE
    assert g.detail == ""


@settings(max_examples=20, deadline=None)
@given(st.lists(st.tuples(st.floats(-80.0, 80.0), st.floats(-80.0, 80.0), st.floats(-3.0, 3.0)), min_size=1, max_size=20))
def test_it_never_releases_a_vessel_that_is_outside(moves: list[tuple[float, float, float]]) -> None:
    g = guard()
    for x, y, u in moves:
        outside = max(abs(x), abs(y)) > 50.0
        reasons = {step(g, at(x, u, y), HOME) for _ in range(round(1.2 * RELEASE_TIME / T) if outside else 1)}
        if outside:
            assert reasons == {Reason.FENCE}
            g.reset()
            assert step(g, at(x, u, y), HOME) is Reason.FENCE, "nor does a reset"


def test_the_water_is_that_which_was_observed_before_the_alarm() -> None:
    g = guard()
    water = (0.3 + 0j, 0.0, 0.1, 0.0)
    g.step(at(30.0), 0.0, 0.0, water, AHEAD, T)
    assert g.stop is not None
    before = g.stop.way
    g.step(at(30.0), 0.0, 0.0, None, AHEAD, T)
    assert g.stop.way == pytest.approx(before)


def test_a_command_that_has_ended_still_acts_for_its_lag() -> None:
    slow = BRAKING._replace(lag=2.0)
    driven, idle = guard(), guard()
    for g in (driven, idle):
        g.braking = slow
    for _ in range(100):
        driven.step(at(0.0, 2.0), 100.0, 0.0, None, AHEAD, T)
        idle.step(at(0.0, 2.0), 0.0, 0.0, None, AHEAD, T)
    for g in (driven, idle):
        g.step(at(0.0, 2.0), 0.0, 0.0, None, AHEAD, T)
    assert driven.stop is not None
    assert idle.stop is not None
    assert driven.stop.distance > idle.stop.distance + 0.5


def sail(g: FenceGuard, drive: float, current: float = 0.0, periods: int = 1200) -> tuple[float, Supervision]:
    """The farthest x of a vessel without lag whose law drives it, under supervision, and the supervision."""
    s, motion, farthest = Supervision(SafetyParameters(), SHIP), at(0.0, 0.5), 0.0
    for _ in range(periods):
        reason = g.step(motion, s.command[0], 0.0, None, AHEAD, T)
        goal = g.reference or AHEAD
        demand = (drive if g.reference is None else 50.0 * (goal.x - motion.x) - 100.0 * motion.u, 0.0)
        demand = (max(-100.0, min(100.0, demand[0])), 0.0)
        s.step(demand, reason, T, (motion.u, motion.r), None, g.command(demand, motion, T))
        u = motion.u + T * (s.command[0] / 200.0 - 0.05 * (motion.u - current))
        motion = at(motion.x + 0.5 * T * (motion.u + u), u)
        farthest = max(farthest, motion.x)
    return farthest, s


@pytest.mark.parametrize("action", ["hold", "return", "brake"])
def test_a_law_that_drives_at_the_fence_never_crosses_it(action: str) -> None:
    farthest, s = sail(guard(action=action), 100.0)
    assert 40.0 < farthest < 50.0
    assert (s.operation, s.reason) == (Operation.SAFE, Reason.FENCE)


def test_a_law_that_fails_at_the_fence_leaves_the_brake_on() -> None:
    g, s = guard(), Supervision(SafetyParameters(), SHIP)
    motion = at(46.0, 2.0)
    reason = g.step(motion, 0.0, 0.0, None, AHEAD, T)
    s.step(None, Reason.LAW_UNDEFINED or reason, T, (2.0, 0.0), None, g.command(None, motion, T))
    assert s.command == pytest.approx((-100.0, 0.0))


def test_a_stop_by_a_person_is_zero_also_at_the_fence() -> None:
    g, s = guard(), Supervision(SafetyParameters(), SHIP)
    s.stop()
    motion = at(46.0, 2.0)
    reason = g.step(motion, 0.0, 0.0, None, AHEAD, T)
    assert s.step(LAWS, reason, T, (2.0, 0.0), None, g.command(LAWS, motion, T)) == (0.0, 0.0)
    assert g.alarm is Alarm.SAFE
