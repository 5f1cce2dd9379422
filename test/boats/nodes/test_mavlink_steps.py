"""The MAVLink node step by step: each state of controller and autopilot, each input that falls silent, and the second time."""

import time
from types import SimpleNamespace
from typing import Any

import pytest
from durations import rest_long
from forwarded_share import HEARTBEAT_TIMEOUT, Period, compare
from geometry_msgs.msg import TwistStamped
from sockets import free_port
from std_msgs.msg import Float64
from stepped_node import SteppedNode
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.boats import takeover
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import commands

pytest.importorskip("pymavlink", exc_type=ImportError)

import itertools

from mavlink_autopilot import Autopilot
from recorded_link import Recording

from vessel_hsmc_ros.boats import mavlink, mavlink_link
from vessel_hsmc_ros.boats.mavlink import MavlinkNode
from vessel_hsmc_ros.boats.mavlink_link import Link
from vessel_hsmc_ros.nodes.base import ERROR, LAST_COMMANDS

STANDBY, ACTIVE, SAFE, STOPPED = ControlState.STANDBY, ControlState.ACTIVE, ControlState.SAFE, ControlState.STOPPED
PERIOD, RAMP, TIMEOUT = 0.04, 0.4, 0.3
MANUAL, HOLD = 0, 4
UNLIKE = {"surge_force_limit": 200.0, "yaw_moment_limit": 50.0}
THRUSTERS = {
    "vessel__thrusters__names": ["left", "right"],
    "vessel__thrusters__y": [0.5, -0.5],
    "vessel__thrusters__thrust_ahead": [100.0],
    "vessel__thrusters__thrust_astern": [50.0],
    "channels": [2.0, 4.0],
}
FULL = {"manual": ("manual", 500, 500), "channels": ("override", {2: 1700, 4: 1300}), "guided": ("velocity", 0.5, 0.2)}
ZERO = {"manual": ("manual", 0, 0), "channels": ("override", {2: 1500, 4: 1500}), "guided": ("velocity", 0.0, 0.0)}
RELEASE = {"manual": ("override", {1: 0, 3: 0}), "channels": ("override", {2: 0, 4: 0})}


class Boat(SteppedNode):
    """An autopilot, a controller and its commands around the node."""

    def __init__(
        self, bench: Any, monkeypatch: pytest.MonkeyPatch, form: str = "manual", ramp_time: float = 0.0, **given_more: Any
    ) -> None:
        monkeypatch.setattr(mavlink, "Link", Recording)
        more = given_more | (THRUSTERS if form == "channels" else {})
        given = {"form": form, "ramp_time": ramp_time, "command_timeout": TIMEOUT, "mode": "MANUAL", **UNLIKE, **more}
        super().__init__(bench, monkeypatch, MavlinkNode, (mavlink, mavlink_link, commands, takeover), **given)
        self.form, self.link, self.silent, self.boot = form, Recording.made[-1], "", 9_000_000
        self.autopilot = {"base_mode": 128, "custom_mode": MANUAL, "system_status": 4}
        self.standby_requests: list[bool] = []
        self.events: list[str] = []
        client = SimpleNamespace(service_is_ready=lambda: True, call_async=lambda r: self.standby_requests.append(r.data))
        monkeypatch.setattr(self.node._takeover, "_enable", client)
        monkeypatch.setattr(self.node.reporter, "event", lambda _, text: self.events.append(text))

    def receive(self, name: str, **fields: Any) -> None:
        self.link.waiting.append(SimpleNamespace(get_type=lambda: name, **fields))

    def step(self, operation: int = ACTIVE, steps: int = 1) -> list[tuple[Any, ...]]:
        """Some periods of everything; returns what has been sent to the autopilot in them."""
        count = len(self.link.sent)
        for _ in range(steps):
            self.wait(PERIOD)
            self.receive("HEARTBEAT", **self.autopilot, autopilot=3)
            self.node._poll()
            self.node._takeover._on_state(ControlState(operation=operation))
            self.command()
            self.node._on_timer()
        return self.link.sent[count:]

    PERIOD = PERIOD

    def period(self, given: Period) -> float:
        """A period with some command and some state of controller and autopilot; returns the share that was sent."""
        count = len(self.link.sent)
        self.wait(PERIOD)
        if given.heard:
            state = {"base_mode": 128 * given.armed, "custom_mode": MANUAL if given.mode else HOLD}
            self.receive("HEARTBEAT", **state, system_status=5 if given.failsafe else 4, autopilot=3)
        self.boot += -60_000 if given.restarted else round(1e3 * PERIOD)
        self.receive("LOCAL_POSITION_NED", time_boot_ms=self.boot, x=0.0, y=0.0, vx=0.0, vy=0.0)
        self.node._poll()
        self.node._takeover._on_state(ControlState(operation=given.operation))
        if given.command:
            self.node._commands.input.take(self.command_of(given.command, 100.0, -25.0))
        self.node._on_timer()
        sent = [each for each in self.link.sent[count:] if each[0] == "manual"]
        return float(sent[-1][2]) / FULL["manual"][2] if sent else 0.0  # type: ignore[operator]

    def command(self) -> None:
        commands = self.node._commands
        if self.form == "manual" and self.silent != "all":
            commands.input.take(self.wrench(100.0, -25.0))
        elif self.form == "guided" and self.silent != "all":
            twist = TwistStamped()
            twist.twist.linear.x, twist.twist.angular.z = 1.0, -0.2
            commands.input.take("cmd_vel", twist)
        for name, thrust in {"left": 50.0, "right": -25.0}.items():
            if self.form == "channels" and self.silent not in (name, "all"):
                commands.input.take(f"thrusters/{name}/thrust", Float64(data=thrust))

    def driven(self) -> "Boat":
        """The same while it carries out its commands."""
        self.step(STANDBY)
        assert self.step(ACTIVE, 30)[-1] == FULL[self.form]
        return self


