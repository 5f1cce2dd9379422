"""The executables of the nodes: each imports its node and runs it.

A node's module imports generated messages and ROS at its top. Importing it here instead of in the entry point itself turns a
package that is not installed into one line instead of a traceback.
"""

import sys
from collections.abc import Callable
from importlib import import_module

from vessel_hsmc_ros.core.install_paths import missing_module


def entry_point(module: str) -> Callable[[], int]:
    """A function that imports a node's module and calls its `main`; exit code 2 if a module that it needs is missing."""

    def main() -> int:
        try:
            node = import_module(module)
        except ModuleNotFoundError as error:
            sys.stderr.write(f"[FATAL]: {missing_module(error)}\n")
            return 2
        code: int = node.main()
        return code

    return main


vessel_sim_node = entry_point("vessel_sim_node.node")
reference_ship_node = entry_point("vessel_hsmc_ros.nodes.reference_ship")
controller_node = entry_point("vessel_hsmc_ros.nodes.controller")
recorder_node = entry_point("vessel_hsmc_ros.nodes.recorder")
marker_node = entry_point("vessel_hsmc_ros.nodes.markers")
live_node = entry_point("vessel_hsmc_ros.nodes.live")
