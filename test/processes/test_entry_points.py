"""The executables of the nodes where a library is missing."""

import os
import subprocess
import sys
from pathlib import Path

import definitions
import pytest
from durations import rest_long

from vessel_hsmc_ros.cli.command import VERBS
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.node_list import GROUP, LOOP, PROGRAMS

ANALYSIS = (
    *("click", "foxglove", "geographiclib", "jinja2", "llvmlite", "lz4", "matplotlib", "mcap", "mcap_ros2", "numba", "optuna"),
    *("plotly", "rich", "rosbags", "scipy", "zstandard"),
)
"""Libraries that nodes and verbs need only where they declare it."""


WORKSPACE = "/opt/ros/jazzy"


def code_without(modules: tuple[str, ...], code: str) -> list[str]:
    """The command that runs Python code in which modules cannot be imported."""
    return [sys.executable, "-c", f"import sys; sys.modules.update(dict.fromkeys({modules!r})); {code}"]


@pytest.mark.parametrize(
    ("executable", "workspace"),
    rest_long(
        [
            *(("controller_node", ""), ("controller_node", WORKSPACE), ("vessel_sim_node", ""), ("vessel_sim_node", WORKSPACE)),
            *(("reference_ship_node", ""), ("recorder_node", WORKSPACE)),
        ],
        3,
    ),
)
def test_without_the_message_package_a_node_names_the_way_to_install_it_in_one_line(executable: str, workspace: str) -> None:
    code = f"from vessel_hsmc_ros.nodes import entry_points; sys.exit(entry_points.{executable}())"
    blocked = ("vessel_hsmc_msgs",)
    if executable in ("vessel_sim_node", "recorder_node"):
        blocked = ("rclpy",)  # these two use no message of the package itself
    environment = {**os.environ, "AMENT_PREFIX_PATH": workspace}
    done = subprocess.run(code_without(blocked, code), env=environment, capture_output=True, text=True, timeout=120.0)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert f"{blocked[0]} is not installed: " in line
    remedy = "by `colcon build`" if workspace else "make wheels"
    assert (remedy in line) == (blocked[0] == "vessel_hsmc_msgs")
    assert ("pip install 'ros-jazzy-rclpy" in line) == (blocked[0] == "rclpy")


@pytest.mark.parametrize(
    ("module", "remedy"),
    rest_long([("rclpy", "nodes need ROS 2"), ("vessel_hsmc_msgs", "`pip install` its wheel"), ("rich", "`pip install rich`")]),
)
def test_the_command_run_names_a_missing_module_and_its_remedy(tmp_path: Path, module: str, remedy: str) -> None:
    code = "sys.argv[1:] = ['run', 'case2_tracking']; from vessel_hsmc_ros.cli.main import main; sys.exit(main())"
    environment = {name: value for name, value in os.environ.items() if name != "AMENT_PREFIX_PATH"}
    command = code_without((module,), code)
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120.0)
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"error: {module} is not installed: {remedy}")
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("name", rest_long(["controller", "vessel_sim", "reference_ship"]))
def test_a_node_of_the_loop_runs_without_the_analysis_libraries(name: str, tmp_path: Path) -> None:
    """It starts, and ends in order after SIGINT, whose handler is installed before rclpy is initialised."""
    code = (
        "import signal, threading, time\n"
        f"from {LOOP[name].source} import {LOOP[name].kind} as Kind; from vessel_hsmc_ros.nodes.process import run_node\n"
        "sys.argv[1:] = ['--ros-args', '-p', 'lockstep:=false']\n"
        "def interrupt():\n"
        "    import rclpy\n"
        "    while not rclpy.ok():\n"
        "        time.sleep(0.01)\n"
        "    signal.raise_signal(signal.SIGINT)\n"
        "threading.Thread(target=interrupt, daemon=True).start()\n"
        "sys.exit(run_node(Kind))"
    )
    done = subprocess.run(code_without(ANALYSIS, code), cwd=tmp_path, capture_output=True, text=True, timeout=120.0)
    assert "ModuleNotFoundError" not in done.stderr
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", rest_long([GROUP, "controller", "vessel_sim"]))
def test_a_node_that_is_interrupted_while_it_imports_ends_without_a_traceback(name: str, tmp_path: Path) -> None:
    (tmp_path / "yaml.py").write_text("import signal\nsignal.raise_signal(signal.SIGINT)\n", encoding="utf-8")
    path = os.pathsep.join(filter(None, [str(tmp_path), os.environ.get("PYTHONPATH")]))
    command = [sys.executable, "-m", "vessel_hsmc_ros.nodes", name]
    done = subprocess.run(command, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, timeout=120.0)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_path_that_needs_scipy_is_refused_in_one_line_where_it_is_missing() -> None:
    code = "from vessel_hsmc_ros.nodes import entry_points; sys.exit(entry_points.reference_ship_node())"
    command = [
        *code_without(("scipy",), code),
        "--ros-args",
        "--params-file",
        str(share_directory() / "config" / "waypoints.yaml"),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120.0)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert "scipy is not installed: " in line


def import_without(absent: tuple[str, ...], modules: list[str]) -> str:
    """What Python reports when it imports modules where libraries are absent; empty if it can."""
    code = f"from importlib import import_module as load; [load(each) for each in {modules!r}]"
    environment = {**os.environ, **(definitions.environment("px4_msgs") or {})}
    done = subprocess.run(code_without(absent, code), env=environment, capture_output=True, text=True, timeout=120.0)
    return done.stderr


@pytest.mark.parametrize("declaring", rest_long([False, True]), ids=["nodes_without_libraries", "nodes_with_libraries"])
def test_nodes_import_no_library_but_those_they_declare(declaring: bool) -> None:
    absent = {"px4"} if definitions.environment("px4_msgs") is None else set()
    programs = [program for name, program in PROGRAMS.items() if bool(program.libraries) == declaring and name not in absent]
    declared = {name for program in programs for name in program.libraries}
    modules = [program.source for program in programs]
    assert import_without(tuple(name for name in ANALYSIS if name not in declared), modules) == ""


HELP_WITHOUT = """
from click.testing import CliRunner
from vessel_hsmc_ros.cli.command import cli
for verb in {verbs!r}:
    shown = CliRunner().invoke(cli, [verb, "--help"])
    assert shown.exit_code == 0 and "Usage: " in shown.output, (verb, shown.output, shown.exception)
"""


def test_the_help_of_every_verb_is_shown_where_all_libraries_are_missing_that_verbs_declare() -> None:
    absent = tuple(name for name in ANALYSIS if name not in ("click", "rich"))
    command = code_without(("rclpy", "vessel_hsmc_msgs", *absent), "exec(sys.argv[1])")
    done = subprocess.run([*command, HELP_WITHOUT.format(verbs=[*VERBS])], capture_output=True, text=True, timeout=120.0)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", rest_long(["controller", "recorder", "vessel_sim"]))
def test_a_node_run_by_its_name_without_ros_names_the_remedy_in_one_line(name: str) -> None:
    code = f"import runpy; sys.argv[1:] = [{name!r}]; runpy.run_module('vessel_hsmc_ros.nodes', None, '__main__')"
    command = code_without(("rclpy",), code)
    done = subprocess.run(command, capture_output=True, text=True, timeout=120.0)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert "rclpy is not installed: nodes need ROS 2" in line
