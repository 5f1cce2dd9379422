"""Installed by pip or built by colcon, the package is complete and runs from its installation, not from the checkout."""

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from source_tree import copy_source

from vessel_hsmc_ros.core.node_list import PROGRAMS

ROOT = Path(__file__).resolve().parents[2]
EXECUTABLES = (*(program.executable for program in PROGRAMS.values()), "vessel-hsmc")
PACKAGES = ("vessel_hsmc_ros", "vessel_sim_node")
OUR_PACKAGES = sysconfig.get_path("purelib")
UNDERLAY = {
    "AMENT_PREFIX_PATH": sys.prefix,
    "CMAKE_PREFIX_PATH": sys.prefix,
    "PATH": f"{sys.prefix}/bin{os.pathsep}{os.environ['PATH']}",
    "CFLAGS": "-O0",  # compiles in less time
    "CXXFLAGS": "-O0",
}

LISTENER = """\
<package format="3">
  <name>listener</name>
  <version>0.0.0</version>
  <description>Listens to the controller.</description>
  <maintainer email="maintainers@example.org">maintainers</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <depend>vessel_hsmc_msgs</depend>
  <export><build_type>ament_cmake</build_type></export>
</package>
"""


def check_output(*command: str | Path, cwd: Path, environment: dict[str, str] | None = None, deadline: float = 120.0) -> str:
    done = subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, timeout=deadline, env={**os.environ, **(environment or {})}
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the source like a fresh clone."""
    return copy_source(tmp_path_factory.mktemp("clone") / "vessel_hsmc_ros")


def modules() -> set[Path]:
    return {path.relative_to(ROOT) for top in PACKAGES for path in (ROOT / top).rglob("*.py")}


def assets() -> set[Path]:
    paths = ((ROOT / package).rglob(pattern) for package in PACKAGES for pattern in ("assets/*", "py.typed"))
    return {path.relative_to(ROOT) for found in paths for path in found}


def data(top: str) -> set[Path]:
    return {path.relative_to(ROOT) for path in (ROOT / top).rglob("*") if path.is_file() and path.suffix != ".pyc"}


@pytest.mark.alone
def test_pip_installs_all_modules_config_launch_and_executables(source: Path, tmp_path: Path) -> None:
    prefix = tmp_path / "venv"
    check_output(sys.executable, "-m", "venv", "--without-pip", prefix, cwd=tmp_path)
    pip = (sys.executable, "-m", "pip", "--python", prefix / "bin" / "python")
    check_output(*pip, "install", "-qq", "--no-deps", source, cwd=tmp_path)
    packages = next(prefix.glob("lib/python3.*/site-packages"))
    assert {path for path in modules() | assets() if not (packages / path).is_file()} == set()
    share = prefix / "share" / "vessel_hsmc_ros"
    assert {path for top in ("config", "launch") for path in data(top) if not (share / path).is_file()} == set()
    assert (prefix / "share" / "ament_index" / "resource_index" / "packages" / "vessel_hsmc_ros").is_file()
    assert (share / "package.xml").is_file()
    assert {name for name in EXECUTABLES if not (prefix / "bin" / name).is_file()} == set()

    # The libraries come from this environment, the package itself from the new one.
    environment = {"PYTHONPATH": f"{packages}{os.pathsep}{OUR_PACKAGES}", "AMENT_PREFIX_PATH": sys.prefix}
    where = "import vessel_hsmc_ros, vessel_sim_node as v; print(vessel_hsmc_ros.__file__, v.__file__)"
    output = check_output(prefix / "bin" / "python", "-c", where, cwd=tmp_path, environment=environment)
    assert output.count(str(packages)) == 2
    command = (prefix / "bin" / "vessel-hsmc", "run", "case2_tracking", "--set", "vessel_sim.duration=1", "--no-page")
    assert "messages recorded" in check_output(*command, cwd=tmp_path, environment=environment)


@pytest.mark.alone
def test_plain_colcon_build_in_a_workspace_builds_the_package_with_its_messages(source: Path) -> None:
    workspace = source.parent
    output = check_output("colcon", "build", cwd=workspace, environment=UNDERLAY, deadline=300.0)
    assert "1 package finished" in output
    install = workspace / "install"
    executables = install / "vessel_hsmc_ros" / "lib" / "vessel_hsmc_ros"
    assert {path.name for path in executables.iterdir()} == set(EXECUTABLES)
    share = install / "vessel_hsmc_ros" / "share" / "vessel_hsmc_ros"
    assert {path for top in ("config", "launch") for path in data(top) if not (share / path).is_file()} == set()

    run = f"{executables}/vessel-hsmc run case2_tracking --set vessel_sim.duration=1 --no-page"
    where = "python -c 'import vessel_hsmc_ros, vessel_hsmc_msgs as m; print(vessel_hsmc_ros.__file__, m.__file__)'"
    script = f". install/local_setup.sh && cd log && {where} && {run}"
    output = check_output("sh", "-c", script, cwd=workspace, environment=UNDERLAY)
    assert output.count(f"{install}/vessel_hsmc_ros/lib") == 2
    assert "messages recorded" in output


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a workspace with this package and one of a user, which needs the messages by their name."""
    workspace = tmp_path_factory.mktemp("workspace")
    copy_source(workspace / "src" / "vessel_hsmc_ros")
    listener = workspace / "src" / "listener"
    listener.mkdir()
    (listener / "package.xml").write_text(LISTENER, encoding="utf-8")
    find = "find_package(ament_cmake REQUIRED)\nfind_package(vessel_hsmc_msgs REQUIRED)\nament_package()\n"
    (listener / "CMakeLists.txt").write_text(f"cmake_minimum_required(VERSION 3.20)\nproject(listener)\n{find}", encoding="utf-8")
    return workspace


