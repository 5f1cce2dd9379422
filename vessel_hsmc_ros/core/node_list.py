"""The nodes of the package: the one list of their names, modules, classes and executables."""

from collections.abc import Sequence
from typing import NamedTuple


class NodeProgram(NamedTuple):
    """Where a node is found, and what it needs."""

    source: str  # the module with its class
    kind: str  # the name of its class
    executable: str  # what `ros2 run` runs
    libraries: tuple[str, ...] = ()  # the modules that it imports beside ROS, NumPy and PyYAML
    parameters: str = ""  # module and class of its parameters, where they are not part of a scenario


PLANT = "vessel_sim"
REFERENCE = "reference_ship"
CONTROLLER = "controller"

ALLOCATION = "thruster_allocation"  # the node of the loop that takes part only where thrusters drive the ship
RECORDER = "recorder"

GROUP = "node_group"  # several nodes in one process: not a node, and run like one
RELAY = "fault_relay"  # the node that carries out scripted faults
LOOP = {
    PLANT: NodeProgram("vessel_sim_node.node", "VesselSimNode", "vessel_sim_node"),
    REFERENCE: NodeProgram("vessel_hsmc_ros.nodes.reference_ship", "ReferenceShipNode", "reference_ship_node"),
    CONTROLLER: NodeProgram("vessel_hsmc_ros.nodes.controller", "ControllerNode", "controller_node"),
    ALLOCATION: NodeProgram("vessel_hsmc_ros.nodes.thruster_allocation", "ThrusterAllocationNode", "thruster_allocation_node"),
    RECORDER: NodeProgram("vessel_hsmc_ros.nodes.recorder", "RecorderNode", "recorder_node", ("lz4", "mcap", "zstandard")),
}
"""The nodes of a closed loop, whose parameters make a scenario."""

WATCHERS = {
    RELAY: NodeProgram(
        "vessel_hsmc_ros.nodes.fault_relay",
        "FaultRelayNode",
        "fault_relay_node",
        parameters="vessel_hsmc_ros.scenario.parameter_groups:FaultRelayParameters",
    ),
    "live": NodeProgram(
        "vessel_hsmc_ros.nodes.live",
        "LiveNode",
        "live_node",
        ("foxglove",),
        parameters="vessel_hsmc_ros.scenario.parameter_groups:LiveParameters",
    ),
    "markers": NodeProgram(
        "vessel_hsmc_ros.nodes.markers",
        "MarkerNode",
        "marker_node",
        parameters="vessel_hsmc_ros.scenario.parameter_groups:MarkerParameters",
    ),
    "watchdog": NodeProgram(
        "vessel_hsmc_ros.boats.drive",
        "WatchdogNode",
        "watchdog_node",
        parameters="vessel_hsmc_ros.boats.parameters:WatchdogParameters",
    ),
    "navsat_odom": NodeProgram(
        "vessel_hsmc_ros.boats.navsat_odom",
        "NavsatOdometryNode",
        "navsat_odom_node",
        ("geographiclib",),
        parameters="vessel_hsmc_ros.boats.parameters:NavsatOdometryParameters",
    ),
    "drive": NodeProgram(
        "vessel_hsmc_ros.boats.drive", "DriveNode", "drive_node", parameters="vessel_hsmc_ros.boats.parameters:DriveParameters"
    ),
    "mavlink": NodeProgram(
        "vessel_hsmc_ros.boats.mavlink",
        "MavlinkNode",
        "mavlink_node",
        ("pymavlink",),
        parameters="vessel_hsmc_ros.boats.parameters:MavlinkParameters",
    ),
    "px4": NodeProgram(
        "vessel_hsmc_ros.boats.px4",
        "Px4Node",
        "px4_node",
        ("px4_msgs",),
        parameters="vessel_hsmc_ros.boats.parameters:Px4Parameters",
    ),
}
"""Nodes outside the closed loop: a run takes place without them, and their parameters are not part of a scenario."""

PROGRAMS = LOOP | WATCHERS  # all nodes: `python -m vessel_hsmc_ros.nodes NAME` runs one
START_ORDER = tuple(reversed(LOOP))
"""The recorder starts first, so that it hears every node, and the plant, which sets the pace, starts last."""


def taking_part(by_thrusters: bool, vessels: Sequence[str] = ()) -> tuple[str, ...]:
    """The nodes of a loop in the order of their start, such as `vessel_2/controller` in a fleet, which has one recorder.

    `by_thrusters`: whether thrusters drive the ship, so that the allocation is one of them. `vessels`: namespaces of the
    vessels of a fleet; none for a single vessel without one of its own.
    """
    names = [name for name in START_ORDER if by_thrusters or name != ALLOCATION]
    if not vessels:
        return tuple(names)
    return (RECORDER, *(f"{vessel}/{name}" for name in names if name != RECORDER for vessel in vessels))
