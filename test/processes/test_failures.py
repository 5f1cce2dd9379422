"""A run that fails ends soon, reports the reason in one line, and leaves a readable bag and no process behind."""

import json
import math
import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from durations import rest_long
from harness import children, process_name, run_folder
from mcap_ros2.reader import read_ros2_messages
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Log
from rclpy.executors import SingleThreadedExecutor
from rosbags.highlevel import AnyReader

from vessel_hsmc_ros.cli.command import execute
from vessel_hsmc_ros.core.node_list import GROUP, START_ORDER, taking_part
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos

STEPS = 100
WELL_UNDER_WAY = 500_000
"""Bytes of a bag that holds more than the steps that the tests require; a step takes some 1250."""


def started(start: Any, *arguments: Any) -> Any:
    """Start a run and wait until its bag grows; returns the command and its run folder."""
    command = start("vessel-hsmc", "run", "case2_tracking", *arguments)
    runs = command.output.parent / "runs"
    command.until(lambda: (folder := run_folder(runs)) and bag_size(folder) > WELL_UNDER_WAY)
    return command, run_folder(runs)


def bag_size(folder: Any) -> Any:
    path = folder / "bag" / "bag_0.mcap"
    return path.stat().st_size if path.exists() else 0


def nodes_of(command: Any) -> Any:
    """The processes of the nodes of a run by their names."""
    named = {process_name(pid): pid for pid in children(command.popen.pid)}
    return {name: named[name] for name in (*START_ORDER, GROUP) if name in named}


FORMS = pytest.mark.parametrize("form", rest_long(["--composed", "--processes"]))


def check_bag(folder: Any) -> Any:
    """Assert that two independent readers find the same odometry, without gaps."""
    with AnyReader([folder / "bag"]) as reader:
        stamps = []
        for connection, _, data in reader.messages():
            if connection.topic == "/odom":
                message: Any = reader.deserialize(data, connection.msgtype)
                stamp = message.header.stamp
                stamps.append(stamp.sec * 10**9 + stamp.nanosec)
    np.testing.assert_array_equal(stamps, np.arange(len(stamps)) * 10_000_000)
    assert len(stamps) > STEPS
    decoded = sum(m.channel.topic == "/odom" for m in read_ros2_messages(folder / "bag" / "bag_0.mcap"))
    assert decoded == len(stamps)


def check_nothing_left(pids: Any) -> Any:
    assert not [pid for pid in pids if Path(f"/proc/{pid}").exists()]


def test_a_killed_node_ends_the_run_and_is_named(start: Any) -> None:
    command, folder = started(start, "--processes")
    nodes = nodes_of(command)
    assert nodes.keys() == set(taking_part(by_thrusters=False))
    os.kill(nodes["controller"], signal.SIGKILL)
    assert command.wait() == 1
    assert "error: controller was killed by SIGKILL" in command.text
    assert "Traceback" not in command.text
    check_nothing_left(nodes.values())
    check_bag(folder)
    assert json.loads((folder / "run.json").read_text())["exit_code"] == 1


@pytest.mark.long
def test_a_killed_process_of_all_nodes_ends_the_run_and_what_was_flushed_of_its_bag_is_kept(start: Any) -> None:
    command, folder = started(start, "--composed")
    nodes = nodes_of(command)
    assert [*nodes] == [GROUP]
    os.kill(nodes[GROUP], signal.SIGKILL)
    assert command.wait() == 1
    assert f"error: {GROUP} was killed by SIGKILL" in command.text
    check_nothing_left(nodes.values())
    check_bag(folder)


def check_interrupted(command: Any, folder: Path, number: int, send: Any) -> None:
    """Assert that a signal ends a run in order, with a complete bag."""
    nodes = nodes_of(command)
    send(command.popen.pid, number)
    assert command.wait() == 128 + number
    assert "Traceback" not in command.text
    check_nothing_left(nodes.values())
    check_bag(folder)
    assert "0 dropped" in "".join(log.read_text() for log in (folder / "logs").iterdir())


@pytest.mark.long
@FORMS
def test_a_signal_to_the_command_alone_ends_the_run_in_order_with_a_complete_bag(start: Any, form: str) -> None:
    command, folder = started(start, form)
    check_interrupted(command, folder, signal.SIGTERM, os.kill)


