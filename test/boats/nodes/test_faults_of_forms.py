"""Faults of every form of state and of command, one after the other: each ends the commands, and what is good again goes on."""

import math
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest
from driving import RealTimePlant
from durations import rest_long
from geometry_msgs.msg import PoseStamped, TwistStamped, WrenchStamped
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import Imu, NavSatFix
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.boats.drive import DriveNode
from vessel_hsmc_ros.boats.navsat_odom import NavsatOdometryNode
from vessel_hsmc_ros.control.safety.parameters import Reason
from vessel_hsmc_ros.core.kinematics import Plane
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes.controller import ControllerNode

DATUM = (59.9, 10.7)
TIMEOUT = 0.1
LATE, AHEAD = -1_000_000_000, 30_000_000_000


class Sensors(RealTimePlant):
    """Publishes two messages in place of odometry. A fault changes one of them, or returns None where it is not sent.

    Attributes:
        fault: Takes the name of a topic and its message, and returns what is sent.
    """

    KINDS: ClassVar[dict[str, Any]]

    def __init__(self, bench: Any, time: Any) -> None:
        super().__init__(bench, time)
        bench.probe.destroy_publisher(self.odometry)
        self.outputs = {
            name: bench.probe.create_publisher(kind, name, qos_profile_sensor_data) for name, kind in self.KINDS.items()
        }
        self.odometry = next(iter(self.outputs.values()))
        self.fault: Callable[[str, Any], Any] = lambda _, message: message

    def send_odometry(self, stamp: int, state: Any = None) -> None:
        for name, message in self.messages(np.asarray(state)).items():
            message.header.stamp = conv.time_message(stamp)
            if (sent := self.fault(name, message)) is not None:
                self.outputs[name].publish(sent)

    def messages(self, state: Any) -> dict[str, Any]:
        raise NotImplementedError


class PoseAndTwist(Sensors):
    KINDS: ClassVar = {"twist": TwistStamped, "pose": PoseStamped}

    def messages(self, state: Any) -> dict[str, Any]:
        pose, twist = PoseStamped(), TwistStamped()
        pose.header.frame_id, twist.header.frame_id = "odom", "base_link"
        conv.write_pose(pose.pose, state)
        twist.twist.linear.x, twist.twist.linear.y, twist.twist.angular.z = map(float, state[3:])
        return {"twist": twist, "pose": pose}


class Receiver(Sensors):
    KINDS: ClassVar = {"imu": Imu, "fix": NavSatFix}

    def messages(self, state: Any) -> dict[str, Any]:
        fix, imu = NavSatFix(), Imu()
        fix.latitude, fix.longitude = Plane(*DATUM).coordinates(float(state[0]), float(state[1]))
        fix.status.status = 0
        imu.orientation.z, imu.orientation.w = math.sin(0.5 * state[2]), math.cos(0.5 * state[2])
        return {"imu": imu, "fix": fix}


def lost(topic: str) -> Any:
    return lambda name, message: None if name == topic else message


def shifted(offset: int) -> Any:
    def shift(_: str, message: Any) -> Any:
        message.header.stamp = conv.time_message(max(0, conv.nanoseconds(message.header.stamp) + offset))
        return message

    return shift


def changed(topic: str, path: str, value: Any) -> Any:
    def change(name: str, message: Any) -> Any:
        if name == topic:
            *groups, field = path.split(".")
            holder = message
            for group in groups:
                holder = getattr(holder, group)
            setattr(holder, field, value)
        return message

    return change


EITHER = {"old stamps": (shifted(LATE), "STAMP_OLD"), "stamps ahead": (shifted(AHEAD), "STAMP_FUTURE")}
FAULTS: dict[type, dict[str, tuple[Any, str]]] = {
    PoseAndTwist: {
        "no pose": (lost("pose"), "OVERDUE"),
        "no twist": (lost("twist"), "OVERDUE"),
        "pose NaN": (changed("pose", "pose.position.x", math.nan), "NOT_FINITE"),
        "twist NaN": (changed("twist", "twist.angular.z", math.nan), "NOT_FINITE"),
        "another frame": (changed("pose", "header.frame_id", "base_link"), "WRONG_FRAME"),
        **EITHER,
    },
    Receiver: {
        "no fix": (lost("fix"), "OVERDUE"),
        "no heading": (lost("imu"), "OVERDUE"),
        "status": (changed("fix", "status.status", -1), "OVERDUE"),
        "fix NaN": (changed("fix", "latitude", math.nan), "OVERDUE"),
        "heading NaN": (changed("imu", "orientation.z", math.nan), "OVERDUE"),
        **EITHER,
    },
}


