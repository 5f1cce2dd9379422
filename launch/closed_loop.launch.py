"""The closed loop: plant, reference ship, controller, and by default a recorder.

ros2 launch vessel_hsmc_ros closed_loop.launch.py scenario:=case2_tracking record:=true

Its nodes end with the plant, and the launch with them unless it includes something else. The exit code is 0 if every node exited
with 0, else 1.
"""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from launch.actions import DeclareLaunchArgument, EmitEvent, ExecuteProcess, OpaqueFunction, SetEnvironmentVariable
from launch.events import matches_action
from launch.events.process import ProcessExited, ShutdownProcess
from launch_ros.actions import Node
from launch_ros.substitutions import ExecutableInPackage

from launch import LaunchContext, LaunchDescription
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.install_paths import PACKAGE, PROFILES, discovery_profiles
from vessel_hsmc_ros.core.node_list import GROUP, LOOP, PLANT, taking_part
from vessel_hsmc_ros.nodes.runs.launching import argument, failure, flag, namespace_of, never_raising

HELD = ExitStack()
"""Holds the lock of the ROS domain and namespace until this process ends, so that a second run is refused."""


@never_raising
def start_nodes(context: LaunchContext) -> list[Any]:
    """The node actions, on a resolved parameters file in a run folder of their own.

    Raises:
        ParameterError: all nodes are to share a process in real time, where one would delay another.
        RunError: another run on this machine uses the ROS domain and namespace.
    """
    # Not above: without the messages or a library this file could not be read, and launch would name its syntax as the cause.
    from vessel_hsmc_ros.nodes.ros_environment import check_messages
    from vessel_hsmc_ros.nodes.runs.supervisor import exclusive
    from vessel_hsmc_ros.scenario.law_file import load_law_file
    from vessel_hsmc_ros.scenario.run_folder import make_run_folder
    from vessel_hsmc_ros.scenario.scenario import dump_scenario, for_nodes, load_scenario

    check_messages()
    namespace, recorded = namespace_of(context), flag(context, "record")
    changes = for_nodes(recorded, flag(context, "real_time"), namespace.strip("/"))
    if law := argument(context, "law"):
        changes["controller.law"] = law
    if law_file := argument(context, "law_file"):
        load_law_file(law_file)
    scenario = load_scenario(argument(context, "scenario"), changes)
    if (composed := flag(context, "composed")) and not scenario.controller.lockstep:
        raise ParameterError("composed must be false in real time (got true): one node would delay another")
    names = [name for name in taking_part(scenario.vessel_sim.by_thrusters) if recorded or name != "recorder"]
    for name in names:
        ExecutableInPackage(LOOP[name].executable, PACKAGE).perform(context)  # raises where none is installed
    HELD.enter_context(exclusive(namespace.strip("/"), scenario.controller.lockstep))
    folder = make_run_folder(Path(argument(context, "output")), scenario.name)
    folder.write_parameters(dump_scenario(scenario.with_bag(folder.bag.absolute(), folder.parameters.absolute())))
    start = one_process if composed else own_processes
    return [SetEnvironmentVariable(PROFILES, discovery_profiles()), *start(names, str(folder.parameters), namespace)]


def own_processes(names: Sequence[str], parameters: str, namespace: str) -> list[ExecuteProcess]:
    """A process for each node."""
    from vessel_hsmc_ros.scenario.law_file import law_file_options

    nodes: list[ExecuteProcess] = []
    nodes += [
        Node(
            package=PACKAGE,
            executable=LOOP[name].executable,
            name=name,
            namespace=namespace,
            parameters=[parameters],
            arguments=law_file_options() if name == "controller" else [],
            output="screen",
            on_exit=end_with(name, nodes),
        )
        for name in names
    ]
    return nodes


def one_process(names: Sequence[str], parameters: str, namespace: str) -> list[ExecuteProcess]:
    """A process for all nodes."""
    from vessel_hsmc_ros.nodes.runs.processes import node_command

    command = node_command(names, Path(parameters), namespace.strip("/"))
    nodes: list[ExecuteProcess] = []
    nodes += [ExecuteProcess(cmd=command, name=GROUP, output="screen", on_exit=end_with(GROUP, nodes))]
    return nodes


def end_with(name: str, nodes: list[ExecuteProcess]) -> Callable[[ProcessExited, LaunchContext], Any]:
    """The exit handler of a node: after the plant the other nodes of its loop end, after an error the whole launch does.

    Args:
        name: The node, or GROUP for all of them.
        nodes: Those of its loop; a second loop in the same launch has others. Emptied when the plant has ended.
    """

    def on_exit(event: ProcessExited, context: LaunchContext) -> Any:
        if event.returncode:
            return failure(f"{name} failed with exit code {event.returncode}")
        if context.is_shutdown or not nodes:
            return None
        if name not in (PLANT, GROUP):
            return failure(f"{name} left before the run was over")
        others = [node for node in nodes if node is not event.action]
        nodes.clear()
        return [EmitEvent(event=ShutdownProcess(process_matcher=matches_action(node))) for node in others]

    return on_exit


def generate_launch_description() -> LaunchDescription:
    """The arguments and actions for `ros2 launch`."""
    return LaunchDescription(never_raising(declared)())


def declared() -> list[Any]:
    """The arguments with their descriptions, and the function that starts the nodes with them."""
    from vessel_hsmc_ros.control.laws import LAWS
    from vessel_hsmc_ros.scenario.scenario import scenario_names

    descriptions = {
        "scenario": ("case2_tracking", f"One of {', '.join(scenario_names())}, or a YAML file."),
        "law": (
            "",
            f"One of {', '.join(LAWS)}, or one of law_file; empty: the scenario's. In real time choose one that tolerates late"
            " steps, such as guided.",
        ),
        "law_file": ("", "Python file with a control law of your own."),
        "record": ("true", "true or false: record an MCAP bag."),
        "real_time": ("false", "true or false: run at the pace of the clock."),
        "composed": ("false", "true or false: all nodes in one process, in lockstep only."),
        "namespace": ("", "Namespace of the vessel; the names of its frames are prefixed with it."),
        "output": ("runs", "Folder of the run folders."),
    }
    return [
        *(DeclareLaunchArgument(name, default_value=value, description=text) for name, (value, text) in descriptions.items()),
        OpaqueFunction(function=start_nodes),
    ]
