"""What includes the launch file, and what is left of it where that is refused."""

import os
import re
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from harness import children, command_line

WHERE_TO_RUN = "comes with a ROS install only: source it, colcon build, and run this again"
pytest.importorskip("launch", reason=f"launch {WHERE_TO_RUN}")
pytest.importorskip("launch_ros", reason=f"launch_ros {WHERE_TO_RUN}")

HEAD = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import ExecuteProcess, GroupAction, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch_ros.actions import PushRosNamespace
from vessel_hsmc_ros.core.install_paths import share_directory

def included(name, **arguments):
    source = PythonLaunchDescriptionSource(str(share_directory() / "launch" / f"{name}.launch.py"))
    return IncludeLaunchDescription(source, launch_arguments=arguments.items())

def run(*actions):
    service = LaunchService()
    service.include_launch_description(LaunchDescription(actions))
    sys.exit(service.run())

"""


@pytest.fixture
def launched(start: Any, tmp_path: Path) -> Iterator[Any]:
    """Launch the actions of a Python expression in a process of its own; what goes on after the test is killed."""

    def launch(actions: str, **environment: str) -> Any:
        return start(Path(sys.executable), "-c", f"{HEAD}run({actions})", environment=environment)

    yield launch
    for pid in processes_with(str(tmp_path)):
        os.kill(pid, signal.SIGKILL)


def errors_of_launch(text: str) -> list[str]:
    """The lines by which launch itself reports an error."""
    return [line for line in text.splitlines() if line.startswith("[ERROR] [launch]")]


def processes_with(token: str) -> list[int]:
    """All processes of this machine that have a token in their command line, but those that launch them."""
    lines = {int(path.name): command_line(int(path.name)) for path in Path("/proc").glob("[0-9]*")}
    return [pid for pid, line in lines.items() if any(token in part for part in line) and "-c" not in line]


WRONG = {
    "scenario": ("nope", "scenario nope is unknown"),
    "law": ("nope", "nope"),
    "law_file": ("/nowhere/law.py", "law file /nowhere/law.py cannot be read"),
    "record": ("maybe", "record must be true or false (got 'maybe')"),
    "real_time": ("1", "real_time must be true or false (got '1')"),
    "namespace": ("a-b", "namespace must be names of letters, digits and _, separated by / (got 'a-b')"),
    "output": ("/dev/null", "/dev/null"),
}


@pytest.mark.parametrize("name", [*WRONG, "the namespace of the first"])
def test_nothing_that_was_launched_goes_on_where_a_second_include_is_refused(launched: Any, tmp_path: Path, name: str) -> None:
    first = {"namespace": "first", "real_time": "true", "law": "guided", "record": "false", "output": str(tmp_path)}
    value, expected = WRONG.get(name, ("first", "namespace:= in launch"))
    second = {**first, "namespace": "second", (name if name in WRONG else "namespace"): value}
    (tmp_path / "own").touch()
    own = f"ExecuteProcess(cmd=['tail', '-f', {str(tmp_path / 'own')!r}])"
    command = launched(f"{own}, included('closed_loop', **{first}), included('closed_loop', **{second})")
    assert command.wait() == 1
    errors = errors_of_launch(command.text)
    assert len(errors) == 1, command.text
    assert expected in errors[0]
    assert not processes_with(str(tmp_path))


def test_nothing_goes_on_where_the_second_vessel_has_no_parameters_file(launched: Any, tmp_path: Path) -> None:
    file = tmp_path / "boat.yaml"
    file.write_text("/**/controller: {ros__parameters: {law: guided}}\n")
    one, other = ({"namespace": name, "params_file": str(file)} for name in ("one", "other"))
    command = launched(f"included('controller', **{one}), included('controller', **{other | {'params_file': 'nope.yaml'}})")
    assert command.wait() == 1
    (error,) = errors_of_launch(command.text)
    assert "params_file must be the path of a ROS parameters file (got 'nope.yaml')" in error
    assert not processes_with(str(tmp_path))


@pytest.mark.parametrize("name", ["closed_loop", "controller"])
def test_missing_messages_are_named_in_one_line(launched: Any, tmp_path: Path, name: str) -> None:
    package = tmp_path / "vessel_hsmc_msgs"
    package.mkdir()
    (package / "__init__.py").write_text("raise ModuleNotFoundError('it is not installed', name='vessel_hsmc_msgs')\n")
    path = f"{tmp_path}:{':'.join(sys.path)}"
    command = launched(f"included({name!r}, output={str(tmp_path)!r})", PYTHONPATH=path)
    assert command.wait() == 1
    (error,) = errors_of_launch(command.text)
    assert "vessel_hsmc_msgs is not installed" in error
    assert "Traceback" not in command.text


def test_vessels_in_pushed_namespaces_are_two_and_have_frames_of_their_own(launched: Any, tmp_path: Path) -> None:
    scenario = tmp_path / "short.yaml"
    scenario.write_text("/**/vessel_sim: {ros__parameters: {duration: 1.0}}\n")
    arguments = {"scenario": str(scenario), "real_time": "True", "law": "guided", "record": "False", "output": str(tmp_path)}
    groups = [f"GroupAction([PushRosNamespace({name!r}), included('closed_loop', **{arguments})])" for name in ("a", "b")]
    command = launched(", ".join(groups))
    assert command.wait(200.0) == 0, command.text
    assert "/a/cmd_wrench" in command.text
    assert "/b/cmd_wrench" in command.text
    prefixes = [set(re.findall(r"frame_prefix: (\S+)", path.read_text())) for path in tmp_path.glob("*/params.yaml")]
    assert sorted(prefixes, key=str) == [{"a/"}, {"b/"}]


def test_a_controller_of_ones_own_vessel_takes_file_clock_and_log_level(launched: Any, tmp_path: Path) -> None:
    file = tmp_path / "boat.yaml"
    file.write_text("/**/controller: {ros__parameters: {law: guided, rate_hz: 20.0}}\n")
    options = {"params_file": str(file), "use_sim_time": "True", "log_level": "DEBUG", "reference": "false"}
    command = launched(f"GroupAction([PushRosNamespace('own'), included('controller', **{options})])")
    expected = "law guided at 20 Hz; real time on the simulated time of /clock; publishes /own/cmd_wrench"
    command.until(lambda: expected in command.text)
    (pid,) = children(command.popen.pid)
    assert "--log-level debug" in " ".join(command_line(pid))
    command.popen.send_signal(signal.SIGINT)
    assert command.wait() == 0
