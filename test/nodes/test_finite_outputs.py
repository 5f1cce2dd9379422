"""Nodes that pass commands on send finite numbers only, whatever they have taken, and report what they had to leave out."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from durations import rest_long
from geometry_msgs.msg import TwistStamped
from std_msgs.msg import Float64
from stepped_node import SteppedNode
from thruster_layouts import LAYOUTS, layout
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.boats import drive, takeover
from vessel_hsmc_ros.boats.drive import DriveNode, WatchdogNode
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import commands, reporting
from vessel_hsmc_ros.nodes.base import ERROR
from vessel_hsmc_ros.nodes.commands import finite
from vessel_hsmc_ros.nodes.thruster_allocation import ThrusterAllocationNode

NAN, INF = math.nan, math.inf
NUMBERS = (0.0, 1.0, -3.0, 1e12, 1e38, -1e39, 1e154, -1e200, 1.7e308, NAN, INF, -INF)
"""From zero to the ends of what a message can have."""

STATE = ("commanded_surge_velocity", "commanded_yaw_rate", "surge_surface", "yaw_surface")
PERIOD = 0.02


def numbers_of(message: Any) -> list[float]:
    """All floating-point numbers of a message that a consumer reads."""
    if hasattr(message, "wrench"):
        return [message.wrench.force.x, message.wrench.force.y, message.wrench.torque.z]
    if hasattr(message, "twist"):
        return [message.twist.linear.x, message.twist.angular.z]
    return [float(message.data)]


def assert_finite(made: SteppedNode) -> None:
    assert made.sent
    for topic, message in made.sent:
        assert all(map(math.isfinite, numbers_of(message))), f"{topic}: {numbers_of(message)}"


class Drive(SteppedNode):
    """A drive node for cmd_vel, whose commands and states the test draws."""

    def __init__(self, bench: Any, monkeypatch: pytest.MonkeyPatch, **more: Any) -> None:
        given = {"form": "cmd_vel", "ramp_time": 0.1, "command_timeout": 0.3, "surge_speed_limit": 3.0, "yaw_rate_limit": 0.5}
        modules = (drive, takeover, commands, reporting)
        super().__init__(bench, monkeypatch, DriveNode, modules, **{**given, **more})

    def step(self, *state: float, steps: int = 1, command: tuple[float, float] = (10.0, 1.0)) -> None:
        """Some periods with a state of the law, by the fields of STATE, and a commanded wrench."""
        for _ in range(steps):
            self.wait(PERIOD)
            self.node._input.take(self.wrench(*command))
            self.node._on_state(self.stamped(ControlState(operation=ControlState.ACTIVE, **dict(zip(STATE, state, strict=True)))))
            self.node._on_timer()


def test_a_law_without_surfaces_cannot_drive_loops_with_a_response_time_and_the_reason_is_reported(
    bench: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = Drive(bench, monkeypatch, response_time=0.5)
    made.step(1.5, -0.2, NAN, NAN, steps=10)
    made.step(1.5, -0.2, 0.0, 0.0, steps=10)
    made.step(1.5, -0.2, NAN, NAN, steps=3)
    assert_finite(made)
    speeds = [numbers_of(message)[0] for _, message in made.sent]
    assert max(speeds) == 3.0
    assert 0.0 < speeds[-1] < 3.0, "it ramps down from the last command that counts"
    level, text, _ = made.node.status()
    assert level == ERROR
    assert "with their surfaces, which response_time > 0 needs" in text


@pytest.mark.parametrize("response_time", rest_long([0.5, 0.0, 60.0]))
def test_whatever_the_law_reports_cmd_vel_is_finite_and_within_its_limits(
    bench: Any, monkeypatch: pytest.MonkeyPatch, response_time: float
) -> None:
    made = Drive(bench, monkeypatch, response_time=response_time, surge_inertia=1e-3)
    rng = np.random.default_rng(1)
    for _ in range(400):
        state = rng.choice(NUMBERS, 4).tolist() if rng.random() < 0.7 else (1.5, -0.2, 0.0, 0.0)
        made.step(*state, command=(float(rng.choice(NUMBERS)), 1.0))
    assert_finite(made)
    assert all(abs(numbers_of(m)[0]) <= 3.0 and abs(numbers_of(m)[1]) <= 0.5 for _, m in made.sent)


@pytest.mark.parametrize("form", ["normalised", "helm"])
def test_whatever_is_commanded_shares_are_finite(bench: Any, monkeypatch: pytest.MonkeyPatch, form: str) -> None:
    made = Drive(bench, monkeypatch, form=form, surge_force_limit=1e-6, yaw_moment_limit=1e-6)
    for command in itertools.product(NUMBERS, NUMBERS):
        made.step(0.0, 0.0, 0.0, 0.0, command=command)
    assert_finite(made)


def test_whatever_is_commanded_the_watched_wrench_is_finite(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    made = SteppedNode(bench, monkeypatch, WatchdogNode, (drive, takeover, commands, reporting), ramp_time=0.1)
    for command in itertools.product(NUMBERS, NUMBERS):
        made.wait(PERIOD)
        made.node._on_command(made.wrench(*command))
        made.node._on_timer()
    assert_finite(made)


@pytest.mark.parametrize("name", rest_long(LAYOUTS, 3))
def test_whatever_is_commanded_at_whatever_speed_all_demands_are_finite(
    bench: Any, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    modules = (commands, reporting)
    made = SteppedNode(bench, monkeypatch, ThrusterAllocationNode, modules, command_timeout=0.3, **layout(name))
    rng, message = np.random.default_rng(2), conv.new_odometry()
    speeds = NUMBERS if made.node._needs_speed else (0.0,)
    with np.errstate(all="ignore"):
        for force, moment, speed in rng.permutation(list(itertools.product(NUMBERS, NUMBERS, speeds)))[:300].tolist():
            made.wait(PERIOD)
            message.twist.twist.linear.x = speed
            if made.node._needs_speed:
                made.node._on_odometry(message)
            made.node._on_command(made.wrench(force, moment))
        assert_finite(made)
        if made.node._needs_speed:
            message.twist.twist.linear.x = 1e200
            made.node._on_odometry(message)
            made.wait(PERIOD)
            made.node._on_command(made.wrench(1.0, 1.0))
            assert made.node.status()[0] == ERROR
            assert "at 1e+200 m/s" in made.node.status()[1]
        message.twist.twist.linear.x = 1.0
        if made.node._needs_speed:
            made.node._on_odometry(message)
        made.wait(2.0)
        made.node._on_command(made.wrench(0.5, 0.0))
        demands = [m.data for topic, m in made.sent if topic.endswith("thrust")]
        assert any(demands[-len(made.node._demands_out) :]), "it goes on with commands that can be given"


@pytest.mark.parametrize("form", ["manual", "channels", "guided"])
def test_whatever_is_commanded_an_autopilot_can_take_it(bench: Any, monkeypatch: pytest.MonkeyPatch, form: str) -> None:
    pytest.importorskip("pymavlink", exc_type=ImportError)
    from recorded_link import Recording

    from vessel_hsmc_ros.boats import mavlink, mavlink_link

    monkeypatch.setattr(mavlink, "Link", Recording)
    modules = (mavlink, mavlink_link, commands, takeover, reporting)
    thrusters = {"channels": [2.0, 4.0], **layout("twin")} if form == "channels" else {}
    made = SteppedNode(bench, monkeypatch, mavlink.MavlinkNode, modules, form=form, **thrusters)
    given, sent = made.node._commands, []
    monkeypatch.setattr(given._link, "velocity", lambda *pair: sent.append(np.float32(pair)), raising=False)
    for a, b in itertools.product(NUMBERS, NUMBERS):
        made.wait(PERIOD)
        if form == "manual":
            given.input.take(made.wrench(a, b))
        elif form == "guided":
            twist = TwistStamped()
            twist.twist.linear.x, twist.twist.angular.z = a, b
            given.input.take("cmd_vel", twist)
        else:
            for topic, thrust in zip(given.input._latest, (a, b), strict=True):
                given.input.take(topic, Float64(data=thrust))
        with np.errstate(over="ignore"):
            given.send(given.present() or given.nothing)
    assert all(np.isfinite(pair).all() for pair in sent)
    assert len(sent) == (len(NUMBERS) ** 2 if form == "guided" else 0)


@pytest.mark.parametrize("command", [(NAN, 1.0), (1.0, INF), (-INF, NAN), (1e39, 0.0)])
def test_zero_takes_the_place_of_a_command_that_is_not_finite_and_its_numbers_are_reported(command: tuple[float, float]) -> None:
    reports: list[str] = []
    assert finite(command, reports.append) == (0.0, 0.0)
    assert f"(got {command[0]}, {command[1]})" in reports[0]
    assert finite((1.0, -2.0), reports.append) == (1.0, -2.0)
    assert len(reports) == 1
