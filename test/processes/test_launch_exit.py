"""How the launch file ends: its exit code, and what a second launch does to the first."""

import os
import signal
import sys
from pathlib import Path
from typing import Any

import pytest
from harness import children, command_line

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
arguments = [argument.split(":=") for argument in sys.argv[1:]]
service.include_launch_description(LaunchDescription([IncludeLaunchDescription(source, launch_arguments=arguments)]))
sys.exit(service.run())
"""


@pytest.fixture
def launched(start: Any, tmp_path: Path) -> Any:
    """Launch the closed loop, and wait until its plant has started."""

    def launch(*arguments: str, wait: bool = True) -> Any:
        command = start(Path(sys.executable), "-c", LAUNCH, "record:=false", f"output:={tmp_path / 'runs'}", *arguments)
        if wait:
            command.until(lambda: "plant at" in command.text, 30.0)
        return command

    return launch


def test_a_run_that_reaches_its_end_exits_with_0(launched: Any, tmp_path: Path) -> None:
    scenario = tmp_path / "short.yaml"
    scenario.write_text("/**/vessel_sim: {ros__parameters: {duration: 2.0}}\n")
    assert launched(f"scenario:={scenario}").wait(40.0) == 0


@pytest.mark.parametrize("name", ["controller", "reference_ship", "vessel_sim"])
def test_a_killed_node_ends_the_launch_with_1_and_is_named(launched: Any, name: str) -> None:
    command = launched()
    (pid,) = [pid for pid in children(command.popen.pid) if f"__node:={name}" in command_line(pid)]
    os.kill(pid, signal.SIGKILL)
    assert command.wait(30.0) == 1
    assert f"{name} failed with exit code -9" in command.text


def test_a_ctrl_c_that_reaches_the_nodes_twice_exits_with_0(launched: Any) -> None:
    command = launched()
    os.killpg(command.popen.pid, signal.SIGINT)
    assert command.wait(30.0) == 0, command.text
    assert "process has died" not in command.text


def test_a_second_launch_is_refused_in_one_line_and_the_first_goes_on(launched: Any) -> None:
    first, second = launched(), launched(wait=False)
    assert second.wait(30.0) == 1
    errors = [line for line in second.text.splitlines() if "[ERROR]" in line]
    assert len(errors) == 1
    assert "another run uses ROS domain" in errors[0]
    assert first.popen.poll() is None
    os.killpg(first.popen.pid, signal.SIGINT)
    assert first.wait(30.0) == 0
