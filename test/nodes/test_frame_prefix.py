"""The frames of a fleet's vessel: every message of every node that has a frame names one of its own."""

from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import TwistStamped, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu, NavSatFix
from std_msgs.msg import Float64
from stepped_node import SteppedNode
from thruster_layouts import layout
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.boats import drive, takeover
from vessel_hsmc_ros.boats.drive import DriveNode, WatchdogNode
from vessel_hsmc_ros.boats.navsat_odom import NavsatOdometryNode
from vessel_hsmc_ros.control.interface.law import Terms
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import commands
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_hsmc_ros.nodes.thruster_allocation import ThrusterAllocationNode
from vessel_sim_node import drives
from vessel_sim_node import node as sim_node
from vessel_sim_node.node import VesselSimNode

PREFIX = "alpha/"


class Vessel(SteppedNode):
    """A node of a vessel of a fleet, whose commands are in its frame."""

    def __init__(self, bench: Any, monkeypatch: pytest.MonkeyPatch, kind: Any, **more: Any) -> None:
        modules = (drive, takeover, commands, sim_node, drives)
        super().__init__(bench, monkeypatch, kind, modules, frame_prefix=PREFIX, **more)

    def command(self) -> Any:
        message = self.wrench(10.0, 1.0)
        message.header.frame_id = f"{PREFIX}base_link"
        return message

    def frames(self) -> dict[str, set[str]]:
        """The frames of what it has published, by topic."""
        found: dict[str, set[str]] = {}
        for topic, message in self.sent:
            if hasattr(message, "header"):
                names = {message.header.frame_id, getattr(message, "child_frame_id", message.header.frame_id)}
                found.setdefault(topic, set()).update(names)
        return found


ODOMETRY, BODY = {f"{PREFIX}odom", f"{PREFIX}base_link"}, {f"{PREFIX}base_link"}


@pytest.mark.parametrize(
    ("given", "topic"),
    [
        ({"form": "normalised"}, "normalised_wrench"),
        ({"form": "cmd_vel", "stamped": True}, "cmd_vel"),
    ],
)
def test_of_a_drive(bench: Any, monkeypatch: pytest.MonkeyPatch, given: dict[str, Any], topic: str) -> None:
    made = Vessel(bench, monkeypatch, DriveNode, **given)
    for _ in range(3):
        made.wait(0.02)
        made.node._input.take(made.command())
        made.node._on_state(made.stamped(ControlState(operation=ControlState.ACTIVE)))
        made.node._on_timer()
    made.node._send_zero()
    assert made.frames() == {topic: BODY}


def test_of_a_watchdog_and_an_allocation(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    for kind, more, topic in (
        (WatchdogNode, {}, "watched_wrench"),
        (ThrusterAllocationNode, layout("twin"), "allocated_wrench"),
    ):
        made = Vessel(bench, monkeypatch, kind, **more)
        made.wait(0.02)
        made.node._on_command(made.command())
        made.node.close()
        assert made.frames() == {topic: BODY}


@pytest.mark.parametrize("frame", ["odom", "map"])
def test_of_odometry_from_satellites(bench: Any, monkeypatch: pytest.MonkeyPatch, frame: str) -> None:
    made = Vessel(bench, monkeypatch, NavsatOdometryNode, frame=frame, velocity="twist")
    for _ in range(2):
        made.node._on_velocity(made.stamped(TwistStamped()))
        imu, fix = made.stamped(Imu()), made.stamped(NavSatFix(latitude=60.0, longitude=10.0))
        imu.orientation.w, fix.status.status = 1.0, 0
        made.node._on_imu(imu)
        made.node._on_fix(fix)
    assert made.frames() == {"odom": {f"{PREFIX}{frame}", f"{PREFIX}base_link"}}


@pytest.mark.parametrize("by_thrusters", [False, True])
def test_of_a_plant_with_its_ground_truth(bench: Any, monkeypatch: pytest.MonkeyPatch, by_thrusters: bool) -> None:
    more = {"actuators__kind": "thrusters", **layout("twin")} if by_thrusters else {}
    made = Vessel(bench, monkeypatch, VesselSimNode, sensors__position_noise=0.1, rate_hz=20.0, **more)
    made.node.on_connected()
    for _ in range(2):
        made.wait(0.05)
        if by_thrusters:
            made.node._drive._on_demand("thrusters/left/thrust", Float64(data=1.0))
        else:
            made.node._drive._on_command(made.command())
        made.node._on_timer()
    truth = {"odom/truth": ODOMETRY, "disturbance": BODY, "dynamics/truth": BODY}
    assert made.frames() == {"odom": ODOMETRY, "applied_wrench": BODY, **truth}


def test_of_a_reference_also_after_a_goal_and_a_reset(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    made = Vessel(bench, monkeypatch, ReferenceShipNode, mode="goal", frames=["map", "odom"])
    for frame in ("map", "odom", "map"):
        if frame == "odom":
            goal = made.stamped(conv.new_pose())
            goal.header.frame_id, goal.pose.position.x, goal.pose.orientation.w = f"{PREFIX}odom", 50.0, 1.0
            made.node._on_goal(goal)
        elif made.sent:
            made.node._reset()
        made.sent.clear()
        made.node._publish()
        assert made.frames() == {topic: {f"{PREFIX}{frame}"} for topic in ("reference", "reference/pose")}


def test_of_a_controller_with_an_observer(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    made = Vessel(bench, monkeypatch, ControllerNode, observer__enabled=True, law="guided")
    command = deserialize_message(made.node._command(0, (0.0, 0.0)), WrenchStamped)
    state = deserialize_message(made.node._state(0, Terms(), 1, 0, 0.0, 0), ControlState)
    estimate = deserialize_message(made.node._estimate(0, np.zeros(6)), Odometry)
    frames = [message.header.frame_id for message in (command, state, estimate)]
    assert frames == [f"{PREFIX}{name}" for name in ("base_link", "base_link", "odom")]
    assert estimate.child_frame_id == f"{PREFIX}base_link"