@pytest.mark.parametrize("kind", rest_long(FAULTS), ids=lambda kind: kind.__name__)
def test_each_fault_of_a_state_leads_to_the_safe_action_and_back(bench: Any, simulated_time: Any, kind: Any) -> None:
    simulated_time.now = 5_000_000_000
    sea = kind(bench, simulated_time)
    settings = {"law": "guided", "input_timeout": TIMEOUT, "safety__action": "zero"}
    if kind is Receiver:
        bench.start(NavsatOdometryNode, lockstep=False, use_sim_time=True, datum=list(DATUM), timeout=TIMEOUT)
        settings |= {"observer__enabled": True}
    else:
        settings |= {"odometry__form": "pose_twist"}
    sea.start(ControllerNode, **settings)
    bench.until(lambda: all(output.get_subscription_count() for output in sea.outputs.values()))
    good, found = sea.fault, {}

    def operation() -> int:
        return int(sea.states[-1].operation) if sea.states else ControlState.STANDBY

    def run_until(wanted: int) -> None:
        for _ in range(40):
            sea.run(0.05)
            if operation() == wanted:
                return
        pytest.fail(f"operation {operation()}, not {wanted}, after {list(found)}")

    for name, (fault, _) in FAULTS[kind].items():
        sea.fault = good
        run_until(ControlState.ACTIVE)
        sea.fault = fault
        run_until(ControlState.SAFE)
        assert not any(sea.wrenches()[-1]), name
        found[name] = next(reason.name for reason in Reason if reason == sea.states[-1].reason)
    sea.fault = good
    run_until(ControlState.ACTIVE)
    assert found == {name: reason for name, (_, reason) in FAULTS[kind].items()}


FORMS = {"normalised": {"normalised_wrench": WrenchStamped}, "helm": {"throttle": Float64, "steering": Float64}}


def surge(message: Any) -> float:
    """The share of the force in a message."""
    return float(message.data if isinstance(message, Float64) else message.wrench.force.x)


@pytest.mark.parametrize("form", rest_long(FORMS))
def test_each_fault_of_a_command_ends_the_output_and_a_good_one_goes_on(bench: Any, form: str) -> None:
    limits = {"surge_force_limit": 200.0, "yaw_moment_limit": 50.0, "ramp_time": 0.05, "rate_hz": 100.0, "command_timeout": 0.2}
    first = next(iter(FORMS[form]))
    received = bench.collect(FORMS[form][first], first, qos_profile_sensor_data)
    commands = bench.publisher(WrenchStamped, "cmd_wrench", lockstep=False)
    node = bench.start(DriveNode, lockstep=False, form=form, **limits)
    bench.until(lambda: node.connected and commands.get_subscription_count())

    def send(force: float = 100.0, offset: int = 0, frame: str = conv.BODY) -> None:
        wrench = conv.new_wrench()
        conv.write_wrench(wrench, conv.time_message(bench.probe.get_clock().now().nanoseconds + offset), (force, 0.0))
        wrench.header.frame_id = frame
        commands.publish(wrench)

    def until(share: float, act: Callable[[], None]) -> None:
        def there() -> bool:
            act()
            return bool(received) and surge(received[-1]) == pytest.approx(share)

        bench.until(there, 20.0)

    faults: dict[str, Callable[[], None]] = {
        "none": lambda: None,
        "NaN": lambda: send(math.nan),
        "infinite": lambda: send(math.inf),
        "old stamp": lambda: send(offset=LATE),
        "stamp ahead": lambda: send(offset=AHEAD),
        "another frame": lambda: send(frame="odom"),
    }
    for fault in faults.values():
        until(0.5, send)
        until(0.0, fault)
    until(0.5, send)
    assert bench.call(Trigger, "/drive/stop", Trigger.Request()).success
    until(0.0, send)
    assert bench.call(Trigger, "/drive/rearm", Trigger.Request()).success
    until(0.5, send)
    second = bench.publisher(WrenchStamped, "cmd_wrench", lockstep=False)
    until(0.0, send)
    bench.probe.destroy_publisher(second)
    until(0.5, send)
    bench.stop(node)  # without its end, as if it were killed: the topic ends
    count = len(received)
    bench.spin(0.1)
    assert len(received) <= count + 1


def test_a_reader_of_the_drives_that_cannot_be_connected_is_named(bench: Any) -> None:
    node = bench.start(DriveNode, lockstep=False)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    bench.probe.create_subscription(WrenchStamped, "normalised_wrench", print, latched)
    text = bench.until(node.compatibility.problem)
    assert text.startswith("/normalised_wrench: nothing passes between this publisher and the subscription of probe")
