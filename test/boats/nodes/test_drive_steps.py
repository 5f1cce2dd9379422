"""The drive node and the watchdog step by step: unlike limits, inputs that fall silent one by one, and the second time."""

import itertools
import math
from typing import Any

import pytest
from durations import rest_long
from forwarded_share import Period, compare
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
from stepped_node import SteppedNode
from thruster_layouts import layout
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.boats import drive, takeover
from vessel_hsmc_ros.boats.drive import DriveNode, WatchdogNode
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import commands
from vessel_hsmc_ros.nodes.base import LAST_COMMANDS
from vessel_hsmc_ros.nodes.thruster_allocation import ThrusterAllocationNode

PERIOD, RAMP, TIMEOUT = 0.02, 0.2, 0.3
STANDBY, ACTIVE, SAFE, STOPPED = ControlState.STANDBY, ControlState.ACTIVE, ControlState.SAFE, ControlState.STOPPED
GIVEN: dict[str, dict[str, Any]] = {
    "normalised": {"surge_force_limit": 200.0, "yaw_moment_limit": 50.0},
    "helm": {"surge_force_limit": 200.0, "yaw_moment_limit": 50.0, "steering_sign": -1.0},
    "cmd_vel": {"surge_speed_limit": 3.0, "yaw_rate_limit": 0.5},
    "pwm": {
        "pwm__thrusters": ["left", "right"],
        "pwm__curve_pulses": [1100.0, 1300.0, 1700.0, 1900.0],
        "pwm__curve_thrusts": [-40.0, -20.0, 40.0, 80.0],
    },
}
FULL = {"normalised": (0.5, -0.5), "helm": (0.5, 0.5), "cmd_vel": (1.5, -0.2), "pwm": (1700, 1300)}
ZERO = {"normalised": (0.0, 0.0), "helm": (0.0, 0.0), "cmd_vel": (0.0, 0.0), "pwm": (1500, 1500)}


class Drive(SteppedNode):
    """A drive node with its commands: 100 N and -25 N·m, or 1.5 m/s and -0.2 rad/s, or 40 N and -20 N."""

    def __init__(self, bench: Any, monkeypatch: pytest.MonkeyPatch, form: str, **parameters: Any) -> None:
        given = {"form": form, "ramp_time": 0.0, "command_timeout": TIMEOUT, **GIVEN[form], **parameters}
        super().__init__(bench, monkeypatch, DriveNode, (drive, takeover, commands), **given)
        self.form, self.silent = form, ""

    def step(self, steps: int = 1, operation: int = ACTIVE) -> list[Any]:
        """Some periods with commands; returns the pairs that were published in them."""
        count = len(self.sent)
        for _ in range(steps):
            self.wait(PERIOD)
            if self.form == "pwm":
                for name, thrust in {"left": 40.0, "right": -20.0}.items():
                    if self.silent not in (name, "all"):
                        self.node._input.take(f"thrusters/{name}/thrust", Float64(data=thrust))
            else:
                if self.silent not in ("command", "all"):
                    self.node._input.take(self.wrench(100.0, -25.0))
                if self.silent not in ("state", "all") and self.form == "cmd_vel":
                    state = ControlState(operation=operation, commanded_surge_velocity=1.5, commanded_yaw_rate=-0.2)
                    self.node._on_state(self.stamped(state))
            self.node._on_timer()
        return self.pairs(count)

    PERIOD = PERIOD

    def period(self, given: Period) -> float:
        """A period with some command; returns the share of it that was sent."""
        count = len(self.sent)
        self.wait(PERIOD)
        if given.command:
            self.node._input.take(self.command_of(given.command, 100.0, -25.0))
        self.node._on_timer()
        sent = self.pairs(count)
        return float(sent[-1][0]) / FULL[self.form][0] if sent else 0.0

    def pairs(self, count: int) -> list[Any]:
        """What has been published since some messages, as pairs."""
        messages = [message for _, message in self.sent[count:]]
        if self.form == "normalised":
            return [conv.read_wrench(m) for m in messages]
        if self.form == "cmd_vel":
            return [(m.twist.linear.x, m.twist.angular.z) for m in messages]
        return [(a.data, b.data) for a, b in zip(messages[::2], messages[1::2], strict=True)]

    def call(self, serve: Any) -> list[Any]:
        """Call a service; returns what was published at once."""
        count = len(self.sent)
        assert serve(Trigger.Request(), Trigger.Response()).success
        return self.pairs(count)


