"""What messages of MAVLink mean, by known answers."""

import math

import pytest

from vessel_hsmc_ros.boats.autopilot import (
    MODE_NAMES,
    SURFACE_MODES,
    Attitude,
    BootClock,
    Handover,
    Position,
    Pulses,
    axes,
    axis_width,
    filter_problem,
    motion,
    overrides,
)


@pytest.mark.parametrize(
    ("yaw", "velocity", "expected"),
    [
        (0.0, (2.0, 0.0), (0.5 * math.pi, 2.0, 0.0)),  # heading north, ahead
        (0.5 * math.pi, (0.0, 1.5), (0.0, 1.5, 0.0)),  # heading east, ahead
        (0.5 * math.pi, (1.0, 0.0), (0.0, 0.0, 1.0)),  # heading east, to the north, which is to port
        (-math.pi, (-1.0, 0.5), (-0.5 * math.pi, 1.0, 0.5)),  # heading south, a little to the east: to port
        (math.radians(300.0), (0.0, 0.0), (math.radians(150.0), 0.0, 0.0)),
    ],
)
def test_north_east_and_yaw_from_north_become_x_east_y_north_and_heading_from_east(
    yaw: float, velocity: tuple[float, float], expected: tuple[float, float, float]
) -> None:
    found = motion(Position(7.0, 30.0, -4.0, *velocity), Attitude(7.0, 0.0, 0.0, yaw, 0.0, 0.0, 0.1))
    assert (found.x, found.y, found.r) == (-4.0, 30.0, -0.1)
    assert (math.cos(found.psi), math.sin(found.psi)) == pytest.approx((math.cos(expected[0]), math.sin(expected[0])))
    assert (found.u, found.v) == pytest.approx(expected[1:], abs=1e-12)


def test_the_heading_is_that_at_the_time_of_the_position() -> None:
    found = motion(Position(10.2, 0.0, 0.0, 0.0, 0.0), Attitude(10.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.3))
    assert found.psi == pytest.approx(0.5 * math.pi - 0.56)


def test_the_yaw_rate_of_a_heeled_boat_is_that_of_the_yaw_angle() -> None:
    # A pure turn about the vertical at a roll of 20° and a pitch of 5° shows in all three gyroscopes.
    roll, pitch, turn = math.radians(20.0), math.radians(5.0), 0.4
    p, q, r = (
        -turn * math.sin(pitch),
        turn * math.sin(roll) * math.cos(pitch),
        turn * math.cos(roll) * math.cos(pitch),
    )
    assert motion(Position(0.0, 0.0, 0.0, 0.0, 0.0), Attitude(0.0, roll, pitch, 0.0, p, q, r)).r == pytest.approx(-turn)


def test_stamps_since_boot_become_times_without_the_delays_of_single_messages() -> None:
    clock = BootClock()
    assert clock.stamp(999.0) is None
    assert clock.age(5.0, 1000.0) == 0.0
    assert clock.age(5.1, 1000.35) == pytest.approx(0.25, abs=1e-4), "a delay of 0.25 s does not count"
    assert clock.age(5.2, 1000.19) == 0.0, "a shorter one corrects the estimate"
    assert clock.age(1000.0, 1995.3) == pytest.approx(0.12, abs=0.2), "the clocks may diverge"
    assert clock.reboots == 0
    for reboots, received in ((1, 2000.0), (2, 3000.0)):
        assert clock.age(0.5, received) == 0.0
        assert clock.age(0.6, received + 0.15) == pytest.approx(0.05, abs=1e-4)
        assert clock.age(20.0, received + 19.6) == pytest.approx(0.1, abs=5e-3)
        assert clock.stamp(received + 30.0) == pytest.approx(30.5, abs=5e-3)
        assert clock.reboots == reboots


def test_the_estimate_follows_a_clock_that_is_slow() -> None:
    clock = BootClock()
    ages = [clock.age(t, 100.0 + t * (1.0 + 1e-4)) for t in range(0, 3600, 10)]
    assert max(ages) < 1e-6, "without delay the time of receipt is the time"


