"""Variables that would mix two installations of ROS, or keep it from starting, are refused in one line that names them."""

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from vessel_hsmc_ros.core.exceptions import InstallationError
from vessel_hsmc_ros.nodes import ros_environment

rclpy = pytest.importorskip("rclpy", reason="ROS is not installed")
OWN = Path(sysconfig.get_path("purelib")) / "rclpy"
WHEELS = pytest.mark.skipif(not OWN.is_dir(), reason="ROS is that of a workspace")


def refusal() -> str:
    try:
        ros_environment.check_ros()
    except InstallationError as error:
        return str(error)
    return ""


def test_the_environment_of_the_tests_is_accepted() -> None:
    assert refusal() == ""
    ros_environment.check_messages()


def test_a_middleware_that_is_not_installed_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_other_cpp")
    assert refusal().startswith("RMW_IMPLEMENTATION = rmw_other_cpp is not installed, there is ")
    assert refusal().endswith("unset RMW_IMPLEMENTATION")


@WHEELS
def test_libraries_of_another_ros_are_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "librcl.so").touch()
    monkeypatch.setenv("LD_LIBRARY_PATH", os.pathsep.join(["/nowhere", str(tmp_path)]))
    assert refusal() == f"LD_LIBRARY_PATH has the ROS of {tmp_path} beside that of {sys.prefix}: unset LD_LIBRARY_PATH"


@WHEELS
def test_rclpy_from_elsewhere_is_refused_by_a_node_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "rclpy").mkdir()
    (tmp_path / "rclpy" / "__init__.py").touch()
    code = "import sys; from vessel_hsmc_ros.nodes import entry_points; sys.exit(entry_points.controller_node())"
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=60.0)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"[FATAL]: PYTHONPATH leads to rclpy in {tmp_path}")


@pytest.mark.parametrize("home", ["/proc/1", "", None])
def test_logs_go_elsewhere_where_there_is_no_home_that_can_be_written(monkeypatch: pytest.MonkeyPatch, home: str | None) -> None:
    if home is None:
        monkeypatch.delenv("HOME", raising=False)
    else:
        monkeypatch.setenv("HOME", home)
    monkeypatch.delenv("ROS_HOME", raising=False)
    monkeypatch.delenv("ROS_LOG_DIR", raising=False)
    monkeypatch.setattr(os, "environ", dict(os.environ))
    assert refusal() == ""
    assert os.environ["ROS_LOG_DIR"].startswith("/tmp/")  # noqa: S108


def test_a_log_folder_that_cannot_be_written_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_LOG_DIR", "/proc/nothing")
    assert refusal() == "ROS_LOG_DIR = /proc/nothing cannot be written: unset ROS_LOG_DIR"


def test_messages_of_another_version_are_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    definitions = tmp_path / "msg_defs" / "msg"
    definitions.mkdir(parents=True)
    (definitions / "Event.msg").write_text("std_msgs/Header header  # when\nfloat64[3] added\n", encoding="utf-8")
    monkeypatch.setattr(ros_environment, "share_directory", lambda: tmp_path)
    with pytest.raises(InstallationError, match=r"Event of .* is not that of this package: "):
        ros_environment.check_messages()


@pytest.mark.parametrize(("flags", "named"), [("0x9\n", False), ("0x8\n", True), ("", False), (None, False)])
def test_a_loopback_interface_that_is_down_is_named_with_what_brings_it_up(
    tmp_path: Path, flags: str | None, named: bool
) -> None:
    if flags is not None:
        (tmp_path / "flags").write_text(flags)
    text = ros_environment.loopback_down(tmp_path / "flags")
    assert ("ip link set lo up" in text) is named
    assert bool(text) is named
