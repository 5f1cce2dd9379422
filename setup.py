"""Installs the nodes, the command and the data files, for colcon and for pip alike."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

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


setup(
    name=PACKAGE,
    version=ElementTree.parse("package.xml").findtext("version"),  # noqa: S314 - our own file
    description="Hierarchical sliding-mode control of underactuated ships over ROS 2",
    license="Apache-2.0",
    python_requires=">=3.10",
    packages=find_packages(exclude=["test", "test.*", "msg_defs*", "benchmarks*"]),
    package_data={
        PACKAGE: ["py.typed"],
        "vessel_sim_node": ["py.typed"],
        f"{PACKAGE}.campaign": ["assets/*"],
        f"{PACKAGE}.manoeuvres": ["assets/*"],
        f"{PACKAGE}.report": ["assets/*"],
    },
    data_files=data_files(),
    install_requires=[
        "click",
        "jinja2",
        "llvmlite",
        "lz4",
        "matplotlib",
        "mcap",
        "numba",
        "numpy",
        "plotly",
        "pyyaml",
        "rich",
        "rosbags",
        "scipy",
        "setuptools",
        "zstandard",
    ],
    extras_require={
        "analysis": ["pandas", "pyarrow"],
        "campaign": ["distributed", "optuna", "pandas", "pyarrow", "SALib"],
        "live": ["foxglove-sdk"],
        "nmpc": ["casadi"],
        "parquet": ["pyarrow"],
        "ros": ["ros-jazzy-rclpy[fastrtps]", "ros-jazzy-common-interfaces"],
        "test": ["hypothesis", "mcap-ros2-support", "mpmath", "pytest", "selenium", "sympy", "websockets"],
    },
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "vessel_sim_node = vessel_hsmc_ros.nodes.entry_points:vessel_sim_node",
            "reference_ship_node = vessel_hsmc_ros.nodes.entry_points:reference_ship_node",
            "controller_node = vessel_hsmc_ros.nodes.entry_points:controller_node",
            "thruster_allocation_node = vessel_hsmc_ros.nodes.entry_points:thruster_allocation_node",
            "fault_relay_node = vessel_hsmc_ros.nodes.entry_points:fault_relay_node",
            "recorder_node = vessel_hsmc_ros.nodes.entry_points:recorder_node",
            "marker_node = vessel_hsmc_ros.nodes.entry_points:marker_node",
            "watchdog_node = vessel_hsmc_ros.nodes.entry_points:watchdog_node",
            "live_node = vessel_hsmc_ros.nodes.entry_points:live_node",
            "vessel-hsmc = vessel_hsmc_ros.cli.main:main",
        ]
    },
)
