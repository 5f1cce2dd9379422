"""A running connection as `vessel-hsmc check` sees it: real nodes and publishers, with mistakes planted into them."""

from contextlib import AbstractContextManager
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TwistStamped, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data
from serving import served
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.boats.drive import DriveNode
from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.core.kinematics import as_motion
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.remote import Remote
from vessel_hsmc_ros.preflight import live as connection_check
from vessel_hsmc_ros.preflight.connection import WRONG
from vessel_hsmc_ros.preflight.live import LiveConnection
from vessel_hsmc_ros.preflight.rules import judge

PERIOD = 0.02


def serving(bench: Any) -> AbstractContextManager[None]:
    """Serve the nodes of the bench."""
    return served(lambda: bench.serve(wait=0.05))


@pytest.fixture(autouse=True)
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection_check, "PULSE", 0.3)
    monkeypatch.setattr(connection_check, "PAUSE", 0.3)


def publish_odometry(bench: Any, topic: str = "odom", frame: str = "odom", late: float = 0.0) -> None:
    """Publish odometry of a boat at rest, best effort, 50 times a second."""
    publisher = bench.probe.create_publisher(Odometry, topic, qos_profile_sensor_data)

    def publish() -> None:
        message = conv.new_odometry()
        stamp = bench.probe.get_clock().now().nanoseconds - round(late * 1e9)
        conv.write_odometry(message, conv.time_message(stamp), as_motion([0.0] * 6))
        message.header.frame_id = frame
        publisher.publish(message)

    bench.probe.create_timer(PERIOD, publish)


def mistakes(bench: Any, seconds: float = 1.0) -> str:
    with serving(bench), Remote() as remote:
        live = LiveConnection(remote)
        live.listen(seconds)
        return "\n".join(f"{about}: {text}" for level, about, text in judge(live.connection()) if level == WRONG)


def test_other_names_and_types_are_named_with_the_remapping(bench: Any) -> None:
    publish_odometry(bench, "boat/odometry")
    bench.start(ControllerNode, lockstep=False, law="guided")
    with Remote() as other:  # a participant of its own: one alone refuses two types of a topic
        driver = rclpy.create_node("driver", context=other._context)
        driver.create_subscription(TwistStamped, "cmd_wrench", print, 10)
        found = mistakes(bench)
        driver.destroy_node()
    assert "odometry: no node publishes /odom (nav_msgs/msg/Odometry): start with -r odom:=/boat/odometry" in found
    assert "command: /cmd_wrench is geometry_msgs/msg/TwistStamped at driver, and geometry_msgs/msg/WrenchStamped here" in found
    assert "reference: no node publishes /reference" in found


def test_a_quality_of_service_that_is_not_compatible_is_named(bench: Any) -> None:
    publish_odometry(bench)
    bench.start(ControllerNode, lockstep=False, law="guided", **{"qos_overrides./odom.subscription.reliability": "reliable"})
    assert "/odom: the reliability of probe and of controller is not compatible" in mistakes(bench)


def test_frames_stamps_and_a_second_publisher_of_a_remapped_topic_are_named(bench: Any) -> None:
    publish_odometry(bench, "pose_of_boat", "world", 30.0)
    for _ in range(2):
        bench.probe.create_publisher(WrenchStamped, "cmd_wrench", 10)
    parameters = [Parameter("law", value="guided"), Parameter("black_box.duration", value=0.0)]
    node = ControllerNode(
        context=bench.context, parameter_overrides=parameters, cli_args=["--ros-args", "-r", "odom:=pose_of_boat"]
    )
    bench.nodes.append(node)
    bench.executor.add_node(node)
    found = mistakes(bench)
    assert "/pose_of_boat is in 'world', and 'odom' or 'map' is accepted" in found
    assert "stamps of /pose_of_boat are 30" in found
    assert "3 publishers" in found