@pytest.mark.long
@FORMS
def test_a_hanging_node_ends_the_run_and_is_named(start: Any, form: str) -> None:
    command, folder = started(start, form)
    command.until(lambda: "%" in command.text)  # the bag may grow before the command has heard of the nodes
    nodes = nodes_of(command)
    os.kill(nodes.get("controller") or nodes[GROUP], signal.SIGSTOP)
    assert command.wait() == 1
    assert "controller has been silent" in command.text
    check_nothing_left(nodes.values())
    check_bag(folder)


@pytest.mark.long
@FORMS
def test_when_the_command_is_killed_its_nodes_end_and_the_bag_is_complete(start: Any, form: str) -> None:
    command, folder = started(start, form)
    nodes = nodes_of(command)
    command.popen.kill()
    command.popen.wait(60.0)
    end = time.monotonic() + 60.0
    while any(Path(f"/proc/{pid}").exists() for pid in nodes.values()):
        assert time.monotonic() < end, "nodes outlive the command that started them"
        time.sleep(0.05)
    check_bag(folder)


def test_run_without_ros_names_what_is_missing(start: Any) -> None:
    code = "import sys; sys.modules['rclpy'] = None; sys.argv[1:] = ['run', 'case2_tracking']; "
    command = start("python", "-c", code + "from vessel_hsmc_ros.cli.main import main; sys.exit(main())")
    assert command.wait() == 1
    assert "error: rclpy is not installed: nodes need ROS 2, `pip install 'ros-jazzy-rclpy" in command.text
    assert "or source a Jazzy workspace; `vessel-hsmc simulate` does without" in command.text


BAD_RUNS = [
    (["nothing_like_it"], "scenario nothing_like_it is unknown: it must be one of"),
    (["case2_tracking", "--set", "controller.speed=3"], "controller.speed is not a parameter"),
    (["case2_tracking", "--set", "controller.rate_hz=-5"], "controller.rate_hz must be"),
    (["case2_tracking", "--set", "controller.rate_hz=50"], "is unstable at controller.rate_hz = 50 Hz"),
    (["case2_tracking", "--set", "vessel_sim.initial_pose=[1, .nan, 0]"], "(got [1.0, nan, 0.0])"),
    (["case2_tracking", "--set", "controller.law=autopilot"], "controller.law must be one of"),
    (["case2_tracking", "--set", "vessel_sim.duration"], "must be node.param=value"),
    (["case2_tracking", "--output", "/dev/null"], "cannot be made"),
    (["case2_tracking", "--namespace", "no good"], "namespace must be"),
]


@pytest.mark.parametrize(("arguments", "expected"), BAD_RUNS)
def test_a_run_that_cannot_start_is_refused_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path, arguments: list[str], expected: str
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["vessel-hsmc", "run", *arguments])
    assert execute() in (1, 2)
    shown = capsys.readouterr()
    (line,) = (shown.out + shown.err).strip().splitlines()
    assert line.startswith("error: ")
    assert expected in line
    assert not any(tmp_path.iterdir())


BAD_NODES = [
    (
        "controller_node",
        ["-p", "rate_hz:=fast"],
        "rate_hz must be a finite number from 1 to 1000 Hz (got 'fast') (-p rate_hz:=fast)",
    ),
    ("vessel_sim_node", ["-p", "vessel.surge_inertia:=-1.0"], "]: vessel.surge_inertia must be"),
    ("recorder_node", ["-p", "directory:=/dev/null/bag"], "bag folder /dev/null/bag cannot be made"),
    ("reference_ship_node", ["--params-file", "missing.yaml"], "missing.yaml"),
]
"""test/nodes has more of them, in one process."""


@pytest.mark.parametrize(("executable", "arguments", "reason"), rest_long(BAD_NODES))
def test_a_node_that_cannot_start_logs_one_line_with_the_reason(
    start: Any, executable: str, arguments: list[str], reason: str
) -> None:
    command = start(executable, "--ros-args", *arguments)
    assert command.wait() == 2
    (line,) = [line for line in command.text.splitlines() if "[rcl]" not in line]
    assert line.startswith("[FATAL]")
    assert reason in line