@pytest.fixture
def boat(bench: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    return lambda *given, **more: Boat(bench, monkeypatch, *given, **more)


@pytest.mark.parametrize("operation", [ACTIVE, SAFE])
def test_the_law_and_its_safe_action_reach_the_autopilot(boat: Any, operation: int) -> None:
    made = boat()
    made.step(STANDBY)
    assert made.step(operation)[-1] == FULL["manual"]


@pytest.mark.parametrize("form", ["channels", "guided"])
def test_commands_of_two_publishers_are_not_mixed(boat: Any, form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    made = boat(form).driven()
    topic = "/cmd_vel" if form == "guided" else "/thrusters/right/thrust"
    monkeypatch.setattr(made.node, "count_publishers", lambda name: 1 + (name == topic))
    assert made.step(ACTIVE, 10)[0] == ZERO[form]
    (task,) = [task for task in made.node.diagnostic_tasks() if task.name == "command"]
    assert task.level == ERROR
    assert f"{topic} has 2 publishers and may have one" in task.message


@pytest.mark.parametrize("form", FULL)
@pytest.mark.parametrize("operation", [STANDBY, STOPPED])
def test_a_controller_in_standby_or_stopped_leaves_the_autopilot_to_others(boat: Any, form: str, operation: int) -> None:
    made = boat(form).driven()
    ending = made.step(operation, 10)
    assert ending[:LAST_COMMANDS] == [ZERO[form]] * LAST_COMMANDS
    assert all(each in (ZERO[form], RELEASE.get(form)) for each in ending), "and the channels are given back"
    assert not made.step(operation, 10)


@pytest.mark.parametrize("operation", [STANDBY, STOPPED])
def test_after_each_takeover_a_person_may_enable_the_controller_that_was_stood_down(boat: Any, operation: int) -> None:
    made = boat().driven()
    for number in (1, 2):
        made.autopilot["custom_mode"] = HOLD
        made.step()
        assert len(made.events) == number, "each takeover is reported"
        made.autopilot["custom_mode"] = MANUAL
        assert FULL["manual"] not in made.step(ACTIVE, 20), "it does not come back by itself"
        assert len(made.events) == number
        made.step(operation)
        assert made.step()[-1] == FULL["manual"]


def test_where_the_sticks_rest_is_looked_at_anew_after_each_standby(boat: Any) -> None:
    made = boat("guided")  # which sends no channels
    for at in (1500, 1800, 1200):
        made.step(STANDBY)
        for width, kept in ((at, True), (at + 20, True), (at + 200, False)):
            made.receive("RC_CHANNELS", **{f"chan{k}_raw": width for k in range(1, 19)})
            made.step(ACTIVE, 30)
            assert (made.step(ACTIVE)[-1:] == [FULL["guided"]]) == kept, f"the stick rests at {at} and is at {width}"


def test_while_it_is_not_obeyed_standby_is_requested_again_and_again_and_no_longer(boat: Any) -> None:
    made = boat().driven()
    made.autopilot["custom_mode"] = HOLD
    made.step(ACTIVE, 25)
    assert 3 <= len(made.standby_requests) <= 6, "five times a second"
    assert not any(made.standby_requests)
    count = len(made.standby_requests)
    made.step(STANDBY, 25)
    assert len(made.standby_requests) == count


@pytest.mark.parametrize(("state", "fails"), [(0, False), (3, False), (4, False), (5, True), (6, True)])
def test_a_failsafe_of_the_autopilot_ends_the_commands(boat: Any, state: int, fails: bool) -> None:
    made = boat().driven()
    made.autopilot["system_status"] = state
    made.step()
    assert (FULL["manual"] in made.step()) is not fails


@pytest.mark.parametrize(("form", "silent"), [("manual", "all"), ("guided", "all"), ("channels", "left"), ("channels", "right")])
def test_each_command_that_falls_silent_ends_all_of_them_and_again(boat: Any, form: str, silent: str) -> None:
    made = boat(form).driven()
    for _ in range(2):
        made.silent = silent
        assert made.step(ACTIVE, round(TIMEOUT / PERIOD) - 1)[-1] == FULL[form], "a command holds for the time-out"
        ending = made.step(ACTIVE, 12)
        assert ZERO[form] in ending
        assert FULL[form] not in ending[3:]
        made.silent = ""
        assert made.step()[-1] == FULL[form]


@pytest.mark.parametrize("form", FULL)
def test_a_changed_time_out_holds_for_each_form(boat: Any, form: str) -> None:
    made = boat(form).driven()
    made.change(command_timeout=3.0)
    made.silent = "all"
    assert made.step(ACTIVE, 50)[-1] == FULL[form]
    assert made.step(ACTIVE, 30)[-1] != FULL[form]


def test_the_output_ramps_at_both_ends_and_turns_round_on_its_way(boat: Any) -> None:
    made = boat(ramp_time=2.0 * RAMP)
    made.step(STANDBY)
    shares = [0.0] + [each[2] / 500 for each in made.step(ACTIVE, 5)]
    made.silent = "all"
    shares += [each[2] / 500 for each in made.step(ACTIVE, 12)]
    made.silent = ""
    shares += [each[2] / 500 for each in made.step(ACTIVE, 20)]
    changes = [after - before for before, after in itertools.pairwise(shares)]
    assert max(map(abs, changes)) <= PERIOD / (2.0 * RAMP) + 3e-3
    assert shares[-1] == 1.0
    turns = [before * after < 0.0 for before, after in itertools.pairwise(changes)]
    assert sum(turns) == 2, "up, down after the time-out, up again from where it is"
    assert min(shares[12:]) > 0.2


@pytest.mark.parametrize("form", FULL)
def test_a_stop_is_zero_at_once_each_time_and_what_follows_begins_at_zero(boat: Any, form: str) -> None:
    made = boat(form, ramp_time=RAMP).driven()
    for _ in range(2):
        count = len(made.link.sent)
        made.stop()
        assert made.link.sent[count] == ZERO[form]
        assert FULL[form] not in made.step(ACTIVE, 20)
        made.stop(rearm=True)
        begun = made.step()
        assert begun
        assert FULL[form] not in begun
        assert made.step(ACTIVE, 20)[-1] == FULL[form]


@pytest.mark.parametrize("form", FULL)
@pytest.mark.parametrize("silent_for", [0, 9])
def test_at_its_end_it_leaves_zero_whether_it_commands_or_ramps(boat: Any, form: str, silent_for: int) -> None:
    made = boat(form, ramp_time=RAMP).driven()
    made.silent = "all"
    made.step(ACTIVE, silent_for)
    count = len(made.link.sent)
    made.node.close()
    assert made.link.sent[count:].count(ZERO[form]) == LAST_COMMANDS
    assert made.link.sent[count:].count(RELEASE.get(form)) == (LAST_COMMANDS if form in RELEASE else 0)


@pytest.mark.parametrize("form", FULL)
@pytest.mark.parametrize("ended_by", ["stop", "mode"])
def test_what_ends_the_commands_is_sent_several_times_as_a_packet_may_be_lost(boat: Any, form: str, ended_by: str) -> None:
    made = boat(form).driven()
    for _ in range(2):
        count = len(made.link.sent)
        if ended_by == "stop":
            made.stop()
        else:
            made.autopilot["custom_mode"] = HOLD
        made.step(ACTIVE, 10)
        ending = made.link.sent[count:]
        assert ending.count(RELEASE.get(form, ZERO[form])) == LAST_COMMANDS
        assert FULL[form] not in ending
        made.stop(rearm=True)
        made.autopilot["custom_mode"] = MANUAL
        made.driven()


@pytest.mark.parametrize("form", FULL)
def test_at_its_end_right_after_a_stop_it_leaves_all_zeros(boat: Any, form: str) -> None:
    made = boat(form).driven()
    made.stop()
    count = len(made.link.sent)
    made.node.close()
    assert made.link.sent[count:].count(ZERO[form]) == LAST_COMMANDS


def test_at_its_end_in_standby_nothing_is_sent(boat: Any) -> None:
    made = boat()
    made.step(STANDBY, 5)
    made.node.close()
    assert not made.link.sent


def test_an_attitude_of_before_a_restart_makes_no_odometry(boat: Any) -> None:
    made = boat()
    zero = dict.fromkeys(("roll", "pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed"), 0.0)
    place = {"x": 3.0, "y": 4.0, "vx": 0.0, "vy": 0.0}
    made.receive("ATTITUDE", time_boot_ms=5000, **zero)
    made.receive("LOCAL_POSITION_NED", time_boot_ms=5000, **place)
    made.node._poll()
    assert [conv.read_odometry(m)[:2] for _, m in made.sent] == [(4.0, 3.0)]
    made.receive("LOCAL_POSITION_NED", time_boot_ms=900, **place)
    made.receive("LOCAL_POSITION_NED", time_boot_ms=4900, **place)
    made.node._poll()
    assert len(made.sent) == 1
    made.receive("ATTITUDE", time_boot_ms=4900, **zero)
    made.receive("LOCAL_POSITION_NED", time_boot_ms=4950, **place)
    made.node._poll()
    assert len(made.sent) == 2


@pytest.mark.parametrize(("attitude", "counts"), [(4600, True), (5400, True), (4400, False), (1000, False), (5600, False)])
def test_an_attitude_of_another_time_makes_no_odometry_and_the_next_one_does(boat: Any, attitude: int, counts: bool) -> None:
    made = boat()
    zero = dict.fromkeys(("roll", "pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed"), 0.0)
    place = {"x": 3.0, "y": 4.0, "vx": 0.0, "vy": 0.0}
    for offset in (0, 20_000):
        count = len(made.sent)
        made.receive("ATTITUDE", time_boot_ms=attitude + offset, **zero)
        made.receive("LOCAL_POSITION_NED", time_boot_ms=5000 + offset, **place)
        made.node._poll()
        assert (len(made.sent) > count) is counts
        made.receive("ATTITUDE", time_boot_ms=6000 + offset, **zero)
        made.receive("LOCAL_POSITION_NED", time_boot_ms=6000 + offset, **place)
        made.node._poll()
        assert len(made.sent) == count + 1 + counts


def test_only_the_autopilot_that_was_heard_first_is_heard() -> None:
    port = free_port()
    link = Link(f"udpin:127.0.0.1:{port}", 115200, 255, 0)
    first, other = (Autopilot(f"udpout:127.0.0.1:{port}", system=system) for system in (7, 8))
    try:
        heard: list[Any] = []
        deadline = time.monotonic() + 20.0
        while len(heard) < 3:
            assert time.monotonic() < deadline
            first.heartbeat()
            other.heartbeat()
            heard += link.receive()
        assert link.target == 7
        assert {message.get_srcSystem() for message in heard} == {7}
    finally:
        for each in (link, first, other):
            each.close()


def test_each_move_of_the_origin_ends_the_commands_and_its_repetition_does_not(boat: Any) -> None:
    made = boat().driven()

    def origin(degrees: float) -> tuple[Any, ...]:
        made.receive("GPS_GLOBAL_ORIGIN", latitude=round(degrees * 1e7), longitude=0)
        made.step()
        return made.step()[-1]

    assert origin(60.0) == FULL["manual"], "the first one"
    for number, degrees in enumerate((61.0, 60.0, 61.0), 1):
        assert origin(degrees) != FULL["manual"]
        assert len(made.events) == number
        made.driven()
        assert origin(degrees) == FULL["manual"]


def test_two_restarts_end_the_commands_each_time(boat: Any) -> None:
    made = boat().driven()
    for boots in (1, 2):
        made.receive("LOCAL_POSITION_NED", time_boot_ms=9000, x=0.0, y=0.0, vx=0.0, vy=0.0)
        made.step()
        made.receive("LOCAL_POSITION_NED", time_boot_ms=500, x=0.0, y=0.0, vx=0.0, vy=0.0)
        made.step()
        assert made.events == ["the autopilot has been restarted, or has set its clock back"] * boots
        made.step(STANDBY)
        assert made.step()[-1] == FULL["manual"]


def test_outputs_are_those_of_the_main_port_and_in_the_order_of_the_thrusters(boat: Any) -> None:
    made = boat(servos=[3.0, 1.0])
    for port, first, third in ((0, 1700, 1500), (1, 1100, 1100), (0, 1500, 1300)):
        made.receive("SERVO_OUTPUT_RAW", port=port, servo1_raw=first, servo3_raw=third)
        made.node._poll()
    applied = [conv.read_wrench(message) for topic, message in made.sent if topic == "applied_wrench"]
    assert applied == [pytest.approx((50.0, 12.5)), pytest.approx((-50.0, 12.5))]


@pytest.mark.parametrize("step", [2.0, -2.0, 86_400.0, -3600.0])
def test_after_each_step_of_the_computers_clock_odometry_is_stamped_by_it(
    boat: Any, monkeypatch: pytest.MonkeyPatch, step: float
) -> None:
    made, offset = boat(), [0.0]
    monkeypatch.setattr(made.node, "now", lambda: made.time.monotonic_ns() + round(offset[0] * 1e9))
    zero = dict.fromkeys(("roll", "pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed"), 0.0)
    for k in range(300):
        offset[0] = step if 100 <= k < 200 else 0.0
        made.wait(PERIOD + 0.01 * (k % 2))
        made.boot += round(1e3 * PERIOD) + 10 * (k % 2)
        made.receive("ATTITUDE", time_boot_ms=made.boot, **zero)
        made.receive("LOCAL_POSITION_NED", time_boot_ms=made.boot, x=0.0, y=0.0, vx=0.0, vy=0.0)
        made.node._poll()
        stamp = conv.nanoseconds(made.sent[-1][1].header.stamp)
        assert 1e-9 * (made.node.now() - stamp) == pytest.approx(0.0, abs=0.005)
    assert len(made.sent) == 300
    assert not made.events


@pytest.mark.parametrize("seed", rest_long(range(2)))
def test_in_any_sequence_the_share_is_that_of_the_commands_that_count(boat: Any, seed: int) -> None:
    compare(boat(heartbeat_timeout=HEARTBEAT_TIMEOUT), seed, 3000, 2e-3, is_autopilot=True)
