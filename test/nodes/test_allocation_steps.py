"""The thrust allocation step by step: what it leaves to each thruster after a time-out, at its end, and the second time."""

import math
from typing import Any

import numpy as np
import pytest
from std_msgs.msg import Float64
from stepped_node import SteppedNode
from thruster_layouts import layout

from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import commands
from vessel_hsmc_ros.nodes.base import LAST_COMMANDS
from vessel_hsmc_ros.nodes.thruster_allocation import ThrusterAllocationNode

TIMEOUT = 0.3
COEFFICIENTS = {f"vessel__thrusters__thrust_coefficient_{way}": [0.01] for way in ("ahead", "astern")}
PARTS = {"twin": ("left", "right"), "rudder_and_bow_thruster": ("screw", "bow"), "outboards": ("left", "right")}


class Allocation(SteppedNode):
    """An allocation with shaft speeds for each of its thrusters."""

    def __init__(self, bench: Any, monkeypatch: pytest.MonkeyPatch, name: str, **more: Any) -> None:
        given = {"command_timeout": TIMEOUT, **layout(name), **COEFFICIENTS, **more}
        super().__init__(bench, monkeypatch, ThrusterAllocationNode, (commands,), **given)
        self.names = PARTS.get(name, ())

    def drive(self, force: float = 30.0, moment: float = 5.0) -> dict[str, float]:
        """Command a wrench; returns what is sent to the thrusters by topic."""
        self.wait(0.1)
        return self.sent_by(lambda: self.node._on_command(self.wrench(force, moment)))

    def sent_by(self, act: Any) -> dict[str, float]:
        """The last number of each topic that an action sends."""
        count = len(self.sent)
        act()
        return {topic: message.data for topic, message in self.sent[count:] if isinstance(message, Float64)}

    @property
    def at_rest(self) -> dict[str, float]:
        """The demands of thrusters without thrust; angles hold."""
        return {f"thrusters/{name}/{what}": 0.0 for name in self.names for what in ("thrust", "shaft_speed")}


@pytest.fixture
def make(bench: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    return lambda name, **more: Allocation(bench, monkeypatch, name, **more)


@pytest.mark.parametrize("name", PARTS)
def test_each_time_out_ends_every_thrust_and_every_shaft_speed_and_no_angle(make: Any, name: str) -> None:
    made = make(name)
    for _ in range(3):
        driven = made.drive()
        assert all(driven[topic] for topic in made.at_rest if "bow" not in topic), "it turns"
        made.wait(TIMEOUT - 0.02)
        assert made.sent_by(made.node._check_age) == {}, "a command holds for the time-out"
        made.wait(0.05)
        assert made.sent_by(made.node._check_age) == made.at_rest
        assert made.sent_by(made.node._check_age) == {}, "once: then the topics are left to others"


def test_each_change_of_the_time_out_holds_from_the_next_period_on(make: Any) -> None:
    made = make("twin")
    for timeout in (0.8, 0.15, 0.5):
        made.change(command_timeout=timeout)
        made.drive()
        made.wait(timeout - 0.02)
        assert made.sent_by(made.node._check_age) == {}
        made.wait(0.04)
        assert made.sent_by(made.node._check_age) == made.at_rest


@pytest.mark.parametrize("heading", [0.5 * math.pi, math.pi, 0.0])
def test_a_rudder_is_turned_for_the_surge_velocity_in_whichever_frame_the_odometry_gives_it(make: Any, heading: float) -> None:
    angles = []
    for frame in ("child", "parent"):
        made = make("rudder", odometry__twist_frame=frame)
        message = conv.new_odometry()
        conv.write_odometry(message, conv.time_message(made.time.monotonic_ns()), np.array([0.0, 0.0, heading, 2.0, 0.0, 0.0]))
        if frame == "parent":
            twist = message.twist.twist.linear
            twist.x, twist.y = 2.0 * math.cos(heading), 2.0 * math.sin(heading)
        made.node._on_odometry(message)
        angles.append({topic: value for topic, value in made.drive(0.0).items() if topic.endswith("angle")})
    assert any(angles[0].values())
    assert angles[1] == pytest.approx(angles[0])


@pytest.mark.parametrize("name", PARTS)
def test_at_its_end_it_leaves_no_thrust_and_no_shaft_speed(make: Any, name: str) -> None:
    made = make(name)
    made.drive(-30.0)
    count = len(made.sent)
    assert made.sent_by(made.node.close) == made.at_rest
    topics = [topic for topic, _ in made.sent[count:]]
    assert all(topics.count(topic) == LAST_COMMANDS for topic in made.at_rest)


def test_at_its_end_without_a_command_or_after_its_time_out_nothing_is_sent(make: Any) -> None:
    for commanded in (False, True):
        made = make("twin")
        if commanded:
            made.drive()
            made.wait(2.0 * TIMEOUT)
            made.node._check_age()
        assert made.sent_by(made.node.close) == {}


def test_at_its_end_in_lockstep_nothing_is_sent_as_the_plant_counts_the_demands(
    bench: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = Allocation(bench, monkeypatch, "twin", lockstep=True)
    made.node._on_command(made.wrench(30.0, 5.0))
    assert made.sent_by(made.node.close) == {}
