"""Mutated serialised messages at the inputs of the nodes, which run as processes, among valid messages."""

import math
import os
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, WrenchStamped
from harness import Command, executable
from mutation import mutated
from nav_msgs.msg import Odometry
from nav_msgs.msg import Path as PathMessage
from rclpy.executors import SingleThreadedExecutor
from rclpy.serialization import serialize_message
from std_msgs.msg import Float64
from vessel_hsmc_msgs.msg import ReferenceState

from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos

LIMITS = (1e5, 1e6)
"""Limits of force, N, and moment, N·m, of every node under test."""

MEMORY = 1 << 30
"""Bytes of memory that a node may have in use."""

THRUSTERS = ["thrusters.names:=['left','right']", "thrusters.kinds:=['fixed']", "thrusters.x:=[-15.0]", "thrusters.y:=[2.5,-2.5]"]
THRUST = 1e5


def _odometry(stamp: int) -> Any:
    message = Odometry(child_frame_id="base_link")
    message.header.frame_id = "odom"
    message.header.stamp = conv.time_message(stamp)
    message.pose.pose.orientation.w = 1.0
    return message


def _reference(stamp: int) -> Any:
    message = conv.new_reference()
    message.header.stamp = conv.time_message(stamp)
    return message


def _wrench(stamp: int) -> Any:
    message = conv.new_wrench()
    conv.write_wrench(message, conv.time_message(stamp), (1e3, 1e4))
    return message


def _pose(stamp: int) -> Any:
    message = PoseStamped()
    message.header.frame_id, message.header.stamp = "odom", conv.time_message(stamp)
    message.pose.position.x, message.pose.orientation.w = 30.0, 1.0
    return message


def _path(stamp: int) -> Any:
    message = PathMessage(poses=[_pose(stamp), _pose(stamp), _pose(stamp)])
    message.header = message.poses[0].header
    message.poses[1].pose.position.y = 40.0
    message.poses[2].pose.position.x = -20.0
    return message


def _wrench_values(message: Any) -> tuple[float, ...]:
    return tuple(value / limit for value, limit in zip(conv.read_wrench(message), LIMITS, strict=True))


def _reference_values(message: Any) -> tuple[float, ...]:
    place, twist = message.pose.position, message.twist
    return tuple(1e-6 * number for number in (place.x, place.y, twist.linear.x, twist.angular.z))


class Target(NamedTuple):
    """A node with its inputs, and an output whose values must be finite and at most 1 in magnitude."""

    executable: str
    settings: tuple[str, ...]
    inputs: Mapping[str, tuple[Any, Callable[[int], Any]]]
    output: str
    kind: Any
    values: Callable[[Any], tuple[float, ...]]


HULL = ("length:=4.0", "surge_inertia:=550.0", "sway_inertia:=700.0", "yaw_inertia:=700.0")
WRENCH = {"cmd_wrench": (WrenchStamped, _wrench)}
BOUNDS = (f"surge_force_limit:={LIMITS[0]}", f"yaw_moment_limit:={LIMITS[1]}")
TARGETS = {
    "controller": Target(
        "controller_node",
        (
            "law:=guided",
            "rate_hz:=50.0",
            "black_box.duration:=0.0",
            "start_enabled:=true",
            *(f"vessel.{datum}" for datum in HULL),
            *(f"vessel.{bound}" for bound in BOUNDS),
        ),
        {"odom": (Odometry, _odometry), "reference": (ReferenceState, _reference)},
        "cmd_wrench",
        WrenchStamped,
        _wrench_values,
    ),
    "vessel_sim": Target(
        "vessel_sim_node",
        ("rate_hz:=50.0", *(f"actuators.{bound}" for bound in BOUNDS)),
        WRENCH,
        "applied_wrench",
        WrenchStamped,
        _wrench_values,
    ),
    "watchdog": Target(
        "watchdog_node", (*BOUNDS, "watched_nodes:=['']"), WRENCH, "watched_wrench", WrenchStamped, _wrench_values
    ),
    "allocation": Target(
        "thruster_allocation_node",
        (*(f"vessel.{setting}" for setting in THRUSTERS), f"vessel.thrusters.thrust_ahead:=[{THRUST}]"),
        WRENCH,
        "thrusters/left/thrust",
        Float64,
        lambda message: (message.data / THRUST,),
    ),
    "goal": Target(
        "reference_ship_node",
        ("mode:=goal", "rate_hz:=50.0"),
        {"goal_pose": (PoseStamped, _pose)},
        "reference",
        ReferenceState,
        _reference_values,
    ),
    "path": Target(
        "reference_ship_node",
        ("mode:=path", "rate_hz:=50.0"),
        {"path": (PathMessage, _path)},
        "reference",
        ReferenceState,
        _reference_values,
    ),
    "recorder": Target(
        "recorder_node",
        ("topics:=['odom','cmd_wrench']",),
        {"odom": (Odometry, _odometry), **WRENCH},
        "/diagnostics",  # it publishes nothing else
        DiagnosticArray,
        lambda _: (0.0,),
    ),
}


