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


@pytest.mark.long
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


@pytest.mark.long
def test_plain_colcon_build_in_a_workspace_builds_the_package_with_its_messages(source: Path) -> None:
    underlay = {"AMENT_PREFIX_PATH": sys.prefix, "CMAKE_PREFIX_PATH": sys.prefix}
    underlay |= {"CFLAGS": "-O0", "CXXFLAGS": "-O0"}  # compiles in less time
    underlay["PATH"] = f"{sys.prefix}/bin{os.pathsep}{os.environ['PATH']}"
    workspace = source.parent
    output = check_output("colcon", "build", cwd=workspace, environment=underlay, deadline=300.0)
    assert "1 package finished" in output
    install = workspace / "install"
    executables = install / "vessel_hsmc_ros" / "lib" / "vessel_hsmc_ros"
    assert {path.name for path in executables.iterdir()} == set(EXECUTABLES)
    share = install / "vessel_hsmc_ros" / "share" / "vessel_hsmc_ros"
    assert {path for top in ("config", "launch") for path in data(top) if not (share / path).is_file()} == set()

    run = f"{executables}/vessel-hsmc run case2_tracking --set vessel_sim.duration=1 --no-page"
    where = "python -c 'import vessel_hsmc_ros, vessel_hsmc_msgs as m; print(vessel_hsmc_ros.__file__, m.__file__)'"
    script = f". install/local_setup.sh && cd log && {where} && {run}"
    output = check_output("sh", "-c", script, cwd=workspace, environment=underlay)
    assert output.count(f"{install}/vessel_hsmc_ros/lib") == 2
    assert "messages recorded" in output


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