@pytest.fixture
def make(bench: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    return lambda form, **more: Drive(bench, monkeypatch, form, **more)


@pytest.mark.parametrize(
    ("form", "silent"),
    [("normalised", "all"), ("helm", "all"), ("cmd_vel", "command"), ("cmd_vel", "state"), ("pwm", "left"), ("pwm", "right")],
)
def test_each_input_that_falls_silent_ends_the_output_and_again(make: Any, form: str, silent: str) -> None:
    made = make(form)
    for _ in range(2):
        assert made.step()[-1] == FULL[form]
        made.silent = silent
        assert set(made.step(round(TIMEOUT / PERIOD) - 1)) == {FULL[form]}, "a command holds for the time-out"
        ending = made.step(12)
        assert set(ending[4:]) <= {ZERO[form]}
        assert ending.count(ZERO[form]) == LAST_COMMANDS, "then the topic is left to others"
        made.silent = ""


@pytest.mark.parametrize("seed", rest_long(range(2)))
def test_in_any_sequence_the_share_is_that_of_the_commands_that_count(make: Any, seed: int) -> None:
    compare(make("normalised"), seed, 2000, 1e-6, is_autopilot=False)


@pytest.mark.parametrize("form", FULL)
def test_a_changed_time_out_holds_in_each_form(make: Any, form: str) -> None:
    made = make(form)
    made.step()
    made.change(command_timeout=2.0)
    made.silent = "all"
    assert set(made.step(90)) == {FULL[form]}
    assert ZERO[form] in made.step(20)


@pytest.mark.parametrize("operation", [STANDBY, SAFE, STOPPED])
def test_cmd_vel_has_a_velocity_only_while_the_law_commands_and_again(make: Any, operation: int) -> None:
    made = make("cmd_vel")
    for _ in range(2):
        assert made.step()[-1] == FULL["cmd_vel"]
        assert set(made.step(10, operation)) == {(0.0, 0.0)}


@pytest.mark.parametrize("back", [0.5, 100.0])
def test_after_each_step_back_of_the_clock_a_state_of_the_former_time_does_not_count(make: Any, back: float) -> None:
    made = make("cmd_vel")
    for _ in range(2):
        assert made.step(3)[-1] == FULL["cmd_vel"]
        made.wait(-back)
        made.silent = "state"
        made.step()
        assert set(made.step(5)) == {(0.0, 0.0)}
        made.silent = ""


def test_with_a_response_time_the_motion_is_that_of_the_surfaces_astern_too(make: Any) -> None:
    made = make("cmd_vel", response_time=0.5, surge_inertia=100.0, yaw_inertia=25.0, surge_speed_limit=9.0, yaw_rate_limit=9.0)
    made.wait(PERIOD)
    made.node._input.take(made.wrench(-100.0, -25.0))
    names = ("commanded_surge_velocity", "commanded_yaw_rate", "surge_surface", "yaw_surface")
    state = ControlState(operation=ACTIVE, **dict(zip(names, (-1.5, 0.2, -0.25, 0.125), strict=True)))
    made.node._on_state(made.stamped(state))
    made.node._on_timer()
    assert made.pairs(0)[-1] == pytest.approx((-1.5 - 0.25 - 0.5, 0.2 + 0.125 - 0.5))


@pytest.mark.parametrize("form", FULL)
def test_a_stop_is_zero_at_once_each_time_and_what_follows_begins_at_zero(make: Any, form: str) -> None:
    made = make(form, ramp_time=RAMP)
    for _ in range(2):
        assert made.step(12)[-1] == FULL[form]
        assert made.call(made.node._latch._stop) == [ZERO[form]]
        stopped = made.step(20)
        assert set(stopped) == {ZERO[form]}
        assert len(stopped) == 20, "the zero goes on"
        assert not made.call(made.node._latch._rearm)
        first, zero, full = (math.hypot(*(float(a) for a in pair)) for pair in (made.step()[-1], ZERO[form], FULL[form]))
        assert abs(first - zero) <= 1.01 * abs(full - zero) * PERIOD / RAMP + 1.0 * (form == "pwm")


def test_a_command_that_flickers_turns_the_ramp_round_where_it_is(make: Any) -> None:
    made = make("normalised", ramp_time=5.0 * RAMP)
    shares = [0.0]
    for silent in ("", "all", "", "all", ""):
        made.silent = silent
        shares += [force / 0.5 for force, _ in made.step(20 if silent else 12)]
    changes = [after - before for before, after in itertools.pairwise(shares)]
    assert max(map(abs, changes)) <= 1.001 * PERIOD / (5.0 * RAMP)
    turns = [k for k in range(1, len(changes)) if changes[k - 1] * changes[k] < 0.0]
    assert len(turns) == 4
    assert min(shares[k] for k in turns) > 0.2, "before zero"


@pytest.mark.parametrize("form", FULL)
@pytest.mark.parametrize("silent_for", [0, 18])
def test_at_its_end_it_leaves_zero_whether_it_commands_or_ramps(make: Any, form: str, silent_for: int) -> None:
    made = make(form, ramp_time=RAMP)
    made.step(12)
    made.silent = "all"
    made.step(silent_for)
    count = len(made.sent)
    made.node.close()
    assert made.pairs(count) == [ZERO[form]] * LAST_COMMANDS


@pytest.mark.parametrize("form", FULL)
@pytest.mark.parametrize("ended_by", ["stop", "silence"])
def test_at_its_end_right_after_a_stop_or_the_first_zeros_it_leaves_all_of_them(make: Any, form: str, ended_by: str) -> None:
    made = make(form)
    made.step(12)
    if ended_by == "stop":
        made.call(made.node._latch._stop)
    else:
        made.silent = "all"
        while made.step()[-1:] != [ZERO[form]]:
            pass
    count = len(made.sent)
    made.node.close()
    assert made.pairs(count) == [ZERO[form]] * LAST_COMMANDS


def test_a_reversed_thruster_takes_the_mirrored_pulse_of_its_thrust_not_that_of_the_other_direction(make: Any) -> None:
    assert make("pwm", pwm__reversed=[1.0, -1.0]).step()[-1] == (1700, 1700)


def test_at_its_end_without_commands_nothing_is_sent(make: Any) -> None:
    made = make("helm")
    made.silent = "all"
    made.step(5)
    made.node.close()
    assert not made.sent


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_watchdog_has_a_limit_for_each_component_in_both_directions(
    bench: Any, monkeypatch: pytest.MonkeyPatch, sign: float
) -> None:
    made = SteppedNode(
        bench,
        monkeypatch,
        WatchdogNode,
        (drive, takeover, commands),
        surge_force_limit=200.0,
        yaw_moment_limit=3.0,
        ramp_time=0.0,
    )
    for force, moment, expected in ((150.0, 2.0, (150.0, 2.0)), (1e5, 1e5, (200.0, 3.0))):
        made.wait(PERIOD)
        made.node._on_command(made.wrench(sign * force, sign * moment))
        assert conv.read_wrench(made.sent[-1][1]) == (sign * expected[0], sign * expected[1])


def test_the_watchdog_ramps_down_and_up_from_where_it_is_however_often_commands_cease(
    bench: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = SteppedNode(bench, monkeypatch, WatchdogNode, (drive, takeover, commands), ramp_time=1.0, command_timeout=0.1)
    for k in range(200):
        made.wait(PERIOD)
        if k % 50 < 30:
            made.node._on_command(made.wrench(100.0, 0.0))
        made.node._on_timer()
    output = [(1e-9 * conv.nanoseconds(m.header.stamp), conv.read_wrench(m)[0]) for _, m in made.sent]
    assert all(abs(b - a) <= 100.001 * (after - before) + 1e-6 for (before, a), (after, b) in itertools.pairwise(output))
    forces = [force for _, force in output]
    lowest = [force for before, force, after in zip(forces, forces[1:], forces[2:], strict=False) if before > force < after]
    assert len(lowest) == 3
    assert min(lowest) > 20.0, "it turns round before zero"


@pytest.mark.parametrize("kind", ["drive", "watchdog", "allocation"])
def test_of_two_publishers_no_command_is_taken_not_even_the_first(bench: Any, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    modules = (drive, takeover, commands)
    made = {
        "drive": lambda: SteppedNode(bench, monkeypatch, DriveNode, modules, ramp_time=0.0, **GIVEN["normalised"]),
        "watchdog": lambda: SteppedNode(bench, monkeypatch, WatchdogNode, modules, ramp_time=0.0),
        "allocation": lambda: SteppedNode(bench, monkeypatch, ThrusterAllocationNode, modules, **layout("twin")),
    }[kind]()
    shared = ["/cmd_wrench has 2 publishers."]
    monkeypatch.setattr(made.node._input._publishers, "conflict", lambda: shared[0])
    for taken in (0, 1, 1, 2):
        made.wait(PERIOD)
        count = len(made.sent)
        (made.node._input.take if kind == "drive" else made.node._on_command)(made.wrench(50.0, 0.0))
        if kind == "drive":
            made.node._on_timer()
        values = [m.data if kind == "allocation" and isinstance(m, Float64) else m for _, m in made.sent[count:]]
        driven = [v for v in values if (conv.read_wrench(v)[0] if hasattr(v, "wrench") else v)]
        assert bool(driven) is not bool(shared[0])
        assert made.node._input.values()["taken"] == taken
        shared[0] = "" if shared[0] else "/cmd_wrench has 2 publishers."


def test_after_each_stop_of_the_watchdog_the_output_begins_at_zero(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    made = SteppedNode(bench, monkeypatch, WatchdogNode, (drive, takeover, commands), ramp_time=1.0)

    def run(steps: int) -> list[float]:
        count = len(made.sent)
        for _ in range(steps):
            made.wait(PERIOD)
            made.node._on_command(made.wrench(100.0, 0.0))
            made.node._on_timer()
        return [conv.read_wrench(message)[0] for _, message in made.sent[count:]]

    run(60)
    for _ in range(2):
        count = len(made.sent)
        assert made.node._latch._stop(Trigger.Request(), Trigger.Response()).success
        assert [conv.read_wrench(m) for _, m in made.sent[count:]] == [(0.0, 0.0)]
        assert set(run(10)) == {0.0}
        assert made.node._latch._rearm(Trigger.Request(), Trigger.Response()).success
        assert run(60) == pytest.approx([min(100.0, 2.0 * (k + 1)) for k in range(60)])


@pytest.mark.parametrize("shared", ["left", "right"])
def test_a_second_publisher_of_any_thruster_ends_all_pulses_each_time(
    bench: Any, monkeypatch: pytest.MonkeyPatch, shared: str
) -> None:
    made, topics = Drive(bench, monkeypatch, "pwm"), [""]

    def conflict(*given: str) -> str:
        return next((f"{topic} has two publishers" for topic in given if topic in topics), "")

    monkeypatch.setattr(made.node.connections, "shared", conflict)
    for _ in range(2):
        assert made.step(2)[-1] == FULL["pwm"]
        topics[0] = f"thrusters/{shared}/thrust"
        assert made.step(2)[-1] == ZERO["pwm"]
        topics[0] = ""
