"""The nodes of the package: the one list of their names, modules and executables."""

from typing import NamedTuple


class NodeProgram(NamedTuple):
    """Where a node is found: its module, run by `python -m`, and its executable, run by `ros2 run`."""

    module: str
    executable: str


LOOP = {
    "vessel_sim": NodeProgram("vessel_sim_node", "vessel_sim_node"),
    "reference_ship": NodeProgram("vessel_hsmc_ros.nodes.reference_ship", "reference_ship_node"),
    "controller": NodeProgram("vessel_hsmc_ros.nodes.controller", "controller_node"),
    "recorder": NodeProgram("vessel_hsmc_ros.nodes.recorder", "recorder_node"),
}
"""The nodes of a closed loop, whose parameters make a scenario."""

WATCHERS = {
    "live": NodeProgram("vessel_hsmc_ros.nodes.live", "live_node"),
    "markers": NodeProgram("vessel_hsmc_ros.nodes.markers", "marker_node"),
}
"""Nodes that only watch a run: they may fail without harm to it."""

START_ORDER = tuple(reversed(LOOP))
"""The recorder starts first, so that it hears every node, and the plant, which sets the pace, starts last."""
