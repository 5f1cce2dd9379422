"""How a controller in a process of its own ends: by a signal, with zero as its last command."""

import signal
from collections.abc import Iterator
from typing import Any

import pytest
import rclpy
from driving import RealTimePlant
from durations import rest_long
from rclpy.executors import SingleThreadedExecutor


class Bench:
    """A probe in the process of the test."""

    def __init__(self) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, args=[])
        self.probe = rclpy.create_node("probe", context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.probe)

    def publisher(self, kind: Any, topic: str, lockstep: bool = False) -> Any:
        del lockstep
        return self.probe.create_publisher(kind, topic, 10)

    def collect(self, kind: Any, topic: str, profile: Any) -> list[Any]:
        messages: list[Any] = []
        self.probe.create_subscription(kind, topic, messages.append, profile)
        return messages

    def close(self) -> None:
        """Leave the ROS graph: later tests of this process use the same domain."""
        self.executor.shutdown()
        self.probe.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


@pytest.mark.parametrize("number", rest_long([signal.SIGINT, signal.SIGTERM]))
def test_a_signal_ends_the_controller_with_zero_as_its_last_command(bench: Bench, start: Any, number: int) -> None:
    plant = RealTimePlant(bench, None)

    def send() -> None:
        now = int(bench.probe.get_clock().now().nanoseconds)
        plant.send_reference(now)
        plant.send_odometry(now)

    bench.probe.create_timer(0.02, send)
    settings = ["-p", "law:=guided", "-p", "rate_hz:=50.0", "-p", "start_enabled:=true", "-p", "vessel:=paper_ship"]
    command = start("python", "-m", "vessel_hsmc_ros.nodes", "controller", "--ros-args", *settings)

    def spin() -> bool:
        bench.executor.spin_once(timeout_sec=0.02)
        return True

    command.until(lambda: spin() and plant.commands and any(plant.wrenches()[-1]))
    command.popen.send_signal(number)
    command.until(lambda: spin() and command.popen.poll() is not None)
    assert command.popen.returncode == 0
    for _ in range(20):
        spin()
    assert plant.wrenches()[-1] == (0.0, 0.0)
    stamps = [(command.header.stamp.sec, command.header.stamp.nanosec) for command in plant.commands]
    assert stamps == sorted(set(stamps)), "a plant refuses a command with a stamp that it has had"


def test_a_crash_of_native_code_leaves_its_stack_in_the_output(start: Any) -> None:
    command = start("python", "-m", "vessel_hsmc_ros.nodes", "markers")
    command.until(lambda: "real time" in command.text)
    command.popen.send_signal(signal.SIGSEGV)
    assert command.wait() == -signal.SIGSEGV
    assert "Segmentation fault" in command.text
    assert "vessel_hsmc_ros/nodes/process.py" in command.text
