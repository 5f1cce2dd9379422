"""The recorder as a process: interrupted, killed, and its bag read by several readers."""

import os
import signal
import time
from pathlib import Path
from typing import Any

import pytest
import rclpy
from durations import rest_long
from harness import children, command_line, run_folder
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile, ReliabilityPolicy
from readers import READERS
from rosgraph_msgs.msg import Clock

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.repair import is_complete, repair
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos

PERIOD = 10_000_000


@pytest.fixture
def ship_node() -> Any:
    """A node outside the run."""
    context = rclpy.Context()
    rclpy.init(context=context, args=[])
    node = rclpy.create_node("ship", context=context)
    yield node
    node.destroy_node()
    rclpy.shutdown(context=context)


@pytest.fixture
def ship(ship_node: Any) -> Any:
    """A publisher of odometry outside the run."""
    return ship_node.create_publisher(Odometry, "odom", qos.LOSSLESS)


@pytest.mark.parametrize("number", rest_long([signal.SIGINT, signal.SIGTERM]))
def test_an_interrupted_recorder_completes_its_bag_and_exits_with_0(start: Any, ship: Any, number: int) -> None:
    command = start("recorder_node", "--ros-args", "-p", "directory:=bag")
    command.until(ship.get_subscription_count)
    for _ in range(200):
        ship.publish(conversions.new_odometry())
    assert ship.wait_for_all_acked(rclpy.duration.Duration(seconds=5.0))
    command.popen.send_signal(number)
    assert command.wait() == 0, command.text
    bag = command.output.parent / "bag"
    assert is_complete(bag)
    assert open_bag(bag)["odom"].count == 200


def test_the_recorder_runs_as_batch_work_that_preempts_no_other_process(start: Any, ship: Any) -> None:
    command = start("recorder_node", "--ros-args", "-p", "directory:=bag")
    command.until(ship.get_subscription_count)
    threads = Path(f"/proc/{command.popen.pid}/task")
    assert {os.sched_getscheduler(int(thread.name)) for thread in threads.iterdir()} == {os.SCHED_BATCH}


def test_a_recorder_without_processor_time_loses_no_step_of_the_clock_of_lockstep(start: Any, ship_node: Any) -> None:
    clock = ship_node.create_publisher(Clock, "/clock", qos.CLOCK_OF_LOCKSTEP)
    command = start("recorder_node", "--ros-args", "-p", "directory:=bag", "-p", "topics:=[/clock]")
    command.until(clock.get_subscription_count)
    command.popen.send_signal(signal.SIGSTOP)
    for step in range(3000):
        clock.publish(Clock(clock=conversions.time_message(step * PERIOD)))
    command.popen.send_signal(signal.SIGCONT)
    assert clock.wait_for_all_acked(rclpy.duration.Duration(seconds=30.0))
    command.popen.send_signal(signal.SIGINT)
    assert command.wait() == 0, command.text
    bag = open_bag(command.output.parent / "bag")
    assert bag["/clock"].count == 3000
    assert bag.recording["messages_dropped"] == "0"


class Witness:
    """Subscribes to the odometry of a run from this process."""

    def __init__(self) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, args=[])
        self.node = rclpy.create_node("witness", context=self.context)
        profile = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        self.heard = [(time.monotonic(), -1)]
        self.node.create_subscription(Odometry, "odom", self._on_odometry, profile)

    def _on_odometry(self, message: Any) -> Any:
        self.heard.append((time.monotonic(), conversions.nanoseconds(message.header.stamp)))

    def until(self, command: Any, stamp: int) -> Any:
        """Receive messages until the run has reached a simulated time."""
        end = time.monotonic() + 60.0
        while self.heard[-1][1] < stamp:
            assert command.popen.poll() is None, f"ended with {command.popen.returncode}:\n{command.text}"
            assert time.monotonic() < end, f"the run came to {self.heard[-1][1]} ns only:\n{command.text}"
            rclpy.spin_once(self.node, executor=self._executor(), timeout_sec=0.05)

    def _executor(self) -> Any:
        if not hasattr(self, "executor"):
            self.executor = rclpy.executors.SingleThreadedExecutor(context=self.context)
        return self.executor

    def close(self) -> Any:
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def witness() -> Any:
    made = Witness()
    yield made
    made.close()


def test_after_sigkill_every_reader_finds_all_but_the_last_second(start: Any, witness: Any) -> None:
    """At one moment; benchmarks/kills.py takes twenty."""
    command = start("vessel-hsmc", "run", "case2_tracking")
    witness.until(command, 2 * 10**9)
    nodes = children(command.popen.pid)
    assert any(command_line(pid) == command_line(command.popen.pid) for pid in nodes)  # the fork that runs them
    killed_at = time.monotonic()
    for pid in (command.popen.pid, *nodes):
        os.kill(pid, signal.SIGKILL)
    command.popen.wait(60.0)
    folder = run_folder(command.output.parent / "runs")
    assert folder is not None
    bag = folder / "bag"
    before = {name: len(READERS[name](bag)["/odom"]) for name in READERS}
    second_before = max(stamp for at, stamp in witness.heard if at < killed_at - 1.0)
    assert min(before.values()) > second_before // PERIOD
    opened = open_bag(bag)
    assert opened.scenario().controller.law == "hierarchical_printed"
    assert repair(bag).messages == opened.count
    assert {name: len(READERS[name](bag)["/odom"]) for name in READERS} == before
