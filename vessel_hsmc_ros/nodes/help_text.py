"""The help text of a node's executable, and what is wrong with its arguments."""

import inspect
import textwrap
from collections.abc import Sequence
from typing import Any

from rclpy.utilities import remove_ros_args

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.node_list import AUXILIARY, LOOP, WATCHERS
from vessel_hsmc_ros.scenario import parameters

INTERFACES = {
    "vessel_sim": """\
subscribes to  cmd_wrench, or thrusters/<name>/thrust and .../angle with actuators.kind = thrusters
publishes      odom, applied_wrench, disturbance, dynamics/truth; odom/truth with sensor noise; events; /clock in lockstep
services       ~/pause, ~/reset""",
    "reference_ship": """\
subscribes to  goal_pose or path, in these modes; /clock in lockstep
publishes      reference, reference/pose, events
services       ~/pause, ~/reset""",
    "controller": """\
subscribes to  odom, reference
publishes      cmd_wrench, ~/state; ~/estimate with an observer; events
services       ~/enable, ~/reset, ~/stop, ~/rearm; of its lifecycle ~/change_state, ~/get_state, ~/get_available_states,
               ~/get_available_transitions, ~/get_transition_graph""",
    "thruster_allocation": """\
subscribes to  cmd_wrench; odom, with rudders
publishes      thrusters/<name>/thrust; thrusters/<name>/angle of azimuths and rudders; allocated_wrench, events;
               thrusters/<name>/shaft_speed where its thrust coefficients are given
services       ~/reset""",
    "fault_relay": """\
subscribes to  the topics of the parameter topics
publishes      each of them below relayed/, events""",
    "recorder": """\
subscribes to  the topics of the parameters topics, all_topics and regex, and writes them into a bag""",
    "markers": """\
subscribes to  odom, reference/pose
publishes      markers, ship/path, reference/path, /tf""",
    "watchdog": """\
subscribes to  cmd_wrench, /diagnostics
publishes      watched_wrench
services       ~/stop, ~/rearm""",
    "navsat_odom": """\
subscribes to  fix; imu, heading or fix_2; fix_velocity, or course and speed
publishes      odom
services       fromLL, toLL where robot_localization is installed""",
    "drive": """\
subscribes to  cmd_wrench; controller/state with the form cmd_vel
publishes      normalised_wrench, cmd_vel, or throttle and steering, by its form
services       ~/stop, ~/rearm""",
    "live": """\
subscribes to  every topic of the run, and serves it to Foxglove""",
}
"""The topics and services of each node. Names are relative to its namespace; ~ stands for the node's own name."""

OPTIONS = {"controller": " [--law-file FILE]..."}
"""Options of a node's own."""

WIDTH = 110

TEMPLATE = """\
Usage: {executable}{options} [--ros-args [-p NAME:=VALUE]... [--params-file FILE] [-r FROM:=TO]...]

{description}

Topics and services; every node also publishes /diagnostics:
{interface}

Examples:
  {executable} --ros-args --params-file config/case2_tracking.yaml
  {executable} --ros-args -r __ns:=/alpha -p {name}:={value}

Parameters of the node {node}, with their defaults; * can be changed while it runs, by `ros2 param set` or the
vessel-hsmc command:
{parameters}

A parameters file has a section `{node}: ros__parameters:`. Documentation: README.md and docs/parameters.md of vessel_hsmc_ros.
"""


def help_text(node_class: Any) -> str:
    """The help text of a node: its task, its topics and its parameters."""
    program = (LOOP | AUXILIARY | WATCHERS)[node_class.NAME]
    entries = schema.entries((parameters.NODES | parameters.AUXILIARY | parameters.WATCHERS)[node_class.NAME])
    example = next((entry for entry in entries.values() if entry.tunable), next(iter(entries.values())))
    return TEMPLATE.format(
        executable=program.executable,
        options=OPTIONS.get(node_class.NAME, ""),
        description=inspect.getdoc(node_class),
        interface=_indented(INTERFACES[node_class.NAME]),
        node=node_class.NAME,
        name=example.name,
        value=_shown(example.default),
        parameters=_indented("\n".join(map(_parameter, entries.values()))),
    )


def without_ros_arguments(arguments: Sequence[str]) -> list[str]:
    """The command-line arguments that are not of ROS."""
    return [argument for argument in remove_ros_args(args=list(arguments)) if argument]


def unknown_argument(others: Sequence[str]) -> str:
    """The first of the remaining arguments, empty if there is none; --help takes precedence over all others."""
    return next((argument for argument in others if argument in ("-h", "--help")), others[0] if others else "")


def _parameter(entry: schema.Entry) -> str:
    head = f"{'*' if entry.tunable else ' '} {entry.name} = {_shown(entry.default)}"
    meaning = f"{entry.description.rstrip('.')}. It takes {entry.allowed}."
    return "\n".join([head, *textwrap.wrap(meaning, WIDTH, initial_indent="      ", subsequent_indent="      ")])


def _shown(value: object) -> str:
    """A value as it is written on the command line."""
    if isinstance(value, tuple):
        return "[" + ", ".join(map(_shown, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return "''" if value == "" else str(value)


def _indented(text: str) -> str:
    return "\n".join(f"  {line}" for line in text.splitlines())
