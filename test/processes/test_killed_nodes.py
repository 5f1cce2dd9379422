"""A controller that is killed or stopped beside consumers in other processes, in real time."""

import signal
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import rclpy
from geometry_msgs.msg import WrenchStamped
from harness import Command
from rclpy.executors import SingleThreadedExecutor

from vessel_hsmc_ros.core.install_paths import PROFILES, profiles_folder
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos

TIMEOUT = 1.0

COMMANDER = """
import rclpy
from geometry_msgs.msg import WrenchStamped
rclpy.init()
node = rclpy.create_node("commander")
publisher = node.create_publisher(WrenchStamped, "cmd_wrench", 100)
def command():
    message = WrenchStamped()
    message.header.stamp, message.header.frame_id = node.get_clock().now().to_msg(), "base_link"
    message.wrench.force.x = 1e3 + node.get_clock().now().nanoseconds % 10**9 * 1e-6
    publisher.publish(message)
node.create_timer(0.01, command)
rclpy.spin(node)
"""
"""A controller that knows nothing of this package: every command has another force."""


class Witness:
    """Hears commands and what consumers make of them."""

    def __init__(self) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, args=[])
        self.node = rclpy.create_node("witness", context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.commands: dict[float, int] = {}
        self.heard: dict[str, list[tuple[int, float]]] = {"applied_wrench": [], "watched_wrench": []}
        self.node.create_subscription(WrenchStamped, "cmd_wrench", self._on_command, qos.STREAM)
        for topic, heard in self.heard.items():
            self.node.create_subscription(WrenchStamped, topic, lambda m, heard=heard: heard.append(_read(m)), qos.STREAM)

    def _on_command(self, message: WrenchStamped) -> None:
        stamp, force = _read(message)
        self.commands[force] = stamp

    def listen(self) -> None:
        """Take what has been received since the last call: many more messages than calls."""
        for _ in range(100):
            self.executor.spin_once(timeout_sec=0.0)

    def drives(self) -> bool:
        """Whether both consumers carry out commands at present."""
        self.listen()
        return all(heard and heard[-1][1] > 0.0 for heard in self.heard.values())

    def rests(self) -> bool:
        """Whether both are at zero."""
        self.listen()
        return all(heard and heard[-1][1] == 0.0 for heard in self.heard.values())

    def greatest_age(self, topic: str) -> float:
        """The greatest age of a command that a consumer carried out as it is, s."""
        return max((at - self.commands[force]) * 1e-9 for at, force in self.heard[topic] if force in self.commands)


def _read(message: WrenchStamped) -> tuple[int, float]:
    return conv.nanoseconds(message.header.stamp), message.wrench.force.x


@pytest.fixture
def witness() -> Iterator[Witness]:
    made = Witness()
    yield made
    made.executor.shutdown()
    made.node.destroy_node()
    rclpy.shutdown(context=made.context)


def test_no_command_outlives_its_timeout_when_the_controller_is_stopped_goes_on_and_is_killed(
    start: Callable[..., Command], witness: Any
) -> None:
    options = ("--ros-args", "-p", f"command_timeout:={TIMEOUT}")
    profiles = {PROFILES: str(profiles_folder() / "fastdds.xml")}
    plant = start("python", "-m", "vessel_hsmc_ros.nodes", "vessel_sim", *options, environment=profiles)
    start("python", "-m", "vessel_hsmc_ros.nodes", "watchdog", *options, "-p", "ramp_time:=0.0", environment=profiles)
    commander = start("python", "-c", COMMANDER, environment=profiles)
    plant.until(witness.drives)
    for number in (signal.SIGSTOP, signal.SIGCONT, signal.SIGKILL):
        commander.popen.send_signal(number)
        plant.until(witness.drives if number == signal.SIGCONT else witness.rests)
        assert all(witness.greatest_age(topic) <= TIMEOUT for topic in witness.heard)
