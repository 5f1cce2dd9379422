"""`vessel-hsmc run`: nodes over DDS, in one process or four, a bag, results bit-identical to those of the offline loop."""

import dataclasses
import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_comparison import assert_equal_to_the_offline_bag
from harness import BIN, exit_code
from mcap_ros2.reader import read_ros2_messages
from rosbags.highlevel import AnyReader

from vessel_hsmc_ros.bags.reader import Bag, open_bag
from vessel_hsmc_ros.bags.writer import SCENARIO
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.metrics import Run
from vessel_hsmc_ros.core.node_list import taking_part
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate

DURATION = 3.0
COMMAND_LIMIT = 240.0
"""Time limit of a command, s."""

STEPS = 300
CHANGES = ["--set", f"vessel_sim.duration={DURATION}"]
TYPES = {
    "/odom": "nav_msgs/msg/Odometry",
    "/cmd_wrench": "geometry_msgs/msg/WrenchStamped",
    "/applied_wrench": "geometry_msgs/msg/WrenchStamped",
    "/disturbance": "geometry_msgs/msg/WrenchStamped",
    "/dynamics/truth": "geometry_msgs/msg/AccelStamped",
    "/reference": "vessel_hsmc_msgs/msg/ReferenceState",
    "/reference/pose": "geometry_msgs/msg/PoseStamped",
    "/controller/state": "vessel_hsmc_msgs/msg/ControlState",
    "/events": "vessel_hsmc_msgs/msg/Event",
    "/clock": "rosgraph_msgs/msg/Clock",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/rosout": "rcl_interfaces/msg/Log",
    "/parameter_events": "rcl_interfaces/msg/ParameterEvent",
}
OF_EVERY_NODE = {"/diagnostics", "/rosout", "/parameter_events", "/events"}

Finished = subprocess.CompletedProcess[str]
Recorded = tuple[Finished, Path]
"""The finished command and its run folder."""

ARRAYS = [field.name for field in dataclasses.fields(Run) if field.name != "control"]


def vessel_hsmc(*arguments: str, cwd: Path) -> Finished:
    return subprocess.run([BIN / "vessel-hsmc", *arguments], cwd=cwd, capture_output=True, text=True, timeout=COMMAND_LIMIT)


def run(folder: Path, *arguments: str) -> Recorded:
    done = vessel_hsmc("run", *arguments, cwd=folder)
    assert done.returncode == 0, done.stderr
    return done, next((folder / "runs").iterdir())


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    """A run in one process, with all that it draws."""
    return run(tmp_path_factory.mktemp("composed"), "case2_tracking", "--composed", *CHANGES)