def built_in_turn(workspace: Path, *options: str) -> list[str]:
    found = check_output(Path(sys.prefix) / "bin" / "colcon", "list", "--topological-order", *options, cwd=workspace)
    return [line.split("\t")[0] for line in found.splitlines()]


def unknown_in(*folders: Path) -> set[str]:
    """The packages of this repository that rosdep would look for elsewhere, as it reads the files of the folders."""
    from catkin_pkg.packages import find_packages

    packages = [package for folder in folders for package in find_packages(str(folder)).values()]
    kinds = ("buildtool_depends", "build_depends", "exec_depends", "test_depends")
    needed = {each.name for package in packages for kind in kinds for each in getattr(package, kind)}
    return {name for name in needed if name.startswith("vessel_")} - {package.name for package in packages}


def test_colcon_and_rosdep_find_the_messages_as_a_package_by_a_link_or_a_path(workspace: Path) -> None:
    source, messages = workspace / "src", workspace / "src" / "vessel_hsmc_ros" / "msg_defs"
    assert built_in_turn(workspace) == ["listener", "vessel_hsmc_ros"]
    assert unknown_in(source) == {"vessel_hsmc_msgs"}  # that of the listener

    order = ["vessel_hsmc_msgs", "listener", "vessel_hsmc_ros"]
    assert built_in_turn(workspace, "--base-paths", str(source), str(messages)) == order
    assert unknown_in(source, messages) == set()

    link = source / "vessel_hsmc_msgs"
    link.symlink_to("vessel_hsmc_ros/msg_defs")
    try:
        assert built_in_turn(workspace) == order
        assert unknown_in(source) == set()
    finally:
        link.unlink()


@pytest.mark.alone
def test_the_messages_are_built_once_where_colcon_finds_them_as_a_package(workspace: Path) -> None:
    paths = ("--base-paths", "src", "src/vessel_hsmc_ros/msg_defs")
    output = check_output("colcon", "build", *paths, cwd=workspace, environment=UNDERLAY, deadline=300.0)
    assert "3 packages finished" in output
    found = {path.relative_to(workspace / "install").parts[0] for path in workspace.rglob("install/*/lib/*/site-packages/*_msgs")}
    assert found == {"vessel_hsmc_msgs"}
    script = ". install/local_setup.sh && cd log && python -c 'import vessel_hsmc_ros, vessel_hsmc_msgs as m; print(m.__file__)'"
    output = check_output("sh", "-c", script, cwd=workspace, environment=UNDERLAY)
    assert f"{workspace}/install/vessel_hsmc_msgs/lib" in output


def test_rosdep_and_colcon_find_one_package_in_a_workspace_whose_dependencies_exist_elsewhere(source: Path) -> None:
    """rosdep searches like catkin_pkg, and like colcon not below a package; it stops at a name that it cannot resolve."""
    from catkin_pkg.packages import find_packages

    found = find_packages(str(source.parent))
    assert [package.name for package in found.values()] == ["vessel_hsmc_ros"]
    (package,) = found.values()
    needed = [*package.buildtool_depends, *package.build_depends, *package.exec_depends, *package.test_depends]
    assert "vessel_hsmc_msgs" not in {dependency.name for dependency in needed}
    output = check_output(Path(sys.prefix) / "bin" / "colcon", "list", "--names-only", cwd=source.parent)
    assert output.split() == ["vessel_hsmc_ros"]


def test_the_package_needs_what_its_messages_need() -> None:
    from catkin_pkg.package import parse_package

    outer, inner = parse_package(str(ROOT)), parse_package(str(ROOT / "msg_defs"))
    for kind in ("buildtool_depends", "build_depends", "exec_depends"):
        assert {each.name for each in getattr(inner, kind)} <= {each.name for each in getattr(outer, kind)}, kind
