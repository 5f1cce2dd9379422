"""Jumps that no ship makes, and monitors of what no single sample shows."""

import math

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.control.safety.monitors import Alarm, Innovation, NotMoving, Saturation
from vessel_hsmc_ros.control.safety.parameters import MonitorParameters, SafetyParameters
from vessel_hsmc_ros.control.safety.samples import Jumps, Verdict
from vessel_hsmc_ros.core.kinematics import Motion

SECOND = 1_000_000_000
LIMITS = (100.0, 40.0)
TIMES = MonitorParameters(
    not_moving_warning=1.0,
    not_moving_safe=3.0,
    saturation_warning=1.0,
    saturation_safe=3.0,
    innovation_warning=1.0,
    innovation_safe=3.0,
)
T = 0.1


def at(x: float, psi: float = 0.0, u: float = 1.0, r: float = 0.0) -> Motion:
    return Motion(x, 0.0, psi, u, 0.0, r)


def jumps(**values: object) -> Jumps:
    """For a ship of 10 m, which has been at the origin: 30 m/s are a Froude number of 3."""
    found = Jumps(SafetyParameters(jump_samples=3, **values), 10.0)  # type: ignore[arg-type]
    assert found.check(0, at(0.0)) is Verdict.TAKE
    return found


@pytest.mark.parametrize(
    ("motion", "verdict"),
    [
        (at(20.0), Verdict.TAKE),
        (at(60.0), Verdict.HOLD),
        (at(0.0, psi=0.9), Verdict.TAKE),
        (at(0.0, u=31.0), Verdict.HOLD),
        (at(0.0, r=-7.0), Verdict.HOLD),
        (at(0.0, r=-5.9), Verdict.TAKE),
        (at(0.0, r=5.9), Verdict.TAKE),
    ],
)
def test_a_motion_that_no_ship_makes_is_held_out(motion: Motion, verdict: Verdict) -> None:
    assert jumps().check(SECOND // 10, motion) is verdict


def test_a_heading_that_no_ship_turns_to_is_held_out_and_a_full_turn_is_none() -> None:
    assert jumps().check(SECOND // 10, at(0.0, psi=math.pi)) is Verdict.HOLD
    assert jumps().check(SECOND // 10, at(0.0, psi=2.0 * math.pi)) is Verdict.TAKE


def test_a_long_gap_allows_a_long_way() -> None:
    assert jumps().check(10 * SECOND, at(300.0)) is Verdict.TAKE


def test_a_glitch_is_held_out_and_the_next_good_sample_is_taken() -> None:
    found = jumps()
    verdicts = [found.check((k + 1) * SECOND // 10, at(x)) for k, x in enumerate([500.0, 0.1, 500.0, 500.0, 0.2])]
    assert verdicts == [Verdict.HOLD, Verdict.TAKE, Verdict.HOLD, Verdict.HOLD, Verdict.TAKE]
    assert found.held == 0


def test_samples_that_agree_on_a_new_place_are_taken_as_a_relocalisation() -> None:
    found = jumps()
    verdicts = [found.check((k + 1) * SECOND // 10, at(500.0 + k)) for k in range(5)]
    assert verdicts == [Verdict.HOLD] * 3 + [Verdict.RELOCALISED, Verdict.TAKE]


def test_samples_that_do_not_agree_are_never_taken() -> None:
    found = jumps()
    verdicts = {found.check((k + 1) * SECOND // 10, at(500.0 * (-1) ** k)) for k in range(20)}
    assert verdicts == {Verdict.HOLD}


def test_the_speed_that_no_ship_has_can_be_set_and_the_check_switched_off() -> None:
    assert jumps(jump_speed=0.5).check(SECOND // 10, at(0.0, u=0.6)) is Verdict.HOLD
    assert jumps(jump_speed=math.inf).check(SECOND // 10, at(1e9, psi=3.0, u=1e6, r=9.0)) is Verdict.TAKE


def lasting(alarms: list[Alarm]) -> list[int]:
    """How many periods each alarm lasts, in the order OK, WARN, SAFE."""
    assert alarms == sorted(alarms)
    return [alarms.count(alarm) for alarm in Alarm]


def test_a_ship_that_is_driven_and_does_not_move_gives_a_warning_and_then_the_safe_action() -> None:
    monitor = NotMoving(TIMES, LIMITS)
    assert lasting([monitor.step((95.0, 0.0), (0.01, 0.0), T) for _ in range(40)]) == pytest.approx([10, 20, 10], abs=1)
    monitor = NotMoving(TIMES, LIMITS)
    assert lasting([monitor.step((0.0, -40.0), (0.0, 0.001), T) for _ in range(40)]) == pytest.approx([10, 20, 10], abs=1)


@pytest.mark.parametrize(
    ("command", "motion"),
    [
        ((95.0, 0.0), (0.2, 0.0)),
        ((-95.0, 0.0), (-0.2, 0.0)),
        ((50.0, 0.0), (0.0, 0.0)),
        ((0.0, 0.0), (0.0, 0.0)),
        ((0.0, 39.0), (0.0, 0.1)),
        ((0.0, -39.0), (0.0, -0.1)),
    ],
)
def test_a_ship_that_moves_or_is_not_driven_gives_no_alarm(command: tuple[float, float], motion: tuple[float, float]) -> None:
    monitor = NotMoving(TIMES, LIMITS)
    assert {monitor.step(command, motion, T) for _ in range(100)} == {Alarm.OK}


def test_a_command_at_one_limit_gives_a_warning_and_then_the_safe_action() -> None:
    monitor = Saturation(TIMES, LIMITS)
    assert lasting([monitor.step((100.0, 0.0), T) for _ in range(40)]) == pytest.approx([10, 20, 10], abs=1)


@settings(max_examples=300, deadline=None)
@given(st.floats(1e-3, 1e9), st.floats(1e-6, 1e6), st.floats(0.05, 1.0), st.sampled_from([1.0, -1.0]), st.integers(0, 1))
@example(979.2, 1.0 / 979.2 * 3.0, 1.0, 1.0, 0)
def test_a_command_that_was_clipped_in_other_units_is_at_its_limit(
    limit: float, unit: float, share: float, side: float, axis: int
) -> None:
    bounds = MonitorParameters(
        **{f"{name}_{kind}": 1.0 for name in ("saturation", "not_moving") for kind in ("warning", "safe")}, driven_share=share
    )
    limits = (limit, 1e12) if axis == 0 else (1e12, limit)
    rounded = side * limit / unit * unit
    command = (rounded, 0.0) if axis == 0 else (0.0, rounded)
    saturation, moving = Saturation(bounds, limits), NotMoving(bounds, limits)
    assert [saturation.step(command, 0.6) for _ in range(3)][-1] is Alarm.SAFE
    driven = (share * command[0], share * command[1])
    assert [moving.step(driven, (0.0, 0.0), 0.6) for _ in range(3)][-1] is Alarm.SAFE


def test_a_law_that_switches_between_its_limits_is_not_saturated() -> None:
    saturation, moving = Saturation(TIMES, LIMITS), NotMoving(TIMES, LIMITS)
    for k in range(100):
        command = 1e7 * (-1) ** k, 40.0 * (-1) ** k
        assert saturation.step(command, T) is Alarm.OK
        assert moving.step(command, (0.0, 0.0), T) is Alarm.OK


def test_measurements_that_the_observer_rejects_give_an_alarm() -> None:
    monitor = Innovation(TIMES)
    assert monitor.step(False, T) is Alarm.OK
    assert lasting([monitor.step(True, T) for _ in range(40)]) == pytest.approx([10, 20, 10], abs=1)


def test_an_alarm_stays_until_its_condition_has_been_absent_for_a_while() -> None:
    monitor = Saturation(TIMES, LIMITS)
    for _ in range(40):
        monitor.step((100.0, 0.0), T)
    assert lasting([Alarm(2 - monitor.step((0.0, 0.0), T)) for _ in range(20)]) == pytest.approx([9, 0, 11], abs=1)


def test_an_interruption_starts_the_time_of_a_monitor_anew() -> None:
    monitor = Saturation(TIMES, LIMITS)
    for k in range(100):
        assert monitor.step((0.0 if k % 8 == 0 else 100.0, 0.0), T) is Alarm.OK


def test_an_alarm_stays_while_its_condition_returns_again_and_again() -> None:
    """A loose propeller, or a position that comes and goes: each absence is shorter than that which ends the alarm."""
    monitor = Innovation(TIMES)
    for _ in range(40):
        monitor.step(True, T)
    assert {monitor.step(k % 8 == 0, T) for k in range(100)} == {Alarm.SAFE}
    assert [monitor.step(False, T) for _ in range(11)][-1] is Alarm.OK
