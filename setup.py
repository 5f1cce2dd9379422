"""Installs the nodes, the command and the data files, for colcon and for pip alike; colcon has the messages built as well."""

import os
import runpy
import subprocess
import sys
import sysconfig
from pathlib import Path
from xml.etree import ElementTree

from setuptools import Command, find_packages, setup
from setuptools.command.develop import develop
from setuptools.command.install import install

ROOT = Path(__file__).resolve().parent
PACKAGE = "vessel_hsmc_ros"
SHARE = f"share/{PACKAGE}"


def data_files() -> list[tuple[str, list[str]]]:
    """List the files to install below the prefix: resource marker, package.xml, config and launch."""
    files = [
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (SHARE, ["package.xml"]),
        # Bags contain the definitions of their messages, also where the messages are not built.
        (f"{SHARE}/msg_defs/msg", sorted(map(str, Path("msg_defs/msg").glob("*.msg")))),
    ]
    for top in ("config", "launch"):
        for folder in [Path(top), *(path for path in Path(top).rglob("*") if path.is_dir())]:
            names = sorted(str(path) for path in folder.iterdir() if path.suffix in (".json", ".py", ".rviz", ".xml", ".yaml"))
            if names:
                files.append((f"{SHARE}/{folder.as_posix()}", names))
    return files


def executables() -> list[str]:
    """List the executables of the nodes, as the package's list of nodes names them."""
    listed = runpy.run_path(str(ROOT / PACKAGE / "core" / "node_list.py"))
    programs = listed["PROGRAMS"].values()
    return [f"{each.executable} = {PACKAGE}.nodes.entry_points:{each.executable}" for each in programs]


def build_messages(folder: Path) -> None:
    """Build the message package into the prefix that colcon installs into, unless colcon has built it as a package of its own.

    colcon and rosdep do not search below a folder that has a package.xml, and so do not find that of msg_defs by themselves. pip
    takes the messages from a wheel.

    Args:
        folder: Where CMake builds.
    """
    base = getattr(sys, "real_prefix", None)  # colcon replaces the prefix while it runs this file
    prefixes = [Path(each) for each in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if each]
    built_by_colcon = any((prefix / "share" / "colcon-core" / "packages" / "vessel_hsmc_msgs").is_file() for prefix in prefixes)
    if base is None or not prefixes or built_by_colcon:
        return
    within = sysconfig.get_path("purelib", "posix_prefix", {"base": sys.prefix})
    options = {
        "CMAKE_INSTALL_PREFIX": sys.prefix,
        "CMAKE_PREFIX_PATH": os.environ["AMENT_PREFIX_PATH"].replace(os.pathsep, ";"),
        "PYTHON_INSTALL_DIR": os.path.relpath(within, sys.prefix),
        "Python3_EXECUTABLE": sys.executable,
        "BUILD_TESTING": "OFF",
    }
    paths = [path for path in os.environ.get("PYTHONPATH", "").split(os.pathsep) if "prefix_override" not in path]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    configure = ["cmake", "-S", ROOT / "msg_defs", "-B", folder, *(f"-D{name}={value}" for name, value in options.items())]
    for command in (configure, ["cmake", "--build", folder, "--parallel"], ["cmake", "--install", folder]):
        subprocess.run([*map(str, command)], env=environment, check=True)  # noqa: S603 - our own arguments


def with_messages(command: type[Command]) -> type[Command]:
    """A command of setuptools that builds the messages after its own work."""

    class WithMessages(command):  # type: ignore[valid-type, misc]
        def run(self) -> None:
            super().run()
            build_messages(Path(self.get_finalized_command("build").build_base) / "messages")

    return WithMessages


setup(
    name=PACKAGE,
    version=ElementTree.parse("package.xml").findtext("version"),  # noqa: S314 - our own file
    description="Hierarchical sliding-mode control of underactuated ships over ROS 2",
    long_description=(ROOT / "README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    license="Apache-2.0",
    license_files=["LICENSE"],
    maintainer="vessel_hsmc_ros maintainers",
    keywords=["marine control", "sliding mode control", "underactuated vessel", "ROS 2"],
    classifiers=[
        "Development Status :: 4 - Beta",
        "Environment :: Console",
        "Intended Audience :: Science/Research",
        "Operating System :: POSIX :: Linux",
        *(f"Programming Language :: Python :: 3.{minor}" for minor in range(10, 14)),
        "Topic :: Scientific/Engineering",
    ],
    python_requires=">=3.10,<3.14",
    cmdclass={"install": with_messages(install), "develop": with_messages(develop)},
    packages=find_packages(exclude=["test", "test.*", "msg_defs*", "benchmarks*"]),
    package_data={
        PACKAGE: ["py.typed"],
        "vessel_sim_node": ["py.typed"],
        f"{PACKAGE}.studies.campaign": ["assets/*"],
        f"{PACKAGE}.report": ["assets/*"],
    },
    data_files=data_files(),
    # At least what Ubuntu 24.04 has, beside Jazzy.
    install_requires=[
        "click>=8.1",
        "defusedxml>=0.7.1",
        "geographiclib>=2.0",
        "jinja2>=3.1",
        "lz4>=4.0",
        "matplotlib>=3.6",
        "mcap>=1.1",
        "numpy>=1.26",
        "plotly>=5.18",
        "pyyaml>=6.0",
        "rich>=13.7",
        "rosbags>=0.9.20",
        "scipy>=1.11",
        "setuptools",
        "zstandard>=0.22",
    ],
    extras_require={
        "analysis": ["pandas", "pyarrow"],
        "campaign": ["distributed", "llvmlite>=0.41", "numba>=0.58", "optuna", "pandas", "pyarrow", "SALib"],
        "compiled": ["llvmlite>=0.41", "numba>=0.58"],
        "gym": ["gymnasium", "llvmlite>=0.41", "numba>=0.58"],
        "live": ["foxglove-sdk"],
        "mavlink": ["pymavlink", "pyserial"],
        "nmpc": ["casadi"],
        "parquet": ["pyarrow"],
        "ros": ["ros-jazzy-rclpy[fastrtps]", "ros-jazzy-common-interfaces"],
        "test": ["hypothesis", "mcap-ros2-support", "mpmath", "pytest", "selenium", "sympy", "websockets"],
    },
    zip_safe=False,
    entry_points={
        "console_scripts": [
            *executables(),
            "vessel-hsmc = vessel_hsmc_ros.cli.main:main",
        ],
        # Laws to compare with, as an installed package offers its own.
        "vessel_hsmc_ros.laws": [
            "ashrafiuon = vessel_hsmc_ros.studies.rivals.ashrafiuon:AshrafiuonController",
            "backstepping = vessel_hsmc_ros.studies.rivals.backstepping:BacksteppingController",
            "hand_position = vessel_hsmc_ros.studies.rivals.hand_position:HandPositionController",
            "nmpc = vessel_hsmc_ros.studies.rivals.nmpc:NmpcController",
        ],
    },
)
