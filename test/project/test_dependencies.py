"""What the packages import is declared: for pip in setup.py and requirements.in, for ROS in package.xml."""

import ast
import re
import sys
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

from vessel_hsmc_ros.cli.command import LIBRARIES
from vessel_hsmc_ros.core.node_list import PROGRAMS

ROOT = Path(__file__).resolve().parents[2]
OWN = {"vessel_hsmc_ros", "vessel_sim_node"}
BUILT = "vessel_hsmc_msgs"
"""What setup.py builds, for colcon, together with the package."""

FROM_FIRMWARE = "px4_msgs"
"""What who needs it builds from the release of the firmware; the node names that."""

DISTRIBUTIONS = {"yaml": "pyyaml", "foxglove": "foxglove-sdk"}
"""Distributions that are not named like their module."""

PYPI_ONLY = {
    *{"SALib", "casadi", "distributed", "foxglove", "gymnasium", "llvmlite", "lz4", "mcap", "optuna"},
    *{"pandas", "plotly", "pyarrow", "pymavlink", "rosbags", "zstandard"},
}
"""Modules without a rosdep key, or only for an extra; the README names the way to install them."""


@cache
def imported() -> frozenset[str]:
    """The top-level modules that the two packages import, without the standard library and themselves."""
    found: set[str] = set()
    for path in (path for package in OWN for path in (ROOT / package).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                found.add((node.module or "").partition(".")[0])
    return frozenset(found - set(sys.stdlib_module_names) - OWN)


def declared_in_setup() -> set[str]:
    """The distributions in `install_requires` and `extras_require` of setup.py."""
    keywords = [
        keyword.value
        for node in ast.walk(ast.parse((ROOT / "setup.py").read_text(encoding="utf-8")))
        if isinstance(node, ast.Call)
        for keyword in node.keywords
        if keyword.arg in ("install_requires", "extras_require")
    ]
    strings = [node.value for value in keywords for node in ast.walk(value) if isinstance(node, ast.Constant)]
    return {re.split(r"[\[<>=]", str(string))[0] for string in strings}


def declared_in_package_xml() -> set[str]:
    """The packages and rosdep keys that are needed to run."""
    tree = ElementTree.parse(ROOT / "package.xml")  # noqa: S314 - our own file
    return {str(element.text) for tag in ("depend", "exec_depend") for element in tree.iter(tag)}


def ros_packages() -> set[str]:
    names = {"rclpy", "launch", "launch_ros"}
    return {name for name in imported() if name in names or name.endswith(("_msgs", "_srvs", "_interfaces"))}


def test_setup_declares_every_library_that_is_imported() -> None:
    libraries = imported() - ros_packages()
    assert {DISTRIBUTIONS.get(name, name) for name in libraries} - declared_in_setup() == set()


def test_package_xml_declares_every_ros_package_that_is_imported() -> None:
    assert ros_packages() - declared_in_package_xml() == {BUILT, FROM_FIRMWARE}


def test_package_xml_declares_every_library_that_has_a_rosdep_key() -> None:
    libraries = imported() - ros_packages() - PYPI_ONLY
    assert {f"python3-{name}" for name in libraries} - declared_in_package_xml() == set()


def test_nodes_alone_need_no_library_of_the_command_and_pip_is_called_only_where_it_may_install() -> None:
    from catkin_pkg.package import parse_package

    def needed(**variables: str) -> set[str]:
        package = parse_package(str(ROOT))
        package.evaluate_conditions(variables)
        found = {each.name for each in package.exec_depends if each.evaluated_condition}
        return {name.removeprefix("python3-") for name in found if "python3" in name or "mcap" in name}

    nodes = {"geographiclib", "numpy", "scipy", "yaml"}
    command = {"click", "defusedxml", "jinja2", "matplotlib", "numba", "rich"}
    assert needed(VESSEL_HSMC_ROS_NODES_ONLY="1") == nodes
    assert needed() == nodes | command
    assert needed(PIP_BREAK_SYSTEM_PACKAGES="1") == nodes | command | {"mcap-ros2-support", "rosbags-pip"}


def test_the_table_of_libraries_names_what_each_program_declares() -> None:
    rows = (ROOT / "docs" / "installing.md").read_text(encoding="utf-8").partition("## Who needs")[2].splitlines()
    declared = LIBRARIES | {each.executable: each.libraries for each in PROGRAMS.values()}
    for name, libraries in declared.items():
        (row,) = (row.split(" | ")[1] for row in rows if f"`{name}`" in row.partition(" | ")[0])
        assert {DISTRIBUTIONS.get(each, each) for each in libraries} <= set(re.findall(r"[\w-]+", row)), name


def test_both_packages_have_the_same_version() -> None:
    versions = [ElementTree.parse(ROOT / folder / "package.xml").findtext("version") for folder in (".", "msg_defs")]  # noqa: S314
    assert versions[0] == versions[1]


def test_the_version_is_not_repeated_elsewhere() -> None:
    assert "version=ElementTree" in (ROOT / "setup.py").read_text(encoding="utf-8")
    assert not re.search(r"^version:", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE)