@pytest.mark.parametrize("step", [-0.9, -0.3, -0.15, 0.15, 2.0, 3600.0])
def test_the_estimate_follows_a_step_of_the_clock_of_the_autopilot_within_a_few_messages(step: float) -> None:
    clock = BootClock()
    for k in range(200):
        offset = step if k >= 100 else 0.0
        age = clock.age(50.0 + 0.05 * k + offset, 1000.0 + 0.05 * k + 0.01 * (k % 3))
        assert 0.0 <= age < 0.03 or (k == 100 and step < 0.0)
    assert clock.reboots == 0


def test_a_message_that_was_overtaken_keeps_its_time() -> None:
    clock = BootClock()
    for k in range(20):
        assert clock.age(5.0 + 0.1 * k, 1000.0 + 0.1 * k) < 1e-9
        assert clock.age(4.7 + 0.1 * k, 1000.01 + 0.1 * k) == pytest.approx(0.31, abs=1e-3) or not k
    assert clock.reboots == 0


@pytest.mark.parametrize(
    ("flags", "text"),
    [
        (831, ""),
        (831 | 1024, "the filter is not initialised"),
        (831 & ~16, "the filter has no horizontal position"),
        (1 | 2 | 128, "the filter has no horizontal position, no source of position (constant position mode)"),
    ],
)
def test_the_filter_must_have_attitude_velocity_and_position(flags: int, text: str) -> None:
    assert filter_problem(flags) == text


@pytest.mark.parametrize(("share", "width"), [(1.0, 1900), (-1.0, 1100), (0.5, 1720), (-0.5, 1320), (0.0, 1540), (7.0, 1900)])
def test_a_share_of_the_thrust_is_a_pulse_width_and_back(share: float, width: int) -> None:
    pulses = Pulses(1100.0, 1540.0, 1900.0)
    assert pulses.width(share) == width
    assert pulses.share(width) == pytest.approx(max(-1.0, min(1.0, share)), abs=2e-3)


def test_an_output_that_is_switched_off_gives_no_thrust() -> None:
    assert Pulses(1100.0, 1500.0, 1900.0).share(0) == 0.0


@pytest.mark.parametrize(
    ("command", "expected"), [((0.5, 0.25), (-250, 500)), ((-2.0, -2.0), (1000, -1000)), ((0.0, 0.0), (0, 0))]
)
def test_a_moment_to_port_is_steering_to_the_left(command: tuple[float, float], expected: tuple[int, int]) -> None:
    assert axes(*command) == expected


def test_an_axis_is_a_pulse_width_of_the_radio() -> None:
    assert [axis_width(axis, (1100.0, 1900.0)) for axis in (-1000, 0, 500)] == [1100, 1500, 1700]


def test_overrides_leave_other_channels_as_they_are() -> None:
    assert overrides({1: 1600, 3: 0}) == [1600, 65535, 0, 65535, 65535, 65535, 65535, 65535]


def test_a_mode_has_its_name_or_its_number() -> None:
    handover = Handover(15, 3.0, MODE_NAMES)
    for mode, name in ((4, "HOLD"), (99, "99")):
        handover.heartbeat(0.0, armed=True, mode=mode, state=4)
        assert handover.waits(0.0) == f"mode {name}, commands need GUIDED"


def test_the_modes_have_the_numbers_of_the_heartbeat_of_ardupilot() -> None:
    numbers = [0, 1, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 15, 16]
    names = ["MANUAL", "ACRO", "STEERING", "HOLD", "LOITER", "FOLLOW", "SIMPLE", "DOCK", "CIRCLE"]
    names += ["AUTO", "RTL", "SMART_RTL", "GUIDED", "INITIALISING"]
    assert dict(zip(names, numbers, strict=True)) == SURFACE_MODES