class Attack:
    """One node as a process, and a publisher of each of its inputs; a context."""

    def __init__(self, name: str, folder: Path) -> None:
        self.target = TARGETS[name]
        settings = [word for setting in ("lockstep:=false", *self.target.settings) for word in ("-p", setting)]
        arguments = [executable(self.target.executable), "--ros-args", "-r", f"__ns:=/{name}", *settings]
        self.command = Command(arguments, folder, {})
        self.context = rclpy.Context()
        rclpy.init(context=self.context, args=[])
        self.node = rclpy.create_node("attacker", context=self.context, namespace=name)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.outputs: list[tuple[float, ...]] = []
        self.node.create_subscription(
            self.target.kind, self.target.output, lambda m: self.outputs.append(self.target.values(m)), qos.STREAM
        )
        self.publishers = {
            topic: self.node.create_publisher(kind, topic, qos.STREAM) for topic, (kind, _) in self.target.inputs.items()
        }

    def valid(self, topic: str) -> bytes:
        """A valid message of a topic with the present time, serialised."""
        return bytes(serialize_message(self.target.inputs[topic][1](time.time_ns())))

    def until(self, condition: Callable[[], bool], deadline: float = 60.0) -> None:
        """Publish valid messages and take outputs until a condition holds; fails after the deadline, s."""
        end = time.monotonic() + deadline
        while not condition():
            assert self.command.popen.poll() is None, f"ended with {self.command.popen.returncode}:\n{self.command.text}"
            assert time.monotonic() < end, f"no answer within {deadline} s:\n{self.command.text}"
            for topic, publisher in self.publishers.items():
                publisher.publish(self.valid(topic))
            self.executor.spin_once(timeout_sec=0.02)

    def answered(self, count: int) -> None:
        """Wait for some outputs more."""
        wanted = len(self.outputs) + count
        self.until(lambda: len(self.outputs) >= wanted)

    def send(self, count: int, first: int = 0) -> None:
        """Publish mutated messages, each input in turn, and let the node work from time to time."""
        topics = list(self.publishers)
        for number in range(first, first + count):
            topic = topics[number % len(topics)]
            data = self.valid(topic)
            self.publishers[topic].publish(data[:4] + mutated(data[4:], number) if number % 4 else mutated(data, number))
            if number % 20 == 19:
                self.answered(1)

    def check(self) -> None:
        """What must hold at the end: answers to valid messages that are finite and bounded, and bounded memory."""
        self.answered(3)
        for values in self.outputs:
            assert all(math.isfinite(value) and abs(value) <= 1.0 + 1e-9 for value in values), values
        pages = int(Path(f"/proc/{self.command.popen.pid}/statm").read_text().split()[1])
        assert pages * os.sysconf("SC_PAGE_SIZE") < MEMORY

    def stop(self) -> int:
        """Stop the node as a user does; returns its exit code."""
        self.command.popen.send_signal(signal.SIGINT)
        return self.command.wait(60.0)

    def close(self) -> None:
        """Kill what is left."""
        if self.command.popen.poll() is None:
            self.command.kill()
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@contextmanager
def attack(name: str, folder: Path) -> Iterator[Attack]:
    """A node that answers valid messages, to be attacked; killed at the end."""
    made = Attack(name, folder)
    try:
        made.answered(1)
        yield made
    finally:
        made.close()
