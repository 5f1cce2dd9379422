"""The closed loop: plant, reference ship, controller, and by default a recorder.

ros2 launch vessel_hsmc_ros closed_loop.launch.py scenario:=case2_tracking record:=true

Its nodes end with the plant, and the launch with them unless it includes something else. The exit code is 0 if every node exited
with 0, else 1.
"""

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from launch.actions import DeclareLaunchArgument, EmitEvent, OpaqueFunction, SetEnvironmentVariable
from launch.events import matches_action
from launch.events.process import ProcessExited, ShutdownProcess
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from launch import LaunchContext, LaunchDescription
from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.core.install_paths import PROFILES, discovery_profiles
from vessel_hsmc_ros.core.node_list import LOOP, taking_part
from vessel_hsmc_ros.laws import LAWS
from vessel_hsmc_ros.runs.supervisor import exclusive
from vessel_hsmc_ros.scenario.law_file import law_file_options, load_law_file
from vessel_hsmc_ros.scenario.run_folder import make_run_folder
from vessel_hsmc_ros.scenario.scenario import for_nodes, load_scenario, scenario_names

HELD = ExitStack()
"""Holds the lock of the ROS domain and namespace until this process ends, so that a second run is refused."""


def start_nodes(context: LaunchContext) -> list[Any]:
    """The node actions, on a resolved parameters file in a run folder of their own.

    Raises:
        RunError: another run on this machine uses the ROS domain and namespace.
    """
    arguments = {
        name: LaunchConfiguration(name).perform(context) for name in ("scenario", "law", "law_file", "output", "namespace")
    }
    flags = {name: LaunchConfiguration(name).perform(context) == "true" for name in ("record", "real_time")}
    namespace = arguments["namespace"].strip("/")
    changes = for_nodes(flags["record"], flags["real_time"], namespace)
    if arguments["law"]:
        changes["controller.law"] = arguments["law"]
    if arguments["law_file"]:
        load_law_file(arguments["law_file"])
    scenario = load_scenario(arguments["scenario"], changes)
    HELD.enter_context(exclusive(namespace, scenario.controller.lockstep))
    folder = make_run_folder(Path(arguments["output"]), scenario.name)
    folder.write_parameters(scenario.with_bag(folder.bag.absolute(), folder.parameters.absolute()))
    nodes: list[Node] = []
    nodes += [
        Node(
            package="vessel_hsmc_ros",
            executable=LOOP[name].executable,
            name=name,
            namespace=namespace,
            parameters=[str(folder.parameters)],
            arguments=law_file_options() if name == "controller" else [],
            output="screen",
            on_exit=end_with(name, nodes),
        )
        for name in taking_part(scenario.vessel_sim.by_thrusters)
        if flags["record"] or name != "recorder"
    ]
    return [SetEnvironmentVariable(PROFILES, discovery_profiles()), *nodes]


def end_with(name: str, nodes: list[Node]) -> Callable[[ProcessExited, LaunchContext], Any]:
    """The exit handler of a node: after the plant the other nodes of its loop end, after an error the whole launch does.

    Only an exception gives `ros2 launch` a nonzero exit code: its message is logged, all nodes are shut down, the code is 1.

    Args:
        name: The node.
        nodes: Those of its loop; a second loop in the same launch has others. Emptied when the plant has ended.
    """

    def on_exit(event: ProcessExited, context: LaunchContext) -> Any:
        if event.returncode:
            raise RunError(f"{name} failed with exit code {event.returncode}")
        if context.is_shutdown or not nodes:
            return None
        if name != "vessel_sim":
            raise RunError(f"{name} left before the run was over")
        others = [node for node in nodes if node is not event.action]
        nodes.clear()
        return [EmitEvent(event=ShutdownProcess(process_matcher=matches_action(node))) for node in others]

    return on_exit


def generate_launch_description() -> LaunchDescription:
    """The arguments and actions for `ros2 launch`."""
    flag = ["true", "false"]
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "scenario", default_value="case2_tracking", description=f"One of {', '.join(scenario_names())}, or a YAML file."
            ),
            DeclareLaunchArgument(
                "law",
                default_value="",
                description=f"One of {', '.join(LAWS)}, or one of law_file; empty: the scenario's. In real time choose one that"
                " tolerates late steps, such as guided.",
            ),
            DeclareLaunchArgument("law_file", default_value="", description="Python file with a control law of your own."),
            DeclareLaunchArgument("record", default_value="true", choices=flag, description="Record an MCAP bag."),
            DeclareLaunchArgument("real_time", default_value="false", choices=flag, description="Run at the pace of the clock."),
            DeclareLaunchArgument(
                "namespace",
                default_value="",
                description="Namespace of the vessel; the names of its frames are prefixed with it.",
            ),
            DeclareLaunchArgument("output", default_value="runs", description="Folder of the run folders."),
            OpaqueFunction(function=start_nodes),
        ]
    )
