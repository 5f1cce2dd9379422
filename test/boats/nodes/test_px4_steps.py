"""The PX4 node called step by step on a clock of the test: stamps, takeovers, stops and ramps, also the second time."""

import math
from types import SimpleNamespace
from typing import Any

import pytest
from definitions import module
from durations import rest_long
from forwarded_share import HEARTBEAT_TIMEOUT, Period, compare
from stepped_node import SteppedNode
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.boats import takeover
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import commands

if module("px4_msgs.msg") is None:
    pytest.skip("px4_msgs is not installed, and nothing is there to compile it", allow_module_level=True)

from px4_msgs.msg import VehicleOdometry, VehicleStatus

from vessel_hsmc_ros.boats import px4
from vessel_hsmc_ros.boats.px4 import Px4Node

STANDBY, ACTIVE = ControlState.STANDBY, ControlState.ACTIVE
PERIOD, RAMP, TIMEOUT, OFFBOARD, MANUAL, NED = 0.02, 0.2, 0.3, 14, 0, 1
FULL = pytest.approx((0.5, 0.2))


class Boat(SteppedNode):
    """An autopilot in Offboard, a controller and its commands around the node."""

    PERIOD = PERIOD

    def __init__(self, bench: Any, monkeypatch: pytest.MonkeyPatch, **more: Any) -> None:
        given = {"ramp_time": RAMP, "command_timeout": TIMEOUT, "surge_force_limit": 200.0, "yaw_moment_limit": 50.0}
        values = given | more
        super().__init__(bench, monkeypatch, Px4Node, (px4, commands, takeover), **values)
        self.boot = 9000.0
        self.status: dict[str, Any] = {"nav_state": OFFBOARD, "arming_state": 2}
        client = SimpleNamespace(service_is_ready=lambda: True, call_async=lambda _: None)
        monkeypatch.setattr(self.node._takeover, "_enable", client)

    def step(self, operation: int = ACTIVE, steps: int = 1, commanded: bool = True) -> list[tuple[float, float]]:
        """Some periods of everything; returns the pairs of throttle and steering that were sent in them."""
        count = len(self.sent)
        for _ in range(steps):
            self.wait(PERIOD)
            self.node._on_status(VehicleStatus(**self.status))
            self.node._takeover._on_state(ControlState(operation=operation))
            if commanded:
                self.node._input.take(self.wrench(100.0, -10.0))
            self.node._on_timer()
        sent = self.sent[count:]
        throttle = [message.throttle_body_x for topic, message in sent if topic == "fmu/in/rover_throttle_setpoint"]
        steering = [getattr(message, self.node._steering) for topic, message in sent if topic == "fmu/in/rover_steering_setpoint"]
        return list(zip(throttle, steering, strict=True))

    def period(self, given: Period) -> float:
        """A period with some command and some state of controller and autopilot; returns the share that was sent."""
        count = len(self.sent)
        self.wait(PERIOD)
        if given.heard:
            state = {"nav_state": OFFBOARD if given.mode else MANUAL, "arming_state": 2 if given.armed else 1}
            self.node._on_status(VehicleStatus(**state, failsafe=given.failsafe))
        self.boot += -60.0 if given.restarted else PERIOD
        self.estimate(self.boot, self.boot)
        self.node._takeover._on_state(ControlState(operation=given.operation))
        if given.command:
            self.node._input.take(self.command_of(given.command, 100.0, -10.0))
        self.node._on_timer()
        throttle = [m.throttle_body_x for topic, m in self.sent[count:] if topic == "fmu/in/rover_throttle_setpoint"]
        return throttle[-1] / 0.5 if throttle else 0.0

    def estimate(self, sampled: float, published: float, filled_in: bool = True) -> int:
        """The stamp of the odometry that a message gives, by PX4's times, s, in ns; 0 for none."""
        message = VehicleOdometry(timestamp=round(published * 1e6), timestamp_sample=round(sampled * 1e6))
        message.pose_frame = message.velocity_frame = NED
        message.q[0] = 1.0 if filled_in else math.nan
        count = len(self.sent)
        self.node._on_odometry(message)
        stamps = [conv.nanoseconds(message.header.stamp) for _, message in self.sent[count:] if hasattr(message, "header")]
        return stamps[-1] if stamps else 0

    def driven(self) -> "Boat":
        """The same while it carries out its commands."""
        self.step(STANDBY)
        assert self.step(ACTIVE, 15)[-1] == FULL
        return self


@pytest.fixture
def boat(bench: Any, monkeypatch: pytest.MonkeyPatch) -> Boat:
    return Boat(bench, monkeypatch)