def test_a_pulse_reaches_the_drive_and_its_time_out_is_seen(bench: Any) -> None:
    publish_odometry(bench)
    limits = {"surge_force_limit": 100.0, "yaw_moment_limit": 50.0, "ramp_time": 0.1, "command_timeout": 0.3}
    bench.start(DriveNode, lockstep=False, form="normalised", **limits)
    with serving(bench), Remote() as remote:
        live = LiveConnection(remote)
        live.pulse(10.0, 5.0)
        live.listen(0.5)
        connection = live.connection()
    output = connection.of("output")
    assert output is not None
    assert max(output.columns["force"]) == pytest.approx(0.1)
    assert max(output.columns["moment"]) == pytest.approx(0.1)
    force, moment = output.columns["force"], output.columns["moment"]
    first = int(np.flatnonzero(moment)[0])
    assert not force[first:].any(), "the force has ended before the moment begins"
    assert int(np.flatnonzero(force)[-1]) < first - 1, "and nothing is commanded in between"
    assert ("time-out", "ok") in {(f.about, f.level) for f in judge(connection)}


def test_no_pulse_beside_another_publisher(bench: Any) -> None:
    bench.start(ControllerNode, lockstep=False, law="guided")
    with (
        serving(bench),
        Remote() as remote,
        pytest.raises(RunError, match="while controller publishes /cmd_wrench: end it"),
    ):
        LiveConnection(remote).pulse(10.0, 5.0)


def test_a_pulse_of_velocities_reaches_the_loops_of_a_stack_and_ends_with_zero(bench: Any) -> None:
    publish_odometry(bench)
    bench.start(DriveNode, lockstep=False, form="cmd_vel", surge_speed_limit=1.0, yaw_rate_limit=0.5)
    sent: list[tuple[float, float]] = []
    bench.probe.create_subscription(TwistStamped, "cmd_vel", lambda m: sent.append((m.twist.linear.x, m.twist.angular.z)), 10)
    with serving(bench), Remote() as remote:
        live = LiveConnection(remote)
        assert live.units == ("m/s", "rad/s")
        for above in ((1.5, 0.2), (0.5, -0.6)):
            with pytest.raises(RunError, match="must be at most drive"):
                live.pulse(*above)
        assert not any(map(any, sent))
        live.pulse(0.5, 0.2)
        live.listen(0.3)
    assert {command for command in sent if any(command)} == {(0.5, 0.0), (0.0, 0.2)}
    assert sent[-1] == (0.0, 0.0)


def test_no_pulse_of_velocities_beside_a_controller(bench: Any) -> None:
    bench.start(DriveNode, lockstep=False, form="cmd_vel")
    bench.start(ControllerNode, lockstep=False, law="guided")
    with (
        serving(bench),
        Remote() as remote,
        pytest.raises(RunError, match="while controller publishes /cmd_wrench: end it"),
    ):
        LiveConnection(remote).pulse(0.1, 0.1)


@pytest.mark.parametrize(
    ("operation", "named"), [(ControlState.STANDBY, False), (ControlState.ACTIVE, True), (ControlState.SAFE, True)]
)
def test_a_drive_that_waits_for_a_controller_in_standby_is_nothing_to_do(operation: int, named: bool) -> None:
    made = LiveConnection.__new__(LiveConnection)
    made._remote = SimpleNamespace(name=lambda relative: f"/{relative}")  # type: ignore[assignment] # stands for it
    made._received = {"/controller/state": [(0.0, ControlState(operation=operation))]}
    made._statuses = {"drive": (b"\1", "command: no recent command on /cmd_wrench"), "navsat_odom": (b"\1", "no fix")}
    assert ("drive" in made._problems()) is named
    assert "navsat_odom" in made._problems()


@pytest.mark.parametrize("namespace", ["", "alpha"])
def test_warnings_and_errors_are_those_of_the_nodes_of_the_vessel_itself(namespace: str) -> None:
    own = f"{namespace}/" if namespace else ""
    made = LiveConnection.__new__(LiveConnection)
    made._remote = SimpleNamespace(name=lambda relative: f"/{own}{relative}")  # type: ignore[assignment] # stands for it
    made._statuses = {}
    names = [f"{own}controller", f"{own}drive", "beta/controller", f"{own}controller: guard", f"{own}some_node"]
    for level in (b"\2", b"\1"):
        made._on_diagnostics(DiagnosticArray(status=[DiagnosticStatus(name=n, level=level, message=n) for n in names]))
        assert made._statuses == {"controller": (level, f"{own}controller"), "drive": (level, f"{own}drive")}
