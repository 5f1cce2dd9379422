"""How the launch file ends: its exit code, and what a second launch does to the first."""

import os
import signal
import sys
from pathlib import Path
from typing import Any

import pytest
from harness import children, command_line

from vessel_hsmc_ros.bags.reader import open_bag

WHERE_TO_RUN = "comes with a ROS install only: source it, colcon build, and run this again"
pytest.importorskip("launch", reason=f"launch {WHERE_TO_RUN}")
pytest.importorskip("launch_ros", reason=f"launch_ros {WHERE_TO_RUN}")

LAUNCH = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from vessel_hsmc_ros.core.install_paths import share_directory

source = PythonLaunchDescriptionSource(str(share_directory() / "launch" / "closed_loop.launch.py"))
service = LaunchService()
loops = " ".join(sys.argv[1:]).split(" and ")[-2:]
arguments = [[argument.split(":=") for argument in loop.split()] for loop in loops]
service.include_launch_description(
    LaunchDescription([IncludeLaunchDescription(source, launch_arguments=each) for each in arguments])
)
sys.exit(service.run())
"""


@pytest.fixture
def launched(start: Any, tmp_path: Path) -> Any:
    """Launch the closed loop, and wait until its plant has started."""

    def launch(*arguments: str, wait: bool = True) -> Any:
        command = start(Path(sys.executable), "-c", LAUNCH, "record:=false", f"output:={tmp_path / 'runs'}", *arguments)
        if wait:
            command.until(lambda: "plant at" in command.text)
        return command

    return launch


@pytest.mark.parametrize("composed", ["true", "false"])
def test_a_run_that_reaches_its_end_exits_with_0(launched: Any, tmp_path: Path, composed: str) -> None:
    scenario = tmp_path / "short.yaml"
    scenario.write_text("/**/vessel_sim: {ros__parameters: {duration: 2.0}}\n")
    assert launched(f"scenario:={scenario}", f"composed:={composed}").wait() == 0


@pytest.mark.parametrize("name", ["controller", "reference_ship", "vessel_sim"])
def test_a_killed_node_ends_the_launch_with_1_and_is_named(launched: Any, name: str) -> None:
    command = launched()
    (pid,) = [pid for pid in children(command.popen.pid) if f"__node:={name}" in command_line(pid)]
    os.kill(pid, signal.SIGKILL)
    assert command.wait() == 1
    assert f"{name} failed with exit code -9" in command.text


def test_a_killed_process_of_all_nodes_ends_the_launch_with_1_and_nodes_in_real_time_share_none(launched: Any) -> None:
    command = launched("composed:=true")
    (pid,) = [pid for pid in children(command.popen.pid) if "node_group" in command_line(pid)]
    os.kill(pid, signal.SIGKILL)
    assert command.wait() == 1
    assert "node_group failed with exit code -9" in command.text
    refused = launched("composed:=true", "real_time:=true", wait=False)
    assert refused.wait() == 1
    assert "composed must be false in real time" in refused.text


def test_a_ctrl_c_that_reaches_the_nodes_twice_exits_with_0(launched: Any) -> None:
    command = launched()
    os.killpg(command.popen.pid, signal.SIGINT)
    assert command.wait() == 0, command.text
    assert "process has died" not in command.text


def test_a_second_launch_is_refused_in_one_line_and_the_first_goes_on(launched: Any) -> None:
    first, second = launched(), launched(wait=False)
    assert second.wait() == 1
    errors = [line for line in second.text.splitlines() if "[ERROR]" in line]
    assert len(errors) == 1
    assert "another run uses ROS domain" in errors[0]
    assert first.popen.poll() is None
    os.killpg(first.popen.pid, signal.SIGINT)
    assert first.wait() == 0


def test_of_two_loops_in_one_launch_the_second_goes_on_after_the_end_of_the_first(launched: Any, tmp_path: Path) -> None:
    arguments = []
    for name, duration, record in (("alpha", 1.0, "false"), ("beta", 6.0, "true")):
        scenario = tmp_path / f"{name}.yaml"
        scenario.write_text(f"/**/vessel_sim: {{ros__parameters: {{duration: {duration}}}}}\n")
        output = tmp_path / f"runs_{name}"
        own = [f"scenario:={scenario}", f"namespace:={name}", f"record:={record}", f"output:={output}"]
        arguments += ["and", *own, "real_time:=true", "law:=guided"]
    command = launched(*arguments)
    assert command.wait() == 0, command.text
    assert "[ERROR]" not in command.text
    (bag,) = (tmp_path / "runs_beta").glob("*/bag")
    assert open_bag(bag).run().time[-1] > 5.5
