"""The closed loop: plant, reference ship, controller, and a recorder if wanted.

ros2 launch vessel_hsmc_ros closed_loop.launch.py scenario:=case2_tracking record:=true
"""

from pathlib import Path
from typing import Any

from launch.actions import DeclareLaunchArgument, OpaqueFunction, SetEnvironmentVariable, Shutdown
from launch.substitutions import EnvironmentVariable, LaunchConfiguration
from launch_ros.actions import Node

from launch import LaunchContext, LaunchDescription
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.laws import LAWS
from vessel_hsmc_ros.runs.processes import PROFILES
from vessel_hsmc_ros.scenario.run_folder import make_run_folder
from vessel_hsmc_ros.scenario.scenario import for_nodes, load_scenario, scenario_names

EXECUTABLES = {
    "recorder": "recorder_node",
    "controller": "controller_node",
    "reference_ship": "reference_ship_node",
    "vessel_sim": "vessel_sim_node",
}


def start_nodes(context: LaunchContext) -> list[Any]:
    """The node actions, on a resolved parameters file in a run folder of their own."""
    said = {name: LaunchConfiguration(name).perform(context) for name in ("scenario", "law", "output", "namespace")}
    flags = {name: LaunchConfiguration(name).perform(context) == "true" for name in ("record", "real_time")}
    changes = for_nodes(recorded=flags["record"], real_time=flags["real_time"])
    if said["law"]:
        changes["controller.law"] = said["law"]
    scenario = load_scenario(said["scenario"], changes)
    folder = make_run_folder(Path(said["output"]), scenario.name)
    folder.write_parameters(scenario.with_bag(folder.bag.absolute(), folder.parameters.absolute()))
    return [
        Node(
            package="vessel_hsmc_ros",
            executable=executable,
            name=name,
            namespace=said["namespace"],
            parameters=[str(folder.parameters)],
            output="screen",
            on_exit=Shutdown(reason=f"{name} has ended"),
        )
        for name, executable in EXECUTABLES.items()
        if flags["record"] or name != "recorder"
    ]


def generate_launch_description() -> LaunchDescription:
    """What `ros2 launch` asks for."""
    flag = ["true", "false"]
    profiles = str(share_directory() / "config" / "fastdds.xml")
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "scenario", default_value="case2_tracking", description=f"One of {', '.join(scenario_names())}, or a YAML file."
            ),
            DeclareLaunchArgument("law", default_value="", choices=["", *LAWS], description="The law; empty: the scenario's."),
            DeclareLaunchArgument("record", default_value="true", choices=flag, description="Record an MCAP bag."),
            DeclareLaunchArgument("real_time", default_value="false", choices=flag, description="Run at the pace of the clock."),
            DeclareLaunchArgument("namespace", default_value="", description="Namespace of the vessel."),
            DeclareLaunchArgument("output", default_value="runs", description="Folder of the run folders."),
            SetEnvironmentVariable(PROFILES, EnvironmentVariable(PROFILES, default_value=profiles)),
            OpaqueFunction(function=start_nodes),
        ]
    )
