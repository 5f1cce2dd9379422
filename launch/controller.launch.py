"""Controller and reference ship of a vessel of your own, whose odometry and actuators are other nodes; in real time.

ros2 launch vessel_hsmc_ros controller.launch.py params_file:=my_boat.yaml

A node that fails does not end the nodes of whoever includes this file: they may have to bring the vessel to rest.
"""

from pathlib import Path
from typing import Any

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch_ros.actions import Node
from launch_ros.substitutions import ExecutableInPackage

from launch import LaunchContext, LaunchDescription
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.install_paths import PACKAGE
from vessel_hsmc_ros.core.node_list import LOOP
from vessel_hsmc_ros.nodes.ros_environment import check_messages
from vessel_hsmc_ros.nodes.runs.launching import argument, flag, namespace_of, never_raising

ARGUMENTS = {
    "params_file": ("", "ROS parameters file of the nodes, such as that of `vessel-hsmc init`."),
    "namespace": ("", "Namespace of the vessel."),
    "use_sim_time": ("false", "true or false: take the time from /clock."),
    "log_level": ("info", "debug, info, warn, error or fatal."),
    "reference": ("true", "true or false: start the reference ship as well; without it another node publishes `reference`."),
}
"""Default and description of each argument."""

LEVELS = ("debug", "info", "warn", "error", "fatal")


@never_raising
def start_nodes(context: LaunchContext) -> list[Any]:
    """The node actions.

    Raises:
        ParameterError: an argument is not allowed.
        ModuleNotFoundError: the messages are not installed.
    """
    check_messages()
    namespace, file, level = namespace_of(context), argument(context, "params_file"), argument(context, "log_level").lower()
    if not Path(file).is_file():  # launch_ros only warns, and the node would start with its defaults
        raise ParameterError(f"params_file must be the path of a ROS parameters file (got {file!r})")
    if level not in LEVELS:
        raise ParameterError(f"log_level must be one of {', '.join(LEVELS)} (got {level!r})")
    names = ["reference_ship", "controller"] if flag(context, "reference") else ["controller"]
    for name in names:
        ExecutableInPackage(LOOP[name].executable, PACKAGE).perform(context)  # raises where none is installed
    return [
        Node(
            package=PACKAGE,
            executable=LOOP[name].executable,
            name=name,
            namespace=namespace,
            parameters=[file, {"use_sim_time": flag(context, "use_sim_time")}],
            ros_arguments=["--log-level", level],
            output="screen",
        )
        for name in names
    ]


def generate_launch_description() -> LaunchDescription:
    """The arguments and actions for `ros2 launch`."""
    declared = [DeclareLaunchArgument(name, default_value=value, description=text) for name, (value, text) in ARGUMENTS.items()]
    return LaunchDescription([*declared, OpaqueFunction(function=start_nodes)])