@pytest.fixture(scope="module")
def in_processes(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    """The same run in four processes: as its bag is the same, most tests take the one above."""
    return run(tmp_path_factory.mktemp("processes"), "case2_tracking", "--processes", "--no-page", *CHANGES)


BOTH = pytest.mark.parametrize("form", ["recorded", "in_processes"])


@pytest.fixture(scope="module")
def bag(recorded: Recorded) -> Bag:
    return open_bag(recorded[1] / "bag")


@pytest.fixture
def verb(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., int]:
    """A verb in this process, in a folder of the test's own; returns its exit code."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: object) -> int:
        monkeypatch.setattr("sys.argv", ["vessel-hsmc", *map(str, arguments)])
        return exit_code()

    return call


@BOTH
def test_the_messages_are_bit_identical_to_those_of_the_offline_bag(
    request: pytest.FixtureRequest, form: str, tmp_path: Path
) -> None:
    assert_equal_to_the_offline_bag(open_bag(request.getfixturevalue(form)[1] / "bag"), tmp_path / "bag")


def test_the_run_folder_contains_bag_parameters_logs_figures_page_and_summary(recorded: Recorded) -> None:
    _, folder = recorded
    assert {path.name for path in folder.iterdir()} == {
        "bag",
        "figures",
        "logs",
        "params.yaml",
        "report.html",
        "run.json",
    }
    assert {path.name for path in (folder / "bag").iterdir()} == {"bag_0.mcap", "metadata.yaml"}
    for name in ("track", "errors", "velocities", "wrench", "timing"):
        assert (folder / "figures" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    page = (folder / "report.html").read_text()
    assert 'id="numbers"' in page
    assert "position error, rms of the last quarter" in page


@BOTH
def test_the_table_and_the_summary_report_the_run(request: pytest.FixtureRequest, form: str) -> None:
    done, folder = request.getfixturevalue(form)
    for row in (
        "position error, rms with the approach",
        "position error, final",
        "heading error, rms with the approach",
        "surge force, peak",
        "yaw moment, rms",
        "control periods missed",
        "messages recorded",
        "real-time factor",
        f"run folder: runs/{folder.name}",
    ):
        assert row in done.stdout
    summary = json.loads((folder / "run.json").read_text())
    assert summary["exit_code"] == 0
    assert summary["steps"] == STEPS
    assert summary["missed_periods"] == summary["messages_dropped"] == 0
    assert summary["mode"] == "lockstep"
    assert {"version", "git_commit", "seed", "host", "started", "duration"} <= summary.keys()


def test_the_start_up_time_is_measured(recorded: Recorded) -> None:
    """It lies between the start of the command and its end; benchmarks/start_up.py measures it against bare nodes."""
    summary = json.loads((recorded[1] / "run.json").read_text())
    assert 0.0 < summary["start_up"] < COMMAND_LIMIT


def test_the_resolved_parameters_load_as_the_same_scenario(recorded: Recorded) -> None:
    scenario = load_scenario(recorded[1] / "params.yaml")
    expected = load_scenario("case2_tracking", {"vessel_sim.duration": DURATION})
    assert schema.flatten(scenario.controller) == schema.flatten(expected.controller) | {"recorded": True, "start_enabled": True}
    assert scenario.recorder.directory == str(recorded[1] / "bag")
    assert all(getattr(scenario, node).lockstep for node in NODES)


@BOTH
def test_the_bag_contains_its_scenario_and_the_parameters_of_the_nodes(
    request: pytest.FixtureRequest, form: str, tmp_path: Path
) -> None:
    recorded = request.getfixturevalue(form)
    shutil.copytree(recorded[1] / "bag", tmp_path / "bag")
    bag = open_bag(tmp_path / "bag")
    assert bag.scenario() == replace(load_scenario(recorded[1] / "params.yaml"), name="case2_tracking")
    assert bag.parameters.keys() == {f"/{node}" for node in taking_part(by_thrusters=False)}
    assert bag.parameters["/controller"]["hierarchical_printed.network.width"] == 5.0
    assert bag.recording["messages_dropped"] == "0"
    del bag.attachments[SCENARIO]  # as one that was recorded by hand
    assert bag.scenario().vessel_sim == load_scenario(recorded[1] / "params.yaml").vessel_sim
    assert any("finished" in message.msg for _, _, message in bag.messages("/rosout"))


def test_rosbags_reads_every_topic_without_gaps(recorded: Recorded) -> None:
    with AnyReader([recorded[1] / "bag"]) as reader:
        assert {c.topic: c.msgtype for c in reader.connections} == TYPES
        counts = {c.topic: c.msgcount for c in reader.connections}
        stamps: dict[str, list[int]] = {}
        for connection, _, data in reader.messages():
            message: Any = reader.deserialize(data, connection.msgtype)
            if connection.topic in OF_EVERY_NODE:
                continue
            stamp = message.clock if connection.topic == "/clock" else message.header.stamp
            stamps.setdefault(connection.topic, []).append(stamp.sec * 10**9 + stamp.nanosec)
    assert counts["/odom"] == STEPS + 1
    for topic in TYPES.keys() - OF_EVERY_NODE:
        assert len(stamps[topic]) == counts[topic] >= STEPS + 1
        np.testing.assert_array_equal(stamps[topic], np.arange(counts[topic]) * 10_000_000)


def test_mcap_ros2_support_decodes_every_message(recorded: Recorded) -> None:
    decoded: dict[str, list[Any]] = {}
    for message in read_ros2_messages(recorded[1] / "bag" / "bag_0.mcap"):
        decoded.setdefault(message.channel.topic, []).append(message.ros_msg)
    assert TYPES.keys() - OF_EVERY_NODE <= decoded.keys() <= TYPES.keys()
    assert len(decoded["/odom"]) == STEPS + 1
    assert len(decoded["/controller/state"][7].yaw_weights) == 27
    assert decoded["/reference"][0].acceleration.linear.x == pytest.approx(1e5 / 120e3)
    assert decoded["/odom"][0].child_frame_id == "base_link"


def test_nodes_and_offline_loop_are_bit_identical(bag: Bag) -> None:
    run = bag.run(VesselParameters().coefficients())
    offline = simulate(load_scenario("case2_tracking", {"vessel_sim.duration": DURATION}))
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(run, name), getattr(offline, name), err_msg=name)
    assert offline.control.keys() <= run.control.keys()
    for name, values in offline.control.items():
        np.testing.assert_array_equal(run.control[name], values, err_msg=name)


def odometry_bytes(bag: Path) -> list[bytes]:
    with AnyReader([bag]) as reader:
        return [bytes(data) for c, _, data in reader.messages() if c.topic == "/odom"]


@pytest.mark.long
def test_a_second_lockstep_run_of_a_users_file_gives_bit_identical_odometry_and_names_the_folder(
    recorded: Recorded, tmp_path: Path
) -> None:
    mine = tmp_path / "mine.yaml"
    mine.write_text((share_directory() / "config" / "case2_tracking.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    _, again = run(tmp_path, str(mine), "--no-page", "--set", "vessel_sim.duration=1")
    assert again.name.endswith("_mine")
    assert odometry_bytes(again / "bag") == odometry_bytes(recorded[1] / "bag")[:101]


@BOTH
def test_the_diagnostics_of_every_node_are_recorded(request: pytest.FixtureRequest, form: str) -> None:
    bag = open_bag(request.getfixturevalue(form)[1] / "bag")
    status = bag.diagnostics()
    assert status.keys() == set(taking_part(by_thrusters=False))
    assert status["vessel_sim"]["message"] == "finished"
    assert status["controller"]["updates"] == str(STEPS + 1)
    after = bag.count - int(status["recorder"]["messages"])
    assert 1 <= after <= 3  # this report itself, and what came while it was on its way
    assert status["recorder"]["dropped"] == "0"


def test_simulate_gives_the_same_metrics_without_ros(tmp_path: Path, recorded: Recorded, verb: Callable[..., int]) -> None:
    assert verb("simulate", "case2_tracking", *CHANGES, "--no-page") == 0
    folder = next((tmp_path / "runs").iterdir())
    offline, over_ros = (json.loads((path / "run.json").read_text()) for path in (folder, recorded[1]))
    assert offline["metrics"] == over_ros["metrics"]


@pytest.mark.long
def test_simulate_does_not_import_ros(tmp_path: Path) -> None:
    code = (
        "import sys; sys.argv[1:] = ['simulate', 'case2_tracking', '--no-page', '--set', 'vessel_sim.duration=1'];"
        "from vessel_hsmc_ros.cli.main import main; assert main() == 0; assert 'rclpy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True, timeout=60.0, capture_output=True)


def test_report_draws_the_figures_from_the_bag(
    recorded: Recorded, verb: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    _, folder = recorded
    track = folder / "figures" / "track.png"
    track.unlink()
    assert verb("report", folder / "bag", "--figures", "png") == 0
    assert track.exists()
    assert "position error, final" in capsys.readouterr().out


def test_every_recorded_command_is_recomputed_bit_identically(
    recorded: Recorded, tmp_path: Path, verb: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(recorded[1] / "bag", tmp_path / "bag")  # the bag alone
    assert verb("replay", "bag", "--verify") == 0
    assert "301 commands over 3 s: max |delta tau| = 0 N, 0 N·m" in capsys.readouterr().out
    assert verb("replay", "bag", "--verify", "--set", "controller.hierarchical_printed.sway_weight=0.002") == 1
    assert "commands differ, the first at t = 0 s" in capsys.readouterr().out
