"""The nodes of the package: the one list of their names, modules and executables."""

from collections.abc import Sequence
from typing import NamedTuple


class NodeProgram(NamedTuple):
    """Where a node is found: its module, run by `python -m`, and its executable, run by `ros2 run`."""

    module: str
    executable: str


LOOP = {
    "vessel_sim": NodeProgram("vessel_sim_node", "vessel_sim_node"),
    "reference_ship": NodeProgram("vessel_hsmc_ros.nodes.reference_ship", "reference_ship_node"),
    "controller": NodeProgram("vessel_hsmc_ros.nodes.controller", "controller_node"),
    "thruster_allocation": NodeProgram("vessel_hsmc_ros.nodes.thruster_allocation", "thruster_allocation_node"),
    "recorder": NodeProgram("vessel_hsmc_ros.nodes.recorder", "recorder_node"),
}
"""The nodes of a closed loop, whose parameters make a scenario."""

WATCHERS = {
    "live": NodeProgram("vessel_hsmc_ros.nodes.live", "live_node"),
    "markers": NodeProgram("vessel_hsmc_ros.nodes.markers", "marker_node"),
    "watchdog": NodeProgram("vessel_hsmc_ros.nodes.watchdog", "watchdog_node"),
    "navsat_odom": NodeProgram("vessel_hsmc_ros.nodes.navsat_odom", "navsat_odom_node"),
    "drive": NodeProgram("vessel_hsmc_ros.nodes.drive", "drive_node"),
}
"""Nodes outside the closed loop: a run takes place without them."""

AUXILIARY = {
    "fault_relay": NodeProgram("vessel_hsmc_ros.nodes.fault_relay", "fault_relay_node"),
}
"""Nodes that take part in a run only on demand, and whose parameters are not part of a scenario."""

RELAY = "fault_relay"
"""The node that carries out scripted faults."""

ALLOCATION = "thruster_allocation"
"""The node of the loop that takes part only where thrusters drive the ship."""

START_ORDER = tuple(reversed(LOOP))
"""The recorder starts first, so that it hears every node, and the plant, which sets the pace, starts last."""


def taking_part(by_thrusters: bool, vessels: Sequence[str] = ()) -> tuple[str, ...]:
    """The nodes of a loop in the order of their start, such as `vessel_2/controller` in a fleet, which has one recorder.

    Args:
        by_thrusters: Whether thrusters drive the ship, so that the allocation is one of them.
        vessels: Namespaces of the vessels of a fleet; none for a single vessel without one of its own.
    """
    names = [name for name in START_ORDER if by_thrusters or name != ALLOCATION]
    if not vessels:
        return tuple(names)
    return ("recorder", *(f"{vessel}/{name}" for name in names if name != "recorder" for vessel in vessels))