def test_odometry_is_stamped_by_the_time_of_its_sample_not_by_that_of_its_message(boat: Boat) -> None:
    stamps = []
    for k, delay in enumerate((0.004, 0.012, 0.008)):
        boat.time.seconds = 1000.0 + 0.02 * k + delay
        stamps.append(boat.estimate(500.0 + 0.02 * k, 500.0 + 0.02 * k + delay - 0.001))
    assert [stamp - stamps[0] for stamp in stamps] == pytest.approx([0, 20_000_000, 40_000_000], abs=20_000)
    assert boat.estimate(0.0, 500.06) > stamps[-1], "some estimators leave the time of the sample out"


@pytest.mark.parametrize("filled_in", [True, False], ids=["", "the first message has no motion yet"])
def test_each_restart_and_each_other_mode_ends_the_commands_until_the_controller_was_in_standby(
    boat: Boat, filled_in: bool
) -> None:
    boat.driven()
    for began in (300.0, 100.0):
        boat.estimate(began, began)
        count = len(boat.sent)
        boat.estimate(5.0, 5.0, filled_in)
        assert [m.throttle_body_x for _, m in boat.sent[count:] if hasattr(m, "throttle_body_x")][:1] == [0.0], "at once"
        assert set(boat.step(ACTIVE, 20)) == {(0.0, 0.0)}
        boat.driven()
        boat.status["nav_state"] = MANUAL
        assert boat.step(ACTIVE, 3) == [], "its own setpoints count there"
        boat.status["nav_state"] = OFFBOARD
        assert set(boat.step(ACTIVE, 20)) == {(0.0, 0.0)}
        boat.driven()


def test_each_change_of_the_time_out_holds_from_the_next_period_on(boat: Boat) -> None:
    boat.driven()
    for timeout in (1.0, 0.4):
        boat.change(command_timeout=timeout)
        boat.step(ACTIVE, 15)
        held = boat.step(ACTIVE, 60, commanded=False)
        assert sum(pair == FULL for pair in held) == pytest.approx(timeout / PERIOD, abs=1.0)


def test_a_stop_is_zero_at_once_each_time_and_what_follows_begins_at_zero(boat: Boat) -> None:
    boat.driven()
    for _ in range(2):
        count = len(boat.sent)
        boat.stop()
        assert boat.sent[count][1].throttle_body_x == 0.0
        assert set(boat.step(ACTIVE, 10)) == {(0.0, 0.0)}
        boat.stop(rearm=True)
        assert [throttle for throttle, _ in boat.step(ACTIVE, 3)] == pytest.approx([0.05, 0.1, 0.15])
        boat.step(ACTIVE, 10)


def test_without_commands_the_output_ramps_down_and_again_up_from_where_it_is(boat: Boat) -> None:
    boat.driven()
    for _ in range(2):
        assert boat.step(ACTIVE, 14, commanded=False) == [FULL] * 14, "within the time-out"
        boat.step(ACTIVE, 1, commanded=False)
        assert [throttle for throttle, _ in boat.step(ACTIVE, 4, commanded=False)] == pytest.approx([0.45, 0.4, 0.35, 0.3])
        assert [throttle for throttle, _ in boat.step(ACTIVE, 2)] == pytest.approx([0.35, 0.4])
        boat.step(ACTIVE, 10)


@pytest.mark.parametrize("step", rest_long([2.0, -2.0, 86_400.0, -3600.0]))
@pytest.mark.parametrize("synchronised", rest_long([False, True]), ids=["since boot", "by a clock that is stepped too"])
def test_after_each_step_of_the_computers_clock_odometry_is_stamped_by_it_and_setpoints_by_that_of_px4(
    boat: Boat, monkeypatch: pytest.MonkeyPatch, step: float, synchronised: bool
) -> None:
    offset = [0.0]
    monkeypatch.setattr(boat.node, "now", lambda: boat.time.monotonic_ns() + round(offset[0] * 1e9))
    for k in range(300):
        offset[0] = step if 100 <= k < 200 else 0.0
        boat.wait(PERIOD)
        own = 9000.0 + PERIOD * k + (offset[0] if synchronised else 0.0)
        stamp = boat.estimate(own - 0.002, own)
        assert 1e-9 * (boat.node.now() - stamp) == pytest.approx(0.0, abs=0.005)
        boat.node._on_timer()
        sent = [message.timestamp for topic, message in boat.sent if topic == "fmu/in/offboard_control_mode"]
        assert 1e-6 * sent[-1] == pytest.approx(own, abs=0.005)


@pytest.mark.long
def test_in_any_sequence_the_share_is_that_of_the_commands_that_count(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    compare(Boat(bench, monkeypatch, heartbeat_timeout=HEARTBEAT_TIMEOUT), 0, 3000, 1e-6, is_autopilot=True)