@pytest.fixture
def sensor() -> Iterator[Any]:
    """A node with an executor that does not belong to the run."""
    context = rclpy.Context()
    rclpy.init(context=context, args=[])
    node = rclpy.create_node("sensor", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    yield node
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown(context=context)


def test_the_error_that_ends_a_node_is_logged_as_fatal_and_reaches_rosout_and_diagnostics(start: Any, sensor: Any) -> None:
    command = start("controller_node", "--ros-args", "-p", "lockstep:=true")
    logs: list[Log] = []
    statuses: list[DiagnosticArray] = []
    sensor.create_subscription(Log, "/rosout", logs.append, 10)
    sensor.create_subscription(DiagnosticArray, "/diagnostics", statuses.append, qos.DIAGNOSTICS)
    publisher = sensor.create_publisher(Odometry, "odom", qos.LOSSLESS)
    connected = (publisher.get_subscription_count, lambda: sensor.count_publishers("/diagnostics"))
    command.until(lambda: sensor.executor.spin_once(0.02) or (all(each() for each in connected) and statuses))
    message = conversions.new_odometry()
    message.pose.pose.position.y = math.nan
    publisher.publish(message)
    reason = "odometry must be finite numbers (got y = nan)"
    end = time.monotonic() + 60.0
    while not (logs and logs[-1].msg == reason and statuses[-1].status[0].message == reason):
        assert time.monotonic() < end, command.text
        sensor.executor.spin_once(0.05)
    assert logs[-1].level == 50  # FATAL
    assert statuses[-1].status[0].level == DiagnosticStatus.ERROR
    assert command.wait() == 1
    lines = command.text.splitlines()
    assert lines[-1].startswith("[FATAL]")
    assert lines[-1].endswith(f"[controller]: {reason}")
    assert "Traceback" not in command.text


@pytest.mark.parametrize("executable", rest_long(["controller_node", "recorder_node"]))
def test_repeated_sigint_during_shutdown_does_not_change_the_exit_code(start: Any, executable: str) -> None:
    """A terminal and `ros2 launch` each send SIGINT for one Ctrl-C."""
    command = start(executable)
    command.until(lambda: "real time" in command.text)
    end = time.monotonic() + 60.0
    while command.popen.poll() is None:
        assert time.monotonic() < end, command.text
        command.popen.send_signal(signal.SIGINT)  # without a pause between them: one may come at any instant of the shutdown
    assert command.popen.returncode == 0, command.text


@pytest.mark.long
def test_a_second_run_and_a_second_plant_in_the_same_domain_are_refused_and_the_first_run_goes_on_until_ctrl_c(
    start: Any,
) -> None:
    """A terminal sends SIGINT for Ctrl-C to the process group."""
    run, folder = started(start)
    second = start("vessel-hsmc", "run", "case2_tracking")
    plant = start("vessel_sim_node", "--ros-args", "-p", "lockstep:=true")
    assert second.wait() == 1
    assert "error: another run uses ROS domain" in second.text
    assert run_folder(second.output.parent / "runs") is None
    assert plant.wait() == 1
    assert "has 2 publishers and may have one: does another run use this ROS domain" in plant.text.splitlines()[-1]
    before = bag_size(folder)
    run.until(lambda: bag_size(folder) > before)
    check_interrupted(run, folder, signal.SIGINT, os.killpg)


HANGS = """\
import ctypes, sys
from vessel_hsmc_ros.nodes import process
from vessel_hsmc_ros.boats.drive import WatchdogNode

class Hanging(WatchdogNode):
    def destroy_node(self):
        ctypes.PyDLL(None).sleep(600)  # with the interpreter's lock, as the middleware

process.DESTROYED_WITHIN = 1.0
sys.exit(process.run_node(Hanging))
"""


def test_a_node_that_the_middleware_does_not_let_go_ends_with_its_stacks(start: Any) -> None:
    command = start("python", "-c", HANGS)
    command.until(lambda: "watches" in command.text)
    command.popen.send_signal(signal.SIGINT)
    assert command.wait() == -signal.SIGALRM
    assert "in destroy_node" in command.text
